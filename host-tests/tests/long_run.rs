//! Filters and integrators in the loop over 10^9 steps, by their cycles; `long-run` also takes the steps one by one.

use crate::common::*;
use fingertip::control::Observer;
use host_tests::long_run::{Cycle, Machine, all, cycle, hold};

#[test]
fn nothing_in_the_loop_drifts_or_swings() {
    for outcome in all(false) {
        println!("{outcome}");
        assert!(outcome.passes(), "{outcome}");
    }
}

#[test]
fn the_pipeline_comes_to_rest_under_what_does_not_change() {
    let cases = [
        ("off", false, 0, 0, Mode::Off, None),
        ("off, with a drifted array", false, 0, 1, Mode::Off, None),
        ("released", true, 0, 0, Mode::Release, None),
        ("released, with a drifted array", true, 0, 1, Mode::Release, None),
        // A motor that is driven ever harder and does not turn is not driven for ever.
        ("pressing with less than the goal", true, 7_000, 60, Mode::Fault, Some(Fault::EncoderFrozen)),
        ("pressing with more than the goal", true, 50, 1_500, Mode::Fault, Some(Fault::EncoderFrozen)),
    ];
    for (name, torque, goal_mn, codes, mode, fault) in cases {
        let (outcome, status) = hold(name, torque, goal_mn, codes, 20_000_000);
        println!("{outcome}");
        assert_eq!((status.mode, status.fault), (mode, fault), "{name}");
    }
}

#[test]
fn the_observer_recovers_from_anything() {
    for (settle_ns, sample_cycles, speed_max_um_per_s) in
        [(500, 3, 2_000_000), (2_400, 15, 250_000), (100_000, 480, 1_000)]
    {
        let approach_um_per_s = speed_max_um_per_s.min(Params::DEFAULT.approach_um_per_s);
        let params = Params { settle_ns, sample_cycles, speed_max_um_per_s, approach_um_per_s, ..images::CONFIRMED };
        let config = allowed(params);
        let mut rng = Rng::with_seed(11);
        for _ in 0..300 {
            let mut observer = Observer::new();
            let (reach, frames) = (1 << rng.u32(1..31), rng.u32(1..200));
            for _ in 0..frames {
                observer.update(rng.i32(-reach..reach), rng.i32(..), &config.gain_sets[0], &config);
            }
            let encoder = rng.i32(-50_000..50_000);
            let (_, rest) =
                cycle(&observer, 100_000, |observer| observer.update(encoder, 0, &config.gain_sets[0], &config))
                    .expect("a cycle");
            let measured = rest.measured(encoder, &config).to_bits();
            assert!((rest.travel.to_bits() - measured).abs() <= 1, "{rest:?} at {measured}");
            assert!(rest.speed.to_bits().abs() <= 131 && rest.disturbance.to_bits().abs() <= 1_024, "{rest:?}");
        }
    }
}

#[test]
fn known_cycles_are_found() {
    let step = |x: &mut u32| *x = if *x < 100 { *x + 1 } else { 94 };
    let (found, begin) = cycle(&0, 10_000, step).unwrap();
    assert_eq!(found.length, 7);
    assert!(found.lead >= 94 && (94..=100).contains(&begin));
    let (rest, _) = cycle(&5, 10, |_: &mut i32| {}).unwrap();
    assert_eq!(rest, Cycle { lead: 0, length: 1 });
    assert_eq!(cycle(&0_u64, 100_000, |x| *x += 1), None);
}

#[test]
fn a_swing_is_measured() {
    let swings = |allowed| Machine {
        name: "two-step".into(),
        start: 0,
        inputs: 1,
        step: Box::new(|x: &mut i64| *x = 5 - *x),
        outputs: vec![("value", |x| *x, allowed)],
    };
    assert!(swings(5).run(100, false).passes());
    assert!(!swings(4).run(100, false).passes());
}
