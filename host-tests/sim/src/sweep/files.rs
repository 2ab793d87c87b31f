//! A sweep's files: `runs.csv` with a row for each run, `summary.csv`, and a plot for each metric that is bounded.
//!
//! A shard writes `runs-1-of-4.csv` alone; merging makes the rest. Each row says to which sweep it belongs and of how
//! many runs.

use super::table::{self, Table};
use super::{Plan, Shard};
use crate::metrics::METRICS;
use crate::part::{self, cannot_write};
use crate::run::RunError;
use crate::scene::Scene;
use csv::ReaderBuilder;
use output::kept::Lock;
use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};

/// Columns before the varied keys.
pub(super) const ID: &str = "sweep";
pub(super) const RUN: &str = "run";
pub(super) const RUNS: &str = "of_runs";
/// The first column after the varied keys; then the verdict, the digest, the metrics, and what is expected.
pub(super) const SEED: &str = "seed";
pub(super) const PASSED: &str = "passed";
pub(super) const DIGEST: &str = "digest";
pub(super) const EXPECT: &str = "expect ";

/// The head, and what stands at the beginning and the end of every row.
pub(super) struct Head {
    columns: Vec<String>,
    /// Of all that makes the sweep what it is; its folder's name where none is given.
    pub id: String,
    runs: usize,
    expected: Vec<String>,
}

/// What the plan's rows look like.
pub(super) fn head(plan: &Plan, scene: &Scene, runs: usize) -> Head {
    let mut columns: Vec<String> = [ID, RUN, RUNS].map(String::from).into();
    columns.extend(plan.vary.iter().map(|vary| vary.key.clone()));
    columns.extend([SEED, PASSED, DIGEST].map(String::from));
    columns.extend(METRICS.iter().map(|metric| metric.name.to_owned()));
    columns.extend(scene.bounds.iter().map(|bound| format!("{EXPECT}{}", bound.metric)));
    let side = |side: Option<f64>| side.map_or(String::new(), |side| side.to_string());
    let expected = scene.bounds.iter().map(|bound| format!("{}..{}", side(bound.min), side(bound.max))).collect();
    let said = format!("{} {:?} {}\n{}", env!("CARGO_PKG_VERSION"), plan.vary, plan.seeds, scene.text);
    Head { columns, id: format!("{}-{}", scene.name, part::check(&said)), runs, expected }
}

/// The rows so far, also on disk, so that a sweep that is stopped can go on.
pub(super) struct Rows {
    head: Head,
    rows: BTreeMap<usize, Vec<String>>,
    part: part::Part,
}

impl Rows {
    /// Takes up what an earlier try of the same sweep left.
    pub fn open(plan: &Plan, out: &Path, head: Head) -> Result<Self, RunError> {
        let file = out.join(runs_name(plan));
        let name = format!("the sweep {} of {} runs", head.id, head.runs);
        let (part, lines) = part::Part::open(&file, &name)?;
        refuse_others(&file, &head.id)?;
        let (mut rows, width) = (BTreeMap::new(), head.columns.len());
        for line in lines {
            let mut reader = ReaderBuilder::new().has_headers(false).from_reader(line.as_bytes());
            let row: Vec<String> = reader.deserialize().next().ok_or("an empty row")??;
            let number = row.get(1).and_then(|number| number.parse().ok());
            // Each line is whole; of another form it is of another version.
            let number = number.filter(|number| row.len() == width && (1..=head.runs).contains(number));
            let number =
                number.ok_or_else(|| format!("{}.part has a row of another form: remove it", file.display()))?;
            rows.insert(number, row);
        }
        Ok(Self { rows, part, head })
    }

    /// Whether a run is done; numbers count from 1.
    pub fn has(&self, number: usize) -> bool {
        self.rows.contains_key(&number)
    }

    /// How many are done.
    pub fn count(&self) -> usize {
        self.rows.len()
    }

    /// Takes a run in.
    pub fn add(&mut self, number: usize, values: Vec<String>) -> Result<(), RunError> {
        let Head { id, runs, expected, .. } = &self.head;
        let first = [id.clone(), number.to_string(), runs.to_string()];
        let row: Vec<String> = first.into_iter().chain(values).chain(expected.iter().cloned()).collect();
        let line = table::csv([&row])?;
        self.part.add(String::from_utf8(line)?.trim_end())?;
        self.rows.insert(number, row);
        Ok(())
    }

    /// Writes the files. The rows so far go last.
    pub fn finish(self, plan: &Plan, out: &Path) -> Result<Table, RunError> {
        let table = Table { head: self.head.columns, rows: self.rows.into_values().collect() };
        self.part.write(table.csv()?)?;
        if plan.shard.is_whole() {
            table.write_rest(out, self.part.lock())?;
        }
        self.part.done()?;
        Ok(table)
    }
}

fn runs_name(plan: &Plan) -> String {
    let Shard { number, of } = plan.shard;
    if plan.shard.is_whole() { "runs.csv".into() } else { format!("runs-{number}-of-{of}.csv") }
}

/// A file of runs may be replaced by those of the same sweep only.
fn refuse_others(file: &Path, id: &str) -> Result<(), RunError> {
    let Ok(bytes) = fs::read(file) else { return Ok(()) };
    let mut reader = ReaderBuilder::new().flexible(true).from_reader(&bytes[..]);
    let first = reader.records().next().and_then(Result::ok);
    match first.as_ref().and_then(|row| row.get(0)) {
        Some(found) if found == id => Ok(()),
        found => {
            let whose = found.map_or("something else".into(), |found| format!("the sweep {found}"));
            Err(format!("{} holds {whose}, not {id}: move it away, or name another folder with --out", file.display())
                .into())
        }
    }
}

/// Puts shards together.
///
/// # Errors
/// They are not of one sweep, a run is missing or there twice, or a file cannot be read or written.
pub fn merge(files: &[PathBuf], out: &Path) -> Result<Table, RunError> {
    let table = super::merge::table(files)?;
    fs::create_dir_all(out).map_err(|error| format!("cannot make {}: {error}", out.display()))?;
    let file = out.join("runs.csv");
    let lock = Lock::take(&file).map_err(|error| cannot_write(&file, &error))?;
    refuse_others(&file, &table.rows[0][0])?;
    lock.write(table.csv()?).map_err(|error| cannot_write(&file, &error))?;
    table.write_rest(out, &lock)?;
    Ok(table)
}
