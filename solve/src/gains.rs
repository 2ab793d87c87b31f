//! Poses and taxel gains of all presses together.
//!
//! While it loads, taxel i reads at step k of a press
//!
//! ```text
//! u_ik = g_i y_k m_i(x_k; pose)
//! ```
//!
//! with the model's share m ([`crate::model`]), the taxel's gain g and a stiffness y, kPa, of its own for **each step**.
//! Relaxation, creep, hysteresis and temperature change what all taxels read in common, so they go into y and reach neither
//! pose nor gains. (The chip's present method takes them for zero, which leaves 1 % in the gains.) All unknowns of all presses
//! are solved together by Gauss and Newton's method with Huber's weights: a taxel that two presses reach ties them together.
//!
//! One factor is free: all gains times f with all y over f read the same. It is fixed by the gains' mean, which is 1 for
//! an array as made; its uncertainty is their spread over the root of their number, and [`crate::modulus()`] takes it on.
//!
//! Judgement of a press: was the plate hard, and did it stand still? The shape of the tactile image shows how deep the tip
//! is, whatever gains, creep and relaxation do to the force: pressures under the rim against those in the middle. For each
//! step the shift of the contact in the image, beyond the encoder's travel, follows from the residuals by least squares,
//! together with the step's stiffness. A plate that yields shifts in proportion to the force, a plate that moves shifts with
//! time. This separates a yielding plate from a relaxing tip, which is impossible from the force curves alone (the chip's
//! present method).

use crate::joint::{YIELD_USUAL, joint};
use crate::memory::without_creep;
use crate::model::{Pose, Square};
use crate::modulus::each;
use crate::press::{Press, Step};
use crate::record::{Ended, Reason};
use crate::robust::median;
use nalgebra::{Matrix3, Vector3};
use std::fmt;

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Condition {
    /// Follows the model.
    Sound,
    /// No press reached it: it keeps its gain.
    Unreached,
    /// Reads less than a quarter of the expected value, or the chip counted it as bad in most steps.
    Dead,
    /// Reads, but does not follow the model: left out.
    Odd,
}

#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Gain {
    /// Factor by which the taxel reads too much; see [`Gain::factor`].
    pub reads: f64,
    /// Standard uncertainty of `reads`, apart from the factor that all have in common.
    pub sigma: f64,
    pub condition: Condition,
    /// Highest reading of the taxel, codes.
    pub highest: f64,
}

impl Gain {
    /// Factor for the gain in force, with the array's characteristic (`curve_permille` of the parameters).
    ///
    /// The gain acts on codes before the characteristic makes u (1 + p u / 4096) / (1 + p) of them. So it is the ratio of
    /// two codes: at three quarters of the highest reading, where most of the weight is.
    pub fn factor(&self, curve_permille: i32) -> f64 {
        let p = 1e-3 * f64::from(curve_permille);
        if p == 0.0 {
            return 1.0 / self.reads;
        }
        // p times the code behind a reading, as shares of the full range.
        let before = |reading: f64| (0.25 + p * (1.0 + p) * (reading / 4_096.0).max(1e-3)).sqrt() - 0.5;
        let usual = 0.75 * self.highest;
        before(usual / self.reads) / before(usual)
    }
}

#[derive(Clone, Debug, PartialEq)]
pub struct Posed {
    pub pose: Pose,
    /// Force of each step of the press, N.
    pub forces_n: Vec<f64>,
    /// Yield of the plate, mm/N, and its standard uncertainty.
    pub yields_mm_per_n: [f64; 2],
    /// Was it a press onto a hard plate that stood still?
    pub verdict: Verdict,
}

#[derive(Clone, Debug, PartialEq)]
pub struct Gains {
    pub columns: usize,
    /// Gains, row by row.
    pub taxels: Vec<Gain>,
    /// One pose for each press that counts, in order.
    pub presses: Vec<Posed>,
    /// Presses that do not count, by their place, and why.
    pub left_out: Vec<(usize, NoGains)>,
    pub spread: f64,
    /// Standard uncertainty of the factor that all gains have in common, as a share.
    pub common: f64,
}

/// Reason why a press, or all of them, do not count, with the number behind it.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum NoGains {
    #[error("no press was given")]
    NoPress,
    #[error("the press was ended early: {0}")]
    Ended(#[from] Ended),
    #[error("the press has an array of {0:?} rows and columns, the first press one of {1:?}")]
    Shape([usize; 2], [usize; 2]),
    #[error("{0}")]
    Judged(Verdict),
    #[error("{0} loading steps touch the plate; 5 are needed: press deeper")]
    Steps(usize),
    #[error("{0} sound taxels were pressed; 8 are needed: press deeper or nearer the middle")]
    Taxels(usize),
    #[error("the poses still change by {0} radii after the last round; 0.02 is allowed")]
    Unsettled(f64),
    #[error("force over travel of {0} presses does not follow the model")]
    Fit(usize),
}

/// Poses and gains of presses on the same array, with a judgement of each press.
///
/// Presses that are judged other than good or soft are left out ([`Gains::left_out`]).
pub fn gains(presses: &[Press]) -> Result<Gains, NoGains> {
    settle(presses).map(|(_, gains, _)| gains)
}

