//! Metrics of a run, on which a scene may set bounds.
//!
//! [`METRICS`] is their only table: the reader, the results and the reference page use it. All values are simulated;
//! times before 0, when the finger is tared, do not count.

mod conduct;
mod finger;

pub use crate::metrics::conduct::Hold;
pub use crate::metrics::finger::{AtGoal, Finger, duty, newtons};

use crate::metrics::finger::{DROPPED_MM, Response};
use crate::scene::Bound;
use crate::watch::{Controller, Step, Watch};
use Worst::{FirstFault, Largest, Least, Sum};
use fingertip::params::Params;
use fingertip::state::Limits;
use serde::{Deserialize, Serialize};
use std::sync::LazyLock;

/// Most fingers of a scene.
const FINGERS: usize = 2;

#[derive(Clone, Copy)]
pub struct Metric {
    /// Name, with its unit last.
    pub name: &'static str,
    pub about: &'static str,
    /// Title of its group in a report, one of [`GROUPS`].
    pub group: &'static str,
    /// Value that counts if a scene has several fingers.
    pub of_several: Worst,
    pub value: fn(&Finger) -> Option<f64>,
}

/// Selection of one of several values.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Worst {
    Largest,
    Least,
    Sum,
    /// Value of the finger with the earliest fault.
    FirstFault,
}

/// Returns every name that `[[expect]]` may use: `peak_force_n` of the scene, `finger0.peak_force_n` of one finger.
pub fn names() -> Vec<&'static str> {
    static OF_FINGERS: LazyLock<Vec<String>> = LazyLock::new(|| {
        (0..FINGERS).flat_map(|n| METRICS.iter().map(move |metric| format!("finger{n}.{}", metric.name))).collect()
    });
    METRICS.iter().map(|metric| metric.name).chain(OF_FINGERS.iter().map(String::as_str)).collect()
}

#[derive(Clone, Debug, Default)]
pub struct Meter(Vec<Finger>);

impl Meter {
    pub fn measured(&self) -> Measured {
        let scene = METRICS.iter().map(|metric| (metric.name.to_owned(), self.scene(metric)));
        let several = if self.0.len() > 1 { &self.0[..] } else { &[] };
        let fingers = several.iter().enumerate().flat_map(|(number, finger)| {
            METRICS.iter().map(move |metric| (format!("finger{number}.{}", metric.name), (metric.value)(finger)))
        });
        Measured(scene.chain(fingers).collect())
    }

    pub fn verdicts(&self, measured: &Measured, bounds: &[Bound]) -> Vec<Verdict> {
        bounds.iter().map(|bound| self.verdict(measured, bound)).collect()
    }

    fn verdict(&self, measured: &Measured, bound: &Bound) -> Verdict {
        let (mut value, mut max) = (measured.get(&bound.metric), bound.max);
        // A finger without a value leaves the scene without one.
        if let (Some(_), Some(base), Some(share)) = (value, bound.max, bound.max_per_goal_n) {
            // The value at the goal with the largest share of its limit.
            let allowed = |at: &AtGoal| base + share * at.goal_n;
            let used = |at: &AtGoal| if allowed(at) > 0.0 { at.value / allowed(at) } else { at.value - allowed(at) };
            let worst = self.by_goal(&bound.metric).into_iter().max_by(|a, b| used(a).total_cmp(&used(b)));
            if let Some(worst) = worst {
                (value, max) = (Some(worst.value), Some(allowed(&worst)));
            }
        }
        let within = |value: f64| bound.min.is_none_or(|min| value >= min) && max.is_none_or(|max| value <= max);
        Verdict { metric: bound.metric.clone(), value, min: bound.min, max, held: value.is_some_and(within) }
    }

    fn by_goal(&self, metric: &str) -> Vec<AtGoal> {
        let numbered =
            (0..FINGERS).find_map(|number| Some((number, metric.strip_prefix(&format!("finger{number}."))?)));
        let (fingers, name) = match numbered {
            Some((number, name)) => (self.0.get(number..=number).unwrap_or_default(), name),
            None => (&self.0[..], metric),
        };
        let known = BY_GOAL.iter().find(|(known, _)| *known == name);
        known.map_or(Vec::new(), |(_, values)| fingers.iter().flat_map(values).collect())
    }

    pub fn holds(&self) -> Vec<Hold> {
        self.0.iter().flat_map(|finger| finger.conduct.ended().holds).collect()
    }

