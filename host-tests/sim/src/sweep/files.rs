//! A sweep's files: `runs.csv` with a row for each run, `summary.csv`, and a plot for each metric that is bounded.
//!
//! A shard writes `runs-1-of-4.csv` alone; merging makes the rest. Each row says to which sweep it belongs and of how many runs.

use super::{Plan, Shard, plots, summary};
use crate::metrics::METRICS;
use crate::run::RunError;
use crate::scene::Scene;
use csv::{Reader, StringRecord, Writer};
use std::collections::BTreeMap;
use std::fs::{self, File, OpenOptions};
use std::path::{Path, PathBuf};

/// Columns before the varied keys.
const ID: &str = "sweep";
const RUN: &str = "run";
const RUNS: &str = "of_runs";
/// The first column after the varied keys; then the verdict, the digest, the metrics, and what is expected.
const SEED: &str = "seed";
const PASSED: &str = "passed";
const DIGEST: &str = "digest";
const EXPECT: &str = "expect ";

/// All rows of a sweep or of a shard, in order.
#[derive(Clone, Debug, PartialEq)]
pub struct Table {
    /// The columns' names.
    pub head: Vec<String>,
    /// A row for each run.
    pub rows: Vec<Vec<String>>,
}

/// The head, and what stands at the beginning and the end of every row.
pub(super) struct Head {
    columns: Vec<String>,
    id: String,
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
    let crc = crc::Crc::<u64>::new(&crc::CRC_64_XZ);
    let said = format!("{} {:?} {}\n{}", env!("CARGO_PKG_VERSION"), plan.vary, plan.seeds, scene.text);
    Head { columns, id: format!("{}-{:016x}", scene.name, crc.checksum(said.as_bytes())), runs, expected }
}

/// The rows so far, also on disk, so that a sweep that is stopped can go on.
pub(super) struct Part {
    head: Head,
    path: PathBuf,
    rows: BTreeMap<usize, Vec<String>>,
    out: Writer<File>,
}

impl Part {
    /// Takes up what an earlier try of the same sweep left.
    pub fn open(plan: &Plan, head: Head) -> Result<Self, RunError> {
        fs::create_dir_all(&plan.out).map_err(|error| format!("cannot make {}: {error}", plan.out.display()))?;
        let path = plan.out.join(format!("{}.part", runs_name(plan)));
        let mut rows = BTreeMap::new();
        if let Ok(mut reader) = Reader::from_path(&path)
            && reader.headers().is_ok_and(|found| found == head.columns)
        {
            // The last row may be cut off: it is run again.
            for row in reader.records().map_while(Result::ok).filter(|row| row.get(0) == Some(&head.id)) {
                let number = row.get(1).and_then(|number| number.parse().ok());
                rows.extend(number.map(|number: usize| (number, words(&row))));
            }
        }
        let file = OpenOptions::new().create(true).write(true).truncate(true).open(&path);
        let file = file.map_err(|error| format!("cannot write {}: {error}", path.display()))?;
        let mut part = Self { path, rows, out: Writer::from_writer(file), head };
        part.out.write_record(&part.head.columns)?;
        for row in part.rows.values() {
            part.out.write_record(row)?;
        }
        part.out.flush()?;
        Ok(part)
    }

    /// Whether a run is done; numbers count from 1.
    pub fn has(&self, number: usize) -> bool {
        self.rows.contains_key(&number)
    }

    /// How many are done.
    pub fn rows(&self) -> usize {
        self.rows.len()
    }

    /// Takes a run in.
    pub fn add(&mut self, number: usize, values: Vec<String>) -> Result<(), RunError> {
        let Head { id, runs, expected, .. } = &self.head;
        let first = [id.clone(), number.to_string(), runs.to_string()];
        let row: Vec<String> = first.into_iter().chain(values).chain(expected.iter().cloned()).collect();
        self.out.write_record(&row)?;
        self.out.flush()?;
        self.rows.insert(number, row);
        Ok(())
    }

    /// Writes the files.
    pub fn finish(self, plan: &Plan) -> Result<Table, RunError> {
        let table = Table { head: self.head.columns, rows: self.rows.into_values().collect() };
        if plan.shard.is_whole() {
            table.write(&plan.out)?;
        } else {
            table.write_runs(&plan.out.join(runs_name(plan)))?;
        }
        drop(self.out);
        fs::remove_file(&self.path)?;
        Ok(table)
    }
}

fn runs_name(plan: &Plan) -> String {
    let Shard { number, of } = plan.shard;
    if plan.shard.is_whole() { "runs.csv".into() } else { format!("runs-{number}-of-{of}.csv") }
}

