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

use crate::joint::{YIELD_USUAL, joint};
use crate::judge::{Judgement, Verdict};
use crate::memory::without_creep;
use crate::model::Pose;
use crate::modulus::each;
use crate::press::Press;
use crate::record::{Ended, Reason};

/// Condition of a taxel.
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

/// Gain of a taxel.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Gain {
    /// Factor by which the taxel reads too much; see [`Gain::factor`].
    pub reads: f64,
    /// Standard uncertainty of `reads`, apart from the factor that all have in common.
    pub sigma: f64,
    /// Condition.
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

/// Pose of a press, with what it rests on.
#[derive(Clone, Debug, PartialEq)]
pub struct Posed {
    /// The pose.
    pub pose: Pose,
    /// Force of each step of the press, N.
    pub forces_n: Vec<f64>,
    /// Was it a press onto a hard plate that stood still?
    pub judgement: Judgement,
}

/// Result for the whole array.
#[derive(Clone, Debug, PartialEq)]
pub struct Gains {
    /// Number of columns of the array.
    pub columns: usize,
    /// Gains, row by row.
    pub taxels: Vec<Gain>,
    /// One pose for each press that counts, in order.
    pub presses: Vec<Posed>,
    /// Presses that do not count, by their place, and why.
    pub left_out: Vec<(usize, NoGains)>,
    /// Spread of the gains that were found.
    pub spread: f64,
    /// Standard uncertainty of the factor that all gains have in common, as a share.
    pub common: f64,
}

/// Reason why a press, or all of them, do not count, with the number behind it.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
#[allow(missing_docs, reason = "their texts say it")]
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
}

/// Poses and gains, and the presses that they rest on, without creep.
pub(crate) struct Settled {
    /// Presses that count, creep taken out.
    pub presses: Vec<Press>,
    /// Poses and gains. A pose for each press that counts.
    pub gains: Gains,
    /// Creep that was taken out, as a share for each decade of time.
    pub creep: f64,
}

/// Poses and gains of presses on the same array, with a judgement of each press.
///
/// Presses that are judged other than good or soft are left out ([`Gains::left_out`]).
pub fn gains(presses: &[Press]) -> Result<Gains, NoGains> {
    settle(presses).map(|settled| settled.gains)
}

/// Rounds of the joint fit: each press by itself on the readings, for the creep; each by itself without creep, for the
/// judgement, so that none spoils another; then all that count together. A plate is rigid unless its press shows otherwise:
/// a yield that is always free would double the uncertainty of every press.
pub(crate) fn settle(presses: &[Press]) -> Result<Settled, NoGains> {
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
        match alone.map(|alone| alone.presses[0].judgement.verdict) {
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
    Ok(Settled { presses: kept, gains, creep })
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
