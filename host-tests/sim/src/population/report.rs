//! Report of a population: draws and results of every finger, and their summary.

use super::draw::Spread;
use super::{Counted, Finger, Population};
use crate::metrics::{Hold, Verdict, shown};
use crate::part::check;
use crate::run::{Outcome, RunError, asked};
use crate::shards::complete;
use serde::{Deserialize, Serialize};
use serde_json::{Map, Value, json};
use std::collections::BTreeMap;
use std::fmt::Write as _;
use std::fs;
use std::path::PathBuf;

/// All fingers of a population or of a shard, in order.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Report {
    pub population: String,
    pub about: String,
    /// Always true.
    pub simulated: bool,
    pub board: String,
    pub seed: u64,
    /// Number of fingers of the whole.
    pub of_fingers: usize,
    /// Digest of the text of the population, the seed and the number of fingers: the same for all shards of a whole.
    pub id: String,
    /// Additional counts, not part of the envelope.
    pub counted: Vec<Counted>,
    pub summary: Value,
    pub fingers: Vec<Ran>,
}

#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Ran {
    /// Number of the finger, from 1.
    pub finger: usize,
    pub seed: u64,
    pub inside: bool,
    pub drawn: Map<String, Value>,
    pub promises: Vec<Verdict>,
    pub holds: Vec<Hold>,
    /// All metrics; null if the run has none.
    pub metrics: Map<String, Value>,
    pub digest: String,
}

impl Ran {
    pub fn new(number: usize, finger: &Finger, outcome: &Outcome) -> Self {
        Self {
            finger: number,
            seed: finger.scene.seed,
            inside: outcome.passed(),
            drawn: finger.drawn.iter().map(|(name, value)| (name.clone(), json!(value))).collect(),
            promises: outcome.verdicts.clone(),
            holds: outcome.holds.clone(),
            metrics: outcome.measured.json(),
            digest: outcome.summary.digest.clone(),
        }
    }

    pub fn broken(&self) -> impl Iterator<Item = &Verdict> {
        self.promises.iter().filter(|promise| !promise.held)
    }

    /// Promise that is broken by most, or else the nearest to its bound.
    pub fn nearest(&self) -> Option<&Verdict> {
        self.promises.iter().max_by(|a, b| a.excess().total_cmp(&b.excess()))
    }

    pub fn metric(&self, name: &str) -> Option<f64> {
        self.metrics.get(name)?.as_f64()
    }
}

/// Digest of everything that determines the fingers of a population.
pub(super) fn id(population: &Population, board: &str, seed: u64, of_fingers: usize) -> String {
    let said = format!("{} {board} {seed} {of_fingers}\n{}", env!("CARGO_PKG_VERSION"), population.text);
    format!("{}-{}", population.name, check(&said))
}

impl Report {
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

    /// Merges shards. The result is the same, byte for byte, as that of the whole.
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
        whole.fingers = complete(fingers, all, "finger")?;
        whole.finish();
        Ok(whole)
    }

    fn finish(&mut self) {
        let [percent, mn] = self.errors();
        let counted = self.counted().map(
            |(Counted { metric, above }, fingers)| json!({ "metric": metric, "above": above, "fingers": fingers }),
        );
        self.summary = json!({
            "fingers": self.fingers.len(),
            "inside": self.inside(),
            "promises": self.promises(),
            "hold_error_percent": percent,
            "hold_error_mn": mn,
            "counted": counted.collect::<Vec<_>>(),
        });
    }

    pub fn inside(&self) -> usize {
        self.fingers.iter().filter(|ran| ran.inside).count()
    }

    pub fn counted(&self) -> impl Iterator<Item = (&Counted, usize)> {
        self.counted.iter().map(|counted| {
            let above = |ran: &&Ran| ran.metric(&counted.metric) > Some(counted.above);
            (counted, self.fingers.iter().filter(above).count())
        })
    }

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

    /// Errors of the true force in holds, in percent of it and in mN, where something was touched before any fault.
    pub fn errors(&self) -> [Spread; 2] {
        let holds = || self.fingers.iter().flat_map(|ran| &ran.holds).filter(|hold| !hold.faulty && !hold.missed);
        let off_n = |hold: &Hold| (hold.mean_n - hold.goal_n).abs();
        let percent = holds().map(|hold| 100.0 * off_n(hold) / hold.goal_n).collect();
        [Spread::of(percent), Spread::of(holds().map(|hold| 1e3 * off_n(hold)).collect())]
    }

    /// All fingers, the worst first: those that broke a promise, then those nearest to a bound.
    pub fn worst(&self) -> Vec<&Ran> {
        let excess = |ran: &Ran| ran.nearest().map_or(-1.0, Verdict::excess);
        let mut fingers: Vec<&Ran> = self.fingers.iter().collect();
        fingers.sort_by(|a, b| excess(b).total_cmp(&excess(a)).then(a.finger.cmp(&b.finger)));
        fingers
    }

    pub fn json(&self) -> Result<String, RunError> {
        Ok(serde_json::to_string_pretty(self)? + "\n")
    }
}

