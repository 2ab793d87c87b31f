//! The taxels' gains and the scale, from presses under a load cell.
//!
//! The force is the sum of the pressures: `F = a sum(g_i u_i)` for codes u above tare, gains g and a newtons for a code.
//! Presses at several places tell the g apart. They are laid through the force by least squares, each drawn towards 1 by
//! what was left out judges best: a taxel that was hardly pressed keeps 1.

use crate::presses::{Presses, Sample};
use crate::squares::rms;
use crate::table::Refusal;
use fingertip::params::Params;
use fingertip::pressure::GAIN_ONE;
use nalgebra::{DMatrix, DVector};
use serde::Serialize;
use std::fmt::{self, Display, Formatter};

/// How strongly gains are drawn to 1, in shares of what a taxel tells of itself in the mean; the last one is not to fit any.
const PULLS: [f64; 12] = [1e-6, 1e-5, 3e-5, 1e-4, 3e-4, 1e-3, 3e-3, 1e-2, 3e-2, 1e-1, 1.0, f64::INFINITY];
/// Gains are worth their while where they lower the error of what was left out to this share.
const BETTER: f64 = 0.9;
/// A gain counts as known where the recording leaves less than this share of what was not known of it.
const KNOWN: f64 = 0.95;
/// What the firmware takes, [`GAIN_ONE`] is 1: a half to just below 2.
const GAINS: [f64; 2] = [0.5, 32_767.0 / 16_384.0];

/// What a recording tells.
#[derive(Debug, Serialize)]
pub struct Found {
    /// Rows of taxels.
    pub rows: usize,
    /// Columns of taxels.
    pub columns: usize,
    /// Readings under a force.
    pub readings: usize,
    /// Left out: a taxel at the converter's end.
    pub left_out: usize,
    /// Parts, each left out in turn.
    pub parts: usize,
    /// Of the force.
    pub largest_force_n: f64,
    /// Root mean square of the force's error on what was left out, without gains, as a share of the largest force.
    pub without_percent: f64,
    /// The same with gains.
    pub with_percent: f64,
    /// Whether the recording supports them.
    pub supported: bool,
    /// What a taxel's reading is to be multiplied by, row by row; 1 where it is not known.
    pub gains: Vec<f64>,
    /// Their relative standard uncertainty; none where the gain is not known.
    pub relative_sigmas: Vec<Option<f64>>,
    /// What the parameter is to be.
    pub codes_per_kpa_milli: i64,
    /// On another recording.
    pub judged: Option<Judged>,
}

/// On readings that nothing was fitted to.
#[derive(Debug, Serialize)]
pub struct Judged {
    /// Which.
    pub file: String,
    /// How many.
    pub readings: usize,
    /// Root mean square of the force's error without gains, as a share of the largest force.
    pub without_percent: f64,
    /// The same with gains.
    pub with_percent: f64,
}

/// Newtons for a code, and what the taxels' gains are beyond 1.
struct Fit {
    per_code: f64,
    beyond: DVector<f64>,
    /// What is left not known of each, as a share of what was not known.
    left: DVector<f64>,
    /// How strongly they were drawn to 1, in N^2.
    strength: f64,
}

impl Fit {
    fn force(&self, sample: &Sample) -> f64 {
        let sum = |(code, beyond): (&f64, &f64)| code * (1.0 + beyond);
        self.per_code * sample.codes.iter().zip(self.beyond.iter()).map(sum).sum::<f64>()
    }

    fn error(&self, samples: &[&Sample]) -> f64 {
        rms(samples.iter().map(|sample| self.force(sample) - sample.force))
    }

