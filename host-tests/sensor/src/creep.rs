//! Creep: how the conductance under a held weight grows, G = G_0 (1 + sum of k_i f_i(t)).
//!
//! The firmware's term is one first-order lag, f = 1 - exp(-t / tau). A second lag and the logarithm of time stand
//! beside it, to tell whether it lacks something.

use crate::holds::Hold;
use crate::squares::{median, rms, solve, trimmed_mean};
use crate::table::{Refusal, Table};
use serde::Serialize;

/// Time constants that are tried, s.
const CONSTANTS_S: [f64; 6] = [2.0, 5.0, 10.0, 20.0, 50.0, 100.0];
/// Time constants whose errors are nearer to each other than this are not told apart.
const ALIKE: f64 = 0.05;
/// Parts of the cross-validation where there is one run only.
const PARTS: usize = 5;

/// A form of the creep.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
#[serde(rename_all = "snake_case", tag = "form")]
pub enum Form {
    /// None.
    None,
    /// k (1 - exp(-t / tau)): the firmware's.
    Lag {
        /// tau, s.
        time_constant_s: f64,
    },
    /// Two of them, the quicker one with a tenth of the time constant.
    TwoLags {
        /// tau of the slower one, s.
        time_constant_s: f64,
    },
    /// k ln(1 + t / 1 s).
    Logarithm,
}

impl Form {
    fn all() -> Vec<Self> {
        let lags = CONSTANTS_S.map(|time_constant_s| Self::Lag { time_constant_s });
        let two = CONSTANTS_S[2..5].iter().map(|constant| Self::TwoLags { time_constant_s: *constant });
        [Self::None].into_iter().chain(lags).chain(two).chain([Self::Logarithm]).collect()
    }

    const fn in_firmware(self) -> bool {
        matches!(self, Self::None | Self::Lag { .. })
    }

    /// f_i at a time.
    fn grown(self, t_s: f64) -> [f64; 2] {
        let lag = |constant: f64| 1.0 - (-t_s / constant).exp();
        match self {
            Self::None => [0.0; 2],
            Self::Lag { time_constant_s } => [lag(time_constant_s), 0.0],
            Self::TwoLags { time_constant_s } => [lag(time_constant_s), lag(time_constant_s / 10.0)],
            Self::Logarithm => [t_s.ln_1p(), 0.0],
        }
    }

    /// k_i that the holds agree on: of each by least squares, then the trimmed mean over all.
    fn fit<'a>(self, holds: impl Iterator<Item = &'a Hold>) -> [f64; 2] {
        let of = |hold: &Hold| -> Option<[f64; 2]> {
            let rows = || hold.readings.iter().map(|[t, conductance]| (self.grown(*t), *conductance));
            match self {
                Self::None => None,
                Self::TwoLags { .. } => {
                    let [start, slow, quick] = solve(rows().map(|([slow, quick], y)| ([1.0, slow, quick], y)))?;
                    (start > 0.0).then(|| [slow / start, quick / start])
                }
                _ => {
                    let [start, one] = solve(rows().map(|([one, _], y)| ([1.0, one], y)))?;
                    (start > 0.0).then(|| [one / start, 0.0])
                }
            }
        };
        let rates: Vec<_> = holds.filter_map(of).collect();
        if rates.is_empty() {
            return [0.0; 2];
        }
        [0, 1].map(|at| trimmed_mean(rates.iter().map(|rate| rate[at])))
    }

    /// What of the drift is left at the hold's end, and how far the corrected conductance goes up and down (rms), both
    /// as shares.
    fn left(self, rates: [f64; 2], hold: &Hold) -> [f64; 2] {
        let corrected = |[t, conductance]: [f64; 2]| {
            let [one, two] = self.grown(t);
            conductance / (1.0 + rates[0] * one + rates[1] * two).max(0.1)
        };
        let all: Vec<_> = hold.readings.iter().map(|reading| corrected(*reading)).collect();
        let mean = all.iter().sum::<f64>() / all.len().max(1) as f64;
        [corrected(hold.end()) / corrected(hold.start()) - 1.0, rms(all.iter().map(|value| value / mean - 1.0))]
    }
}

/// What a file's holds say.
#[derive(Debug, Serialize)]
pub struct Creep {
    /// Holds that count.
    pub holds: usize,
    /// Holds without a weight.
    pub left_out: usize,
    /// What the cross-validation left out in turn.
    pub parts: &'static str,
    /// The firmware's form that the holds support.
    pub chosen: Form,
    /// By what share of the force a hold's reading grows in the end, k.
    pub rate: f64,
    /// All forms.
    pub forms: Vec<Tried>,
    /// On the other file.
    pub judged: Option<Judged>,
}

