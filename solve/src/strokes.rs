//! The drive from recorded strokes in the air: torque constant, time constant, friction.
//!
//! The controller makes strokes under steps of voltage and records encoder counts and the voltage really applied. In
//! the air the motor obeys
//!
//! ```text
//! J w' = k i - T_f(w)      i = (V - k w) / R
//! a w' = V - k w - V_f(w)      a = R J / k      V_f = R T_f / k
//! ```
//!
//! so k, a and the friction voltage V_f are observable, and tau = a / k = R J / k^2; J = a k / R and T_f = V_f k / R
//! need R. At a speed w only the sum k w + V_f(w) is observable. Friction that grows in proportion to the speed
//! (viscous, b) is therefore indistinguishable from back-EMF: k + R b / k is found. Friction that falls with speed,
//!
//! ```text
//! V_f(w) = V_c + V_s share(w / w_s)
//! ```
//!
//! is separated from k by strokes at several speeds, because it vanishes at high speed. If all strokes were
//! slow it is not separated, and the standard uncertainty of k is large.
//!
//! The parameters of all strokes are fitted together by nonlinear least squares over the samples, with Huber
//! weights. Each stroke has its own angle and speed at its first fitted sample, so what happens at standstill is
//! not part of the model. The encoder's steps are a noise of a count / sqrt(12).
//!
//! A standard uncertainty is the root of the sum of squares of
//!
//! 1. scatter: the covariance of the residuals, and that of the strokes' sums of residuals (which counts what is
//!    common to a stroke's samples as one observation),
//! 2. model: how far the values of the forms of friction are apart (the result is their mean, each weighted by how
//!    well it fits), and how far the value changes with a k that differs between forward and back, and with a force that depends on the place,
//! 3. reference: [`VOLTAGE`] for the supply's divider, [`TIMING_S`], and the uncertainty of R.

mod fit;
mod model;

use crate::Value;
use crate::record::{Ended, Reason};
use fit::Fit;
use model::{FITTED, Path, SPAN, index};

/// Relative standard uncertainty of a voltage: the supply's divider and reference.
pub const VOLTAGE: f64 = 0.008;
/// Standard uncertainty of the moment at which a voltage acts, s: the time constant of the winding, L / R, adds to tau.
pub const TIMING_S: f64 = 20e-6;
/// Largest fall of friction that the form does not describe, up to the speed of the fastest stroke, as a share of the
/// friction voltage. Above [`SETTLED`] the allowance falls with the square of the speed.
pub const UNSEEN: f64 = 0.1;
/// Speed beyond which friction of brushes and bearings hardly falls, rad/s.
pub const SETTLED: f64 = 30.0;
/// Least number of strokes in each direction for a fit.
const STROKES_MIN: usize = 3;
/// Counts of the longest stroke below which the motor counts as still.
const STILL_COUNTS: i32 = 12;
/// The fastest stroke must be this many times as fast as the slowest.
const SPEEDS: f64 = 2.0;
/// Share of the speed of the fastest stroke above which a stroke is fast.
const FAST: f64 = 0.4;
/// A force that depends on the place is refused above this, N, where it is this many times its uncertainty.
const PUSH_N: f64 = 0.05;
const PUSH_SIGMAS: f64 = 4.0;
/// Allowed jump of the count between samples: a number of counts, plus a multiple of the largest change that the
/// voltage can cause.
const JUMP_COUNTS: f64 = 3.0;
const JUMP: f64 = 3.0;

#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Sample {
    pub count: i32,
    /// Mean of duty times supply since the sample before, V; positive presses.
    pub voltage_v: f64,
}

/// One motion from rest to rest. The voltage goes one way, then the motor is shorted.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Stroke {
    /// Evenly spaced samples. The first is taken as the voltage begins.
    pub samples: Vec<Sample>,
}

impl Stroke {
    /// True for a stroke forward; none without a voltage.
    fn forward(&self) -> Option<bool> {
        let sum: f64 = self.samples.iter().map(|sample| sample.voltage_v).sum();
        (sum != 0.0).then_some(sum > 0.0)
    }

