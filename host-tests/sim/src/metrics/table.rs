//! The one table of metrics.

use super::finger::{DROPPED_MM, Finger, LIMITS};
use super::response::AtGoal;
use super::{ByGoal, Metric, Worst};
use Worst::{FirstFault, Largest, Least, Sum};

const fn metric(
    name: &'static str,
    of_several: Worst,
    about: &'static str,
    value: fn(&Finger) -> Option<f64>,
) -> Metric {
    Metric { name, about, of_several, value }
}

const fn flag(is: bool) -> Option<f64> {
    Some(if is { 1.0 } else { 0.0 })
}

/// Share of the time in which a limit (by its bit) held the controller back, percent.
fn limited<const BIT: usize>(finger: &Finger) -> Option<f64> {
    const { assert!(LIMITS[BIT].1 == 1 << BIT) }
    (finger.time_s > 0.0).then(|| 100.0 * finger.limits_s[BIT] / finger.time_s)
}

/// Every metric, in the order in which they are shown.
#[rustfmt::skip]
pub const METRICS: &[Metric] = &[
    metric("peak_force_n", Largest, "largest true normal force", |f| Some(f.peak_n)),
    metric("overshoot_percent", Largest, "largest true force beyond a goal, of the goal or of the step to it, whichever is smaller; the worst of all goals", |f| f.answers().overshoot().map(|share| 100.0 * share)),
    metric("rise_ms", Largest, "from 10 % to 90 % of the way to a goal; the worst of all goals, none where one is not reached", |f| f.answers().rise_s().map(|s| 1e3 * s)),
    metric("settling_ms", Largest, "from the goal's change, or from the touch, until the true force stays within 2 % of the goal or of the step, whichever is smaller; the worst of all goals, none where one never settles", |f| f.answers().settling_s().map(|s| 1e3 * s)),
    metric("steady_error_max_mn", Largest, "largest error of the true force against the goal, from 100 ms after the goal's change or the touch", |f| f.answers().steady_max_n().map(|n| 1e3 * n)),
    metric("steady_error_rms_mn", Largest, "root mean square of that error", |f| f.answers().steady_rms_n().map(|n| 1e3 * n)),
    metric("touch_ms", Largest, "from the start to the first contact", |f| f.touch_s.map(|s| 1e3 * s)),
    metric("approach_mm_per_s", Largest, "mean speed of the tip over the last 10 ms before the first contact", |f| f.approach_mm_per_s),
    metric("travel_max_mm", Largest, "farthest way of the tip from its start", |f| Some(f.travel_max_mm)),
    metric("travel_min_mm", Least, "farthest way of the tip behind its start, below 0", |f| Some(f.conduct.travel_min_mm)),
    metric("indentation_max_mm", Largest, "largest indentation of the tip", |f| Some(f.indentation_max_mm)),
    metric("faults_count", Sum, "faults that stopped the motor, without those that come while a defect of the events acts or within a second after it", |f| Some(f64::from(f.faults))),
    metric("fault_number", FirstFault, "number of the first fault, as on the bus; 0 without", |f| Some(f.first_fault.map_or(0.0, |(fault, _)| f64::from(fault as u8)))),
    metric("fault_ms", FirstFault, "from the start to the first fault", |f| f.first_fault.map(|(_, s)| 1e3 * s)),
    metric("limit_voltage_percent", Largest, "share of the time in which the voltage or the supply was used up", limited::<0>),
    metric("limit_current_percent", Largest, "share of the time in which the current limit held back", limited::<1>),
    metric("limit_speed_percent", Largest, "share of the time at the speed limit", limited::<2>),
    metric("limit_goal_percent", Largest, "share of the time in which the goal was moved to the largest or the least force", limited::<3>),
    metric("limit_travel_percent", Largest, "share of the time at the travel's end", limited::<4>),
    metric("limit_taxels_percent", Largest, "share of the time in which taxels were left out", limited::<5>),
    metric("limit_slew_percent", Largest, "share of the time in which the voltage's slew limit held back", limited::<8>),
    metric("missed_frames_count", Sum, "frames that the controller missed", |f| Some(f64::from(f.missed))),
    metric("duty_rms_percent", Largest, "root mean square of the duty", |f| f.duty.rms().map(|share| 100.0 * share)),
    metric("force_error_max_mn", Largest, "largest difference of the sensed from the true force", |f| Some(1e3 * f.force_error_n.max)),
    metric("force_error_rms_mn", Largest, "root mean square of that difference, over the whole run", |f| f.force_error_n.rms().map(|n| 1e3 * n)),
    metric("centre_error_max_mm", Largest, "largest distance of the sensed from the true centre of the contact, above 0.1 N", |f| f.centre_error_mm),
    metric("confidence_min_percent", Least, "least confidence that the contact is a tip on a plane, from 100 ms after the goal's change or the touch", |f| f.confidence_min.map(|c| f64::from(c) / 2.55)),
    metric("slip_mm", Largest, "way that the contact slipped", |f| Some(f.slip_mm)),
    metric("slips_count", Sum, "slips of more than 1 um; one is over when the contact stuck for 10 ms", |f| Some(f64::from(f.slips.count))),
    metric("slips_unnoticed_count", Sum, "slips that were over before more force was asked for", |f| Some(f64::from(f.slips.unnoticed()))),
    metric("slip_noticed_ms", Largest, "from the onset of a slip until more force is asked for; the longest", |f| f.slips.noticed_after_s.map(|s| 1e3 * s)),
    metric("object_lift_mm", Least, "how much higher than at the start the object is at the end", |f| Some(f.object_lift_mm)),
    metric("object_fall_mm", Largest, "farthest that the object came below its highest place before", |f| Some(f.object_fall_mm)),
    metric("object_dropped", Largest, "1 where it fell more than 5 mm", |f| flag(f.object_fall_mm > DROPPED_MM)),
    metric("object_broken", Largest, "1 where the object broke", |f| flag(f.broken)),
    metric("energy_j", Sum, "electrical energy that the bridge took from the supply, less what the motor gave back", |f| Some(f.energy_j)),
    metric("current_rms_a", Largest, "root mean square of the winding's current", |f| f.current_a.rms()),
    metric("current_max_a", Largest, "largest current in the winding", |f| Some(f.current_a.max)),
    metric("winding_max_c", Largest, "highest temperature of the winding", |f| f.winding_max_c),
    metric("runaway_mm", Largest, "farthest way of the tip behind the first touch, beyond the largest indentation and the clearance (before a touch: behind the start, beyond the clearance), or beyond the travel's end", |f| Some(f.conduct.runaway_mm)),
    metric("air_speed_percent", Largest, "largest speed of the tip without a contact, from 20 ms after one ended, of the approach speed", |f| Some(100.0 * f.conduct.air_share())),
    metric("over_force_mn", Largest, "largest true force beyond the goal; a goal that is taken back counts for 200 ms, and on behind a fault or torque off; what an object does to a finger without a motor does not count", |f| largest(&over_force(f)).or(Some(0.0))),
    metric("over_force_defective_mn", Largest, "the same while a defect of the events acts and for a second after it; `over_force_mn` leaves that time out", |f| largest(&over_force_defective(f)).or(Some(0.0))),
    metric("stop_force_mn", Largest, "largest true force later than 0.5 s after a stop (goal 0, or torque off) while it lasts, without faults, and until the object comes nearer or is put back; with torque off less what dry friction and the gear hold", |f| Some(1e3 * f.conduct.stop_force_n)),
    metric("rest_travel_um", Largest, "from the least to the farthest travel in the last 200 ms of a goal of 0 that was there for 400 ms; the worst of all", |f| f.conduct.ended().rest_mm.map(|mm| 1e3 * mm).or(unjudged(f))),
    metric("rest_duty_percent", Largest, "deviation of the duty in the last 200 ms of a goal, 0 or not, that was there for 400 ms; the worst of all", |f| f.conduct.ended().duty.map(|share| 100.0 * share).or(unjudged(f))),
    metric("hold_swing_mn", Largest, "from the least to the largest true force in the last 200 ms of a goal that was there for 400 ms; the worst of all", |f| largest(&swings(f)).or(unjudged(f))),
    metric("hold_error_mn", Largest, "what the mean of the true force is off the goal in the last 200 ms of one that was there for 400 ms; the worst of all, without those that a fault ended", |f| largest(&errors(f)).or(f.first_fault.map(|_| 0.0)).or(unjudged(f))),
    metric("touches_missed_count", Sum, "goals of at least 400 ms without a fault in whose last 200 ms nothing was touched", |f| Some(f.conduct.ended().missed() as f64)),
];

