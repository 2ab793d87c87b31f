//! The array's scale, from forces read on a kitchen scale, and the drift of a reading: creep under a held force, and its
//! change with temperature.
//!
//! A press shows Y times the gain that all taxels have in common: a harder tip under less sensitive taxels reads the same. A
//! scale shows the force itself:
//!
//! ```text
//! F = k R
//! ```
//!
//! with R the array's sum. k divides `codes_per_kpa` and multiplies the modulus. Least squares with Huber's weights, so that
//! a single misread number hardly changes k.

use crate::Value;
use crate::gains::NoGains;
use crate::modulus::modulus;
use crate::press::Press;
use crate::robust::minimise;
use nalgebra::DVector;

/// Goals before a held force, as shares of it: one above, then one below. An array with hysteresis reads less while
/// the force rises than while it falls; these goals bring the reading between the two.
pub const SWINGS: [f64; 2] = [1.06, 0.98];

#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Held {
    pub shown_n: f64,
    /// Force that the array reads meanwhile by its sum, creep and temperature taken off, N.
    pub read_n: f64,
}

/// Reason why there is no scale, with the number behind it.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum NoScale {
    #[error("the largest force is {0:.3} N; 0.1 N is needed")]
    TooLittle(f64),
    #[error("the scale shows {0:.2} of what the array reads; a half to two is allowed")]
    Range(f64),
}

/// Half a step of a kitchen scale with its repeatability, N.
const SHOWN_N: f64 = 0.005;
/// Change by creep and hysteresis from hold to hold, as a share.
const HELD_PART: f64 = 0.01;
const LEAST_N: f64 = 0.1;

pub fn scale(held: &[Held]) -> Result<Value, NoScale> {
    let largest_n = held.iter().map(|held| held.read_n).fold(0.0, f64::max);
    if largest_n < LEAST_N || held.iter().all(|held| held.shown_n < LEAST_N) {
        return Err(NoScale::TooLittle(largest_n));
    }
    let off =
        |factor: f64, held: &Held| (factor * held.read_n - held.shown_n) / SHOWN_N.hypot(HELD_PART * held.shown_n);
    let residuals = |x: &DVector<f64>| DVector::from_iterator(held.len(), held.iter().map(|held| off(x[0], held)));
    let fit = minimise(&[1.0], &[1e-4], residuals).ok_or(NoScale::TooLittle(largest_n))?;
    let scale2 = (fit.cost / held.len().saturating_sub(1).max(1) as f64).max(1.0);
    let factor = Value { value: fit.unknowns[0], sigma: (scale2 * fit.covariance[(0, 0)]).sqrt() };
    if !(0.5..=2.0).contains(&factor.value) {
        return Err(NoScale::Range(factor.value));
    }
    Ok(factor)
}

#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Creep {
    /// Final growth of a held reading, as a share (`creep_permille`).
    pub share: Value,
    /// Time constant, s (`creep_time_ms`).
    pub time_s: Value,
    /// Root mean square of what the share and its time constant leave, as a share of the reading.
    pub left: f64,
}

/// Reason why there is no creep or temperature coefficient, with the number behind it.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum NoDrift {
    #[error("the hold has {0} readings; 10 are needed")]
    Readings(usize),
    #[error("the hold lasts {0:.1} s; 5 s are needed")]
    Short(f64),
    #[error("the chip's temperature is unknown in one of the presses")]
    Temperature,
    #[error("the presses differ by {0:.1} K; 3 K are needed")]
    Warming(f64),
    #[error("{0}")]
    Press(#[from] NoGains),
    #[error("the fit has no solution")]
    Fit,
}

/// Least time for which a weight must be recorded to solve creep, s.
pub const CREEP_LEAST_S: f64 = 5.0;

/// Creep by readings under a force that does not change: time from the begin of the hold, s, and force by the array's
/// sum, N.
///
/// The chip knows one term: under a force F the reading goes to F (1 + k) with a time constant tau (`src/control.rs`).
/// Ink creeps with the logarithm of time instead, so k and tau are those that serve this hold best; `left` shows how well.
pub fn creep(readings: &[[f64; 2]]) -> Result<Creep, NoDrift> {
    if readings.len() < 10 {
        return Err(NoDrift::Readings(readings.len()));
    }
    let begin_s = readings[0][0];
    let long_s = readings[readings.len() - 1][0] - begin_s;
    if long_s < CREEP_LEAST_S {
        return Err(NoDrift::Short(long_s));
    }
    let first_n = readings[0][1];
    let lag = |x: &DVector<f64>| {
        let model = |time_s: f64| x[0] * (1.0 + x[1] * (1.0 - (-time_s / x[2].exp()).exp()));
        let off = readings.iter().map(|[time_s, force_n]| (model(time_s - begin_s) - force_n / first_n) / 1e-3);
        // A weak prior keeps the time constant near the length of the hold.
        DVector::from_iterator(readings.len(), off).push((x[2] - (0.3 * long_s).ln()) / 2.0)
    };
    let fit = minimise(&[1.0, 0.03, (0.3 * long_s).ln()], &[1e-5, 1e-5, 1e-3], lag).ok_or(NoDrift::Fit)?;
    let scale = (fit.cost / (readings.len() - fit.unknowns.len()) as f64).sqrt();
    let sigma = |at: usize| scale * fit.covariance[(at, at)].sqrt();
    let time_s = fit.unknowns[2].exp();
    Ok(Creep {
        share: Value { value: fit.unknowns[1], sigma: sigma(1) },
        time_s: Value { value: time_s, sigma: sigma(2) * time_s },
        left: 1e-3 * scale,
    })
}

#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Temperature {
    /// Change of the gain for each K, as a share (`array_gain_ppm_per_k`).
    pub per_k: Value,
    /// Temperatures of the chip in the cold and the warm press, degrees Celsius.
    pub chip_c: [f64; 2],
}

/// Change of the array's gain with the chip's temperature (FlexiForce A201: 0.36 %/K), from two presses at the same place.
///
/// Both presses are solved for the modulus; errors in radius and gains, common to both, cancel in the ratio.
pub fn temperature(cold: &Press, warm: &Press) -> Result<Temperature, NoDrift> {
    let mean_c = |press: &Press| {
        let known: Vec<f64> = press.steps.iter().filter_map(|step| step.chip_c).collect();
        if known.is_empty() { Err(NoDrift::Temperature) } else { Ok(known.iter().sum::<f64>() / known.len() as f64) }
    };
    let chip_c = [mean_c(cold)?, mean_c(warm)?];
    let warmer_k = chip_c[1] - chip_c[0];
    if warmer_k.abs() < 3.0 {
        return Err(NoDrift::Warming(warmer_k));
    }
    let found = modulus(&[cold.clone(), warm.clone()])?;
    if let [(_, why), ..] = found.gains.left_out.as_slice() {
        return Err((*why).into());
    }
    let [before, after] = found.presses.as_slice() else { return Err(NoDrift::Fit) };
    let ratio = after.kpa / before.kpa;
    let sigma = (before.sigma_kpa / before.kpa).hypot(after.sigma_kpa / after.kpa);
    Ok(Temperature { per_k: Value { value: (ratio - 1.0) / warmer_k, sigma: (sigma / warmer_k).abs() }, chip_c })
}
