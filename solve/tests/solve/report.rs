//! Results and refusals in sentences.

use solve::drift::{Creep, NoDrift, Temperature};
use solve::record::{Ended, Reason};
use solve::scale::Scale;
use solve::strokes::Refusal;
use solve::{Value, creep, scale};

#[test]
fn a_value_has_as_many_decimals_as_its_uncertainty_allows() {
    let said = |value: f64, sigma: f64| Value { value, sigma }.to_string();
    assert_eq!(said(0.251_234, 0.003_24), "0.2512 +- 0.0032");
    assert_eq!(said(251.234, 3.24), "251.2 +- 3.2");
    assert_eq!(said(2512.34, 314.0), "2512 +- 314");
    assert_eq!(said(2.0, 0.0), "2.0000 +- 0.0e0");
    assert_eq!(said(2.0, f64::NAN), "2.0000 +- NaN");
}

#[test]
fn results_are_sentences() {
    let value = |value: f64, sigma: f64| Value { value, sigma };
    let plain = Scale { factor: value(1.05, 0.01), offset_n: Some(value(0.01, 0.01)), curve: None };
    assert_eq!(plain.to_string(), "The force is 1.050 +- 0.010 times what the array reads.");
    let bent = Scale { offset_n: Some(value(0.3, 0.01)), curve: Some(value(0.2, 0.02)), ..plain }.to_string();
    assert!(bent.contains("set to zero?") && bent.contains("changes by 20.0 +- 2.0 %"), "{bent}");
    let creep =
        Creep { share: value(0.05, 0.001), time_s: value(10.0, 1.0), per_decade: value(0.03, 0.001), left: 0.001 };
    assert!(
        creep.to_string().starts_with("A held reading grows by 5.00 +- 0.10 % with a time constant of 10.0 +- 1.0 s")
    );
    let temperature = Temperature { per_k: value(0.0036, 0.0001), chip_c: [25.0, 45.0] };
    let said = "The array's gain changes by 0.360 +- 0.010 % per kelvin, between 25.0 and 45.0 degrees Celsius.";
    assert_eq!(temperature.to_string(), said);
}

#[test]
fn refusals_are_sentences_with_their_number() {
    let ended = |reason, value| Ended { reason, value }.to_string();
    assert!(ended(Reason::Touched, 51).contains("0.051 N"));
    assert!(ended(Reason::Still, 1200).contains("1.20 V"));
    assert!(ended(Reason::Reversed, 17).contains("counted 17 against"));
    assert!(ended(Reason::Restless, 7).contains("7 counts"));
    assert!(ended(Reason::Stalled, 850).contains("0.85 mm"));
    assert!(ended(Reason::Full, 120).contains("120 records"));
    let touched = Refusal::from(Ended { reason: Reason::Touched, value: 51 }).to_string();
    assert_eq!(
        touched,
        "the strokes were ended early: the array measured 0.051 N, more than allowed here: clear the tip's way, hold the plate fast"
    );
    assert_eq!(creep(&solve::drift::HeldSeries::default()), Err(NoDrift::Readings(0)));
    assert_eq!(scale(&[]).unwrap_err().to_string(), "the largest force is 0.000 N; 0.1 N is needed");
}
