//! Fingers without a cause of their force's error.

use sim::native;
use sim::population::budget::{Budget, CAUSES};
use sim::population::load;

#[test]
fn what_is_taken_out_is_zero_and_the_rest_as_it_was() {
    let all = load("budget").unwrap();
    let less = all.clone().without(&["effects.hysteresis.width_percent", "gain_off"]).unwrap();
    for number in 0..5 {
        let [whole, less] = [&all, &less].map(|population| population.finger(3, number).unwrap().drawn);
        let mut zeros = 0;
        for ((name, value), (same, now)) in whole.iter().zip(&less) {
            assert_eq!(name, same);
            match name.as_str() {
                "effects.hysteresis.width_percent" | "gain_off" => {
                    assert!(value.number() != Some(0.0) && now.number() == Some(0.0), "{name}: {value:?}, {now:?}");
                    zeros += 1;
                }
                // What is worked out of the gain.
                "controller.codes_per_kpa_milli" => assert_eq!(now.number(), Some(24_000.0)),
                _ => assert_eq!(value, now, "{name}"),
            }
        }
        assert_eq!(zeros, 2);
    }
}

#[test]
fn a_cause_that_nobody_drew_is_refused() {
    let refused = load("budget").unwrap().without(&["effects.hysteresis.width"]).unwrap_err();
    assert!(refused.contains("effects.hysteresis.width"), "{refused}");
}

#[test]
fn what_makes_the_force_wrong_is_larger_than_what_is_left() {
    let budget = Budget::of(1, &native::board, &native::calibrated::board).unwrap();
    for goal in 0..3 {
        let largest = budget.changes.iter().map(|changes| changes[goal]).fold(0.0, f64::max);
        // A finger is off by what parts vary, and all of that is in the causes.
        assert!((0.02..0.25).contains(&(budget.all[goal] / [0.5, 1.0, 5.0][goal])), "{budget:?}");
        assert!(largest > 10.0 * budget.none[goal] && budget.none[goal] > 0.0, "{budget:?}");
    }
    assert!((1..3).all(|goal| budget.calibrated[goal] < 0.5 * budget.all[goal]), "{budget:?}");
    assert_eq!((budget.changes.len(), budget.left.len()), (CAUSES.len(), CAUSES.len()));
    let page = budget.page();
    assert!(CAUSES.iter().all(|cause| page.contains(cause.about)), "{page}");
}
