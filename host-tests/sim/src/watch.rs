//! Values that a run shows to its watchers, one control step at a time; and the watcher that compares two boards.

use crate::events::Event;
use crate::scene::Scene;
use fingertip::command::Command;
use fingertip::frame::Sense;
use fingertip::params::Params;
use fingertip::pipeline::Status;
use fingertip::shipped::{COLUMNS, Frame, ROWS};
use std::fmt;

/// Settings of a controller when a run begins. With all [`Step`]s they are sufficient for a replay.
#[derive(Clone, Debug)]
pub struct Controller {
    pub params: Params,
    /// Gain of each taxel, Q14, if the finger is calibrated.
    pub calibration: Option<[[u16; COLUMNS]; ROWS]>,
}

/// Control step of one finger: inputs, outputs and truth.
#[derive(Clone, Copy, Debug)]
pub struct Step<'a> {
    /// Number of the finger, from 0.
    pub finger: usize,
    /// Virtual time from the start of the scene; negative while the finger is tared.
    pub time_s: f64,
    /// Complete input of the core with `sense` and `command`: a recording of them replays the run to the bit.
    pub frame: &'a Frame,
    pub sense: &'a Sense,
    pub command: &'a Command,
    /// Output of the core, with the duty.
    pub status: &'a Status,
    pub truth: &'a Truth,
}

/// True state of the world at a step.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Truth {
    /// Normal force between tip and object.
    pub force_n: f64,
    pub indentation_mm: f64,
    /// Centre of the contact from the array's middle, along columns and rows.
    pub centre_mm: [f64; 2],
    /// Travel of the tip from its start.
    pub travel_mm: f64,
    pub speed_mm_per_s: f64,
    pub current_a: f64,
    pub supply_v: f64,
    /// Share of the supply at the motor, -1 to 1; positive presses.
    pub duty: f64,
    /// Temperature of the winding; 25 unless a scene heats it.
    pub winding_c: f64,
    /// Tangential force on the object, upwards.
    pub tangential_n: f64,
    pub slip_mm: f64,
    /// Place of the object along the fingers' motion and upwards.
    pub object_mm: [f64; 2],
    /// Distance to which an event has removed the object from the fingers.
    pub object_away_mm: f64,
    /// True while an event acts on the finger, its object or its controller.
    pub disturbed: bool,
    /// True while a defect acts and for a second after it: it may cause a fault.
    pub defective: bool,
    /// Force at the tip that dry friction and the gear hold without the motor; infinite for a self-locking gear.
    pub friction_n: f64,
    pub broken: bool,
    /// Mean true pressure on each taxel if a watcher requests it ([`Watch::wants_pressures`]), else 0.
    pub pressures_kpa: [[f64; COLUMNS]; ROWS],
}

/// Watcher of a run. It cannot change the run.
pub trait Watch {
    /// Starts the run with these controllers, one for each finger.
    fn begin(&mut self, _controllers: &[Controller]) {}

    /// Returns true if the true pressures of this step are requested. They cost time.
    fn wants_pressures(&mut self, _finger: usize, _time_s: f64) -> bool {
        false
    }

    /// Returns true if every frame is requested. Otherwise the emulated board shows the frames that an answer on the
    /// bus covers, and the others have the status of the last answer.
    fn wants_every_frame(&self) -> bool {
        false
    }

    fn step(&mut self, step: &Step);
}

#[derive(Clone, Debug, PartialEq)]
pub struct Cost {
    pub effect: &'static str,
    /// Number of calls, including those skipped because their results are known.
    pub evaluations: u64,
    /// Wall time, estimated from a sample of the calls.
    pub seconds: f64,
}

#[derive(Clone, Debug, Default, PartialEq)]
pub struct Summary {
    pub virtual_s: f64,
    /// Wall time before the start of the scene: to build the world, to power the boards up and to tare them.
    pub set_up_s: f64,
    pub wall_s: f64,
    /// Cost of each effect, in the order of the scene.
    pub ledger: Vec<Cost>,
    /// XXH3 of 128 bits over every frame, sense, command, duty and status of the run, in order.
    pub digest: String,
}

/// Largest shift in time between the two boards.
pub const SHIFT_S: f64 = 0.5e-3;
/// Largest force beyond the tube: the force of [`BEYOND_MM`] at 2 N, where the tip has 2.5 N/mm.
pub const BEYOND_N: f64 = 0.0125;
/// Largest travel beyond the tube.
pub const BEYOND_MM: f64 = 0.005;
/// Effects that draw a number for each sample. They draw others on the other board.
const NOISE: [&str; 2] = ["noise", "burst"];

/// Time, true force and travel.
type Point = (f64, [f64; 2]);

/// A run's trajectory, finger by finger.
#[derive(Clone, Debug, Default)]
pub struct Path(Vec<Vec<Point>>);

impl Watch for Path {
    fn step(&mut self, step: &Step) {
        if self.0.len() <= step.finger {
            self.0.resize_with(step.finger + 1, Vec::new);
        }
        self.0[step.finger].push(point(step));
    }
}

