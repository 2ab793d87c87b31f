//! Young's modulus and the contact point from force over travel.
//!
//! The force of a step is `F = pi y d^2` (Park, Kim and Hirai 2003, eq. 14) with the stiffness y that all sound taxels give
//! together ([`crate::gains()`]). What the tip and the ink remember changes it by 5 to 20 %, so it is fitted along
//! ([`crate::memory`]): the two ways of a press and its holds show all of it. Unknowns of a press: Y, the contact point,
//! hysteresis, creep, relaxation and its time constant.

use crate::Value;
use crate::gains::{Gains, NoGains, settle};
use crate::memory::{Memory, Motion};
use crate::model::Pose;
use crate::press::Press;
use crate::robust::{Fit, minimise};
use nalgebra::DVector;
use std::f64::consts::PI;
use std::fmt;

/// Usual sizes of hysteresis, creep and relaxation; they only matter if a press does not determine these. Hysteresis up
/// to 10 %, creep under 5 % a decade (Interlink FSR 400 guide); silicones relax by 5 to 20 %, mostly within two seconds
/// (Fung, 7.6).
const HYSTERESIS_USUAL: f64 = 0.1;
const CREEP_USUAL: f64 = 0.03;
const RELAXATION_USUAL: f64 = 0.1;
const RELAXATION_S: f64 = 0.4;
const RELAXATION_DECADES: f64 = 0.5;
/// Relaxation's time constants that are tried, s: half a decade in three.
const TRIED_S: [f64; 13] = [0.03, 0.044, 0.065, 0.095, 0.14, 0.2, 0.3, 0.44, 0.65, 0.95, 1.4, 2.0, 4.0];
/// Error of the model in a step's force: as a share of it, and of the largest.
const FORCE_PART: f64 = 0.003;
const LARGEST_PART: f64 = 0.0007;
const UNKNOWNS: usize = 5;

#[derive(Clone, Debug, PartialEq)]
pub struct OfPress {
    pub kpa: f64,
    /// Standard uncertainty of the modulus from the residuals, kPa.
    pub sigma_kpa: f64,
    /// Travel at which the tip touches, mm.
    pub touch_mm: f64,
    pub memory: Memory,
    pub creep_sigma: f64,
}

#[derive(Clone, Debug, PartialEq)]
pub struct Modulus {
    pub kpa: f64,
    pub sigma_kpa: f64,
    pub parts: Parts,
    pub presses: Vec<OfPress>,
    /// Poses and gains that it rests on.
    pub gains: Gains,
}

/// Parts of the modulus' standard uncertainty, as shares.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Parts {
    /// Residuals of the presses.
    pub residuals: f64,
    /// Spread between the presses.
    pub presses: f64,
    /// Factor that all gains have in common.
    pub gains: f64,
    /// Correction for creep, relaxation and hysteresis, times the relative error of such a model.
    pub memory: f64,
}

pub fn modulus(presses: &[Press]) -> Result<Modulus, NoGains> {
    let (presses, gains, creep) = settle(presses)?;
    let mut found = Vec::new();
    for (index, mut one) in
        each(&presses, &gains).into_iter().enumerate().filter_map(|(index, one)| Some((index, one?)))
    {
        one.memory.creep += creep;
        let posed = &gains.presses[index];
        // A yield that was solved for leaves its uncertainty; one that was not, half of its effect.
        let [yields, sigma] = posed.yields_mm_per_n;
        let plate = if posed.pose.yields_mm_per_n.abs() > 1e-4 { 2.0 * sigma } else { yields.abs() };
        let depth_mm = presses[index].deepest_mm() - one.touch_mm;
        let force_n = posed.forces_n.iter().copied().fold(0.0, f64::max);
        one.sigma_kpa = one.sigma_kpa.hypot(one.kpa * plate * force_n / depth_mm);
        found.push(one);
    }
    if found.is_empty() {
        return Err(NoGains::Fit(presses.len()));
    }
    let weight = |one: &OfPress| (one.kpa / one.sigma_kpa).powi(2);
    let weights: f64 = found.iter().map(weight).sum();
    let kpa = (found.iter().map(|one| weight(one) * one.kpa.ln()).sum::<f64>() / weights).exp();
    let scatter: f64 = found.iter().map(|one| weight(one) * (one.kpa / kpa).ln().powi(2)).sum();
    let count = found.len() as f64;
    let between = if found.len() > 1 { (scatter / weights / (count - 1.0)).sqrt() } else { 0.0 };
    let mean = |part: fn(&OfPress) -> f64| found.iter().map(|one| weight(one) * part(one)).sum::<f64>() / weights;
    let memory = mean(|one| one.memory.creep).hypot(0.1 * mean(|one| one.memory.relaxation));
    let parts =
        Parts { residuals: weights.sqrt().recip(), presses: between, gains: gains.common, memory: 0.3 * memory };
    let sigma = parts.residuals.hypot(parts.presses).hypot(parts.gains).hypot(parts.memory);
    Ok(Modulus { kpa, sigma_kpa: sigma * kpa, parts, presses: found, gains })
}

/// Each press by itself; None where its fit has no solution.
pub(crate) fn each(presses: &[Press], gains: &Gains) -> Vec<Option<OfPress>> {
    presses.iter().zip(&gains.presses).map(|(press, posed)| of_press(press, &posed.pose, &posed.forces_n)).collect()
}

