//! Sets of readings in which one taxel is pressed again and again.

use crate::forms::Point;
use crate::table::{Refusal, Table};

/// A converter's end is where so many readings,
const END_READINGS: usize = 5;
/// and this share of a set,
const END_SHARE: f64 = 0.02;
/// lie so near to the highest of all,
const END_BAND: f64 = 0.005;
/// while the force goes through this share of its largest.
const END_FORCES: f64 = 0.1;
/// Fewer readings than this tell no characteristic.
const LEAST: usize = 20;
/// Parts of a set for the cross-validation, where it does not have so many cycles.
const PARTS: usize = 5;
/// A cycle has been up above this share of the largest force,
const UP: f64 = 0.4;
/// and ends below this one.
const DOWN: f64 = 0.1;

/// One sensor's readings, in order of time.
#[derive(Debug)]
pub struct Set {
    /// As the file calls it.
    pub name: String,
    /// All readings.
    pub points: Vec<Point>,
    /// Where the set begins.
    pub line: u64,
}

impl Set {
    /// The sets of a file, in the order of their first rows.
    ///
    /// # Errors
    /// Names a line that is out of order.
    pub fn all(table: &Table) -> Result<Vec<Self>, Refusal> {
        let mut sets: Vec<(Self, f64)> = Vec::new();
        for row in &table.rows {
            let [sample, force, conductance] = row.numbers;
            let point = Point { force, conductance };
            let Some((set, last)) = sets.iter_mut().find(|(set, _)| set.name == row.of) else {
                sets.push((Self { name: row.of.clone(), points: vec![point], line: row.line }, sample));
                continue;
            };
            if sample <= *last {
                let why =
                    "the rows of a set must be in order of time: sort them, or name the second recording otherwise";
                return Err(table.refuse(row.line, format_args!("sample {sample} of {} after {last}: {why}", set.name)));
            }
            *last = sample;
            set.points.push(point);
        }
        Ok(sets.into_iter().map(|(set, _)| set).collect())
    }

    /// Refuses a set that tells no characteristic.
    ///
    /// # Errors
    /// Says why, and what to do.
    pub fn check(&self, table: &Table) -> Result<(), Refusal> {
        let (name, count) = (&self.name, self.points.len());
        let refuse = |why: String| Err(table.refuse(self.line, format_args!("{name}: {why}")));
        if count < LEAST {
            return refuse(format!("{count} readings, at least {LEAST} are needed: record some cycles of pressing"));
        }
        let forces = || self.points.iter().map(|point| point.force);
        let (least, largest) = (forces().fold(f64::MAX, f64::min), self.largest());
        if largest <= 0.0 {
            return refuse("no force above zero: forces that press count as positive".into());
        }
        if largest - least < 0.5 * largest {
            return refuse(format!(
                "the force stays within {least} to {largest} N: record from no force to the largest"
            ));
        }
        let mean = |of: &dyn Fn(&Point) -> f64| self.points.iter().map(of).sum::<f64>() / count as f64;
        let (force, conductance) = (mean(&|point| point.force), mean(&|point| point.conductance));
        let moment = |a: &dyn Fn(&Point) -> f64, b: &dyn Fn(&Point) -> f64| mean(&|point| a(point) * b(point));
        let (df, dg) = (|point: &Point| point.force - force, |point: &Point| point.conductance - conductance);
        let scale = (moment(&df, &df) * moment(&dg, &dg)).sqrt();
        if scale <= 0.0 || moment(&df, &dg) < 0.5 * scale {
            let why = "the conductance does not grow with the force";
            return refuse(format!("{why}: check the columns, and that conductance is 1/R of the taxel"));
        }
        Ok(())
    }

    /// The largest force, N.
    pub fn largest(&self) -> f64 {
        largest(&self.points)
    }

    /// The conductance from which a reading only says that the converter is at its end, where it came there.
    pub fn end(&self) -> Option<f64> {
        let top = self.points.iter().map(|point| point.conductance).fold(0.0, f64::max);
        let from = top * (1.0 - END_BAND);
        let there: Vec<_> =
            self.points.iter().filter(|point| point.conductance >= from).map(|point| point.force).collect();
        let (least, most) =
            there.iter().fold((f64::MAX, 0.0_f64), |(least, most), force| (least.min(*force), most.max(*force)));
        let many = there.len() >= END_READINGS && there.len() as f64 >= END_SHARE * self.points.len() as f64;
        (many && most - least >= END_FORCES * self.largest()).then_some(from)
    }

    /// The readings below the converter's end.
    ///
    /// # Errors
    /// They are too few.
    pub fn seen(&self, end: Option<f64>, table: &Table) -> Result<Vec<Point>, Refusal> {
        let below = |point: &&Point| end.is_none_or(|end| point.conductance < end);
        let seen: Vec<_> = self.points.iter().filter(below).copied().collect();
        if seen.len() < LEAST {
            let why = "are below the converter's end: press less, or read through a smaller resistor";
            return Err(table.refuse(self.line, format_args!("{}: {} readings {why}", self.name, seen.len())));
        }
        Ok(seen)
    }
}

/// The largest force, N.
pub fn largest(points: &[Point]) -> f64 {
    points.iter().map(|point| point.force).fold(0.0, f64::max)
}

/// The part of the cross-validation that each reading belongs to: its cycle of pressing, or a fifth of the time.
pub fn parts(points: &[Point]) -> Vec<usize> {
    let largest = largest(points);
    let (mut up, mut cycle) = (false, 0);
    let cycles: Vec<_> = points
        .iter()
        .map(|point| {
            up |= point.force > UP * largest;
            if up && point.force < DOWN * largest {
                (up, cycle) = (false, cycle + 1);
            }
            cycle
        })
        .collect();
    if cycle + 1 >= 3 { cycles } else { (0..points.len()).map(|at| at * PARTS / points.len().max(1)).collect() }
}
