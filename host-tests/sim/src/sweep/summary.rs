//! Least, median and largest value of every metric, point by point and over all points.

use crate::metrics::shown;
use crate::part::cannot_write;
use crate::report::around;
use crate::run::RunError;
use crate::sweep::{DIGEST, EXPECT, PASSED, SEED};
use csv::Writer;
use output::kept::Lock;
use output::plot::{Curve, Curves, PlotError, curves};
use output::units::label;
use std::collections::BTreeSet;
use std::fmt::Write as _;
use std::path::Path;

/// Least, median and largest value; none without values.
pub fn spread(mut values: Vec<f64>) -> Option<[f64; 3]> {
    values.sort_by(f64::total_cmp);
    let (low, high) = (*values.first()?, *values.last()?);
    let middle = values.len() / 2;
    let median = if values.len() % 2 == 1 { values[middle] } else { 0.5 * (values[middle - 1] + values[middle]) };
    Some([low, median, high])
}

pub fn values<'a>(rows: impl Iterator<Item = &'a Vec<String>>, column: usize) -> Vec<f64> {
    rows.filter_map(|row| row[column].parse().ok()).filter(|value: &f64| value.is_finite()).collect()
}

/// Points in order: values of the varied keys, and rows.
pub fn points(table: &Table) -> Vec<(&[String], Vec<&Vec<String>>)> {
    let mut points: Vec<(&[String], Vec<&Vec<String>>)> = Vec::new();
    for row in &table.rows {
        let at = &row[table.varied()];
        match points.last_mut() {
            Some((last, rows)) if *last == at => rows.push(row),
            _ => points.push((at, vec![row])),
        }
    }
    points
}

/// `summary.csv`: a row for each point and metric.
pub fn rows(table: &Table) -> Vec<Vec<String>> {
    let keys = &table.head[table.varied()];
    let named = ["metric", "runs", "passed_percent", "with_value", "min", "median", "max"].map(String::from);
    let mut lines = vec![keys.iter().cloned().chain(named).collect::<Vec<_>>()];
    for (at, rows) in points(table) {
        let passed = 100.0 * table.passes(rows.iter().copied()) as f64 / rows.len() as f64;
        for column in table.metrics() {
            let values = values(rows.iter().copied(), column);
            let count = values.len();
            let spread =
                spread(values).map_or([const { String::new() }; 3], |spread| spread.map(|value| value.to_string()));
            let counts = [rows.len().to_string(), passed.to_string(), count.to_string()];
            let line = at.iter().chain([&table.head[column]]).cloned().chain(counts).chain(spread);
            lines.push(line.collect());
        }
    }
    lines
}

#[derive(Clone, Debug, PartialEq)]
pub struct Table {
    pub head: Vec<String>,
    pub rows: Vec<Vec<String>>,
}

pub(super) fn csv<'a>(rows: impl IntoIterator<Item = &'a Vec<String>>) -> Result<Vec<u8>, RunError> {
    let mut writer = Writer::from_writer(Vec::new());
    rows.into_iter().try_for_each(|row| writer.write_record(row))?;
    Ok(writer.into_inner()?)
}

impl Table {
    /// Contents of `runs.csv`, or of the file of a shard.
    pub(super) fn csv(&self) -> Result<Vec<u8>, RunError> {
        csv(std::iter::once(&self.head).chain(&self.rows))
    }

    /// Writes `summary.csv` and the pictures under the lock of `runs.csv`.
    pub(super) fn write_rest(&self, out: &Path, lock: &Lock) -> Result<(), RunError> {
        let write = |name: &str, bytes: &[u8]| {
            let path = out.join(name);
            lock.write_with(&path, bytes).map_err(|error| cannot_write(&path, &error))
        };
        write("summary.csv", &csv(&rows(self))?)?;
        all(self)?.iter().try_for_each(|(metric, svg)| write(&format!("{metric}.svg"), svg.as_bytes()))?;
        Ok(())
    }

    /// Text for people: pass rate by point, and spread of each metric over all runs.
    pub fn text(&self) -> String {
        let mut text = String::new();
        let keys = &self.head[self.varied()];
        if !keys.is_empty() {
            for (at, rows) in points(self) {
                let point: Vec<String> = keys.iter().zip(at).map(|(key, value)| format!("{key} = {value}")).collect();
                let (point, passed, all) = (point.join(", "), self.passes(rows.iter().copied()), rows.len());
                let _ = writeln!(text, "  {point}: {passed} of {all} runs passed");
            }
            text.push('\n');
        }
        let width = self.metrics().map(|column| self.head[column].len()).max().unwrap_or(0);
        let _ = writeln!(text, "  {:width$} {:>11} {:>11} {:>11}", "metric", "min", "median", "max");
        for column in self.metrics() {
            let name = &self.head[column];
            let Some(spread) = spread(values(self.rows.iter(), column)) else { continue };
            let [low, median, high] = spread.map(|value| shown(Some(value)));
            let expected = self.expected(name).map_or(String::new(), |bounds| format!("   expected {bounds}"));
            let _ = writeln!(text, "  {name:width$} {low:>11} {median:>11} {high:>11}{expected}");
        }
        let (passed, all) = (self.passes(self.rows.iter()), self.rows.len());
        let seeds: BTreeSet<&String> = self.rows.iter().map(|row| &row[self.varied().end]).collect();
        let _ = writeln!(text, "\n{passed} of {all} runs passed ({} seeds)", seeds.len());
        text
    }

    pub fn passed(&self) -> bool {
        self.passes(self.rows.iter()) == self.rows.len()
    }

