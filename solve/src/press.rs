//! The record of a press, as the chip delivers it.
//!
//! The chip moves the tip into a flat plate and back, and averages frames over short stretches of time. It fits nothing
//! and judges nothing. `docs/solve.md` describes the motion.

use crate::gains::{Condition, Gain};
use crate::model::{At, Pose, Square};
use crate::record::Ended;

/// Tactile array: square taxels that touch.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Array {
    pub rows: usize,
    pub columns: usize,
    /// Distance from taxel to taxel, mm.
    pub pitch_mm: f64,
    /// Codes above the tare for each kPa, at a gain of 1.
    pub codes_per_kpa: f64,
}

impl Array {
    pub fn taxels(&self) -> usize {
        self.rows * self.columns
    }

    /// Centre of a taxel from the array's middle: along the columns (x) and the rows (y), mm. Taxels count row by row.
    pub fn place_mm(&self, taxel: usize) -> [f64; 2] {
        let from_middle = |index: usize, count: usize| (index as f64 + 0.5 - 0.5 * count as f64) * self.pitch_mm;
        [from_middle(taxel % self.columns, self.columns), from_middle(taxel / self.columns, self.rows)]
    }
}

/// Half of a press in which a step was recorded.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Branch {
    /// Forward stroke, or held at the deepest place.
    Loading,
    /// Return stroke.
    Unloading,
}

/// Reading of a taxel over the frames of a step.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Reading {
    /// Mean, codes above the tare, row sag taken out, gains in force applied.
    pub mean: f64,
    /// Standard deviation of a frame, codes.
    pub deviation: f64,
    /// True if the chip counted the taxel as bad or saturated in any frame.
    pub bad: bool,
}

/// Mean of consecutive frames.
#[derive(Clone, Debug, PartialEq)]
pub struct Step {
    /// Times of the first and the last frame, s. The zero is the same for all presses of a session.
    pub time_s: [f64; 2],
    /// Travel at the first and the last frame by the encoder, mm; it grows towards the plate.
    pub travel_mm: [f64; 2],
    pub frames: u32,
    pub branch: Branch,
    pub taxels: Vec<Reading>,
    /// Temperature of the microcontroller, degrees Celsius; None where it is unknown.
    pub chip_c: Option<f64>,
}

impl Step {
    /// Mean travel, mm.
    pub fn middle_mm(&self) -> f64 {
        0.5 * (self.travel_mm[0] + self.travel_mm[1])
    }

    pub fn middle_s(&self) -> f64 {
        0.5 * (self.time_s[0] + self.time_s[1])
    }

    pub fn at(&self, array: &Array) -> At {
        let half_mm = 0.5 * (self.travel_mm[1] - self.travel_mm[0]).abs();
        At { travel_mm: self.middle_mm(), half_mm, force_n: self.force_n(array) }
    }

    /// Force by the plain sum of the taxels that are not bad, N.
    pub fn force_n(&self, array: &Array) -> f64 {
        1e-3 * array.pitch_mm * array.pitch_mm * self.sum() / array.codes_per_kpa
    }

    /// Sum of the readings of all taxels that are not bad, codes.
    pub fn sum(&self) -> f64 {
        self.taxels.iter().filter(|taxel| !taxel.bad).map(|taxel| taxel.mean).sum()
    }
}

/// A press: steps in order of time, from the air into the plate and back.
#[derive(Clone, Debug, PartialEq)]
pub struct Press {
    /// Radius of the tip as configured, mm.
    pub radius_mm: f64,
    pub array: Array,
    pub steps: Vec<Step>,
    /// Early end of the press. Only a press that filled the memory counts nevertheless.
    pub ended: Option<Ended>,
}

impl Press {
    /// Loading steps, each deeper than the one before: all taxels load.
    pub fn inward(&self) -> impl Iterator<Item = &Step> {
        let mut before_mm = f64::NEG_INFINITY;
        self.steps.iter().filter(move |step| {
            let deeper = step.branch == Branch::Loading && step.middle_mm() > before_mm + 1e-3;
            before_mm = step.middle_mm();
            deeper
        })
    }

