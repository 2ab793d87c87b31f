//! The solver against simulated fingers and drives. `-- --nocapture` prints the figures.

mod finger;
mod modulus;
mod record;
mod strokes;

use crate::finger::{Draw, Finger, presses};
use fingertip::measure::series::{HEAD, Head, check, step_bytes};
use fingertip::params::Params;
use sim::effects::Parts;
use sim::native::calibrated::Place;
use solve::gains::{Condition, NoGains, Verdict};
use solve::press::{Branch, Press};
use solve::record::{Ended, Reason};
use solve::scale::{Held, NoDrift};
use solve::strokes::NoDrive;
use solve::{Value, creep, gains, scale, temperature};
use std::f64::consts::TAU;
use std::ops::Range;

// Scale, creep and temperature on simulated holds and presses.

#[test]
fn a_scale_gives_the_factor() {
    let mut rng = fastrand::Rng::with_seed(3);
    // The scale has a resolution of 5 mN.
    let mut held = [1.0, 2.0, 3.0, 4.0, 5.0].map(|read_n: f64| {
        let true_n = 1.1 * read_n * (1.0 + 0.004 * (rng.f64() - 0.5));
        Held { shown_n: (true_n / 0.005).round() * 0.005, read_n }
    });
    let plain = scale(&held).expect("a scale");
    assert!((plain.value - 1.1).abs() < 2.0 * plain.sigma && plain.sigma < 0.01, "{plain:?}");
    // One number misread by 1 N.
    held[2].shown_n += 1.0;
    let robust = scale(&held).expect("a scale");
    assert!((robust.value - 1.1).abs() < 0.02, "{robust:?}");
    assert!(scale(&[]).is_err() && scale(&[Held { shown_n: 5.0, read_n: 1.0 }]).is_err());
}

#[test]
fn a_hold_shows_the_creep() {
    for percent in [1.0, 4.0] {
        let draw = Draw { creep_percent: percent, ..Draw::plain(250.0) };
        let mut sensor = Parts::of(&draw.scene(&Place::default()), 0).sensor;
        let readings = (0..=120).map(|n| {
            let (time_s, mut kpa) = (0.25 * f64::from(n), [20.0; 10]);
            sensor.pressure.each(|part| part(4, time_s, &mut kpa));
            [time_s, kpa[4]]
        });
        let found = creep(&readings.skip(1).collect::<Vec<_>>()).expect("a hold");
        assert!(found.share.value > 0.005 * percent && found.left < 0.002 * percent, "{found:?}");
    }
}

#[test]
fn two_presses_show_the_temperature() {
    let extra = "[effects.temperature_drift]\nwarming_k = 20.0\ntime_constant_s = 5.0\ngain_percent_per_k = 0.36\nzero_kpa_per_k = 0.0\n";
    let draw = Draw {
        extra: extra.into(),
        creep_percent: 2.0,
        hysteresis_percent: 5.0,
        relaxation: 0.05,
        ..Draw::plain(250.0)
    };
    let place = Place { centre_mm: [0.4, -0.3], tilt_deg: [1.0, 0.5] };
    let press = |draw: &Draw, chip_c| {
        let mut finger = Finger::new(draw);
        // The array reaches its final temperature.
        finger.bench.rest(30.0);
        let mut press = finger.press(&place, 0.0);
        press.steps.iter_mut().for_each(|step| step.chip_c = Some(chip_c));
        press
    };
    let warm = press(&draw, 45.0);
    let cold = press(&Draw { extra: String::new(), ..draw }, 25.0);
    let found = temperature(&cold, &warm).expect("two presses");
    let per_k = found.per_k;
    assert!((per_k.value - 0.0036).abs() < 3.0 * per_k.sigma && per_k.sigma < 5e-4, "{found:?}");
    assert!(temperature(&cold, &cold).is_err());
}

// Gains of drawn arrays, apart from the factor that all have in common.

sim::sizes!(three_presses_give_the_gains, drawn_arrays(100..102), drawn_arrays(102..130));

