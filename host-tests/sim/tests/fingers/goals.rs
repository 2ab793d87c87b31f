//! A goal of 0 must release the object after any other request, also with torque off and on while the tip moves. Other
//! goals and tares at unusual moments: amid a release, at the slowest approach, under a load.

use crate::*;

/// Time within which a goal of 0 releases an object of this compliance. In a very soft object the tip must
/// travel several times as far.
fn release_s(yield_mm_per_n: f64) -> f64 {
    if yield_mm_per_n > 1.0 { 0.8 } else { 0.5 }
}

/// Requests a release, and judges the largest force from the time allowed to 1.5 s after.
fn case(finger: &mut Finger, yield_mm_per_n: f64, what: String) -> Case {
    press(finger, 0.0, release_s(yield_mm_per_n));
    Case::new(what, finger.run(1.5), CONTACT_ON_N)
}

/// A soft object's compliance, mm/N, the goal, N, and the losses of the drive.
type Held = (f64, f64, &'static str);

/// These objects and goals, without and with losses.
fn with_and_without_losses(objects: [(f64, f64); 2]) -> impl Iterator<Item = Held> {
    objects.into_iter().flat_map(|(yield_mm_per_n, goal_n)| ["", LOSSES].map(|losses| (yield_mm_per_n, goal_n, losses)))
}

fn drawn(rng: &mut Rng) -> Held {
    (log_uniform(rng, 0.1, 2.0), uniform(rng, 0.3, 7.0), if rng.bool() { LOSSES } else { "" })
}

/// Holds the goal for 1 s, lets an interruption happen, and releases.
fn interrupted((yield_mm_per_n, goal_n, losses): Held, happens: &str, interrupt: impl FnOnce(&mut Finger)) -> Case {
    let mut finger = finger(&(object(2.5, yield_mm_per_n) + losses));
    press(&mut finger, goal_n, 1.0);
    interrupt(&mut finger);
    case(&mut finger, yield_mm_per_n, format!("{yield_mm_per_n:.3} mm/N, {goal_n:.2} N, {happens}, {losses:?}"))
}

sim::sizes!(goal_zero_releases_soft_objects_after_a_torque_interruption, torque_interrupted: 0..6, 6..56);

fn torque_interrupted(seeds: Range<u64>) {
    let objects = with_and_without_losses([(0.7, 5.0), (2.0, 7.0)]);
    let fixed = objects.flat_map(|held| [0.0, 0.01, 0.3].map(|wait_s| (held, 0.01, wait_s)));
    let drawn = seeds.map(|seed| {
        let mut rng = Rng::with_seed(seed);
        (drawn(&mut rng), uniform(&mut rng, 0.002, 0.06), uniform(&mut rng, 0.0, 0.1))
    });
    let cases = cores::map(fixed.chain(drawn).collect::<Vec<_>>(), |(held, off_s, wait_s)| {
        interrupted(held, &format!("off for {off_s:.4} s, 0 after {wait_s:.3} s"), |finger| {
            interrupt_torque(finger, off_s);
            finger.run(wait_s);
        })
    });
    judge("soft objects, torque interrupted", "N", &cases);
}

// Goal 0 for the first time, another goal for the second one, and 0 for good.
sim::sizes!(goal_zero_releases_soft_objects_after_a_goal_interruption, goal_interrupted: 100..106, 106..135);

fn goal_interrupted(seeds: Range<u64>) {
    let fixed = with_and_without_losses([(0.7, 5.0), (1.0, 7.0)]).map(|held| (held, 0.5, [0.003; 2]));
    let drawn = seeds.map(|seed| {
        let mut rng = Rng::with_seed(seed);
        let held = drawn(&mut rng);
        (held, uniform(&mut rng, 0.1, 1.0) * held.1, [0; 2].map(|_| log_uniform(&mut rng, 0.001, 0.03)))
    });
    let cases = cores::map(fixed.chain(drawn).collect::<Vec<_>>(), |(held, again_n, times_s)| {
        interrupted(held, &format!("{again_n:.2} N again, {times_s:.4?} s"), |finger| {
            press(finger, 0.0, times_s[0]);
            press(finger, again_n, times_s[1]);
        })
    });
    judge("soft objects, goal interrupted", "N", &cases);
}

/// The surface of a soft object is the travel of the first touch, not the travel to which the object has yielded.
#[test]
fn goal_zero_releases_a_soft_object_after_a_press_that_measures() {
    let cases = cores::map([0.0, 0.3, 0.5, 1.0, 2.0], |yield_mm_per_n| {
        let mut finger = finger(&(object(3.0, yield_mm_per_n) + LOSSES));
        finger.run(0.1);
        finger.request(Task::Press);
        finger.step();
        let until_s = finger.time_s() + 12.0;
        while finger.status().mode == Mode::Press && finger.time_s() < until_s {
            finger.step();
        }
        let what = format!("{yield_mm_per_n} mm/N, then {:?} {:?}", finger.status().mode, finger.status().fault);
        case(&mut finger, yield_mm_per_n, what)
    });
    judge("soft objects, after a press that measures", "N", &cases);
}

#[test]
fn goal_zero_releases_an_object_that_moved_while_it_was_held() {
    let cases = each(&[0.0, 0.3, 0.7, 1.0, 2.0], &[-2.0, -1.0, 1.0, 2.0], |yield_mm_per_n, by_mm| {
        let mut finger = finger(&(object(5.0, yield_mm_per_n) + LOSSES));
        press(&mut finger, 3.0, 1.0);
        finger.carry_object(5.0, 5.0 + by_mm, 40.0, |_| {});
        finger.run(0.3);
        let what = format!("{yield_mm_per_n} mm/N, moved by {by_mm} mm, {:?}", finger.status().fault);
        case(&mut finger, yield_mm_per_n, what)
    });
    judge("objects that moved", "N", &cases);
}

/// One press, torque off somewhere in it, and on again while the motor still turns.
fn restarted(seed: u64) -> Case {
    let mut rng = Rng::with_seed(seed);
    let goal_n = uniform(&mut rng, 0.5, 7.0);
    let mut finger = finger(&(object(uniform(&mut rng, 1.0, 5.0), 0.0) + LOSSES));
    set_goal(&mut finger, goal_n);
    let moment = match seed % 4 {
        0 => {
            finger.run(uniform(&mut rng, 0.005, 0.03));
            "in the approach"
        }
        1 => {
            touch(&mut finger);
            finger.run(uniform(&mut rng, 0.0, 0.02));
            "after the touch"
        }
        2 => {
            finger.run(0.7);
            press(&mut finger, 0.0, uniform(&mut rng, 0.002, 0.1));
            "in the release"
        }
        _ => {
            finger.run(0.7);
            press(&mut finger, uniform(&mut rng, 0.5, 7.0), uniform(&mut rng, 0.001, 0.02));
            "between two goals"
        }
    };
    let (speed, off_s) = (finger.truth().speed_mm_per_s, uniform(&mut rng, 0.001, 0.03));
    interrupt_torque(&mut finger, off_s);
    let again_n = if rng.bool() { goal_n } else { uniform(&mut rng, 0.5, 7.0) };
    press(&mut finger, again_n, 0.5);
    let fault = finger.status().fault;
    let stopped = matches!(fault, Some(Fault::EncoderFrozen | Fault::Runaway | Fault::Reversed));
    let what = format!(
        "{seed}: goal {goal_n:.2} N, off {moment} at {speed:.0} mm/s for {off_s:.4} s, then {again_n:.2} N: {fault:?}"
    );
    Case::never(what, stopped)
}

#[test]
fn torque_on_while_the_motor_coasts_is_no_fault() {
    judge("torque on while the motor coasts", "faults 5, 14 or 15", &cores::map(0..100, restarted));
}

/// Another goal amid a release: until the force rises, what the array reads may be a residue, and there may be air ahead.
#[test]
fn a_goal_amid_a_release_does_not_drive_the_tip_through_the_air() {
    let remembering = "[effects.dry_friction]\n[effects.creep]\nrate_percent_per_decade = 2\n";
    let goals = [0.0, 0.2].map(|mm_per_n| [(2.0, 3.0), (1.6, 4.0), (1.0, 0.4)].map(|goals| (mm_per_n, goals)));
    let times_s: Vec<_> = (10..22).map(|step| 0.0025 * f64::from(step)).collect();
    let cases = each(goals.as_flattened(), &times_s, |(yield_mm_per_n, (first_n, second_n)), after_s| {
        let mut finger = finger(&(object(3.0, yield_mm_per_n) + remembering));
        press(&mut finger, first_n, 0.7);
        set_goal(&mut finger, 0.0);
        let fastest = fastest_in_the_air(&mut finger, (after_s, second_n), 0.8);
        let held = (finger.truth().force_n - second_n).abs() < 0.1 * second_n + 0.03;
        let what =
            format!("{yield_mm_per_n} mm/N, {first_n} N, {second_n} N {after_s} s after goal 0, holds it: {held}");
        Case::new(what, if held { fastest } else { f64::NAN }, 1.5 * APPROACH_MM_PER_S)
    });
    judge("speed without contact", "mm/s", &cases);
}

/// A release is quick enough for its promise however slow an approach is.
#[test]
fn goal_zero_releases_at_the_slowest_approach() {
    let cases = cores::map([(0.0, 5.0), (0.0, 1.0), (1.0, 1.0)], |(yield_mm_per_n, goal_n)| {
        let controller = "[controller]\napproach_um_per_s = 500\n";
        let mut finger = finger(&(object(0.2, yield_mm_per_n) + LOSSES + controller));
        press(&mut finger, goal_n, 8.0);
        let held_n = finger.truth().force_n;
        case(&mut finger, yield_mm_per_n, format!("{yield_mm_per_n} mm/N, {held_n:.3} of {goal_n} N"))
    });
    judge("released at the slowest approach", "N", &cases);
}

/// The hand that moved the tip, and may still hold it there, is no fault of the finger.
#[test]
fn a_tip_that_is_pushed_back_without_torque_goes_on() {
    let cases = each(&[1.0, 5.0, 9.0, 20.0], &[20.0, 200.0], |back_mm, mm_per_s| {
        [false, true].map(|stays| {
            let mut finger = finger(&(object(3.0, 0.0) + LOSSES));
            finger.run(0.1);
            finger.command().torque = false;
            finger.carry_object(3.0, -back_mm, mm_per_s, |_| {});
            if !stays {
                finger.carry_object(-back_mm, 3.0, mm_per_s, |_| {});
            }
            finger.run(0.1);
            finger.command().torque = true;
            let held_n = finger.truth().force_n;
            let peak_n = press(&mut finger, 0.0, 1.0);
            let what = format!("{back_mm} mm at {mm_per_s} mm/s, stays {stays}, {:?}", finger.status().fault);
            let left_n = finger.truth().force_n;
            // A tip that was thrown back coasts a long way, and the approach is slow.
            press(&mut finger, 1.0, 6.0);
            let off_n = (finger.truth().force_n - 1.0).abs();
            [
                Case::new(what.clone() + ": peak at goal 0", peak_n, held_n + 0.1),
                Case::new(what.clone() + ": left at goal 0", left_n, 0.1),
                Case::new(what + ": off 1 N", off_n, 0.15),
            ]
        })
    });
    judge("pushed back without torque", "N", &cases.into_iter().flatten().flatten().collect::<Vec<_>>());
}

/// The tare takes the force that presses as zero: with torque on, the tip would press harder by as much.
// With `Command { tare_forced: true, .. }` the same tare allows torque.
#[test]
fn a_tare_while_something_presses_does_not_change_the_force() {
    let mut cases = Vec::new();
    for first in [false, true] {
        for (pressed_mm, goal_n) in [(0.4, 0.0), (0.4, 0.5), (0.4, 3.0), (0.8, 0.0), (0.8, 0.5), (0.8, 3.0)] {
            let scene = scene(&(object(5.0, 0.0) + LOSSES));
            let mut finger: Finger = Bench::new(&scene).unwrap_or_else(|error| panic!("{error}"));
            if !first {
                finger.tare();
            }
            finger.command().torque = false;
            finger.run(0.01);
            finger.place_object(-pressed_mm);
            // The friction of the drive then holds the tip at its place of rest.
            finger.run(0.3);
            finger.tare();
            let before_n = finger.truth().force_n;
            assert!(before_n > CONTACT_ON_N, "nothing presses during the tare");
            let peak_n = press(&mut finger, goal_n, 1.0);
            let state = format!("{:?} {:?}", finger.status().mode, finger.status().fault);
            let what = format!("{before_n:.2} N during the tare, the first one {first}, goal {goal_n} N, {state}");
            let drives = finger.status().mode != Mode::Off;
            // A first tare is not to be trusted; a later one leaves the zero that is known to be right.
            cases.push(Case::never(format!("driven, {what}"), drives == first));
            let most_n = if first { before_n + 0.01 } else { before_n.max(1.05 * goal_n + 0.05) };
            cases.push(Case::new(what, peak_n, most_n));
        }
    }
    // Whoever insists has it.
    let mut finger = finger(&object(5.0, 0.0));
    finger.place_object(-0.4);
    finger.command().tare_forced = true;
    finger.tare();
    finger.run(0.1);
    cases.push(Case::never("not driven though forced".into(), finger.status().mode == Mode::Off));
    judge("torque after a tare while something presses: the largest force", "N", &cases);
}

/// What comes to a released tip during a tare is no residue: the tare shows it, or the next force is true.
#[test]
fn a_push_during_a_tare_after_a_release_does_not_change_the_next_goal() {
    let cases = each(&[10.0, 30.0, 100.0, 300.0], &[0.0, 0.002, 0.005, 0.01, 0.014], |mm_per_s, after_s| {
        let mut finger = finger(&(object(5.0, 0.0) + LOSSES));
        press(&mut finger, 2.0, 0.7);
        press(&mut finger, 0.0, 0.4);
        finger.command().tare_request += 1;
        finger.run(after_s);
        let travel_mm = finger.truth().travel_mm;
        finger.place_object(travel_mm + 0.05);
        finger.carry_object(travel_mm + 0.05, travel_mm - 0.8, mm_per_s, |_| {});
        press(&mut finger, 0.5, 0.6);
        let (force_n, limits) = (finger.truth().force_n, finger.status().limits);
        let shown = limits.has(Limits::TARED_TOUCHING);
        let what = format!("{mm_per_s} mm/s, {after_s} s after the tare began, shown: {shown}");
        Case::new(what, if shown { 0.0 } else { (force_n - 0.5).abs() }, 0.15)
    });
    judge("a push during a tare, then 0.5 N: off by", "N", &cases);
}

/// A supply that dips without a fault does not limit the braking of the motor.
#[test]
fn a_supply_that_dips_after_a_larger_goal_does_not_let_the_force_rise() {
    let dips = [0.85, 0.95].map(|dip_v| [0.002, 0.005, 0.008, 0.011].map(|after_s| (dip_v, after_s)));
    let goals = [(0.2, 1.0), (0.2, 2.0), (0.2, 4.0), (0.5, 3.0), (1.0, 5.0)];
    let cases = each(&goals, dips.as_flattened(), |(first_n, second_n), (dip_v, after_s)| {
        let mut finger = finger(&(object(3.0, 0.0) + LOSSES));
        press(&mut finger, first_n, 0.7);
        let before_n = press(&mut finger, second_n, after_s);
        finger.harm(|faults| faults.supply_drop_v = dip_v);
        let during_n = finger.run(0.03);
        finger.harm(|faults| faults.supply_drop_v = 0.0);
        let peak_n = before_n.max(during_n).max(finger.run(0.2));
        let what =
            format!("{first_n} N to {second_n} N, {dip_v} V less {after_s} s later: {:?}", finger.status().fault);
        Case::new(what, peak_n, most_n(second_n))
    });
    judge("a supply that dips after a larger goal", "N", &cases);
}

// Hysteresis makes the reading stay while the tip follows the object: the array is not frozen.
sim::sizes!(hysteresis_on_a_moving_object_is_no_frozen_array, is_not_frozen(0..20), is_not_frozen(20..80));

fn is_not_frozen(seeds: Range<u64>) {
    let cases = cores::map(seeds, |seed| {
        let mut rng = Rng::with_seed(seed);
        let (width_percent, goal_n) = (uniform(&mut rng, 2.0, 10.0), uniform(&mut rng, 0.5, 4.0));
        let (mm_per_s, way_mm) = (uniform(&mut rng, 10.0, 60.0), uniform(&mut rng, 0.5, 2.0));
        let hysteresis = format!("[effects.hysteresis]\nwidth_percent = {width_percent:?}\n");
        let mut finger = finger(&(object(6.0, 0.0) + LOSSES + &hysteresis));
        press(&mut finger, goal_n, 0.7);
        let mut stopped = None;
        let mut place_mm = 6.0;
        for to_mm in [6.0 + way_mm, 6.0, 6.0 - way_mm, 6.0] {
            finger.carry_object(place_mm, to_mm, mm_per_s, |finger| stopped = stopped.or(finger.status().fault));
            place_mm = to_mm;
        }
        let what =
            format!("{seed}: {width_percent:.1} %, {goal_n:.2} N, {way_mm:.2} mm at {mm_per_s:.0} mm/s: {stopped:?}");
        Case::never(what, stopped == Some(Fault::ArrayFrozen))
    });
    judge("hysteresis on a moving object", "faults 4", &cases);
}
