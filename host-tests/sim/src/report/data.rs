//! Data for the script of the page as JSON, and the data of another page, to be drawn over this run.

use crate::report::plots::{Line, Plot, Style, all};
use crate::report::trace::{Instant, Kept, Tracks};
use crate::report::{Over, Report};
use crate::run::RunError;
use serde_json::{Map, Value, json};
use std::fs;
use std::path::Path;

/// Version of the format of the data. Another version is refused.
pub const FORMAT: u64 = 1;
/// Text before the data in a page.
pub const BEGIN: &str = "<script type=\"application/json\" id=\"run\">";
const END: &str = "</script>";

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

fn finger(tracks: &Tracks) -> Value {
    json!({
        "times_s": tracks.time.means().into_iter().map(rounded).collect::<Vec<_>>(),
        "plots": all(tracks).iter().map(shown).collect::<Vec<_>>(),
        "strip": tracks.strip(),
        "maps": maps(&tracks.instants),
    })
}

fn shown(Plot { title, unit, about, range, lines }: &Plot) -> Value {
    let mut shown = json!({ "title": title, "unit": unit, "about": about });
    if range.is_some() {
        shown["range"] = json!(range);
    }
    shown["lines"] = lines.iter().map(drawn).collect();
    shown
}

fn drawn(Line { label, style, kept }: &Line) -> Value {
    let of = |value: fn(&Kept) -> f64| -> Value {
        kept.iter().map(|kept| json!(kept.as_ref().map(value).map(rounded))).collect()
    };
    let mut drawn = json!({ "label": label, "style": style, "mean": of(|kept| kept.mean) });
    if *style == Style::Main && kept.iter().flatten().any(|kept| kept.low < kept.high) {
        (drawn["low"], drawn["high"]) = (of(|kept| kept.low), of(|kept| kept.high));
    }
    drawn
}

/// Pressure maps in tenths of kPa, and codes, both row after row from row 0.
fn maps(instants: &[Instant]) -> Value {
    let tenths = |kpa: &f64| (10.0 * kpa).round() as i64;
    let true_dpa = instants.iter().map(|at| at.true_kpa.iter().flatten().map(tenths).collect::<Vec<_>>());
    json!({
        "times_s": instants.iter().map(|instant| rounded(instant.time_s)).collect::<Vec<_>>(),
        "true_dpa": true_dpa.collect::<Vec<_>>(),
        "codes": instants.iter().map(|at| at.codes.as_flattened()).collect::<Vec<_>>(),
    })
}

/// Rounds to six significant digits, as a plot shows no more.
fn rounded(value: f64) -> f64 {
    format!("{value:.5e}").parse().unwrap_or(value)
}

/// Data for a page. Nothing in them can end the element, whatever the name of the scene.
pub fn embedded(data: &Value) -> String {
    // JSON has this letter only within strings.
    data.to_string().replace('<', "\\u003c")
}

impl Over {
    /// Reads the run of another report.
    pub fn read(path: &Path) -> Result<Self, RunError> {
        let page = fs::read_to_string(path).map_err(|error| format!("cannot read {}: {error}", path.display()))?;
        Self::of(&page).map_err(|why| format!("{}: {why}", path.display()).into())
    }

    /// Reads the run from the text of a report.
    pub fn of(page: &str) -> Result<Self, String> {
        let again = "write it again with `--out`";
        let (_, rest) = page.split_once(BEGIN).ok_or(format!("this is no report with a run in it; {again}"))?;
        let (data, _) = rest.split_once(END).ok_or(format!("the report is cut off; {again}"))?;
        let data: Value =
            serde_json::from_str(data).map_err(|error| format!("the report is damaged: {error}; {again}"))?;
        match data["format"].as_u64() {
            Some(FORMAT) => Ok(Self(data)),
            _ => Err(format!("its data are of format {}, not {FORMAT}; {again}", data["format"])),
        }
    }
}