fn drawn_arrays(seeds: Range<u64>) {
    let mut all = Vec::new();
    for seed in seeds {
        let draw = Draw::any(seed, [15.0, 25.0], [1, 3]);
        let truth = draw.gains();
        let found = gains(&presses(&draw, 3)).unwrap_or_else(|why| panic!("{why:?} {draw:?}"));
        let known = || found.taxels.iter().zip(&truth).filter(|(gain, _)| gain.condition == Condition::Sound);
        let count = known().count() as f64;
        let factor = known().map(|(gain, truth)| truth / gain.reads).sum::<f64>() / count;
        let off = known().map(|(gain, truth)| gain.reads * factor / truth - 1.0);
        let rms = 100.0 * (off.map(|off| off * off).sum::<f64>() / count).sqrt();
        let sigmas = known().map(|(gain, truth)| ((gain.reads - truth / factor) / gain.sigma).powi(2));
        let sigmas = (sigmas.sum::<f64>() / count).sqrt();
        let listed = |condition| {
            let taxels = found.taxels.iter().enumerate().filter(|(_, gain)| gain.condition == condition);
            taxels.map(|(taxel, _)| [taxel / 10, taxel % 10]).collect::<Vec<_>>()
        };
        // What is found dead reads nothing or less than half, and what is dead is never taken for sound.
        assert!(listed(Condition::Dead).iter().all(|[row, column]| truth[row * 10 + column] < 0.5));
        assert!(known().all(|(_, truth)| *truth > 0.0));
        assert!(listed(Condition::Odd).is_empty());
        all.push([rms, sigmas]);
    }
    all.sort_by(|a, b| a[0].total_cmp(&b[0]));
    let (median, worst) = (all[all.len() / 2][0], all[all.len() - 1][0]);
    println!("rms: median {median:.2} %, worst {worst:.2} %");
    // A finger whose noise is 1 code cannot be better than 0.05 %.
    assert!((0.05..0.4).contains(&median) && worst < 1.5, "{median} {worst}");
    assert!(all.iter().all(|[_, sigmas]| *sigmas < 2.5));
}

/// Taxels whose readings do not follow the model are left out and named, and move nothing else.
#[test]
fn odd_taxels_are_named() {
    let draw = Draw { gains_percent: 5.0, creep_percent: 2.0, ..Draw::plain(250.0) };
    let mut presses = presses(&draw, 2);
    let before = gains(&presses).expect("gains");
    for step in presses.iter_mut().flat_map(|press| &mut press.steps) {
        // One conducts as the square, one is read from its neighbour, one was counted as bad by the chip.
        let mean = step.taxels[44].mean;
        step.taxels[44].mean = mean * mean.abs() / 400.0;
        step.taxels[67].mean = step.taxels[34].mean;
        step.taxels[55].bad = true;
    }
    // A single step decides nothing.
    let glitch = &mut presses[0].steps[20].taxels;
    glitch[45].bad = true;
    (glitch[36].mean, glitch[54].mean) = (0.0, 4000.0);
    let found = gains(&presses).expect("gains");
    assert_eq!(found.taxels[44].condition, Condition::Odd);
    assert_eq!(found.taxels[67].condition, Condition::Odd);
    assert_eq!(found.taxels[55].condition, Condition::Dead);
    assert!([36, 45, 54].into_iter().all(|taxel| found.taxels[taxel].condition == Condition::Sound));
    for (taxel, (one, other)) in found.taxels.iter().zip(&before.taxels).enumerate() {
        if one.condition == Condition::Sound {
            assert!((one.reads / other.reads - 1.0).abs() < 0.02, "{taxel}: {one:?} {other:?}");
        }
    }
}

// Results and refusals in sentences.

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
fn refusals_are_sentences_with_their_number() {
    let ended = |reason, value| Ended { reason, value }.to_string();
    assert!(ended(Reason::Touched, 51).contains("0.051 N"));
    assert!(ended(Reason::Still, 1200).contains("1.20 V"));
    assert!(ended(Reason::Reversed, 17).contains("counted 17 against"));
    assert!(ended(Reason::Restless, 7).contains("7 counts"));
    assert!(ended(Reason::Stalled, 850).contains("0.85 mm"));
    assert!(ended(Reason::Full, 120).contains("120 records"));
    let touched = NoDrive::from(Ended { reason: Reason::Touched, value: 51 }).to_string();
    assert_eq!(
        touched,
        "the strokes were ended early: the array measured 0.051 N, more than allowed here: clear the tip's way, hold the plate fast"
    );
    assert_eq!(creep(&[]), Err(NoDrift::Readings(0)));
    assert_eq!(scale(&[]).unwrap_err().to_string(), "the largest force is 0.000 N; 0.1 N is needed");
}

// Bytes and counts as the chip has them.

/// A series of a head and a body.
fn sealed(head: &Head, body: &[u8]) -> Vec<u8> {
    [&Head { check: check(body), ..*head }.bytes(), body].concat()
}

/// Millimetres of an encoder count by the default parameters.
fn mm_per_count() -> f64 {
    TAU / 1600.0 / 3.583
}
