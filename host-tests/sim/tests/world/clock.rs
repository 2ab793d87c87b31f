//! Effects and the clock.

use crate::{Last, run, scene, world};
use sim::bridge::Bridge;
use sim::effects::Named;
use sim::host::Host;
use sim::native::{Begun, Clock, simulate_from};
use sim::watch::{Step, Truth, Watch};
use sim::world::World;

const DAY_S: f64 = 86_400.0;

/// Ticks of the timer in a slot, and in a second.
const SLOT_TICKS: f64 = 1523.0;
const TIMER_HZ: f64 = 168e6;

/// Clock after a number of equal steps.
fn after(steps: u32, step_s: f64) -> Clock {
    let mut clock = Clock::default();
    (0..steps).for_each(|_| clock.go_on(step_s));
    clock
}

#[test]
fn after_more_than_a_day_of_frames_it_is_what_the_timer_says_to_the_last_bit() {
    let slot_s = SLOT_TICKS / TIMER_HZ;
    // In as many slots as there are ticks in a second, 1523 s are whole. In six times as many frames, of 11 slots, 28
    // hours.
    assert_eq!(after(168_000_000, slot_s), Clock::from_start(1523.0));
    let day = after(6 * 168_000_000, 11.0 * slot_s);
    assert_eq!(day, Clock::from_start(100_518.0));
    assert_eq!(day.time_s(), 100_518.0);
}

#[test]
fn a_step_that_is_no_whole_number_of_units_counts_as_the_nearest() {
    // 21e15 units are a second.
    for (units, counted) in [(2.9, 3.0), (3.1, 3.0)] {
        assert_eq!(after(1_000, units / 21e15), after(1, 1_000.0 * counted / 21e15));
    }
}

#[test]
fn at_the_end_of_a_day_time_goes_on_as_at_its_start() {
    let (mut early, mut late) = (Clock::default(), Clock::from_start(DAY_S));
    for _ in 0..10_000 {
        early.go_on(1523.0 / 168e6);
        late.go_on(1523.0 / 168e6);
        assert_eq!(early.since(Clock::default()), late.since(Clock::from_start(DAY_S)));
    }
}

#[test]
fn a_run_is_the_same_at_any_hour() {
    let scene =
        scene("duration_s = 0.4\n[[script]]\nat_s = 0.01\ngoal_n = 1.0\n[effects.noise]\n[effects.relaxation]\n");
    let run = |clock_s| simulate_from::<Named>(&scene, Begun { clock_s, scene_s: 0.0 }, &mut Last::default()).unwrap();
    assert_eq!(run(0.0).digest, run(DAY_S).digest);
}

/// Forces (N), places of the object (mm) and winding temperature (degC) at each step.
#[derive(Default)]
struct Truths(Vec<[f64; 5]>);

impl Watch for Truths {
    fn step(&mut self, step: &Step) {
        let Truth { force_n, tangential_n, object_mm, winding_c, .. } = *step.truth;
        self.0.push([force_n, tangential_n, object_mm[0], object_mm[1], winding_c]);
    }
}

/// Effects that depend on the time.
const BY_TIME: &str = "[effects.settling]\n[effects.creep]\n[effects.relaxation]\n[effects.thermal_derating]\n[effects.object_mass]\n\
    [effects.tangential]\n[effects.dry_friction]\n";

#[test]
fn what_a_script_asks_for_after_a_day_goes_as_at_the_start() {
    let truths = |scene_s: f64| {
        let [first_s, second_s, end_s] = [0.01, 0.3, 0.5].map(|at_s| scene_s + at_s);
        let text = format!(
            "duration_s = {end_s:?}\n[object]\ndistance_mm = 2.0\n[[script]]\nat_s = {first_s:?}\ngoal_n = 1.0\n\
             [[script]]\nat_s = {second_s:?}\ngoal_n = 2.0\n[hand]\nfingers = 2\nlift_mm = 2.0\nlift_at_s = {second_s:?}\nlift_s = 0.1\n{BY_TIME}"
        );
        let mut truths = Truths::default();
        simulate_from::<Named>(&scene(&text), Begun { clock_s: 0.0, scene_s }, &mut truths).unwrap();
        truths.0
    };
    let (early, late) = (truths(0.0), truths(DAY_S));
    assert_eq!(early.len(), late.len());
    let worst = |of: usize| early.iter().zip(&late).map(|(a, b)| (a[of] - b[of]).abs()).fold(0.0, f64::max);
    let most = |of: usize| early.iter().map(|truth| truth[of]).fold(0.0, f64::max);
    println!("{:?} of {:?}", [0, 1, 2, 3, 4].map(worst), [0, 1, 2, 3, 4].map(most));
    // Behind a day's seconds a number has 36 bits left, steps of 15 ps: the lifting hand goes 6e-10 mm in one, a
    // thousand times.
    assert!([1e-9, 1e-8, 1e-9, 1e-7, 1e-9].into_iter().enumerate().all(|(of, least)| worst(of) < least));
    assert!(most(0) > 1.5 && most(3) > 1.5);
}

#[test]
fn the_host_repeats_itself_all_day_at_its_period() {
    let scene = scene("duration_s = 90000.0\n[host]\nperiod_ms = 10.0\n[[script]]\nat_s = 0.0\ngoal_n = 1.0\n");
    let mut host = Host::new(&scene);
    let mut last_s = 0.0;
    while let Some((at_s, _)) = host.arrival(DAY_S + 0.005, &mut ()) {
        last_s = at_s;
    }
    assert_eq!(host.sent, 8_640_001);
    assert!((last_s - DAY_S).abs() < 1e-9, "{last_s:?} s");
}

const ROW: usize = 4;
/// Full drive into a wall.
const DRIVE: Bridge = Bridge::Driven { duty: 1.0 };

fn running_in() -> World<Named> {
    let mut world = world("[object]\ndistance_mm = 0.0\n");
    world.fingers_mut()[0].place(1.0);
    world.fingers_mut()[0].launch(50.0);
    world
}

#[test]
fn what_lies_between_two_steps_is_what_shorter_steps_come_to() {
    let mut coarse = running_in();
    run(&mut coarse, 100e-6, 1, DRIVE);
    for short_steps in [4, 9, 10, 14, 20] {
        let mut fine = running_in();
        run(&mut fine, 10e-6, short_steps, DRIVE);
        let since_s = 10e-6 * short_steps as f64;
        if short_steps <= 10 {
            let (row, there) = (coarse.row_kpa(0, since_s, ROW), fine.row_kpa(0, f64::INFINITY, ROW));
            for (here, there) in row.into_iter().zip(there) {
                // 10 us of motion change the pressure by 0.05 %.
                assert!((here - there).abs() < 5e-5 * there.max(1.0), "{here} and {there} kPa at {since_s} s");
            }
        }
        if short_steps >= 10 {
            let count = coarse.fingers_mut()[0].count_ahead(since_s - 100e-6);
            assert_eq!(count, fine.fingers_mut()[0].count_ahead(0.0), "at {since_s} s");
        }
    }
}
