//! The array's signal is lost, stands still or fades while the motor is driven: the force does not run away.

use crate::{
    Case, LOSSES, fault, finger, force_n, judge, most_n, object, press, run_with, set_goal, show, touch, touch_s,
};
use fingertip::shipped::{COLUMNS, ROWS};
use images::record::Record;
use sim::cores;

/// What becomes of the signal.
#[derive(Clone, Copy, Debug)]
enum Signal {
    /// All codes are those of the tare from then on: the connector is unplugged.
    Blank,
    /// All codes stand still.
    Frozen,
}

/// The moment.
#[derive(Clone, Copy, Debug)]
enum Moment {
    Hold,
    /// This long before the touch.
    Before(f64),
}

/// The largest true force from the start on, where the signal is lost at this moment.
fn lost(modulus_kpa: f64, goal_n: f64, signal: Signal, moment: Moment) -> Case {
    let tables = format!("[tip]\nmodulus_kpa = {modulus_kpa:?}\n{}{LOSSES}", object(3.0, 0.0));
    let mut finger = finger(&tables);
    let blank = *finger.frame();
    let mut peak_n = match moment {
        Moment::Hold => press(&mut finger, goal_n, 1.0),
        Moment::Before(seconds) => press(&mut finger, goal_n, touch_s(&tables, goal_n) - seconds),
    };
    let codes = match signal {
        Signal::Blank => blank,
        Signal::Frozen => *finger.frame(),
    };
    peak_n = peak_n.max(run_with(&mut finger, 1.5, |record| show(record, &codes)));
    let what = format!("{signal:?} {moment:?}, {modulus_kpa} kPa, goal {goal_n} N: {:?}", fault(&finger));
    Case::new(what, peak_n, most_n(goal_n))
}

/// All moduli and goals.
fn all(signal: Signal, moments: &[Moment]) -> Vec<Case> {
    let mut tasks = Vec::new();
    for modulus_kpa in [150.0, 250.0, 400.0] {
        for goal_n in [0.5, 1.0, 3.0, 7.0] {
            tasks.extend(moments.iter().map(|moment| (modulus_kpa, goal_n, *moment)));
        }
    }
    cores::map(tasks, |(modulus_kpa, goal_n, moment)| lost(modulus_kpa, goal_n, signal, moment))
}

#[test]
fn a_signal_that_is_lost_during_a_hold_stops_the_motor_in_time() {
    judge("signal lost during a hold", "N", &all(Signal::Blank, &[Moment::Hold]));
}

#[test]
fn a_signal_that_is_lost_before_the_touch_stops_the_motor_in_time() {
    judge("signal lost before the touch", "N", &all(Signal::Blank, &[Moment::Before(0.002), Moment::Before(0.03)]));
}

#[test]
fn a_signal_that_stands_still_before_the_touch_stops_the_motor_in_time() {
    judge("signal frozen before the touch", "N", &all(Signal::Frozen, &[Moment::Before(0.002), Moment::Before(0.03)]));
}

/// Halves what the codes show above the level of an undriven column.
fn halve(record: &mut Record) {
    for column in 0..COLUMNS {
        let undriven = record.frame.code(ROWS, column);
        for row in 0..ROWS {
            let above = record.frame.code(row, column).saturating_sub(undriven);
            record.frame.set_code(row, column, undriven + above / 2);
        }
    }
}

#[test]
fn gains_that_halve_during_a_press_do_not_double_the_force() {
    let mut cases = Vec::new();
    for goal_n in [0.5, 1.0, 2.2, 5.0] {
        for after_s in [-0.03, 0.003, 0.01, 0.03, 0.5] {
            let mut finger = finger(&(object(3.0, 0.0) + LOSSES));
            set_goal(&mut finger, goal_n);
            if after_s < 0.0 {
                finger.run(0.03);
            } else {
                touch(&mut finger);
                finger.run(after_s);
            }
            let peak_n = run_with(&mut finger, 1.5, halve);
            let what = format!(
                "goal {goal_n} N, {after_s} s after the touch, {:.2} N at last: {:?}",
                force_n(&mut finger),
                fault(&finger)
            );
            cases.push(Case::new(what, peak_n, most_n(goal_n)));
        }
    }
    judge("gains halved", "N", &cases);
}
