//! The characteristic of each set: fitted in all forms, chosen by cross-validation, judged on other readings.

use crate::cycles::{Set, largest, parts};
use crate::forms::{Form, Point};
use crate::table::{Refusal, Table};
use serde::Serialize;

/// A form is better than a line where its mean square on unseen parts is less by this share.
const SURELY: f64 = 0.05;

/// What a file's sets say.
#[derive(Debug, Serialize)]
pub struct Characteristics {
    /// One for each set.
    pub sets: Vec<Characteristic>,
}

/// What a set says.
#[derive(Debug, Serialize)]
pub struct Characteristic {
    /// Its name.
    pub set: String,
    /// Readings that count.
    pub readings: usize,
    /// Readings at the converter's end, which say nothing of the force.
    pub left_out: usize,
    /// Largest force that counts.
    pub largest_force_n: f64,
    /// Largest conductance that counts.
    pub largest_conductance_ms: f64,
    /// The firmware's form that the readings support.
    pub chosen: Form,
    /// a of the chosen form.
    pub force_per_conductance_n_per_ms: f64,
    /// c of the chosen form, 0 for the line.
    pub growth_per_ms: f64,
    /// All forms.
    pub forms: Vec<Tried>,
    /// On the other file.
    pub judged: Option<Judged>,
    #[serde(skip)]
    end: Option<f64>,
    #[serde(skip)]
    parameters: Vec<f64>,
}

/// A form, fitted.
#[derive(Debug, Serialize)]
pub struct Tried {
    /// Which.
    pub form: Form,
    /// Whether the firmware has it.
    pub in_firmware: bool,
    /// In the order of its formula.
    pub parameters: Vec<f64>,
    /// Error on what it was fitted to, of the largest force.
    pub fitted_percent: f64,
    /// Error on parts that it was not fitted to.
    pub unseen_percent: f64,
    /// Error on the worst of those parts.
    pub worst_part_percent: f64,
    /// Whether it is better than a line: on most unseen parts, and by a twentieth of the mean square over all.
    pub supported: bool,
    /// Mean square of each unseen part's error, N^2.
    #[serde(skip)]
    squares: Vec<f64>,
}

/// A characteristic, judged on readings that it was not fitted to.
#[derive(Debug, Serialize)]
pub struct Judged {
    /// Readings that count.
    pub readings: usize,
    /// Readings at the converter's end.
    pub left_out: usize,
    /// Largest force of those that count.
    pub largest_force_n: f64,
    /// Root mean square of the force's error.
    pub rms_n: f64,
    /// The same as a share of the largest force.
    pub rms_percent: f64,
}

impl Characteristics {
    /// Fits and chooses.
    ///
    /// # Errors
    /// A set cannot be used.
    pub fn fit(table: &Table) -> Result<Self, Refusal> {
        let sets = Set::all(table)?;
        Ok(Self { sets: sets.iter().map(|set| Characteristic::fit(set, table)).collect::<Result<_, _>>()? })
    }

    /// Judges each set on the other file's set of this name.
    ///
    /// # Errors
    /// A set cannot be used, or was not fitted.
    pub fn judge(&mut self, table: &Table) -> Result<(), Refusal> {
        for set in Set::all(table)? {
            let Some(fitted) = self.sets.iter_mut().find(|fitted| fitted.set == set.name) else {
                let why = "is not in the recording that is fitted to: add it there, or take it out here";
                return Err(table.refuse(set.line, format_args!("the set {} {why}", set.name)));
            };
            set.check(table)?;
            // The converter is the same one.
            let end = [fitted.end, set.end()].into_iter().flatten().reduce(f64::min);
            let points = set.seen(end, table)?;
            let largest_force_n = largest(&points);
            let rms_n = fitted.chosen.error(&fitted.parameters, &points);
            fitted.judged = Some(Judged {
                readings: points.len(),
                left_out: set.points.len() - points.len(),
                largest_force_n,
                rms_n,
                rms_percent: 100.0 * rms_n / largest_force_n,
            });
        }
        Ok(())
    }
}

impl Characteristic {
    fn fit(set: &Set, table: &Table) -> Result<Self, Refusal> {
        set.check(table)?;
        let end = set.end();
        let points = set.seen(end, table)?;
        let parts = parts(&points);
        let refuse = |why: &str| table.refuse(set.line, format_args!("{}: {why}", set.name));
        let mut forms: Vec<Tried> = Form::ALL.iter().filter_map(|form| Tried::new(*form, &points, &parts)).collect();
        let line = forms
            .iter()
            .find(|tried| tried.form == Form::Line && tried.parameters[0] > 0.0)
            .map(|line| line.squares.clone())
            .ok_or_else(|| refuse("no line can be laid through these readings: check the columns and their units"))?;
        for tried in &mut forms {
            tried.supported = tried.form == Form::Line || better(&line, &tried.squares);
        }
        let best = forms.iter().rfind(|tried| tried.in_firmware && tried.supported);
        let (chosen, parameters) =
            best.map(|tried| (tried.form, tried.parameters.clone())).unwrap_or((Form::Line, vec![]));
        Ok(Self {
            set: set.name.clone(),
            readings: points.len(),
            left_out: set.points.len() - points.len(),
            largest_force_n: largest(&points),
            largest_conductance_ms: points.iter().map(|point| point.conductance).fold(0.0, f64::max),
            chosen,
            force_per_conductance_n_per_ms: parameters.first().copied().unwrap_or(0.0),
            growth_per_ms: parameters.get(1).copied().unwrap_or(0.0),
            forms,
            judged: None,
            end,
            parameters,
        })
    }
}

impl Tried {
    fn new(form: Form, points: &[Point], parts: &[usize]) -> Option<Self> {
        let largest = largest(points);
        let parameters = form.fit(points)?;
        let count = parts.iter().max().map_or(0, |last| last + 1);
        let (mut squares, mut sum, mut worst) = (Vec::new(), 0.0, 0.0_f64);
        for part in 0..count {
            let of = |inside: bool| -> Vec<Point> {
                points.iter().zip(parts).filter(|(_, at)| (**at == part) == inside).map(|(point, _)| *point).collect()
            };
            let unseen = of(true);
            let square = form.error(&form.fit(&of(false))?, &unseen).powi(2);
            squares.push(square);
            sum += square * unseen.len() as f64;
            worst = worst.max(square.sqrt());
        }
        Some(Self {
            form,
            in_firmware: form.in_firmware(),
            fitted_percent: 100.0 * form.error(&parameters, points) / largest,
            unseen_percent: 100.0 * (sum / points.len() as f64).sqrt() / largest,
            worst_part_percent: 100.0 * worst / largest,
            parameters,
            supported: false,
            squares,
        })
    }
}

/// Whether the second error is surely less than the first: in the mean over parts, and in more than half of them.
fn better(than: &[f64], squares: &[f64]) -> bool {
    let mean = |of: &[f64]| of.iter().sum::<f64>() / of.len().max(1) as f64;
    let parts = than.iter().zip(squares).filter(|(than, square)| square < than).count();
    2 * parts > squares.len() && mean(squares) < (1.0 - SURELY) * mean(than)
}