/// Those that have a value for each goal.
pub const BY_GOAL: &[ByGoal] = &[
    ByGoal { name: "over_force_mn", values: over_force },
    ByGoal { name: "over_force_defective_mn", values: over_force_defective },
    ByGoal { name: "hold_swing_mn", values: swings },
    ByGoal { name: "hold_error_mn", values: errors },
];

fn over_force(finger: &Finger) -> Vec<AtGoal> {
    finger.conduct.over_force().iter().map(|at| at.times(1e3)).collect()
}

fn over_force_defective(finger: &Finger) -> Vec<AtGoal> {
    finger.conduct.over_force_defective().iter().map(|at| at.times(1e3)).collect()
}

/// 0 where events left nothing to judge.
fn unjudged(finger: &Finger) -> Option<f64> {
    finger.conduct.disturbed.then_some(0.0)
}

fn swings(finger: &Finger) -> Vec<AtGoal> {
    finger.conduct.ended().swings().iter().map(|at| at.times(1e3)).collect()
}

fn errors(finger: &Finger) -> Vec<AtGoal> {
    finger.conduct.ended().errors().iter().map(|at| at.times(1e3)).collect()
}

fn largest(values: &[AtGoal]) -> Option<f64> {
    values.iter().map(|at| at.value).reduce(f64::max)
}