    /// Returns none if a finger has none: a finger that never settles is not compensated by one that does.
    fn scene(&self, metric: &Metric) -> Option<f64> {
        let values: Option<Vec<f64>> = self.0.iter().map(metric.value).collect();
        let fold: fn(f64, f64) -> f64 = match metric.of_several {
            Worst::Largest => f64::max,
            Worst::Least => f64::min,
            Worst::Sum => core::ops::Add::add,
            Worst::FirstFault => {
                let faulty = self.0.iter().filter_map(|finger| Some((finger, finger.first_fault?.1)));
                let first = faulty.min_by(|(_, a_s), (_, b_s)| a_s.total_cmp(b_s)).map(|(finger, _)| finger);
                return (metric.value)(first.or(self.0.first())?);
            }
        };
        values?.into_iter().reduce(fold)
    }
}

impl Watch for Meter {
    fn begin(&mut self, controllers: &[Controller]) {
        self.0 = controllers.iter().map(|controller| Finger::of(&controller.params)).collect();
    }

    fn step(&mut self, step: &Step) {
        if self.0.len() <= step.finger {
            self.0.resize_with(step.finger + 1, || Finger::of(&Params::DEFAULT));
        }
        self.0[step.finger].step(step);
    }
}

/// Results of a run: each metric, in the order of the table, then those of each of several fingers.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Measured(pub Vec<(String, Option<f64>)>);

impl Measured {
    /// Returns a result by its name. The prefix `finger0.` is allowed with a single finger too.
    pub fn get(&self, name: &str) -> Option<f64> {
        let of = |name: &str| self.0.iter().find(|(known, _)| known == name).map(|(_, value)| *value);
        of(name).or_else(|| of(name.strip_prefix("finger0.")?)).flatten()
    }

    /// Returns all results for scripts, `null` for a missing one.
    #[cfg(feature = "files")]
    pub fn json(&self) -> serde_json::Map<String, serde_json::Value> {
        self.0.iter().map(|(name, value)| (name.clone(), (*value).into())).collect()
    }
}

#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Verdict {
    pub metric: String,
    /// Result: for a metric with a value for each goal, the worst against its limit. A metric without a value breaks
    /// its bound.
    pub value: Option<f64>,
    pub min: Option<f64>,
    /// Largest allowed value: for a bound that grows with the goal, that of the worst goal.
    pub max: Option<f64>,
    pub held: bool,
}

impl Verdict {
    /// Distance beyond the bound as a share of the bound, negative within it; -1 for a count that is 0 as required.
    pub fn excess(&self) -> f64 {
        let Some(value) = self.value else { return if self.held { -1.0 } else { f64::INFINITY } };
        let sides = [self.max.map(|max| value - max), self.min.map(|min| min - value)];
        let over = sides.into_iter().flatten().fold(f64::NEG_INFINITY, f64::max);
        match self.max.or(self.min).map_or(0.0, f64::abs) {
            allowed if allowed > 0.0 => over / allowed,
            _ if self.held => -1.0,
            _ => over,
        }
    }
}

pub fn page() -> String {
    let mut page = String::new();
    for Metric { name, about, of_several, .. } in METRICS {
        let several = match of_several {
            Worst::Largest => "",
            Worst::Least => " (the least)",
            Worst::Sum => " (the sum)",
            Worst::FirstFault => " (the first in time)",
        };
        page += &format!("- `{name}`{several}: {about}\n");
    }
    page
}

/// Formats a value for people: at most six significant digits, or `none` for a missing value.
pub fn shown(value: Option<f64>) -> String {
    let Some(value) = value else { return "none".into() };
    let whole_digits = if value == 0.0 { 1 } else { value.abs().log10().floor() as i32 + 1 };
    let places = (5 - whole_digits).clamp(0, 9) as usize;
    let text = format!("{value:.places$}");
    if text.contains('.') { text.trim_end_matches('0').trim_end_matches('.').to_owned() } else { text }
}

const fn metric(
    name: &'static str,
    group: &'static str,
    of_several: Worst,
    about: &'static str,
    value: fn(&Finger) -> Option<f64>,
) -> Metric {
    Metric { name, about, group, of_several, value }
}

/// Share of the time in which a limit held the controller back, percent.
fn limited(finger: &Finger, limit: u16) -> Option<f64> {
    (finger.time_s > 0.0).then(|| 100.0 * finger.limits_s[limit.trailing_zeros() as usize] / finger.time_s)
}

/// Returns 0 if events left nothing to judge.
fn unjudged(finger: &Finger) -> Option<f64> {
    finger.conduct.disturbed.then_some(0.0)
}

fn largest(values: &[AtGoal]) -> Option<f64> {
    values.iter().map(|at| at.value).reduce(f64::max)
}

