//! Scale, creep and temperature on simulated holds and presses.

use crate::finger::{Draw, Finger, Part, Place, plan};
use solve::drift::HeldSeries;
use solve::scale::Held;
use solve::{creep, scale, temperature};

#[test]
fn a_scale_gives_factor_offset_and_curve() {
    let mut rng = fastrand::Rng::with_seed(3);
    let held = |factor: f64, offset_n: f64, curve: f64, rng: &mut fastrand::Rng| -> Vec<Held> {
        [1.0, 2.0, 3.0, 4.0, 5.0]
            .into_iter()
            .map(|read_n: f64| {
                let shown_n = factor * read_n * (1.0 + curve * read_n / 5.0) + offset_n;
                Held { shown_n: ((shown_n * (1.0 + 0.004 * (rng.f64() - 0.5))) / 0.005).round() * 0.005, read_n }
            })
            .collect()
    };
    let plain = scale(&held(1.1, 0.0, 0.0, &mut rng)).expect("a scale");
    println!("{plain}");
    assert!((plain.factor.value - 1.1).abs() < 2.0 * plain.factor.sigma && plain.factor.sigma < 0.01);
    assert!(!plain.offset_n.expect("five forces").differs() && !plain.curve.expect("five forces").differs());
    let offset = scale(&held(1.1, 0.3, 0.0, &mut rng)).expect("a scale").offset_n.expect("five forces");
    println!("{offset:?}");
    assert!(offset.differs() && (offset.value - 0.3).abs() < 0.05);
    let curved = scale(&held(0.9, 0.0, 0.25, &mut rng)).expect("a scale").curve.expect("five forces");
    println!("{curved:?}");
    assert!(curved.differs() && (curved.value - 0.25).abs() < 0.1);
    // One number misread by 1 N.
    let mut misread = held(1.1, 0.0, 0.0, &mut rng);
    misread[2].shown_n += 1.0;
    let robust = scale(&misread).expect("a scale");
    println!("{robust:?}");
    assert!((robust.factor.value - 1.1).abs() < 0.02);
    assert!(scale(&[]).is_err() && scale(&[Held { shown_n: 5.0, read_n: 1.0 }]).is_err());
}

#[test]
fn a_hold_shows_the_creep() {
    for percent in [1.0, 4.0] {
        let draw = Draw { creep_percent: percent, ..Draw::plain(250.0) };
        let mut finger = Finger::new(&draw);
        finger.go(&Place::default());
        finger.tare();
        let ends_s = (1..=120).map(|n| 0.25 * f64::from(n)).collect();
        let press =
            finger.press(&[Part::Ramp { to_mm: 2.0, mm_per_s: 10.0, step_mm: 9.0 }, Part::Hold { ends_s }], 8.0);
        let readings = press.steps[1..].iter().map(|step| [step.middle_s(), step.force_n(&press.array)]).collect();
        let found = creep(&HeldSeries { readings }).expect("a hold");
        println!("{found}");
        assert!((100.0 * found.per_decade.value / percent - 1.0).abs() < 0.15, "{found:?}");
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
    let mut finger = Finger::new(&draw);
    finger.go(&Place { centre_mm: [0.4, -0.3], tilt_deg: [1.0, 0.5] });
    finger.pause(30.0);
    finger.tare();
    let mut warm = finger.press(&plan(), 8.0);
    warm.steps.iter_mut().for_each(|step| step.chip_c = Some(45.0));
    let mut finger = Finger::new(&Draw { extra: String::new(), ..draw });
    finger.go(&Place { centre_mm: [0.4, -0.3], tilt_deg: [1.0, 0.5] });
    finger.tare();
    let cold = finger.press(&plan(), 8.0);
    let found = temperature(&cold, &warm).expect("two presses");
    println!("{found}");
    let per_k = found.per_k;
    assert!((per_k.value - 0.0036).abs() < 3.0 * per_k.sigma && per_k.sigma < 5e-4, "{found:?}");
    assert!(temperature(&cold, &cold).is_err());
}