/// Rounds of the joint fit: each press by itself on the readings, for the creep; each by itself without creep, for the
/// judgement, so that none spoils another; then all that count together. A plate is rigid unless its press shows otherwise:
/// a yield that is always free would double the uncertainty of every press.
///
/// Returns the presses that count, without creep, their poses and gains, and the creep, as a share for each decade of time.
pub(crate) fn settle(presses: &[Press]) -> Result<(Vec<Press>, Gains, f64), NoGains> {
    let (mut sum, mut weights) = (0.0, 1e-9);
    let shape = |press: &Press| [press.array.rows, press.array.columns];
    let first = shape(presses.first().ok_or(NoGains::NoPress)?);
    // Faults of the record itself, before anything is solved.
    let fault = |press: &Press| match press.ended {
        Some(ended) if ended.reason != Reason::Full => Some(NoGains::Ended(ended)),
        _ => (shape(press) != first).then(|| NoGains::Shape(shape(press), first)),
    };
    for press in presses.chunks(1).filter(|press| fault(&press[0]).is_none()) {
        let Ok(first) = joint(press, 0.0) else { continue };
        for one in each(press, &first).into_iter().flatten() {
            let weight = one.creep_sigma.powi(-2);
            (sum, weights) = (sum + weight * one.memory.creep, weights + weight);
        }
    }
    let creep = sum / weights;
    let (mut kept, mut left_out, mut soft) = (Vec::new(), Vec::new(), false);
    for (index, press) in presses.iter().enumerate() {
        if let Some(fault) = fault(press) {
            left_out.push((index, fault));
            continue;
        }
        let press = without_creep(press, creep);
        let alone = joint(std::slice::from_ref(&press), 0.0);
        match alone.map(|alone| alone.presses[0].verdict) {
            Ok(Verdict::Good) => kept.push(press),
            Ok(Verdict::Soft(_)) => {
                kept.push(press);
                soft = true;
            }
            Ok(verdict) => left_out.push((index, NoGains::Judged(verdict))),
            Err(why) => left_out.push((index, why)),
        }
    }
    if let ([], [(_, why), ..]) = (kept.as_slice(), left_out.as_slice()) {
        return Err(*why);
    }
    let mut gains = joint(&kept, if soft { YIELD_USUAL } else { 0.0 })?;
    gains.left_out = left_out;
    Ok((kept, gains, creep))
}

impl fmt::Display for Gains {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let count = |condition| self.taxels.iter().filter(|gain| gain.condition == condition).count();
        let (sound, spread) = (count(Condition::Sound), 100.0 * self.spread);
        write!(f, "The gains of {sound} of {} taxels were measured; they spread by {spread:.1} %.", self.taxels.len())?;
        match count(Condition::Unreached) {
            0 => {}
            unreached => write!(f, " No press reached {unreached} taxels: they keep their gain.")?,
        }
        for (taxel, gain) in self.taxels.iter().enumerate() {
            let (row, column) = (taxel / self.columns, taxel % self.columns);
            match gain.condition {
                Condition::Dead => write!(f, " The taxel in row {row}, column {column} is dead.")?,
                Condition::Odd => {
                    write!(
                        f,
                        " The taxel in row {row}, column {column} does not follow the pressure: it was left out."
                    )?;
                }
                Condition::Sound | Condition::Unreached => {}
            }
        }
        for posed in &self.presses {
            if let Verdict::Soft(_) = posed.verdict {
                write!(f, " In one press {}.", posed.verdict)?;
            }
        }
        Ok(())
    }
}

/// Shift of the contact that the image of a step shows.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Shift {
    /// Middle of the step, s.
    pub time_s: f64,
    pub travel_mm: f64,
    pub force_n: f64,
    /// Force that the stiffest step leads one to expect, N.
    pub expected_n: f64,
    /// Travel minus depth of the contact, mm.
    pub shift_mm: f64,
    /// Standard deviation of the shift, mm.
    pub sigma_mm: f64,
}

#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
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

pub fn judge(pose: &Pose, yields_mm_per_n: [f64; 2], shifts: &[Shift]) -> Verdict {
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
    if deepest_mm < LEAST_MM {
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
    }
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

#[cfg(test)]
mod tests {
    use super::*;

    /// The chip applies the factor before the characteristic: a corrected code must still give the true pressure.
    #[test]
    fn the_factor_goes_through_the_characteristic() {
        for (curve_permille, reads) in [(0, 1.2), (500, 1.2), (3_000, 0.8), (8_000, 1.2)] {
            let p = 1e-3 * f64::from(curve_permille);
            let reading = |code: f64| code * (1.0 + p * code / 4_096.0) / (1.0 + p);
            let gain = Gain { reads, sigma: 0.01, condition: Condition::Sound, highest: reading(1_500.0) / 0.75 };
            let corrected = reading(1_500.0 * gain.factor(curve_permille));
            assert!((corrected * reads / reading(1_500.0) - 1.0).abs() < 1e-9, "{curve_permille}: {corrected}");
        }
    }
}