#[derive(Clone, Debug, Serialize)]
pub struct Row {
    #[serde(flatten)]
    pub spread: Spread,
    pub metric: String,
    pub broken: usize,
}

/// Most fingers that are listed.
const NAMED: usize = 30;

/// Returns the table of promises, the errors of the force, and the fingers that broke promises.
pub fn text(report: &Report) -> String {
    let Report { population, board, seed, of_fingers, fingers, .. } = report;
    let count = fingers.len();
    let percent = |part: usize| 100.0 * part as f64 / count.max(1) as f64;
    let mut text = format!("{population}: {}\n", report.about);
    let _ = writeln!(text, "{count} of {of_fingers} fingers, seed {seed}, board {board}; simulated\n");
    let promises = report.promises();
    let width = promises.iter().map(|row| row.metric.len()).max().unwrap_or(0);
    let _ = writeln!(
        text,
        "  {:width$} {:>8} {:>8} {:>10} {:>10} {:>10}",
        "promise", "broken", "%", "median", "95 %", "worst"
    );
    for row in &promises {
        let [median, most, worst] = values(&row.spread);
        let (broken, share) = (row.broken, percent(row.broken));
        let _ = writeln!(text, "  {:width$} {broken:>8} {share:>8.1} {median:>10} {most:>10} {worst:>10}", row.metric);
    }
    for (Counted { metric, above }, fingers) in report.counted() {
        let _ = writeln!(text, "  {metric} above {above}: {fingers} fingers ({:.1} %)", percent(fingers));
    }
    let [of_goal, mn] = report.errors();
    let _ = writeln!(text, "\n  true force off the goal in {} holds that touched: median, 95 %, worst", of_goal.count);
    for (spread, unit) in [(of_goal, "% of the goal"), (mn, "mN")] {
        let _ = writeln!(text, "  {} {unit}", values(&spread).join(", "));
    }
    let worst: Vec<&Ran> = report.worst().into_iter().filter(|ran| !ran.inside).collect();
    if !worst.is_empty() {
        text += "\n  outside, the worst first:\n";
    }
    worst.iter().take(NAMED).for_each(|ran| text += &format!("  {}\n", judged(ran)));
    if worst.len() > NAMED {
        let _ = writeln!(text, "  and {} more: --json FILE has them all", worst.len() - NAMED);
    }
    let inside = report.inside();
    let _ = writeln!(text, "\n{inside} of {count} fingers inside the envelope ({:.1} %)", percent(inside));
    text
}

/// Describes a finger in one line: the promises that it broke, else the promise with the smallest margin.
pub fn judged(ran: &Ran) -> String {
    let promise = |Verdict { metric, value, min, max, .. }: &Verdict| {
        format!("{metric} {} ({})", shown(*value), asked(*min, *max))
    };
    let about = match ran.nearest().filter(|_| ran.inside) {
        Some(nearest) => format!("broke no promise, nearest to its bound is {}", promise(nearest)),
        None => ran.broken().map(promise).collect::<Vec<_>>().join("; "),
    };
    format!("finger {}: {about}", ran.finger)
}

fn values(spread: &Spread) -> [String; 3] {
    [spread.median, spread.most, spread.worst].map(shown)
}