    /// Largest speed over a few samples, rad/s.
    fn fastest(&self, record: &Record) -> f64 {
        let gone = self.samples.windows(SPAN + 1).map(|part| (part[SPAN].count - part[0].count).abs()).max();
        f64::from(gone.unwrap_or(0)) * core::f64::consts::TAU / record.counts_per_turn / (SPAN as f64 * record.sample_s)
    }

    /// Counts gone in the direction of the voltage.
    fn gone(&self) -> i32 {
        let (Some(first), Some(last)) = (self.samples.first(), self.samples.last()) else { return 0 };
        let gone = last.count - first.count;
        if self.forward() == Some(false) { -gone } else { gone }
    }
}

#[derive(Clone, Debug, PartialEq)]
pub struct Record {
    /// Time between samples, s.
    pub sample_s: f64,
    /// Delay from a sample's count to the effect of the voltage computed in the same frame, s.
    pub delay_s: f64,
    /// Encoder counts for a turn of the motor.
    pub counts_per_turn: f64,
    /// Motor angle for a travel of the tip, rad/mm.
    pub rad_per_mm: f64,
    /// Resistance of the whole circuit, Ohm.
    pub resistance: Value,
    pub strokes: Vec<Stroke>,
    pub ended: Option<Ended>,
}

/// Reason why there is no drive, with the number behind it.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum NoDrive {
    #[error("the strokes were ended early: {0}")]
    Ended(#[from] Ended),
    #[error("the longest stroke has {0} counts; 12 are needed: check the encoder and the motor's cables")]
    Still(i32),
    #[error("a stroke went {0} counts against its voltage: exchange the leads of the motor or of the encoder")]
    Reversed(i32),
    #[error("the count jumped by {0}, which no voltage of these strokes can do: check encoder and coupling")]
    Astray(i32),
    #[error("a force of {0:.3} N depends on the place of the tip: clear its way")]
    Pushed(f64),
    #[error("{0} strokes in one direction can be used; 3 are needed")]
    Few(usize),
    #[error(
        "the fastest stroke is {0:.1} times as fast as the slowest; 2 times are needed to tell back-EMF from friction"
    )]
    Slow(f64),
    #[error("the fit did not converge in {0} rounds: the samples do not follow the model of a motor with friction")]
    Unsolved(usize),
}

#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MeasuredDrive {
    /// k, N m/A: the back-EMF constant in V s/rad.
    pub torque_constant: Value,
    /// tau = R J / k^2, s.
    pub time_constant_s: Value,
    /// J at the motor's shaft, kg m^2, with the caller's resistance.
    pub inertia_kg_m2: Value,
    /// Friction torque at high speed, forward and back, N m, with the caller's resistance.
    pub friction_nm: [Value; 2],
    /// Largest force at the foremost place that depends on the place, N.
    pub force_n: Value,
}

