//! Weights held still, one after the other.

use crate::table::{Refusal, Row, Table};

/// A hold with fewer readings,
const LEAST_READINGS: usize = 10;
/// or shorter than this, tells no creep, s.
const LEAST_S: f64 = 3.0;

/// A weight that was held still.
#[derive(Debug)]
pub struct Hold {
    /// The run that it belongs to.
    pub run: String,
    /// What was held.
    pub weight_kg: f64,
    /// Time since the weight was put there, s, and conductance, mS.
    pub readings: Vec<[f64; 2]>,
}

impl Hold {
    /// The holds of a file, those without a weight left out: how many were, comes beside them.
    ///
    /// # Errors
    /// Names the line that cannot be used.
    pub fn all(table: &Table) -> Result<(Vec<Self>, usize), Refusal> {
        let mut holds: Vec<(Self, u64)> = Vec::new();
        for row in &table.rows {
            let Row { of, numbers: [weight_kg, t_s, conductance], line } = row;
            if *weight_kg < 0.0 || *t_s < 0.0 {
                let why = "weight and time count from zero up: check the columns";
                return Err(table.refuse(*line, format_args!("a weight of {weight_kg} kg at {t_s} s: {why}")));
            }
            let reading = [*t_s, *conductance];
            match holds.last_mut().filter(|(hold, _)| hold.run == *of && hold.weight_kg == *weight_kg) {
                Some((hold, _)) if hold.readings.last().is_some_and(|[last, _]| t_s > last) => {
                    hold.readings.push(reading)
                }
                // The clock starts anew: the same weight was put there again.
                Some((hold, _)) if hold.readings.first().is_some_and(|[first, _]| t_s > first) => {
                    let last = hold.readings.last().map_or(0.0, |[last, _]| *last);
                    let why = "the rows of a hold must be in order of time: sort them by run, weight and time";
                    return Err(table.refuse(*line, format_args!("t_s of {t_s} after {last}: {why}")));
                }
                _ => holds.push((Self { run: of.clone(), weight_kg: *weight_kg, readings: vec![reading] }, *line)),
            }
        }
        let all = holds.len();
        holds.retain(|(hold, _)| hold.weight_kg > 0.0);
        let bare = all - holds.len();
        if holds.is_empty() {
            return Err(table.refuse(2, "no weight above zero is held: record holds under weights"));
        }
        for (hold, line) in &holds {
            hold.check()
                .map_err(|why| table.refuse(*line, format_args!("{} kg of {}: {why}", hold.weight_kg, hold.run)))?;
        }
        Ok((holds.into_iter().map(|(hold, _)| hold).collect(), bare))
    }

    fn check(&self) -> Result<(), String> {
        let (count, long) = (self.readings.len(), self.end()[0] - self.start()[0]);
        if count < LEAST_READINGS || long < LEAST_S {
            let why = "sort the rows by run, weight and time, and hold longer";
            return Err(format!("{count} readings in {long:.1} s, {LEAST_READINGS} in {LEAST_S} s are needed: {why}"));
        }
        if let Some([t_s, conductance]) = self.readings.iter().find(|[_, conductance]| *conductance <= 0.0) {
            let why = "a taxel under a weight conducts: check the columns";
            return Err(format!("a conductance of {conductance} mS at {t_s} s: {why}"));
        }
        Ok(())
    }

    /// The first reading.
    pub fn start(&self) -> [f64; 2] {
        self.readings.first().copied().unwrap_or_default()
    }

    /// The last reading.
    pub fn end(&self) -> [f64; 2] {
        self.readings.last().copied().unwrap_or_default()
    }

    /// By how much the last reading is above the first.
    pub fn drift(&self) -> f64 {
        self.end()[1] / self.start()[1] - 1.0
    }
}