    /// None where the readings do not grow with the force.
    fn new(samples: &[&Sample], pull: f64) -> Option<Self> {
        let taxels = samples.first()?.codes.len();
        let sum = |sample: &Sample| sample.codes.iter().sum::<f64>();
        let square: f64 = samples.iter().map(|sample| sum(sample).powi(2)).sum();
        let per_code = samples.iter().map(|sample| sum(sample) * sample.force).sum::<f64>() / square;
        if !per_code.is_finite() || per_code <= 0.0 {
            return None;
        }
        let none = Self {
            per_code,
            beyond: DVector::zeros(taxels),
            left: DVector::repeat(taxels, 1.0),
            strength: f64::INFINITY,
        };
        if pull.is_infinite() {
            return Some(none);
        }
        let readings = DMatrix::from_fn(samples.len(), taxels, |at, taxel| per_code * samples[at].codes[taxel]);
        let missing = DVector::from_fn(samples.len(), |at, _| samples[at].force - none.force(samples[at]));
        let mut normal = readings.tr_mul(&readings);
        let strength = pull * normal.trace() / taxels as f64;
        (0..taxels).for_each(|taxel| normal[(taxel, taxel)] += strength);
        let solved = normal.cholesky()?;
        let beyond = solved.solve(&readings.tr_mul(&missing));
        let left = solved.inverse().diagonal().map(|value| (value * strength).sqrt());
        Some(Self { per_code, beyond, left, strength })
    }
}

/// Root mean square of the force's error where each part is left out in turn.
fn unseen(presses: &Presses, pull: f64) -> Option<f64> {
    let mut errors = Vec::new();
    for part in 0..presses.parts {
        let (out, rest): (Vec<&Sample>, Vec<&Sample>) = presses.samples.iter().partition(|sample| sample.part == part);
        let fit = Fit::new(&rest, pull)?;
        errors.extend(out.iter().map(|sample| fit.force(sample) - sample.force));
    }
    Some(rms(errors.into_iter()))
}

/// Fits to one recording, and judges on another.
///
/// # Errors
/// The readings do not grow with the force, a result is beyond what the firmware takes, or the recordings are not of one
/// array: the text says what to do.
pub fn fit(presses: &Presses, judge: Option<&Presses>) -> Result<Found, Refusal> {
    let refuse = |why: &str| Refusal(format!("{}: {why}", presses.file));
    let shape = [presses.rows, presses.columns];
    if let Some(other) = judge.filter(|other| [other.rows, other.columns] != shape) {
        let why = format!("{} x {} taxels, not {} x {}", other.rows, other.columns, shape[0], shape[1]);
        return Err(Refusal(format!("{}: {why}: judge on a recording of the same array", other.file)));
    }
    let flat = "the codes do not grow with the force: is force_N of the same instant as the codes?";
    let mut errors = Vec::new();
    for pull in PULLS {
        errors.push((pull, unseen(presses, pull).ok_or_else(|| refuse(flat))?));
    }
    let without = errors[PULLS.len() - 1].1;
    let best = errors.iter().copied().min_by(|(_, left), (_, right)| left.total_cmp(right));
    let best = best.filter(|(_, error)| *error < BETTER * without);
    let supported = best.is_some();
    let (pull, with) = best.unwrap_or((f64::INFINITY, without));
    let all: Vec<&Sample> = presses.samples.iter().collect();
    let plain = Fit::new(&all, f64::INFINITY).ok_or_else(|| refuse(flat))?;
    let mut fit = Fit::new(&all, pull).ok_or_else(|| refuse(flat))?;
    let known: Vec<bool> = fit.left.iter().map(|left| *left < KNOWN).collect();
    let count = known.iter().filter(|known| **known).count().max(1) as f64;
    // What they have in common belongs to the scale.
    let common: f64 = known.iter().zip(fit.beyond.iter()).filter(|(known, _)| **known).map(|(_, beyond)| beyond).sum();
    let mean = 1.0 + common / count;
    for (known, beyond) in known.iter().zip(fit.beyond.iter_mut()) {
        *beyond = if *known { ((1.0 + *beyond) / mean).clamp(GAINS[0], GAINS[1]) - 1.0 } else { 0.0 };
    }
    fit.per_code *= mean;
    let pitch_mm = f64::from(Params::DEFAULT.pitch_um) * 1e-3;
    let codes_per_kpa_milli = (pitch_mm * pitch_mm / fit.per_code).round();
    let params = Params { codes_per_kpa_milli: codes_per_kpa_milli as i32, ..Params::DEFAULT };
    params.check().map_err(|why| refuse(&format!("{why}: is force_N in newtons, of the whole contact?")))?;
    let largest = all.iter().map(|sample| sample.force).fold(0.0, f64::max);
    let sigma = |(known, left): (&bool, &f64)| known.then(|| left * with / fit.strength.sqrt());
    let relative_sigmas = known.iter().zip(fit.left.iter()).map(sigma).collect();
    let judged = judge.map(|other| {
        let samples: Vec<&Sample> = other.samples.iter().collect();
        let largest = samples.iter().map(|sample| sample.force).fold(0.0, f64::max);
        let percent = |fit: &Fit| 100.0 * fit.error(&samples) / largest;
        Judged {
            file: other.file.clone(),
            readings: samples.len(),
            without_percent: percent(&plain),
            with_percent: percent(&fit),
        }
    });
    Ok(Found {
        rows: presses.rows,
        columns: presses.columns,
        readings: all.len(),
        left_out: presses.left_out,
        parts: presses.parts,
        largest_force_n: largest,
        without_percent: 100.0 * without / largest,
        with_percent: 100.0 * with / largest,
        supported,
        gains: fit.beyond.iter().map(|beyond| 1.0 + beyond).collect(),
        relative_sigmas,
        codes_per_kpa_milli: codes_per_kpa_milli as i64,
        judged,
    })
}