fn of_press(press: &Press, pose: &Pose, measured: &[f64]) -> Option<OfPress> {
    let (radius_mm, touch_mm) = (press.radius_mm, pose.touch_mm);
    // Travel into the tip: less what the plate yields.
    let mut press = press.clone();
    for (step, force_n) in press.steps.iter_mut().zip(measured) {
        step.travel_mm.iter_mut().for_each(|travel_mm| *travel_mm -= pose.yields_mm_per_n * force_n);
    }
    let motion = Motion::new(&press, touch_mm);
    let largest_n = measured.iter().copied().fold(0.0, f64::max);
    let start_kpa = 1e3 * largest_n / (PI * (press.deepest_mm() - touch_mm).max(1e-3).powi(2));
    let read = |x: &DVector<f64>, tau_s: f64| {
        let memory = Memory { hysteresis: x[2].max(0.0), creep: x[3], relaxation: x[4].max(0.0), relaxation_s: tau_s };
        (start_kpa * x[0].exp(), touch_mm + x[1] * radius_mm, memory)
    };
    let fits: Vec<(Fit, f64)> = TRIED_S
        .into_iter()
        .filter_map(|tau_s| {
            let residuals = |x: &DVector<f64>| {
                let (kpa, touch_mm, memory) = read(x, tau_s);
                let model = motion.forces(kpa, radius_mm, touch_mm, &memory);
                let off = model.iter().zip(measured).map(|(model, measured)| {
                    (model - measured) / (FORCE_PART * measured).hypot(LARGEST_PART * largest_n)
                });
                let decades = (tau_s / RELAXATION_S).log10();
                let usual = [
                    x[2] / HYSTERESIS_USUAL,
                    x[3] / CREEP_USUAL,
                    x[4] / RELAXATION_USUAL,
                    decades / RELAXATION_DECADES,
                ];
                DVector::from_iterator(measured.len() + usual.len(), off.chain(usual))
            };
            let start = [0.0, 0.0, 0.04, 0.02, 0.05];
            minimise(&start, &[1e-4, 1e-5, 1e-4, 1e-4, 1e-4], residuals).map(|fit| (fit, tau_s))
        })
        .collect();
    let cost = fits.iter().map(|(fit, _)| fit.cost).min_by(f64::total_cmp)?;
    let freedom = measured.len().saturating_sub(UNKNOWNS).max(1) as f64;
    let scale = (cost / freedom).max(1.0).sqrt();
    // Each time constant counts by its likelihood: the mean and the spread of the unknowns over all of them are the result.
    let weights = DVector::from_iterator(
        fits.len(),
        fits.iter().map(|(fit, _)| (-0.5 * (fit.cost - cost) / (scale * scale)).exp()),
    );
    let weights = &weights / weights.sum();
    let mut mean = DVector::zeros(UNKNOWNS + 1);
    let with_tau = |fit: &Fit, tau_s: f64| fit.unknowns.clone().insert_row(UNKNOWNS, tau_s.ln());
    fits.iter().zip(&weights).for_each(|((fit, tau_s), weight)| mean += *weight * with_tau(fit, *tau_s));
    let mut variance = [0.0; UNKNOWNS];
    for ((fit, tau_s), weight) in fits.iter().zip(&weights) {
        let off = with_tau(fit, *tau_s) - &mean;
        for (unknown, variance) in variance.iter_mut().enumerate() {
            *variance += weight * (scale * scale * fit.covariance[(unknown, unknown)] + off[unknown] * off[unknown]);
        }
    }
    let (kpa, touch_mm, memory) = read(&mean, mean[UNKNOWNS].exp());
    let [kpa_sigma, _, _, creep_sigma, _] = variance.map(f64::sqrt);
    Some(OfPress { kpa, sigma_kpa: kpa_sigma * kpa, touch_mm, memory, creep_sigma })
}

impl fmt::Display for Modulus {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { kpa, sigma_kpa, parts, presses, gains } = self;
        let value = Value { value: *kpa, sigma: *sigma_kpa };
        let [residuals, between, common, memory] =
            [parts.residuals, parts.presses, parts.gains, parts.memory].map(|part| 100.0 * part);
        write!(
            f,
            "Young's modulus is {value} kPa, from {} press{}. Its uncertainty: {residuals:.1} % residuals, {between:.1} % \
             spread between presses, {common:.1} % common gain of the taxels, {memory:.1} % creep and relaxation.",
            presses.len(),
            if presses.len() == 1 { "" } else { "es" }
        )?;
        for (index, press) in presses.iter().enumerate() {
            let memory = &press.memory;
            let [hysteresis, creep, relaxation] =
                [memory.hysteresis, memory.creep, memory.relaxation].map(|share| 100.0 * share);
            write!(
                f,
                " Press {}: {:.1} kPa, contact at {:.3} mm, hysteresis {hysteresis:.1} %, creep {creep:.1} % per decade, \
                 relaxation {relaxation:.1} % with a time constant of {:.2} s.",
                index + 1,
                press.kpa,
                press.touch_mm,
                memory.relaxation_s
            )?;
        }
        write!(f, " {gains}")
    }
}
