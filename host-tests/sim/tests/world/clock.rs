//! Time.

use crate::bench::{Last, scene};
use sim::native::Clock;

#[test]
fn a_day_of_slots_ends_when_the_timer_says() {
    // 9.5e9 slots, in groups: each is counted to half a femtosecond, so a day is right to 5 us.
    let slot_s = 1523.0 / 168e6;
    let mut clock = Clock::default();
    let slots = 1_000_000_u32;
    (0..slots).for_each(|_| clock.go_on(slot_s));
    let error_s = clock.time_s() - f64::from(slots) * slot_s;
    assert!(error_s.abs() <= 0.5e-15 * f64::from(slots) + 1e-15, "{error_s:e} s");
}

#[test]
fn at_the_end_of_a_day_time_goes_on_as_at_its_start() {
    let (mut early, mut late) = (Clock::default(), Clock::from_start(86_400.0));
    for _ in 0..10_000 {
        early.go_on(1523.0 / 168e6);
        late.go_on(1523.0 / 168e6);
        assert_eq!(early.since(Clock::default()), late.since(Clock::from_start(86_400.0)));
    }
}

#[test]
fn a_run_is_the_same_at_any_hour() {
    let scene =
        scene("duration_s = 0.4\n[[script]]\nat_s = 0.01\ngoal_n = 1.0\n[effects.noise]\n[effects.relaxation]\n");
    let early = sim::native::simulate_from::<sim::effects::set::Named>(&scene, 0.0, &mut Last::default()).unwrap();
    let late = sim::native::simulate_from::<sim::effects::set::Named>(&scene, 86_400.0, &mut Last::default()).unwrap();
    assert_eq!(early.digest, late.digest);
}
