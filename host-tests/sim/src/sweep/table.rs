//! A sweep's table: a row for each run, and all that is made of it.

use super::files::{DIGEST, EXPECT, PASSED, SEED};
use super::{plots, summary};
use crate::part::cannot_write;
use crate::run::RunError;
use csv::Writer;
use output::kept::Lock;
use std::path::Path;

/// All rows of a sweep or of a shard, in order.
#[derive(Clone, Debug, PartialEq)]
pub struct Table {
    /// The columns' names.
    pub head: Vec<String>,
    /// A row for each run.
    pub rows: Vec<Vec<String>>,
}

/// Rows as CSV.
pub(super) fn csv<'a>(rows: impl IntoIterator<Item = &'a Vec<String>>) -> Result<Vec<u8>, RunError> {
    let mut writer = Writer::from_writer(Vec::new());
    rows.into_iter().try_for_each(|row| writer.write_record(row))?;
    Ok(writer.into_inner()?)
}

impl Table {
    /// `runs.csv`, or a shard's.
    pub(super) fn csv(&self) -> Result<Vec<u8>, RunError> {
        csv(std::iter::once(&self.head).chain(&self.rows))
    }

    /// Writes what is made of all runs: `summary.csv` and the pictures, under the lock of `runs.csv`.
    pub(super) fn write_rest(&self, out: &Path, lock: &Lock) -> Result<(), RunError> {
        let write = |name: &str, bytes: &[u8]| {
            let path = out.join(name);
            lock.write_with(&path, bytes).map_err(|error| cannot_write(&path, &error))
        };
        write("summary.csv", &csv(&summary::rows(self))?)?;
        plots::all(self)?.iter().try_for_each(|(metric, svg)| write(&format!("{metric}.svg"), svg.as_bytes()))?;
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