impl Path {
    /// Returns the difference of a step on another board, N and mm; none at times outside of the path.
    pub fn difference(&self, step: &Step) -> Option<[f64; 2]> {
        let points = self.0.get(step.finger)?;
        let after = points.partition_point(|(time_s, _)| *time_s < step.time_s);
        let ((to_s, to), (from_s, from)) = (points.get(after)?, points.get(after.checked_sub(1)?)?);
        let share = (step.time_s - from_s) / (to_s - from_s);
        let (_, here) = point(step);
        Some(core::array::from_fn(|n| here[n] - from[n] - share * (to[n] - from[n])))
    }

    /// Returns the distance of a step from the range of the path within the shift.
    fn beyond(&self, step: &Step) -> Option<[f64; 2]> {
        let points = self.0.get(step.finger)?;
        let first = points.partition_point(|(time_s, _)| *time_s < step.time_s - SHIFT_S).saturating_sub(1);
        let near = points[first..].iter().take_while(|(time_s, _)| *time_s <= step.time_s + 2.0 * SHIFT_S);
        let (mut low, mut high) = ([f64::INFINITY; 2], [f64::NEG_INFINITY; 2]);
        for (_, values) in near {
            for n in 0..2 {
                (low[n], high[n]) = (low[n].min(values[n]), high[n].max(values[n]));
            }
        }
        let (_, here) = point(step);
        Some(core::array::from_fn(|n| (low[n] - here[n]).max(here[n] - high[n]).max(0.0)))
    }
}

fn point(step: &Step) -> Point {
    (step.time_s, [step.truth.force_n, step.truth.travel_mm])
}

/// Largest value and its time.
type Largest = (f64, f64);

/// Comparison of two boards in a scene by their trajectories: watches the second one.
///
/// Both begin with the script. They cannot be alike to the bit: the emulated board takes a goal up to two frames earlier or
/// later, its duty acts some microseconds apart, its PWM counts in steps, and a row is sampled where its conversions
/// begin. Except for the steps of the PWM these are shifts in time. So the bound is a tube: at each time the second board
/// lies between the least and the largest value of the first one within [`SHIFT_S`], or beyond them by at most [`BEYOND_N`]
/// and [`BEYOND_MM`]. The loop rests within two counts of the encoder, so two boards may rest four counts, 4.4 um, apart.
#[derive(Clone, Debug)]
pub struct Agreement {
    first: Path,
    noisy: bool,
    steps: u64,
    /// Largest difference of the force, N, and of the travel, mm.
    pub difference: [Largest; 2],
    /// Largest distance of the second board from the tube, N and mm.
    pub beyond: [Largest; 2],
}

impl Agreement {
    /// Creates the watcher from the path of the first board.
    pub fn new(scene: &Scene, first: Path) -> Self {
        let noise = scene.effects.iter().any(|named| NOISE.contains(&named.effect.name));
        let noisy = noise || scene.events.iter().any(Event::is_random);
        Self { first, noisy, steps: 0, difference: [(0.0, 0.0); 2], beyond: [(0.0, 0.0); 2] }
    }

    /// True if the second board stayed in the tube. A scene with noise is not judged.
    pub fn held(&self) -> bool {
        let [(force_n, _), (travel_mm, _)] = self.beyond;
        self.noisy || self.steps > 0 && force_n <= BEYOND_N && travel_mm <= BEYOND_MM
    }
}

impl Watch for Agreement {
    fn step(&mut self, step: &Step) {
        if step.time_s < 0.0 {
            return;
        }
        let (Some(difference), Some(beyond)) = (self.first.difference(step), self.first.beyond(step)) else { return };
        self.steps += 1;
        for (largest, value) in [(&mut self.difference, difference), (&mut self.beyond, beyond)] {
            for (largest, value) in largest.iter_mut().zip(value) {
                if value.abs() > largest.0 {
                    *largest = (value.abs(), step.time_s);
                }
            }
        }
    }
}

impl fmt::Display for Agreement {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let [(force_n, force_s), (travel_mm, travel_s)] = self.difference;
        let [(beyond_n, _), (beyond_mm, _)] = self.beyond;
        writeln!(f, "Both boards, {} steps: they differ by {force_n:.4} N at most (at {force_s:.4} s)", self.steps)?;
        writeln!(f, "  and by {travel_mm:.4} mm (at {travel_s:.4} s);")?;
        let shift_ms = SHIFT_S * 1e3;
        writeln!(f, "  beyond a shift of {shift_ms} ms by {beyond_n:.4} N ({BEYOND_N} allowed) and {beyond_mm:.4} mm")?;
        let verdict = match (self.noisy, self.held()) {
            (true, _) => "a scene with noise is not judged",
            (false, true) => "held",
            (false, false) => "BROKEN",
        };
        write!(f, "  ({BEYOND_MM} allowed): {verdict}")
    }
}
