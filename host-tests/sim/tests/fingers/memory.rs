//! Earlier presses do not change later ones: residual readings, pushes, tares under load.

use crate::{
    APPROACH_MM_PER_S, CONTACT_ON_N, Case, Finger, LOSSES, finger, judge, object, press, scene, set_goal, uniform,
};
use fastrand::Rng;
use fingertip::state::{Fault, Mode};
use sim::cores;
use sim::native::bench::Bench;

/// An object that is pushed into a released tip and taken away leaves the next goal as it is.
#[test]
fn a_push_against_a_released_tip_does_not_change_the_next_goal() {
    let mut cases = Vec::new();
    for wait_s in [0.02, 0.04, 0.06, 0.1, 0.16, 0.2, 0.3] {
        for depth_mm in [1.0, 1.45] {
            let mut finger = finger(&(object(5.0, 0.0) + LOSSES));
            press(&mut finger, 7.0, 1.0);
            press(&mut finger, 0.0, wait_s);
            let travel_mm = finger.truth().travel_mm;
            finger.carry_object(5.0, (travel_mm - depth_mm).min(5.0), 100.0, |_| {});
            finger.run(1.0);
            let pushed_n = finger.truth().force_n;
            finger.place_object(8.0);
            finger.run(0.05);
            press(&mut finger, 1.0, 1.5);
            let off_n = (finger.truth().force_n - 1.0).abs();
            let what = format!("{depth_mm} mm, {wait_s} s after the release began ({pushed_n:.2} N at last)");
            cases.push(Case::new(what, off_n, 0.15));
        }
    }
    judge("a push against a released tip, then 1 N: off by", "N", &cases);
}

/// A residual reading after a contact does not move a tip that touches nothing.
#[test]
fn a_residual_reading_does_not_drive_the_tip_through_the_air() {
    let remembering = "[effects.hysteresis]\nwidth_percent = 2\n[effects.creep]\nrate_percent_per_decade = 2\n";
    let mut cases = Vec::new();
    for hold_s in [0.5, 2.0] {
        for away_s in [0.0, 0.001, 0.003, 0.01, 0.03, 0.1] {
            for goal_n in [1.0, 3.0] {
                let mut finger = finger(&(object(5.0, 0.0) + LOSSES + remembering));
                press(&mut finger, goal_n, hold_s);
                finger.place_object(8.0);
                let begun_s = finger.time_s();
                let (mut ended_s, mut fastest) = (begun_s, 0.0_f64);
                while finger.time_s() < begun_s + 2.0 {
                    if finger.time_s() >= begun_s + away_s {
                        set_goal(&mut finger, 0.0);
                    }
                    finger.step();
                    let truth = finger.truth();
                    if truth.force_n > 0.0 {
                        ended_s = finger.time_s();
                    } else if finger.time_s() > ended_s + 0.02 {
                        fastest = fastest.max(truth.speed_mm_per_s.abs());
                    }
                }
                let what = format!(
                    "{goal_n} N for {hold_s} s, goal 0 {away_s} s after the object is away, {:?}",
                    finger.status().fault
                );
                cases.push(Case::new(what, fastest, 1.5 * APPROACH_MM_PER_S));
            }
        }
    }
    judge("speed without contact", "mm/s", &cases);
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
            cases.push(Case::new(format!("driven, {what}"), f64::from(u8::from(drives == first)), 0.0));
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
    cases.push(Case::new(
        "not driven though forced".into(),
        f64::from(u8::from(finger.status().mode == Mode::Off)),
        0.0,
    ));
    judge("torque after a tare while something presses: the largest force", "N", &cases);
}

/// Hysteresis makes the reading stay while the tip follows the object: the array is not frozen.
#[test]
fn hysteresis_on_a_moving_object_is_no_frozen_array() {
    let cases = cores::map(0..80, |seed| {
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
        Case::new(what, f64::from(u8::from(stopped == Some(Fault::ArrayFrozen))), 0.0)
    });
    judge("hysteresis on a moving object", "faults 4", &cases);
}