pub fn solve(record: &Record) -> Result<MeasuredDrive, NoDrive> {
    match record.ended {
        // The motions continued after the memory was full: all strokes in it are used except the last, which was cut.
        Some(Ended { reason: Reason::Full, .. }) => {
            let strokes = record.strokes.split_last().map_or(Vec::new(), |(_, strokes)| strokes.to_vec());
            return solve(&Record { strokes, ended: None, ..record.clone() });
        }
        Some(ended) => return Err(ended.into()),
        None => {}
    }
    let resistance = record.resistance;
    let gone = || record.strokes.iter().map(Stroke::gone);
    let (least, most) = (gone().min().unwrap_or(0), gone().max().unwrap_or(0));
    if -least >= STILL_COUNTS {
        return Err(NoDrive::Reversed(-least));
    } else if most < STILL_COUNTS {
        return Err(NoDrive::Still(most));
    }
    let places = || record.strokes.iter().flat_map(|stroke| &stroke.samples).map(|sample| f64::from(sample.count));
    let rad = core::f64::consts::TAU / record.counts_per_turn;
    let ends = [rad * places().fold(f64::MAX, f64::min), rad * places().fold(f64::MIN, f64::max)];
    let fastest = record.strokes.iter().map(|stroke| stroke.fastest(record)).fold(0.0, f64::max);
    let parts = |stroke| Path::parts(record, stroke, ends, FAST * fastest);
    let paths: Vec<Vec<Path>> = (0..record.strokes.len()).map(parts).collect();
    let slowest = paths.iter().flatten().map(|path| path.fastest).fold(f64::MAX, f64::min);
    for side in 0..2 {
        let strokes = paths.iter().flat_map(|parts| parts.first()).filter(|path| path.side == side).count();
        if strokes < STROKES_MIN {
            return Err(NoDrive::Few(strokes));
        }
    }
    let paths: Vec<Path> = paths.into_iter().flatten().collect();
    if fastest < SPEEDS * slowest {
        return Err(NoDrive::Slow(fastest / slowest));
    }
    // Changes of speed between samples, counts. The largest is compared with the largest change that the voltage can
    // cause, or with the usual change if the fit fails.
    let samples = record.strokes.iter().flat_map(|stroke| stroke.samples.windows(3));
    let mut jumps: Vec<i32> = samples.map(|part| (part[2].count - 2 * part[1].count + part[0].count).abs()).collect();
    jumps.sort_unstable();
    let jump = jumps.last().copied().unwrap_or(0);
    let fits = Fit::all(&paths, record, slowest).map_err(|refusal| {
        let usual = jumps.get(jumps.len() * 9 / 10).copied().map_or(0.0, f64::from);
        if f64::from(jump) > JUMP_COUNTS + JUMP * usual { NoDrive::Astray(jump) } else { refusal }
    })?;
    let best = &fits[0];
    let most_v = paths.iter().map(|path| path.voltage_v).fold(0.0, f64::max);
    let most = most_v / best.p[index::A].exp() * record.sample_s.powi(2) / rad;
    if f64::from(jump) > JUMP_COUNTS + JUMP * most {
        return Err(NoDrive::Astray(jump));
    }
    let newtons = best.p[index::K].exp() / resistance.value * record.rad_per_mm * 1e3;
    let pushes = [index::FRONT, index::SPRING].map(|force| {
        let (value, sigma, _) = best.probes[force - FITTED];
        Value { value: newtons * value.abs(), sigma: newtons * sigma }
    });
    let force_n = if pushes[0].value > pushes[1].value { pushes[0] } else { pushes[1] };
    if force_n.value > PUSH_N && force_n.value > PUSH_SIGMAS * force_n.sigma {
        return Err(NoDrive::Pushed(force_n.value));
    }

    // A friction that falls evenly with speed: k is found lower, and friction higher.
    let volts = [0, 1].map(|side| best.p[index::COULOMB + side].exp());
    let share = UNSEEN * (SETTLED / fastest).powi(2).min(1.0);
    let slope = share * volts[0].max(volts[1]) / (fastest - slowest);
    let mut unseen = fit::Vector::zeros();
    unseen[index::K] = slope / best.p[index::K].exp();
    for (side, volts) in volts.iter().enumerate() {
        unseen[index::COULOMB + side] = -slope * 0.5 * (slowest + fastest) / volts;
    }
    // Values are functions of ln k, ln a, ln V_c...; each is given by its gradient.
    let logarithm = |value: f64, factors: &[(usize, f64)], reference: f64| {
        let mut gradient = fit::Vector::zeros();
        factors.iter().for_each(|(at, factor)| gradient[*at] = *factor);
        let variance = best.variance(&gradient, &fits) + unseen.dot(&gradient).powi(2) + reference * reference;
        Value { value, sigma: value * variance.sqrt() }
    };
    let weights = best.weights(&fits);
    let p = |at: usize| fits.iter().zip(&weights).map(|(fit, weight)| weight * fit.p[at]).sum::<f64>();
    let (k, a) = (p(index::K).exp(), p(index::A).exp());
    let reference = resistance.relative().hypot(2.0 * VOLTAGE);
    let friction_nm = [index::COULOMB, index::COULOMB + 1].map(|coulomb| {
        logarithm(p(coulomb).exp() * k / resistance.value, &[(coulomb, 1.0), (index::K, 1.0)], reference)
    });
    Ok(MeasuredDrive {
        torque_constant: logarithm(k, &[(index::K, 1.0)], VOLTAGE),
        time_constant_s: logarithm(a / k, &[(index::A, 1.0), (index::K, -1.0)], TIMING_S * k / a),
        inertia_kg_m2: logarithm(a * k / resistance.value, &[(index::A, 1.0), (index::K, 1.0)], reference),
        friction_nm,
        force_n,
    })
}