    pub fn deepest(&self) -> Option<&Step> {
        self.steps.iter().max_by(|a, b| a.middle_mm().total_cmp(&b.middle_mm()))
    }

    /// Deepest travel, mm; 0 without steps.
    pub fn deepest_mm(&self) -> f64 {
        self.deepest().map_or(0.0, Step::middle_mm)
    }
}

/// Rows and columns beside the array that the model covers: a contact may reach over the edge.
const BESIDE: usize = 4;

/// Force of each step, N: what the sound taxels read, gains taken off, times what the model has under the whole contact over
/// what it has under them. So the missing force of dead taxels, and of what lies off the array, is filled by the model.
///
/// Near the contact and in the air, the ratio is the one at a quarter of the depth: the readings that creep leaves
/// there count as forces too, and [`crate::modulus()`] needs them to separate creep from relaxation.
pub fn forces(press: &Press, pose: &Pose, taxels: &[Gain]) -> Vec<f64> {
    let Press { radius_mm, array, .. } = press;
    let sound = |taxel: usize| matches!(taxels[taxel].condition, Condition::Sound | Condition::Unreached);
    let wide = Array { rows: array.rows + 2 * BESIDE, columns: array.columns + 2 * BESIDE, ..*array };
    let squares: Vec<_> = (0..wide.taxels()).map(|taxel| Square::new(pose, *radius_mm, &wide, taxel)).collect();
    let inner = |taxel: usize| (taxel / array.columns + BESIDE) * wide.columns + taxel % array.columns + BESIDE;
    let least_mm = pose.touch_mm + 0.25 * (press.deepest_mm() - pose.touch_mm).max(0.0);
    let force = |step: &Step| {
        let at = step.at(array);
        let at = At { travel_mm: at.travel_mm.max(least_mm), ..at };
        let shares: Vec<f64> = squares.iter().map(|square| square.share(&at)).collect();
        let (mut read, mut under) = (0.0, 0.0);
        for taxel in (0..array.taxels()).filter(|taxel| sound(*taxel) && !step.taxels[*taxel].bad) {
            read += step.taxels[taxel].mean / array.codes_per_kpa / taxels[taxel].reads;
            under += shares[inner(taxel)];
        }
        1e-3 * array.pitch_mm * array.pitch_mm * read * shares.iter().sum::<f64>() / under.max(1e-9)
    };
    press.steps.iter().map(force).collect()
}

/// Pose to start from: axis at the centre of the deepest readings, touch by the line through the roots of the sums.
pub fn first_pose(press: &Press) -> Pose {
    let steps: Vec<_> = press.inward().collect();
    let largest = steps.iter().map(|step| step.sum()).fold(0.0, f64::max);
    let points: Vec<[f64; 2]> = steps
        .iter()
        .filter(|step| step.sum() > 0.05 * largest)
        .map(|step| [step.middle_mm(), step.sum().sqrt()])
        .collect();
    let count = points.len().max(1) as f64;
    let mean = |index: usize| points.iter().map(|point| point[index]).sum::<f64>() / count;
    let [x, y] = [mean(0), mean(1)];
    let (xx, xy) =
        points.iter().fold((0.0, 0.0), |(xx, xy), p| (xx + (p[0] - x).powi(2), xy + (p[0] - x) * (p[1] - y)));
    let touch_mm = if xy > 0.0 { x - y * xx / xy } else { x };
    let mut axis_mm = [0.0; 2];
    if let Some(deepest) = steps.last() {
        let readings = || deepest.taxels.iter().enumerate().filter(|(_, taxel)| !taxel.bad && taxel.mean > 0.0);
        let sum: f64 = readings().map(|(_, taxel)| taxel.mean).sum();
        for (taxel, reading) in readings() {
            let place_mm = press.array.place_mm(taxel);
            axis_mm.iter_mut().zip(place_mm).for_each(|(axis, place)| *axis += place * reading.mean / sum);
        }
    }
    Pose { touch_mm, axis_mm, ..Pose::default() }
}
