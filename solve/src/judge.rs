//! Judgement of a press: was the plate hard, and did it stand still?
//!
//! The shape of the tactile image shows how deep the tip is, whatever gains, creep and relaxation do to the force: pressures
//! under the rim against those in the middle. For each step the shift of the contact in the image, beyond the
//! encoder's travel, follows from the residuals by least squares, together with the step's stiffness. A plate that yields
//! shifts in proportion to the force, a plate that moves shifts with time. This separates a yielding plate from a
//! relaxing tip, which is impossible from the force curves alone (the chip's present method).

use crate::gains::{Condition, Gain};
use crate::model::{Pose, Square};
use crate::press::{Press, Step};
use crate::robust::median;
use nalgebra::{Matrix3, Vector3};

/// Shift of the contact that the image of a step shows.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Shift {
    /// Middle of the step, s.
    pub time_s: f64,
    /// Travel, mm.
    pub travel_mm: f64,
    /// Force, N.
    pub force_n: f64,
    /// Force that the stiffest step leads one to expect, N.
    pub expected_n: f64,
    /// Travel minus depth of the contact, mm.
    pub shift_mm: f64,
    /// Standard deviation of the shift, mm.
    pub sigma_mm: f64,
}

/// Judgement of a press.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Judgement {
    /// Yield of the plate, mm/N, and its standard uncertainty.
    pub yields_mm_per_n: [f64; 2],
    /// Verdict.
    pub verdict: Verdict,
}

/// Verdict on a press, with the number behind it.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
#[allow(missing_docs, reason = "their texts say it")]
pub enum Verdict {
    #[error("the press counts")]
    Good,
    #[error("the plate yields by {0:.3} mm/N, more than 2.5 % of the depth: the yield is taken off")]
    Soft(f64),
    #[error("the plate moves by {0:.3} mm/s; 0.01 is allowed: hold plate and finger fast")]
    Moving(f64),
    #[error("the force fell to {0:.2} of what the depth says: the contact was lost")]
    Lost(f64),
    #[error("the tip was indented by {0:.2} mm; 0.3 is needed: press deeper")]
    TooLittle(f64),
    #[error(
        "the gap is rounder than the tip's radius says by {0:.2}; 0.1 is allowed: is the plate flat, the radius right?"
    )]
    NotFlat(f64),
}

/// Yield of the plate under the largest force that is left uncorrected, as a share of the depth: a radius that is wrong by 2 %
/// looks like this much.
const YIELD_PART: f64 = 0.025;
const MOVES_MM_PER_S: f64 = 0.01;
const LEAST_SHARE: f64 = 0.25;
const LEAST_MM: f64 = 0.3;
const ROUNDNESS: f64 = 0.1;
const SIGMAS: f64 = 3.0;
/// Depth from which on a step without force counts as lost, as a share of the deepest.
const LOST_FROM: f64 = 0.5;

/// Shifts of the contact, by the image, for all steps of a press that touch.
pub fn shifts(press: &Press, pose: &Pose, taxels: &[Gain], forces_n: &[f64]) -> Vec<Shift> {
    let array = &press.array;
    let squares: Vec<_> = (0..array.taxels()).map(|taxel| Square::new(pose, press.radius_mm, array, taxel)).collect();
    let depth2 = |step: &Step| (step.middle_mm() - pose.touch_mm).max(0.0).powi(2);
    let stiffnesses = press.steps.iter().zip(forces_n).filter(|(step, _)| depth2(step) > 0.01);
    let usual = median(stiffnesses.map(|(step, force)| force / depth2(step)).collect());
    let mut shifts = Vec::new();
    for (step, force_n) in press.steps.iter().zip(forces_n).filter(|(step, _)| depth2(step) > 0.0) {
        let (at, mut both, mut sums) = (step.at(array), Vec::new(), [0.0; 2]);
        for (taxel, reading) in step.taxels.iter().enumerate() {
            if taxels[taxel].condition == Condition::Sound && !reading.bad {
                let share = squares[taxel].share_with_slopes(&at);
                let (value, slope) = (taxels[taxel].reads * share.value, taxels[taxel].reads * share.slopes[0]);
                let read = reading.mean / array.codes_per_kpa;
                sums = [sums[0] + value * read, sums[1] + value * value];
                both.push((read, value, slope));
            }
        }
        let stiffness = sums[0] / sums[1];
        // The part of the slopes that no other stiffness explains.
        let along = both.iter().map(|(_, value, slope)| value * slope).sum::<f64>() / sums[1];
        let (mut up, mut down, mut off2) = (0.0, 0.0, 0.0);
        for (read, value, slope) in &both {
            let slope = slope - along * value;
            up += slope * (read - stiffness * value);
            down += slope * slope;
            off2 += (read - stiffness * value).powi(2);
        }
        let radius_mm = press.radius_mm;
        shifts.push(Shift {
            time_s: step.middle_s(),
            travel_mm: step.middle_mm(),
            force_n: *force_n,
            expected_n: usual * depth2(step),
            shift_mm: up / down / stiffness * radius_mm,
            sigma_mm: (off2 / both.len() as f64 / down).sqrt() / stiffness.abs() * radius_mm,
        });
    }
    shifts
}

