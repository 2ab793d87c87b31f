//! The wall scene, natively.

use crate::bench::{Last, scene};
use fingertip::state::Mode;
use sim::effects::set::Named;
use sim::native::simulate_with;

#[test]
fn the_finger_touches_and_holds() {
    let mut last = Last::default();
    let summary = sim::simulate(&scene("duration_s = 0.5\n[[script]]\nat_s = 0.0\ngoal_n = 1.0\n"), &mut last).unwrap();
    println!("{} times real time, {last:?}", summary.virtual_s / summary.wall_s);
    assert_eq!(last.mode, Some(Mode::Force));
    assert!((0.995..=1.005).contains(&last.truth.force_n), "{} N", last.truth.force_n);
    assert!((0.995..=1.05).contains(&last.peak_n), "{} N", last.peak_n);
}

#[test]
fn without_effects_and_with_none_compiled_it_is_the_same_to_the_bit() {
    let scene = scene("duration_s = 0.3\n[[script]]\nat_s = 0.0\ngoal_n = 1.0\n");
    let with = simulate_with::<Named>(&scene, &mut Last::default()).unwrap();
    let without = simulate_with::<()>(&scene, &mut Last::default()).unwrap();
    assert_eq!(with.digest, without.digest);
}
