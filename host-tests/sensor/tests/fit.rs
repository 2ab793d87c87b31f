//! Recordings with a known truth: the fit finds it, and chooses no more than they hold.

mod made;

use made::{Creeping, Pressed};
use sensor::characteristic::Characteristics;
use sensor::creep::{Creep, Form as Lag};
use sensor::forms::Form;
use sensor::table::Table;

fn table(text: &str) -> Table {
    Table::parse("made.csv", text.as_bytes()).unwrap()
}

fn characteristic(fit: &Pressed, judge: &Pressed) -> sensor::characteristic::Characteristic {
    let mut found = Characteristics::fit(&table(&fit.text())).unwrap();
    found.judge(&table(&judge.text())).unwrap();
    found.sets.remove(0)
}

#[test]
fn a_curve_is_found_and_chosen() {
    let truth = Pressed { line: 24.0, growth: 7.0, noise: 0.2, ..Pressed::default() };
    let found = characteristic(&truth, &Pressed { seed: 2, ..truth });
    assert_eq!(found.chosen, Form::Curve);
    assert!((found.force_per_conductance_n_per_ms / 24.0 - 1.0).abs() < 0.05, "{found:?}");
    assert!((found.growth_per_ms / 7.0 - 1.0).abs() < 0.1, "{found:?}");
    let judged = found.judged.unwrap();
    assert!((0.15..0.25).contains(&judged.rms_n), "no less than the noise and hardly more: {judged:?}");
    assert!((judged.rms_percent - 100.0 * judged.rms_n / judged.largest_force_n).abs() < 1e-9);
}

#[test]
fn a_line_is_chosen_where_there_is_no_more() {
    for seed in 1..20 {
        let truth = Pressed { line: 40.0, growth: 0.0, noise: 0.5, seed, ..Pressed::default() };
        let found = characteristic(&truth, &Pressed { seed: seed + 100, ..truth });
        assert_eq!((found.chosen, found.growth_per_ms), (Form::Line, 0.0), "seed {seed}");
    }
}

#[test]
fn a_force_that_grows_ever_less_with_conductance_gets_the_line() {
    // Such a curve would turn back, and make a force look smaller than it may be.
    let truth = Pressed { line: 40.0, growth: -1.0, noise: 0.05, ..Pressed::default() };
    let found = characteristic(&truth, &truth);
    assert_eq!(found.chosen, Form::Line);
    let curve = found.forms.iter().find(|tried| tried.form == Form::Curve).unwrap();
    assert!(curve.parameters[1] < 1e-6 && !curve.supported);
}

#[test]
fn a_resistance_that_stays_is_told_from_a_curve_but_not_chosen() {
    let truth = Pressed { line: 20.0, series: 2.5, noise: 0.02, ..Pressed::default() };
    let found = characteristic(&truth, &Pressed { seed: 3, ..truth });
    let unseen = |form| found.forms.iter().find(|tried| tried.form == form).unwrap().unseen_percent;
    assert!(unseen(Form::Series) < 0.5 * unseen(Form::Curve));
    assert_eq!(found.chosen, Form::Curve, "of what the firmware has, this is nearer than a line");
}

#[test]
fn readings_at_the_converter_end_are_left_out_of_fit_and_judgement() {
    let truth = Pressed { line: 40.0, growth: 2.0, noise: 0.1, ..Pressed::default() };
    let cut = Pressed { end: Some(0.2), ..truth };
    let (whole, found) = (characteristic(&truth, &truth), characteristic(&cut, &Pressed { seed: 9, ..cut }));
    assert_eq!(whole.left_out, 0);
    let judged = found.judged.unwrap();
    assert!(found.left_out > 20 && judged.left_out > 20, "{} {}", found.left_out, judged.left_out);
    assert!(judged.rms_n < 0.15 && judged.largest_force_n < 12.0, "{judged:?}");
    assert!((found.growth_per_ms / 2.0 - 1.0).abs() < 0.2);
}

#[test]
fn the_sets_of_a_file_do_not_touch_each_other() {
    let (one, two) =
        (Pressed { line: 20.0, ..Pressed::default() }, Pressed { line: 80.0, seed: 5, ..Pressed::default() });
    let both = format!("{}{}", one.text(), two.rows("b"));
    let found = Characteristics::fit(&table(&both)).unwrap();
    for (set, alone) in found.sets.iter().zip([one, two]) {
        let alone = characteristic(&alone, &alone);
        assert_eq!(set.force_per_conductance_n_per_ms, alone.force_per_conductance_n_per_ms);
    }
}

#[test]
fn creep_is_found_and_taken_off_unseen_holds() {
    let truth = Creeping { rate: 0.07, time_constant_s: 10.0, spread: 0.3, seed: 1 };
    let mut found = Creep::fit(&table(&truth.text(&["one", "two"]))).unwrap();
    found.judge(&table(&Creeping { seed: 7, ..truth }.text(&["three"]))).unwrap();
    assert!(matches!(found.chosen, Lag::Lag { time_constant_s: 10.0 }), "{:?}", found.chosen);
    assert!((found.rate / 0.07 - 1.0).abs() < 0.15, "{}", found.rate);
    let judged = found.judged.unwrap();
    assert!(judged.drift_percent > 4.5 && judged.drift_left_percent < 2.0, "{judged:?}");
    assert_eq!((judged.holds.len(), judged.left_out), (12, 1));
}

#[test]
fn no_creep_is_chosen_where_there_is_none() {
    for seed in 1..20 {
        let truth = Creeping { rate: 0.0, time_constant_s: 10.0, spread: 0.0, seed };
        let found = Creep::fit(&table(&truth.text(&["one", "two", "three"]))).unwrap();
        assert_eq!((found.chosen, found.rate), (Lag::None, 0.0), "seed {seed}");
    }
}

#[test]
fn holds_that_went_wrong_do_not_move_the_rate() {
    let truth = Creeping { rate: 0.07, time_constant_s: 10.0, spread: 0.1, seed: 1 };
    let clean = Creep::fit(&table(&truth.text(&["one", "two"]))).unwrap();
    let mut text = truth.text(&["one", "two"]);
    for (hold, run) in ["x", "y", "z"].into_iter().enumerate() {
        for at in 0..75 {
            let t = 0.1 + 0.2 * f64::from(at);
            text += &format!("{run},{}.5,{t:.3},{:.5}\n", hold + 1, 10.0 * (1.0 + 0.08 * t));
        }
    }
    let wrong = Creep::fit(&table(&text)).unwrap();
    assert!((wrong.rate / clean.rate - 1.0).abs() < 0.2, "{} {}", wrong.rate, clean.rate);
}
