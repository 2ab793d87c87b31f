//! What the page's script draws, as JSON in the page; and the same read out of a page again, to lie over another run.

use super::plots::{Line, Plot, Style, all};
use super::states::Strip;
use super::trace::{Instant, Tracks};
use super::{Over, Report};
use crate::run::RunError;
use serde::Serialize;
use serde_json::{Map, Value, json};
use std::fs;
use std::path::Path;

/// Counts what a page's data are read by: another one is refused.
pub const FORMAT: u64 = 1;
/// What stands before the data in a page.
pub const BEGIN: &str = "<script type=\"application/json\" id=\"run\">";
const END: &str = "</script>";

#[derive(Serialize)]
struct Drawn {
    label: &'static str,
    style: Style,
    mean: Vec<Option<f64>>,
    #[serde(skip_serializing_if = "Vec::is_empty")]
    low: Vec<Option<f64>>,
    #[serde(skip_serializing_if = "Vec::is_empty")]
    high: Vec<Option<f64>>,
}

#[derive(Serialize)]
struct Shown {
    title: &'static str,
    unit: &'static str,
    about: String,
    #[serde(skip_serializing_if = "Option::is_none")]
    range: Option<[f64; 2]>,
    lines: Vec<Drawn>,
}

#[derive(Serialize)]
struct Maps {
    times_s: Vec<f64>,
    /// Tenths of kPa, row after row from row 0.
    true_dpa: Vec<Vec<i64>>,
    codes: Vec<Vec<i32>>,
}

#[derive(Serialize)]
struct Finger {
    times_s: Vec<f64>,
    plots: Vec<Shown>,
    strip: Strip,
    maps: Maps,
}

/// A report's data.
pub fn data(report: &Report) -> Value {
    let metrics: Map<String, Value> =
        report.outcome.measured.0.iter().map(|(name, value)| (name.clone(), json!(value))).collect();
    json!({
        "format": FORMAT,
        "scene": report.scene.name,
        "seed": report.scene.seed,
        "board": report.board,
        "digest": report.outcome.summary.digest,
        "metrics": metrics,
        "fingers": report.trace.fingers.iter().map(finger).collect::<Vec<_>>(),
    })
}

fn finger(tracks: &Tracks) -> Finger {
    Finger {
        times_s: tracks.time.means().into_iter().map(rounded).collect(),
        plots: all(tracks).into_iter().map(shown).collect(),
        strip: tracks.strip(),
        maps: maps(&tracks.instants),
    }
}

fn shown(Plot { title, unit, about, range, lines }: Plot) -> Shown {
    Shown { title, unit, about, range, lines: lines.iter().map(drawn).collect() }
}

fn drawn(Line { label, style, kept }: &Line) -> Drawn {
    let of =
        |value: fn(&super::trace::Kept) -> f64| kept.iter().map(|kept| kept.as_ref().map(value).map(rounded)).collect();
    let banded = *style == Style::Main && kept.iter().flatten().any(|kept| kept.low < kept.high);
    let band = |value| if banded { of(value) } else { Vec::new() };
    Drawn { label, style: *style, mean: of(|kept| kept.mean), low: band(|kept| kept.low), high: band(|kept| kept.high) }
}

fn maps(instants: &[Instant]) -> Maps {
    let tenths = |kpa: &f64| (10.0 * kpa).round() as i64;
    Maps {
        times_s: instants.iter().map(|instant| rounded(instant.time_s)).collect(),
        true_dpa: instants.iter().map(|at| at.true_kpa.iter().flatten().map(tenths).collect()).collect(),
        codes: instants.iter().map(|at| at.codes.iter().flatten().copied().collect()).collect(),
    }
}

/// To six digits that count: a plot shows no more.
fn rounded(value: f64) -> f64 {
    format!("{value:.5e}").parse().unwrap_or(value)
}

/// Data as they stand in a page: nothing in them can end the element, whatever a scene is called.
pub fn embedded(data: &Value) -> String {
    // In JSON this letter is only within strings.
    data.to_string().replace('<', "\\u003c")
}

impl Over {
    /// The run of another report.
    ///
    /// # Errors
    /// It cannot be read, or is no report that this version can lay over another.
    pub fn read(path: &Path) -> Result<Self, RunError> {
        let page = fs::read_to_string(path).map_err(|error| format!("cannot read {}: {error}", path.display()))?;
        Self::of(&page).map_err(|why| format!("{}: {why}", path.display()).into())
    }

    /// The run of a report's text.
    pub fn of(page: &str) -> Result<Self, String> {
        let again = "write it anew with `--out`";
        let (_, rest) = page.split_once(BEGIN).ok_or(format!("this is no report with a run in it; {again}"))?;
        let (data, _) = rest.split_once(END).ok_or(format!("the report is cut off; {again}"))?;
        let data: Value =
            serde_json::from_str(data).map_err(|error| format!("the report is damaged: {error}; {again}"))?;
        match data["format"].as_u64() {
            Some(FORMAT) => Ok(Self(data)),
            _ => Err(format!("its data are of format {}, {FORMAT} is asked for; {again}", data["format"])),
        }
    }
}
