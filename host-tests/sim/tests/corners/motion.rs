//! Torque off and on while the tip moves.

use crate::{Case, LOSSES, fault, finger, interrupt_torque, judge, most_n, object, press, set_goal, touch, uniform};
use fastrand::Rng;
use fingertip::params::Params;
use fingertip::state::Fault;
use sim::cores;

#[test]
fn torque_off_just_after_the_touch_does_not_let_the_tip_run_into_the_object() {
    let mut tasks = Vec::new();
    for losses in ["", LOSSES] {
        for goal_n in [0.5, 1.0, 3.0, 7.0] {
            tasks.extend([1, 2, 4, 6, 8, 10, 12, 14, 17, 20].map(|after_ms| (losses, goal_n, after_ms)));
        }
    }
    let cases = cores::map(tasks, |(losses, goal_n, after_ms)| {
        let mut finger = finger(&(object(2.0, 0.0) + losses));
        set_goal(&mut finger, goal_n);
        touch(&mut finger);
        let before_n = finger.run(1e-3 * f64::from(after_ms));
        let peak_n = before_n.max(interrupt_torque(&mut finger, 0.5));
        let losses = if losses.is_empty() { "no losses" } else { "losses" };
        Case::new(format!("goal {goal_n} N, off {after_ms} ms after the touch, {losses}"), peak_n, most_n(goal_n))
    });
    judge("torque off just after the touch", "N", &cases);
}

#[test]
fn torque_off_during_a_release_does_not_let_the_tip_fly_back() {
    let clearance_mm = f64::from(Params::DEFAULT.clearance_um) * 1e-3;
    let mut cases = Vec::new();
    for goal_n in [1.0, 3.0, 7.0] {
        for after_s in [0.004, 0.012, 0.03, 0.1] {
            let mut finger = finger(&(object(5.0, 0.0) + LOSSES));
            press(&mut finger, goal_n, 1.0);
            let indentation_mm = finger.truth().indentation_mm;
            press(&mut finger, 0.0, after_s);
            interrupt_torque(&mut finger, 3.0);
            let behind_mm = 5.0 - finger.truth().travel_mm;
            let what = format!("goal {goal_n} N, off {after_s} s after the release began");
            cases.push(Case::new(what, behind_mm, clearance_mm + indentation_mm + 3.0));
        }
    }
    judge("torque off during a release, behind the surface", "mm", &cases);
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
    let fault = fault(&finger);
    let stopped = matches!(fault, Some(Fault::EncoderFrozen | Fault::Runaway | Fault::Reversed));
    let what = format!(
        "{seed}: goal {goal_n:.2} N, off {moment} at {speed:.0} mm/s for {off_s:.4} s, then {again_n:.2} N: {fault:?}"
    );
    Case::new(what, f64::from(u8::from(stopped)), 0.0)
}

#[test]
fn torque_on_while_the_motor_coasts_is_no_fault() {
    judge("torque on while the motor coasts", "faults 5, 14 or 15", &cores::map(0..100, restarted));
}