    pub(super) fn place(&self, column: &str) -> usize {
        self.head.iter().position(|name| name == column).unwrap_or(0)
    }

    pub(super) fn varied(&self) -> core::ops::Range<usize> {
        3..self.place(SEED)
    }

    pub(super) fn metrics(&self) -> core::ops::Range<usize> {
        let end = self.head.iter().position(|name| name.starts_with(EXPECT)).unwrap_or(self.head.len());
        self.place(DIGEST) + 1..end
    }

    /// Bounds of a metric as a row has them: `0.5..`.
    pub(super) fn expected(&self, metric: &str) -> Option<&str> {
        let place = self.head.iter().position(|name| name.strip_prefix(EXPECT) == Some(metric))?;
        Some(&self.rows.first()?[place])
    }

    /// Number of these rows that stayed within their bounds.
    pub(super) fn passes<'a>(&self, rows: impl Iterator<Item = &'a Vec<String>>) -> usize {
        let passed = self.place(PASSED);
        rows.filter(|row| row[passed] == "1").count()
    }
}

const PANEL_PX: (u32, u32) = (560, 340);
/// Most runs that are drawn each. Beyond them only the least, the median and the largest value are drawn.
const DRAWN: usize = 2_000;

/// Draws a picture for each bounded metric, or for each that varies if none is bounded.
pub fn all(table: &Table) -> Result<Vec<(String, String)>, PlotError> {
    let bounded = table.metrics().any(|column| table.expected(&table.head[column]).is_some());
    let mut pictures = Vec::new();
    for column in table.metrics() {
        let name = &table.head[column];
        let Some([low, _, high]) = spread(values(table.rows.iter(), column)) else { continue };
        if if bounded { table.expected(name).is_some() } else { low < high } {
            let varied = table.varied();
            let (x, y) = (|key: usize| label(&table.head[key]), label(name));
            let labels: Vec<String> = varied.clone().map(x).collect();
            let panels: Vec<Curves> = match varied.is_empty() {
                true => vec![spread_over_seeds(table, column, &y)],
                false => varied.zip(&labels).map(|(key, x)| over(table, (key, x), (column, &y))).collect(),
            };
            pictures.push((name.clone(), curves(&panels, PANEL_PX)?));
        }
    }
    Ok(pictures)
}

/// Draws a metric over a varied key: runs as circles, medians as a line, least and largest values pale, bounds dashed.
fn over<'a>(table: &Table, (key, x): (usize, &'a str), (column, y): (usize, &'a str)) -> Curves<'a> {
    let number = |text: &String| text.parse::<f64>().unwrap_or(0.0);
    let at = |row: &Vec<String>| number(&row[key]);
    let mut places: Vec<f64> =
        points(table).iter().map(|(values, _)| number(&values[key - table.varied().start])).collect();
    places.sort_by(f64::total_cmp);
    places.dedup();
    let of = |x: f64| spread(values(table.rows.iter().filter(|row| at(row) == x), column)).map(|spread| (x, spread));
    let spreads: Vec<(f64, [f64; 3])> = places.iter().copied().filter_map(of).collect();
    let line = |which: usize| spreads.iter().map(|(x, spread)| (*x, spread[which])).collect::<Vec<_>>();
    let [left, right] = around_all(&places);
    let bounds = bounds(table, column).into_iter().map(|bound| Curve::Dashed(vec![(left, bound), (right, bound)]));
    let mut curves: Vec<Curve> =
        bounds.chain([Curve::Pale(line(0)), Curve::Pale(line(2)), Curve::Solid(line(1))]).collect();
    if table.rows.len() <= DRAWN {
        let runs = table.rows.iter().filter_map(|row| Some((at(row), row[column].parse().ok()?)));
        curves.push(Curve::Circles(runs.collect()));
    }
    let mut heights: Vec<f64> = spreads.iter().flat_map(|(_, spread)| *spread).collect();
    heights.extend(self::bounds(table, column));
    Curves {
        title: "Runs (circles), median (solid), least and largest (pale), bounds (dashed)".into(),
        x,
        y,
        x_range: [left, right],
        y_range: around_all(&heights),
        curves,
    }
}

/// Draws the share of the runs at or below each value.
fn spread_over_seeds<'a>(table: &Table, column: usize, x: &'a str) -> Curves<'a> {
    let mut values = values(table.rows.iter(), column);
    values.sort_by(f64::total_cmp);
    let share = |rank: usize| 100.0 * rank as f64 / table.rows.len() as f64;
    let steps = values.iter().enumerate().flat_map(|(rank, value)| [(*value, share(rank)), (*value, share(rank + 1))]);
    let steps = Curve::Solid(steps.collect());
    let bounds = bounds(table, column);
    let upright = bounds.iter().map(|bound| Curve::Dashed(vec![(*bound, 0.0), (*bound, 100.0)]));
    let [left, right] = around_all(&[values, bounds.clone()].concat());
    Curves {
        title: "Share of the runs at or below a value, bounds (dashed)".into(),
        x,
        y: "share of the runs, %",
        x_range: [left, right],
        y_range: [0.0, 104.0],
        curves: upright.chain([steps]).collect(),
    }
}

fn bounds(table: &Table, column: usize) -> Vec<f64> {
    let sides = table.expected(&table.head[column]).into_iter().flat_map(|bounds| bounds.split(".."));
    sides.filter_map(|side| side.parse().ok()).collect()
}

fn around_all(values: &[f64]) -> [f64; 2] {
    let fold = |of: fn(f64, f64) -> f64, start| values.iter().copied().fold(start, of);
    around(fold(f64::min, f64::INFINITY), fold(f64::max, f64::NEG_INFINITY))
}
