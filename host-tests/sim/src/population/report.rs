//! What became of a population: every finger's draws and verdicts, and what they come to.

use super::draw::Spread;
use super::{Counted, Finger, Population};
use crate::metrics::Hold;
use crate::part::{cannot_write, check};
use crate::run::{Outcome, RunError};
use crate::sweep::first_missing;
use output::kept;
use serde::{Deserialize, Serialize};
use serde_json::{Map, Value, json};
use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};

/// All fingers of a population or of a shard, in order.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Report {
    /// The population's name.
    pub population: String,
    /// What it is.
    pub about: String,
    /// Always true.
    pub simulated: bool,
    /// On which board.
    pub board: String,
    /// Of the draws.
    pub seed: u64,
    /// How many fingers the whole has.
    pub of_fingers: usize,
    /// Of the population's text, the seed and the number of fingers: shards of one whole have the same.
    pub id: String,
    /// What is counted beside the envelope.
    pub counted: Vec<Counted>,
    /// What they come to, for scripts.
    pub summary: Value,
    /// Each finger.
    pub fingers: Vec<Ran>,
}

/// A finger that was run.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Ran {
    /// Its number, from 1.
    pub finger: usize,
    /// Of its scene.
    pub seed: u64,
    /// Whether it kept all promises.
    pub inside: bool,
    /// What was drawn.
    pub drawn: Map<String, Value>,
    /// What it promised, and what became of it.
    pub promises: Vec<Promise>,
    /// The forces that it held.
    pub holds: Vec<Hold>,
    /// All metrics; null where the run has none.
    pub metrics: Map<String, Value>,
    /// Of its run.
    pub digest: String,
}

/// A promise of the envelope.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Promise {
    /// What it is about.
    pub metric: String,
    /// What was measured: of a metric that has a value for each goal, that which is worst against what is allowed.
    pub value: Option<f64>,
    /// The least that is allowed.
    pub min: Option<f64>,
    /// The largest that is allowed.
    pub max: Option<f64>,
    /// Whether it is kept.
    pub held: bool,
}

impl Promise {
    /// Distance beyond the bound as a share of the bound, negative within it; -1 for a count that is 0 as it must be.
    pub fn excess(&self) -> f64 {
        let Some(value) = self.value else { return if self.held { -1.0 } else { f64::INFINITY } };
        let sides = [self.max.map(|max| value - max), self.min.map(|min| min - value)];
        let over = sides.into_iter().flatten().fold(f64::NEG_INFINITY, f64::max);
        match self.max.or(self.min).map_or(0.0, f64::abs) {
            allowed if allowed > 0.0 => over / allowed,
            _ if self.held => -1.0,
            _ => over,
        }
    }
}

impl Ran {
    /// What became of a finger.
    pub fn new(number: usize, finger: &Finger, outcome: &Outcome) -> Self {
        let promises = outcome.verdicts.iter().map(|verdict| Promise {
            metric: verdict.bound.metric.clone(),
            value: verdict.value,
            min: verdict.bound.min,
            max: verdict.max,
            held: verdict.held,
        });
        Self {
            finger: number + 1,
            seed: finger.scene.seed,
            inside: outcome.passed(),
            drawn: finger.drawn.iter().map(|(name, value)| (name.clone(), json!(value))).collect(),
            promises: promises.collect(),
            holds: outcome.holds.clone(),
            metrics: outcome.measured.0.iter().map(|(name, value)| (name.clone(), json!(value))).collect(),
            digest: outcome.summary.digest.clone(),
        }
    }

    /// The promises that it broke.
    pub fn broken(&self) -> impl Iterator<Item = &Promise> {
        self.promises.iter().filter(|promise| !promise.held)
    }

    /// The promise that is broken by most, or, where none is, nearest to its bound.
    pub fn nearest(&self) -> Option<&Promise> {
        self.promises.iter().max_by(|a, b| a.excess().total_cmp(&b.excess()))
    }

    /// A metric; none where the run has none.
    pub fn metric(&self, name: &str) -> Option<f64> {
        self.metrics.get(name)?.as_f64()
    }
}

/// Of all that makes a population's fingers what they are.
pub(super) fn id(population: &Population, board: &str, seed: u64, of_fingers: usize) -> String {
    let said = format!("{} {board} {seed} {of_fingers}\n{}", env!("CARGO_PKG_VERSION"), population.text);
    format!("{}-{}", population.name, check(&said))
}

impl Report {
    /// Of these fingers, in any order.
    pub fn new(population: &Population, board: &str, seed: u64, of_fingers: usize, fingers: Vec<Ran>) -> Self {
        let id = id(population, board, seed, of_fingers);
        let mut report = Self {
            population: population.name.clone(),
            about: population.about.clone(),
            simulated: true,
            board: board.into(),
            seed,
            of_fingers,
            id,
            counted: population.counted.clone(),
            summary: Value::Null,
            fingers,
        };
        report.finish();
        report
    }