/// Judges a press by the shifts of its steps.
pub fn judge(pose: &Pose, yields_mm_per_n: [f64; 2], shifts: &[Shift]) -> Judgement {
    let depth_mm = |shift: &Shift| shift.travel_mm - pose.touch_mm;
    let deepest_mm = shifts.iter().map(depth_mm).fold(0.0, f64::max);
    let seen: Vec<&Shift> =
        shifts.iter().filter(|shift| depth_mm(shift) > 0.25 * deepest_mm && shift.sigma_mm.is_finite()).collect();
    let moves_mm_per_s = speed(&seen);
    let lost = shifts.iter().filter(|shift| depth_mm(shift) > LOST_FROM * deepest_mm);
    let least = lost.map(|shift| shift.force_n / shift.expected_n).fold(f64::INFINITY, f64::min);
    let moving = moves_mm_per_s[0].abs() > MOVES_MM_PER_S.max(SIGMAS * moves_mm_per_s[1]);
    let largest_n = shifts.iter().map(|shift| shift.force_n).fold(0.0, f64::max);
    let yields = yields_mm_per_n[0] > (YIELD_PART * deepest_mm / largest_n).max(SIGMAS * yields_mm_per_n[1]);
    let verdict = if deepest_mm < LEAST_MM {
        Verdict::TooLittle(deepest_mm)
    } else if least < LEAST_SHARE {
        Verdict::Lost(least.max(0.0))
    } else if moving {
        Verdict::Moving(moves_mm_per_s[0])
    } else if yields {
        Verdict::Soft(yields_mm_per_n[0])
    } else if pose.roundness.abs() > ROUNDNESS {
        Verdict::NotFlat(pose.roundness)
    } else {
        Verdict::Good
    };
    Judgement { yields_mm_per_n, verdict }
}

/// Slope of the shift by time, beside one by the force, with its standard uncertainty.
fn speed(seen: &[&Shift]) -> [f64; 2] {
    let (mut normal, mut right) = (Matrix3::zeros(), Vector3::zeros());
    let begin_s = seen.first().map_or(0.0, |shift| shift.time_s);
    let row = |shift: &Shift| Vector3::new(1.0, shift.force_n, shift.time_s - begin_s);
    for shift in seen {
        let weight = 1.0 / shift.sigma_mm.powi(2);
        normal += weight * row(shift) * row(shift).transpose();
        right += weight * shift.shift_mm * row(shift);
    }
    let Some(inverse) = normal.try_inverse() else { return [0.0, f64::INFINITY] };
    let line = inverse * right;
    let off2: f64 = seen.iter().map(|shift| ((shift.shift_mm - line.dot(&row(shift))) / shift.sigma_mm).powi(2)).sum();
    let scale2 = (off2 / seen.len().saturating_sub(3).max(1) as f64).max(1.0);
    [line[2], (scale2 * inverse[(2, 2)]).sqrt()]
}
