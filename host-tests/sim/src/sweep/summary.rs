//! Least, median and largest of every metric, point by point and over all.

use super::table::Table;
use crate::metrics::shown;
use std::collections::BTreeSet;
use std::fmt::Write as _;

/// Least, median and largest; none of nothing.
pub fn spread(mut values: Vec<f64>) -> Option<[f64; 3]> {
    values.sort_by(f64::total_cmp);
    let (low, high) = (*values.first()?, *values.last()?);
    let middle = values.len() / 2;
    let median = if values.len() % 2 == 1 { values[middle] } else { 0.5 * (values[middle - 1] + values[middle]) };
    Some([low, median, high])
}

/// The values of a column in rows.
pub fn values<'a>(rows: impl Iterator<Item = &'a Vec<String>>, column: usize) -> Vec<f64> {
    rows.filter_map(|row| row[column].parse().ok()).filter(|value: &f64| value.is_finite()).collect()
}

/// The points, in order: the varied keys' values, and their rows.
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

/// For people: the pass rate by point, and the spread of each metric over all runs.
pub fn text(table: &Table) -> String {
    let mut text = String::new();
    let keys = &table.head[table.varied()];
    if !keys.is_empty() {
        for (at, rows) in points(table) {
            let point: Vec<String> = keys.iter().zip(at).map(|(key, value)| format!("{key} = {value}")).collect();
            // Writing to a string does not fail.
            let _ = writeln!(
                text,
                "  {}: {} of {} runs passed",
                point.join(", "),
                table.passes(rows.iter().copied()),
                rows.len()
            );
        }
        text.push('\n');
    }
    let width = table.metrics().map(|column| table.head[column].len()).max().unwrap_or(0);
    let _ = writeln!(text, "  {:width$} {:>11} {:>11} {:>11}", "metric", "min", "median", "max");
    for column in table.metrics() {
        let name = &table.head[column];
        let Some(spread) = spread(values(table.rows.iter(), column)) else { continue };
        let [low, median, high] = spread.map(|value| shown(Some(value)));
        let side = |side: Option<f64>| side.map_or(String::new(), |side| side.to_string());
        let expected = table
            .expected(name)
            .map_or(String::new(), |[min, max]| format!("   expected {}..{}", side(min), side(max)));
        let _ = writeln!(text, "  {name:width$} {low:>11} {median:>11} {high:>11}{expected}");
    }
    let (passed, all) = (table.passes(table.rows.iter()), table.rows.len());
    let seeds: BTreeSet<&String> = table.rows.iter().map(|row| &row[table.varied().end]).collect();
    let _ = writeln!(text, "\n{passed} of {all} runs passed ({} seeds)", seeds.len());
    text
}