    /// Shards put together: the same, byte for byte, as the whole.
    ///
    /// # Errors
    /// They are not of one population, a finger is missing or there twice, or a file cannot be read.
    pub fn merge(files: &[PathBuf]) -> Result<Self, RunError> {
        let mut whole: Option<Self> = None;
        let mut fingers = BTreeMap::new();
        for file in files {
            let name = file.display();
            let text = fs::read_to_string(file).map_err(|error| format!("cannot read {name}: {error}"))?;
            let shard: Self =
                serde_json::from_str(&text).map_err(|error| format!("{name} is no population's JSON: {error}"))?;
            let known = whole.get_or_insert_with(|| shard.clone());
            if known.id != shard.id {
                return Err(format!("{name} is of the population {} and not of {}", shard.id, known.id).into());
            }
            for finger in shard.fingers {
                let number = finger.finger;
                if fingers.insert(number, finger).is_some() {
                    return Err(format!("finger {number} is there twice: in {name} again").into());
                }
            }
        }
        let mut whole = whole.ok_or("there are no files to put together")?;
        let all = whole.of_fingers;
        if let Some(number) = fingers.keys().find(|number| !(1..=all).contains(*number)) {
            return Err(format!("there is a finger {number}, where there are {all} in all").into());
        }
        if let Some(first) = first_missing(fingers.keys(), all) {
            let missing = all - fingers.len();
            return Err(format!(
                "{missing} of {all} fingers are missing, finger {first} the first: is a shard missing?"
            )
            .into());
        }
        whole.fingers = fingers.into_values().collect();
        whole.finish();
        Ok(whole)
    }

    fn finish(&mut self) {
        self.fingers.sort_by_key(|ran| ran.finger);
        let promises: Vec<Value> = self.promises().iter().map(Row::json).collect();
        let [percent, mn] = self.errors().map(|spread| spread.json());
        let counted = self.counted().map(
            |(Counted { metric, above }, fingers)| json!({ "metric": metric, "above": above, "fingers": fingers }),
        );
        self.summary = json!({
            "fingers": self.fingers.len(),
            "inside": self.inside(),
            "promises": promises,
            "hold_error_percent": percent,
            "hold_error_mn": mn,
            "counted": counted.collect::<Vec<_>>(),
        });
    }

    /// How many kept all promises.
    pub fn inside(&self) -> usize {
        self.fingers.iter().filter(|ran| ran.inside).count()
    }

    /// What is counted beside the envelope, and of how many fingers it is so.
    pub fn counted(&self) -> impl Iterator<Item = (&Counted, usize)> {
        self.counted.iter().map(|counted| {
            let above = |ran: &&Ran| ran.metric(&counted.metric) > Some(counted.above);
            (counted, self.fingers.iter().filter(above).count())
        })
    }

    /// Each promise over all fingers.
    pub fn promises(&self) -> Vec<Row> {
        let of = |place: usize| self.fingers.iter().filter_map(move |ran| ran.promises.get(place));
        let names =
            self.fingers.first().map_or(Vec::new(), |ran| ran.promises.iter().map(|p| p.metric.clone()).collect());
        let row = |(place, metric): (usize, String)| Row {
            metric,
            broken: of(place).filter(|promise| !promise.held).count(),
            spread: Spread::of(of(place).filter_map(|promise| promise.value).collect()),
        };
        names.into_iter().enumerate().map(row).collect()
    }

    /// What the true force is off the goal in holds, in percent of it and in mN; where something was touched, and no
    /// fault came before.
    pub fn errors(&self) -> [Spread; 2] {
        let holds = || self.fingers.iter().flat_map(|ran| &ran.holds).filter(|hold| !hold.faulty && !hold.missed);
        let off_n = |hold: &Hold| (hold.mean_n - hold.goal_n).abs();
        let percent = holds().map(|hold| 100.0 * off_n(hold) / hold.goal_n).collect();
        [Spread::of(percent), Spread::of(holds().map(|hold| 1e3 * off_n(hold)).collect())]
    }

    /// All fingers, the worst first: those that broke a promise, then those nearest to a bound.
    pub fn worst(&self) -> Vec<&Ran> {
        let excess = |ran: &Ran| ran.nearest().map_or(-1.0, Promise::excess);
        let mut fingers: Vec<&Ran> = self.fingers.iter().collect();
        fingers.sort_by(|a, b| excess(b).total_cmp(&excess(a)).then(a.finger.cmp(&b.finger)));
        fingers
    }

    /// For scripts.
    pub fn json(&self) -> Result<String, RunError> {
        Ok(serde_json::to_string_pretty(self)? + "\n")
    }

    /// Writes it for scripts.
    ///
    /// # Errors
    /// The file cannot be written; what was there before still is.
    pub fn write(&self, path: &Path) -> Result<(), RunError> {
        Ok(kept::write(path, self.json()?).map_err(|error| cannot_write(path, &error))?)
    }
}

/// A promise over all fingers.
#[derive(Clone, Debug)]
pub struct Row {
    /// What it is about.
    pub metric: String,
    /// Fingers that broke it.
    pub broken: usize,
    /// The values.
    pub spread: Spread,
}

impl Row {
    fn json(&self) -> Value {
        let Value::Object(mut row) = self.spread.json() else { return Value::Null };
        row.insert("metric".into(), json!(self.metric));
        row.insert("broken".into(), json!(self.broken));
        Value::Object(row)
    }
}