const FORCE: &str = "Force";
const MOTION: &str = "Motion and touch";
const FAULTS: &str = "Faults and limits";
const SENSING: &str = "Sensing";
const OBJECT: &str = "Slip and object";
const MOTOR: &str = "Motor and energy";
/// Groups of metrics, in the order of a report.
pub const GROUPS: [&str; 6] = [FORCE, MOTION, FAULTS, SENSING, OBJECT, MOTOR];

#[rustfmt::skip]
pub const METRICS: &[Metric] = &[
    metric("peak_force_n", FORCE, Largest, "largest true normal force", |f| Some(f.peak_n)),
    metric("overshoot_percent", FORCE, Largest, "largest true force beyond the goal, as a share of the goal or of the step to it, whichever is smaller", |f| f.worst(|r| Some(r.beyond_n / r.unit_n())).map(|share| 100.0 * share)),
    metric("rise_ms", FORCE, Largest, "time from 10 % to 90 % of the step; none if a goal is not reached", |f| f.worst(Response::rise_s).map(|s| 1e3 * s)),
    metric("settling_ms", FORCE, Largest, "time from the goal's change or the touch until the true force stays within 2 % of the goal or of the step, whichever is smaller; none if a goal never settles", |f| f.worst(Response::settled_s).map(|s| 1e3 * s)),
    metric("steady_error_max_mn", FORCE, Largest, "largest error of the true force from 100 ms after the goal's change or the touch", |f| f.steady_error_n().map(|[n, _]| 1e3 * n)),
    metric("steady_error_rms_mn", FORCE, Largest, "root mean square of that error", |f| f.steady_error_n().map(|[_, n]| 1e3 * n)),
    metric("touch_ms", MOTION, Largest, "time of the first contact", |f| f.touch_s.map(|s| 1e3 * s)),
    metric("approach_mm_per_s", MOTION, Largest, "mean speed in the last 10 ms before the first contact", |f| f.approach_mm_per_s),
    metric("travel_max_mm", MOTION, Largest, "largest travel of the tip", |f| Some(f.travel_max_mm)),
    metric("travel_min_mm", MOTION, Least, "least travel of the tip; negative behind its start", |f| Some(f.conduct.travel_min_mm)),
    metric("indentation_max_mm", MOTION, Largest, "largest indentation of the tip", |f| Some(f.indentation_max_mm)),
    metric("faults_count", FAULTS, Sum, "faults that stopped the motor, except during a defect and for a second after it", |f| Some(f64::from(f.faults))),
    metric("fault_number", FAULTS, FirstFault, "number of the first fault; 0 if none", |f| Some(f.first_fault.map_or(0.0, |(fault, _)| f64::from(fault as u8)))),
    metric("fault_ms", FAULTS, FirstFault, "time of the first fault", |f| f.first_fault.map(|(_, s)| 1e3 * s)),
    metric("limit_voltage_percent", FAULTS, Largest, "share of the time at the limit of voltage or supply", |f| limited(f, Limits::VOLTAGE)),
    metric("limit_current_percent", FAULTS, Largest, "share of the time at the current limit", |f| limited(f, Limits::CURRENT)),
    metric("limit_speed_percent", FAULTS, Largest, "share of the time at the speed limit", |f| limited(f, Limits::SPEED)),
    metric("limit_goal_percent", FAULTS, Largest, "share of the time in which the goal was changed to the largest or the least force", |f| limited(f, Limits::GOAL)),
    metric("limit_travel_percent", FAULTS, Largest, "share of the time at an end of the travel", |f| limited(f, Limits::TRAVEL)),
    metric("limit_taxels_percent", FAULTS, Largest, "share of the time with taxels left out", |f| limited(f, Limits::TAXELS)),
    metric("limit_slew_percent", FAULTS, Largest, "share of the time at the slew limit", |f| limited(f, Limits::SLEW)),
    metric("missed_frames_count", FAULTS, Sum, "frames that the controller missed", |f| Some(f64::from(f.missed))),
    metric("duty_rms_percent", MOTOR, Largest, "root mean square of the duty", |f| f.duty.rms().map(|share| 100.0 * share)),
    metric("force_error_max_mn", SENSING, Largest, "largest error of the measured force", |f| Some(1e3 * f.force_error_n.max)),
    metric("force_error_rms_mn", SENSING, Largest, "root mean square of that error over the whole run", |f| f.force_error_n.rms().map(|n| 1e3 * n)),
    metric("centre_error_max_mm", SENSING, Largest, "largest error of the measured centre, above 0.1 N", |f| f.centre_error_mm),
    metric("confidence_min_percent", SENSING, Least, "least confidence from 100 ms after the goal's change or the touch", |f| f.confidence_min.map(|c| f64::from(c) / 2.55)),
    metric("slip_mm", OBJECT, Largest, "distance that the contact slipped", |f| Some(f.slip_mm)),
    metric("slips_count", OBJECT, Sum, "slips of more than 1 um; a slip is over when the contact has stuck for 10 ms", |f| Some(f64::from(f.slips.count))),
    metric("slips_unnoticed_count", OBJECT, Sum, "slips that were over before the goal rose", |f| Some(f64::from(f.slips.unnoticed()))),
    metric("slip_noticed_ms", OBJECT, Largest, "longest time from the onset of a slip to a higher goal", |f| f.slips.noticed_after_s.map(|s| 1e3 * s)),
    metric("object_lift_mm", OBJECT, Least, "height of the object at the end above its start", |f| Some(f.object_lift_mm)),
    metric("object_fall_mm", OBJECT, Largest, "largest fall of the object below its highest place before", |f| Some(f.object_fall_mm)),
    metric("object_dropped", OBJECT, Largest, "1 if the object fell more than 5 mm", |f| Some(f64::from(f.object_fall_mm > DROPPED_MM))),
    metric("object_broken", OBJECT, Largest, "1 if the object broke", |f| Some(f64::from(f.broken))),
    metric("energy_j", MOTOR, Sum, "energy that the bridge took from the supply, less the energy that it returned", |f| Some(f.energy_j)),
    metric("current_rms_a", MOTOR, Largest, "root mean square of the winding's current", |f| f.current_a.rms()),
    metric("current_max_a", MOTOR, Largest, "largest current in the winding", |f| Some(f.current_a.max)),
    metric("winding_max_c", MOTOR, Largest, "highest temperature of the winding", |f| f.winding_max_c),
    metric("runaway_mm", MOTION, Largest, "largest distance of the tip beyond the end of the travel, or behind the first touch less the largest indentation and the clearance (before a touch: behind the start less the clearance)", |f| Some(f.conduct.runaway_mm)),
    metric("air_speed_percent", MOTION, Largest, "largest speed in the air, as a share of the approach speed, from 20 ms after a contact ended", |f| Some(100.0 * (f.conduct.air_mm_per_s / f.conduct.approach_mm_per_s))),
    metric("over_force_mn", FORCE, Largest, "largest true force beyond the goal. A reduced goal counts for 200 ms more, and during a fault or torque off. A push of the object on a finger without torque does not count", |f| largest(&f.conduct.over_force_mn).or(Some(0.0))),
    metric("over_force_defective_mn", FORCE, Largest, "the same during a defect and for a second after it, which `over_force_mn` leaves out", |f| largest(&f.conduct.over_force_defective_mn).or(Some(0.0))),
    metric("stop_force_mn", FORCE, Largest, "largest true force from 0.5 s after a stop (goal 0 or torque off) until the stop ends, a fault occurs, or the object comes nearer or is put back; with torque off, less the force that dry friction and gear hold", |f| Some(1e3 * f.conduct.stop_force_n)),
    metric("rest_travel_um", MOTION, Largest, "range of the travel at the end of a goal of 0", |f| f.conduct.ended().rest_mm.map(|mm| 1e3 * mm).or(unjudged(f))),
    metric("rest_duty_percent", MOTOR, Largest, "deviation of the duty at the end of any goal, also 0", |f| f.conduct.ended().duty.map(|share| 100.0 * share).or(unjudged(f))),
    metric("hold_swing_mn", FORCE, Largest, "range of the true force at the end of a goal", |f| largest(&f.conduct.ended().swings_mn()).or(unjudged(f))),
    metric("hold_error_mn", FORCE, Largest, "error of the mean true force at the end of a goal, without goals that a fault ended", |f| largest(&f.conduct.ended().errors_mn()).or(f.first_fault.map(|_| 0.0)).or(unjudged(f))),
    metric("touches_missed_count", MOTION, Sum, "goals without a fault at whose end nothing was touched", |f| Some(f.conduct.ended().missed() as f64)),
];

/// Name of a metric that has a value for each goal, and these values.
type ByGoal = (&'static str, fn(&Finger) -> Vec<AtGoal>);

pub const BY_GOAL: [ByGoal; 4] = [
    ("over_force_mn", |f| f.conduct.over_force_mn.clone()),
    ("over_force_defective_mn", |f| f.conduct.over_force_defective_mn.clone()),
    ("hold_swing_mn", |f| f.conduct.ended().swings_mn()),
    ("hold_error_mn", |f| f.conduct.ended().errors_mn()),
];