/// A form, fitted.
#[derive(Debug, Serialize)]
pub struct Tried {
    /// Which.
    #[serde(flatten)]
    pub form: Form,
    /// Whether the firmware has it.
    pub in_firmware: bool,
    /// k_i.
    pub rates: [f64; 2],
    /// Drift left at the end of holds that it was not fitted to, median of its size.
    pub unseen_drift_percent: f64,
    /// How far their corrected conductance goes up and down, rms, median.
    pub unseen_rms_percent: f64,
    /// Unseen holds whose drift it makes smaller.
    pub better_holds: usize,
    /// Whether it betters more of them than chance does, by two standard deviations.
    pub supported: bool,
}

/// Holds that were not fitted to.
#[derive(Debug, Serialize)]
pub struct Judged {
    /// Each of them.
    pub holds: Vec<JudgedHold>,
    /// Holds without a weight.
    pub left_out: usize,
    /// Median of the drift's size, as recorded.
    pub drift_percent: f64,
    /// Median of what is left of it.
    pub drift_left_percent: f64,
}

/// A hold that was not fitted to.
#[derive(Debug, Serialize)]
pub struct JudgedHold {
    /// Its run.
    pub run: String,
    /// What was held.
    pub weight_kg: f64,
    /// From the first reading to the last.
    pub drift_percent: f64,
    /// What is left of it at the end.
    pub drift_left_percent: f64,
}

impl Creep {
    /// Fits and chooses.
    ///
    /// # Errors
    /// A hold cannot be used.
    pub fn fit(table: &Table) -> Result<Self, Refusal> {
        let (holds, left_out) = Hold::all(table)?;
        if holds.len() < 3 {
            return Err(
                table.refuse(2, format_args!("{} holds, at least 3 are needed: hold more weights", holds.len()))
            );
        }
        let mut runs: Vec<&str> = holds.iter().map(|hold| hold.run.as_str()).collect();
        runs.dedup();
        let by_run = runs.iter().any(|run| *run != runs[0]);
        let part = |at: usize| {
            if by_run { runs.iter().position(|run| *run == holds[at].run).unwrap_or(0) } else { at % PARTS }
        };
        let parts: Vec<usize> = (0..holds.len()).map(part).collect();
        let forms: Vec<_> = Form::all().into_iter().map(|form| Tried::new(form, &holds, &parts)).collect();
        let chosen = choose(&forms).unwrap_or(&forms[0]);
        Ok(Self {
            holds: holds.len(),
            left_out,
            parts: if by_run { "run" } else { "fifth of the holds" },
            chosen: chosen.form,
            rate: chosen.rates[0],
            forms,
            judged: None,
        })
    }

    /// Judges the other file's holds.
    ///
    /// # Errors
    /// A hold cannot be used.
    pub fn judge(&mut self, table: &Table) -> Result<(), Refusal> {
        let (holds, left_out) = Hold::all(table)?;
        let judged = |hold: &Hold| JudgedHold {
            run: hold.run.clone(),
            weight_kg: hold.weight_kg,
            drift_percent: 100.0 * hold.drift(),
            drift_left_percent: 100.0 * self.chosen.left([self.rate, 0.0], hold)[0],
        };
        let holds: Vec<_> = holds.iter().map(judged).collect();
        self.judged = Some(Judged {
            left_out,
            drift_percent: median(holds.iter().map(|hold| hold.drift_percent.abs())),
            drift_left_percent: median(holds.iter().map(|hold| hold.drift_left_percent.abs())),
            holds,
        });
        Ok(())
    }
}

/// The firmware's form that the holds support: of the time constants that they do not tell apart the shortest, which
/// says least of times beyond the recording.
fn choose(forms: &[Tried]) -> Option<&Tried> {
    let lags = || forms.iter().filter(|tried| tried.in_firmware && tried.supported && tried.rates[0] > 0.0);
    let best = lags().map(|tried| tried.unseen_rms_percent).fold(f64::MAX, f64::min);
    lags().find(|tried| tried.unseen_rms_percent <= best * (1.0 + ALIKE))
}

impl Tried {
    fn new(form: Form, holds: &[Hold], parts: &[usize]) -> Self {
        let (mut left, mut better_holds) = (Vec::new(), 0);
        for part in 0..=parts.iter().max().copied().unwrap_or(0) {
            let of = |inside: bool| {
                holds.iter().zip(parts).filter(move |(_, at)| (**at == part) == inside).map(|(hold, _)| hold)
            };
            let rates = form.fit(of(false));
            for hold in of(true) {
                let [drift, rms] = form.left(rates, hold);
                better_holds += usize::from(drift.abs() < hold.drift().abs());
                left.push([drift.abs(), rms]);
            }
        }
        let half = holds.len() as f64 / 2.0;
        Self {
            form,
            in_firmware: form.in_firmware(),
            rates: form.fit(holds.iter()),
            unseen_drift_percent: 100.0 * median(left.iter().map(|[drift, _]| *drift)),
            unseen_rms_percent: 100.0 * median(left.iter().map(|[_, rms]| *rms)),
            better_holds,
            supported: better_holds as f64 > half + half.sqrt() * std::f64::consts::SQRT_2,
        }
    }
}