fn words(row: &StringRecord) -> Vec<String> {
    row.iter().map(str::to_owned).collect()
}

/// Puts shards together.
///
/// # Errors
/// They are not of one sweep, a run is missing or there twice, or a file cannot be read or written.
pub fn merge(files: &[PathBuf], out: &Path) -> Result<Table, RunError> {
    let mut head: Option<Vec<String>> = None;
    let mut rows = BTreeMap::new();
    let mut sweep: Option<[String; 2]> = None;
    for file in files {
        let name = file.display();
        let mut reader = Reader::from_path(file).map_err(|error| format!("cannot read {name}: {error}"))?;
        let found = words(reader.headers().map_err(|error| format!("{name}: {error}"))?);
        if *head.get_or_insert_with(|| found.clone()) != found || found.first().is_none_or(|first| first != ID) {
            return Err(format!("{name} is no shard of the same sweep: its columns are others").into());
        }
        for row in reader.records() {
            let row = words(&row.map_err(|error| format!("{name}: {error}"))?);
            let of = [row[0].clone(), row[2].clone()];
            let known = sweep.get_or_insert_with(|| of.clone());
            if *known != of {
                return Err(format!("{name} is of the sweep {} and not of {}", of[0], known[0]).into());
            }
            let number: usize = row[1].parse().map_err(|_| format!("{name}: `{}` is no run's number", row[1]))?;
            if rows.insert(number, row).is_some() {
                return Err(format!("run {number} is there twice: in {name} again").into());
            }
        }
    }
    let all: usize = sweep.ok_or("there are no runs in these files")?[1].parse()?;
    let missing: Vec<usize> = (1..=all).filter(|number| !rows.contains_key(number)).collect();
    if let Some(first) = missing.first() {
        return Err(
            format!("{} of {all} runs are missing, run {first} the first: is a shard missing?", missing.len()).into()
        );
    }
    let table = Table { head: head.unwrap_or_default(), rows: rows.into_values().collect() };
    fs::create_dir_all(out).map_err(|error| format!("cannot make {}: {error}", out.display()))?;
    table.write(out)?;
    Ok(table)
}

impl Table {
    fn write_runs(&self, path: &Path) -> Result<(), RunError> {
        let mut writer =
            Writer::from_path(path).map_err(|error| format!("cannot write {}: {error}", path.display()))?;
        writer.write_record(&self.head)?;
        self.rows.iter().try_for_each(|row| writer.write_record(row))?;
        Ok(writer.flush()?)
    }

    fn write(&self, out: &Path) -> Result<(), RunError> {
        self.write_runs(&out.join("runs.csv"))?;
        let mut writer = Writer::from_path(out.join("summary.csv"))?;
        summary::rows(self).iter().try_for_each(|row| writer.write_record(row))?;
        writer.flush()?;
        for (metric, svg) in plots::all(self)? {
            fs::write(out.join(format!("{metric}.svg")), svg)?;
        }
        Ok(())
    }

    /// For people.
    pub fn text(&self) -> String {
        summary::text(self)
    }

    /// Whether every run held its bounds.
    pub fn passed(&self) -> bool {
        let passed = self.place(PASSED);
        self.rows.iter().all(|row| row[passed] == "1")
    }

    pub(super) fn place(&self, column: &str) -> usize {
        self.head.iter().position(|name| name == column).unwrap_or(0)
    }

    /// The varied keys' columns.
    pub(super) fn varied(&self) -> core::ops::Range<usize> {
        3..self.place(SEED)
    }

    /// The metrics' columns.
    pub(super) fn metrics(&self) -> core::ops::Range<usize> {
        let end = self.head.iter().position(|name| name.starts_with(EXPECT)).unwrap_or(self.head.len());
        self.place(DIGEST) + 1..end
    }

    /// The least and the largest that is expected of a metric.
    pub(super) fn expected(&self, metric: &str) -> Option<[Option<f64>; 2]> {
        let place = self.head.iter().position(|name| name.strip_prefix(EXPECT) == Some(metric))?;
        let (min, max) = self.rows.first()?[place].split_once("..")?;
        Some([min.parse().ok(), max.parse().ok()])
    }

    /// How many of these rows held their bounds.
    pub(super) fn passes<'a>(&self, rows: impl Iterator<Item = &'a Vec<String>>) -> usize {
        let passed = self.place(PASSED);
        rows.filter(|row| row[passed] == "1").count()
    }
}
