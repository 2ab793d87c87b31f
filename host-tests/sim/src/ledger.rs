//! What each effect cost, and what it was worth.

use crate::metrics::{Measured, shown};
use crate::run::{Run, RunError, run};
use crate::scene::Scene;
use crate::watch::{Cost, Summary};
#[cfg(feature = "files")]
use serde_json::{Value, json};
use std::fmt::Write as _;

/// Evaluations, time and share of the run, an effect a line.
pub fn text(summary: &Summary) -> String {
    let mut text = format!("  {:24} {:>12} {:>10} {:>8}\n", "effect", "evaluations", "time, s", "share");
    for (effect, evaluations, seconds, percent) in rows(summary) {
        let evaluations = evaluations.map_or(String::new(), |count| count.to_string());
        // Writing to a string does not fail.
        let _ = writeln!(text, "  {effect:24} {evaluations:>12} {seconds:>10.4} {percent:>6.1} %");
    }
    text
}

/// By effect in the scene's order, all fingers and stages together.
pub fn by_effect(scene: &Scene, all: &[Cost]) -> Vec<Cost> {
    let of = |effect| {
        let mut sum = Cost { effect, evaluations: 0, seconds: 0.0 };
        for cost in all.iter().filter(|cost| cost.effect == effect) {
            sum.evaluations += cost.evaluations;
            sum.seconds += cost.seconds;
        }
        sum
    };
    scene.effects.iter().map(|named| of(named.effect.name)).collect()
}

/// An effect, how often it was called, its time and its share of the run in percent; last what is no effect.
pub fn rows(summary: &Summary) -> Vec<(&'static str, Option<u64>, f64, f64)> {
    let percent = |seconds: f64| if summary.wall_s > 0.0 { 100.0 * seconds / summary.wall_s } else { 0.0 };
    let effects = summary.ledger.iter();
    let effects = effects.map(|cost| (cost.effect, Some(cost.evaluations), cost.seconds, percent(cost.seconds)));
    let rest_s = (summary.wall_s - summary.ledger.iter().map(|cost| cost.seconds).sum::<f64>()).max(0.0);
    effects.chain([("everything else", None, rest_s, percent(rest_s))]).collect()
}

/// The same for scripts, without what is no effect.
#[cfg(feature = "files")]
pub fn json(summary: &Summary) -> Value {
    let row = |(effect, evaluations, wall_s, share_percent): (_, Option<u64>, _, _)| {
        Some(json!({ "effect": effect, "evaluations": evaluations?, "wall_s": wall_s, "share_percent": share_percent }))
    };
    rows(summary).into_iter().filter_map(row).collect()
}

/// What the metrics are without an effect.
#[derive(Clone, Debug)]
pub struct Without {
    /// The effect that was left out.
    pub effect: &'static str,
    /// The metrics then.
    pub measured: Measured,
}

/// Runs the scene once without each of its effects.
pub fn ablate(scene: &Scene, board: Run) -> Result<Vec<Without>, RunError> {
    let without = |left_out: usize| {
        let mut fewer = scene.clone();
        let effect = fewer.effects.remove(left_out).effect.name;
        let measured = run(&fewer, board, &mut []).map_err(|error| format!("without {effect}: {error}"))?.measured;
        Ok(Without { effect, measured })
    };
    (0..scene.effects.len()).map(without).collect()
}

/// A metric's name, its value with all effects, and with each left out.
pub type Difference<'a> = (&'a str, Option<f64>, Vec<Option<f64>>);

/// The metrics that any effect changes.
pub fn differences<'a>(whole: &'a Measured, ablated: &[Without]) -> Vec<Difference<'a>> {
    let rows = whole.0.iter().map(|(name, value)| {
        (name.as_str(), *value, ablated.iter().map(|without| without.measured.get(name)).collect::<Vec<_>>())
    });
    rows.filter(|(_, value, without)| without.iter().any(|other| other != value)).collect()
}

/// What each effect changes: a metric a line, an effect a column, the difference that the effect makes.
pub fn ablation_text(whole: &Measured, ablated: &[Without]) -> String {
    let rows = differences(whole, ablated);
    let width = rows.iter().map(|(name, ..)| name.len()).max().unwrap_or(0).max("metric".len());
    let columns: Vec<usize> = ablated.iter().map(|without| without.effect.len().max(10)).collect();
    let mut text = format!("  {:width$} {:>10}", "metric", "all");
    for (without, column) in ablated.iter().zip(&columns) {
        let _ = write!(text, "  {:>column$}", without.effect);
    }
    text.push('\n');
    for (name, value, others) in rows {
        let _ = write!(text, "  {name:width$} {:>10}", shown(value));
        for (other, column) in others.iter().zip(&columns) {
            let _ = write!(text, "  {:>column$}", difference(value, *other));
        }
        text.push('\n');
    }
    text
}

/// What an effect adds to a metric.
pub fn difference(with: Option<f64>, without: Option<f64>) -> String {
    match (with, without) {
        (Some(with), Some(without)) if with == without => "0".into(),
        (Some(with), Some(without)) => {
            let sign = if with > without { "+" } else { "" };
            format!("{sign}{}", shown(Some(with - without)))
        }
        (None, None) => "0".into(),
        (Some(_), None) => "none without".into(),
        (None, Some(_)) => "none with".into(),
    }
}