impl Found {
    /// As `fingertip params restore` takes them.
    pub fn parameters(&self) -> String {
        let mut text = format!(
            "# From {} readings under a load cell, by `cargo xtask sensor gains`.\n\n[parameters]\ncodes_per_kpa_milli = {}\n\n[gains]\n",
            self.readings, self.codes_per_kpa_milli
        );
        for (row, gains) in self.gains.chunks(self.columns).enumerate() {
            let gains: Vec<_> = gains.iter().map(|gain| (gain * f64::from(GAIN_ONE)).round().to_string()).collect();
            text += &format!("row_{row} = [{}]\n", gains.join(", "));
        }
        text
    }
}

impl Display for Found {
    fn fmt(&self, f: &mut Formatter<'_>) -> fmt::Result {
        let Self { readings, largest_force_n, parts, left_out, .. } = self;
        writeln!(f, "{readings} readings to {largest_force_n:.2} N in {parts} parts, each unseen in turn")?;
        if *left_out > 0 {
            writeln!(f, "  left out: {left_out} readings with a taxel at the converter's end")?;
        }
        let (without, with) = (self.without_percent, self.with_percent);
        writeln!(f, "  force error on what was unseen, % of the largest: {without:.2} without gains, {with:.2} with")?;
        if !self.supported {
            writeln!(f, "  the recording supports no gains: more presses, at more places")?;
        }
        for row in self.gains.chunks(self.columns).zip(self.relative_sigmas.chunks(self.columns)) {
            let cell = |(gain, sigma): (&f64, &Option<f64>)| match sigma {
                Some(_) => format!("{gain:6.3}"),
                None => "     -".into(),
            };
            writeln!(f, "  {}", row.0.iter().zip(row.1).map(cell).collect::<Vec<_>>().join(" "))?;
        }
        let known: Vec<f64> = self.relative_sigmas.iter().copied().flatten().collect();
        let worst = 100.0 * known.iter().copied().fold(0.0, f64::max);
        writeln!(f, "  {} taxels known, the worst to {worst:.1} %; - keeps 1", known.len())?;
        writeln!(f, "  codes_per_kpa_milli = {}", self.codes_per_kpa_milli)?;
        if let Some(judged) = &self.judged {
            let Judged { readings, without_percent, with_percent, .. } = judged;
            writeln!(
                f,
                "  judged: {without_percent:.2} % without gains, {with_percent:.2} % with, {readings} readings"
            )?;
        }
        Ok(())
    }
}
