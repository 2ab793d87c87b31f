//! Run as one page of HTML without other files or a network, light and dark, for a screen and a phone.

mod plots;
mod trace;

pub use crate::report::plots::around;
pub use crate::report::trace::{Instant, Kept, Trace, Track, Tracks};

use crate::metrics::{GROUPS, METRICS, Metric, Verdict, shown};
use crate::report::plots::{Line, Plot, Style};
use crate::report::trace::rows;
use crate::run::{Outcome, RunError, Without, asked, difference, differences, ledger_rows};
use crate::scene::Scene;
use maud::{DOCTYPE, Markup, PreEscaped, html};
use serde_json::{Value, json};
use std::fs;
use std::path::Path;

#[derive(Clone, Copy)]
pub struct Report<'a> {
    pub scene: &'a Scene,
    pub board: &'a str,
    pub outcome: &'a Outcome,
    pub trace: &'a Trace,
    pub ablated: &'a [Without],
    pub over: Option<&'a Over>,
}

/// Run of another report.
#[derive(Clone, Debug)]
pub struct Over(serde_json::Value);

/// Allows nothing that is not in the page.
const POLICY: &str = "default-src 'none'; style-src 'unsafe-inline'; script-src 'unsafe-inline'";
/// Library as published, with its licence.
const LIBRARY: &str = include_str!("report/uplot/uPlot.iife.min.js");
const LIBRARY_STYLE: &str = include_str!("report/uplot/uPlot.min.css");
const LICENSE: &str = include_str!("report/uplot/LICENSE");
const SCRIPTS: [&str; 5] = [
    include_str!("report/script/view.js"),
    include_str!("report/script/plots.js"),
    include_str!("report/script/maps.js"),
    include_str!("report/script/over.js"),
    include_str!("report/script/main.js"),
];

pub fn page(report: &Report) -> String {
    let Report { scene, board, outcome, trace, over, .. } = report;
    let summary = &outcome.summary;
    let page = html! {
        (DOCTYPE)
        html lang="en" {
            head {
                meta charset="utf-8";
                meta http-equiv="Content-Security-Policy" content=(POLICY);
                meta name="viewport" content="width=device-width, initial-scale=1";
                title { (scene.name) ": simulated run" }
                style { (PreEscaped(LIBRARY_STYLE)) (PreEscaped(include_str!("report/style.css"))) }
            }
            body {
                header {
                    h1 { (scene.about) }
                    p.note {
                        "Scene " code { (scene.name) } ", seed " (scene.seed) ", board " (board)
                        @for set in &scene.set { ", " code { (set) } }
                        ". "
                        strong { "Simulated: nothing here was measured on hardware." }
                    }
                    p { (verdict_line(&outcome.verdicts)) }
                }
                main {
                    section id="bounds" { h2 { "What must hold" } (bounds(&outcome.verdicts)) }
                    section id="plots" {
                        h2 { "Over time" }
                        (player())
                        noscript { p.note { "Plots and pressure maps need a script, which this page contains." } }
                        @for (number, tracks) in trace.fingers.iter().enumerate() {
                            (finger(number, tracks, trace.fingers.len() > 1))
                        }
                    }
                    section id="metrics" { h2 { "Metrics" } (metrics(report)) }
                    section id="ledger" {
                        h2 { "What each effect cost" }
                        (ledger(report))
                        p.note {
                            (shown(Some(summary.virtual_s))) " s simulated in " (shown(Some(summary.wall_s)))
                            " s, behind " (shown(Some(summary.set_up_s))) " s to power up and tare. Digest "
                            code { (summary.digest) }
                        }
                    }
                    @if !report.ablated.is_empty() {
                        section id="ablation" { h2 { "What each effect changes" } (ablation(report)) }
                    }
                    section id="scene" { h2 { "The scene" } pre tabindex="0" { code { (scene.text) } } }
                }
                (PreEscaped(BEGIN)) (PreEscaped(embedded(&data(report)))) (PreEscaped("</script>"))
                @if let Some(over) = over {
                    script type="application/json" id="over" { (PreEscaped(embedded(&over.0))) }
                }
                script { (PreEscaped(format!("/*\n{LICENSE}*/\n{LIBRARY}"))) }
                script { (PreEscaped(format!("(() => {{\n'use strict';\n{}}})();\n", SCRIPTS.concat()))) }
            }
        }
    };
    page.into_string()
}

/// Controls of the script. The page has none without it.
fn player() -> Markup {
    html! {
        div id="player" hidden {
            div.controls {
                button id="play" type="button" { "Play" }
                input id="time" type="range" min="0" max="1000" value="0" step="1" aria-label="Time";
                output id="now" for="time" {}
                button id="whole" type="button" disabled { "Whole run" }
            }
        }
        div id="choose" hidden {
            p.note {
                "Drag across a plot to zoom all of them, double-click for the whole run. "
                "A play takes ten seconds, however long what is shown is."
            }
            p {
                label for="other" { "Lay the run of another report over this one: " }
                input id="other" type="file" accept=".html,text/html";
                button id="alone" type="button" hidden { "Take it away" }
            }
            p id="over-note" role="status" {}
        }
    }
}

fn verdict_line(verdicts: &[Verdict]) -> Markup {
    let broken = verdicts.iter().filter(|verdict| !verdict.held).count();
    html! {
        @match (broken, verdicts.len()) {
            (_, 0) => span { "The scene asks for nothing." },
            (0, 1) => span.held { "The bound is held." },
            (0, all) => span.held { "All " (all) " bounds are held." },
            (broken, all) => span.broken { (broken) " of " (all) " bounds broken." },
        }
    }
}

/// Lists the broken bounds, then the held ones, which are folded if a bound is broken.
fn bounds(verdicts: &[Verdict]) -> Markup {
    let (held, broken): (Vec<_>, Vec<_>) = verdicts.iter().partition(|verdict| verdict.held);
    html! {
        @if verdicts.is_empty() { p { "Nothing: the scene has no bounds." } }
        @if !broken.is_empty() { (table_of_bounds(&broken)) }
        @if !held.is_empty() {
            details open[broken.is_empty()] {
                summary { (held.len()) " held" }
                (table_of_bounds(&held))
            }
        }
    }
}

fn table_of_bounds(verdicts: &[&Verdict]) -> Markup {
    html! {
        div.scroll tabindex="0" { table {
            thead { tr {
                th scope="col" { "metric" } th scope="col" { "asked" }
                th.number scope="col" { "measured" } th scope="col" { "" }
            } }
            tbody { @for verdict in verdicts { tr {
                td { code { (verdict.metric) } }
                td.asked { (asked(verdict.min, verdict.max)) }
                td.number { (shown(verdict.value)) }
                td { @if verdict.held { span.held { "held" } } @else { span.broken { "broken" } } }
            } } }
        } }
    }
}

/// The places in which the script draws the plots and the array, and the strip.
fn finger(number: usize, tracks: &Tracks, several: bool) -> Markup {
    html! {
        div.finger data-finger=(number) {
            @if several { h3 { "Finger " (number) } }
            div.plots {
                @for Plot { title, about, .. } in plots::all(tracks) {
                    figure.plot data-title=(title) { figcaption { (about) } }
                }
                figure.plot data-title="strip" {
                    h3 { "Mode, faults and limits" }
                    (plots::strip(&rows(&tracks.states), &tracks.time.means()))
                    figcaption { "What occurred, however short, is as wide as a nine-hundredth of the run." }
                }
            }
            div.array {}
        }
    }
}

/// Lists the metrics by group. Groups with a broken bound are first and open.
fn metrics(report: &Report) -> Markup {
    let verdicts = &report.outcome.verdicts;
    html! {
        @for (title, metrics, broken) in groups(verdicts) {
            details.group open[broken > 0] {
                summary {
                    (title)
                    @if broken > 0 { " " span.broken { (broken) " broken" } }
                }
                (table_of(report, &metrics))
            }
        }
    }
}

fn table_of(report: &Report, metrics: &[&Metric]) -> Markup {
    let measured = &report.outcome.measured;
    let fingers = report.trace.fingers.len();
    let columns = if fingers > 1 { 0..fingers } else { 0..0 };
    let is_broken = |name: &str| report.outcome.verdicts.iter().any(|verdict| verdict.metric == name && !verdict.held);
    let value = |name: &str| {
        html! {
            @if is_broken(name) { span.broken { (shown(measured.get(name))) } } @else { (shown(measured.get(name))) }
        }
    };
    html! {
        div.scroll tabindex="0" { table.metrics[columns.is_empty()] {
            thead { tr {
                th scope="col" { "metric" } th.number scope="col" { "value" }
                @for finger in columns.clone() { th.number scope="col" { "finger " (finger) } }
                th.about scope="col" { "what it is" }
            } }
            tbody { @for metric in metrics { tr data-metric=(metric.name) {
                td { code { (metric.name) } }
                td.number { (value(metric.name)) }
                @for finger in columns.clone() {
                    td.number { (value(&format!("finger{finger}.{}", metric.name))) }
                }
                td.about { (metric.about) }
            } } }
        } }
    }
}

fn ledger(report: &Report) -> Markup {
    html! {
        div.scroll tabindex="0" { table {
            thead { tr {
                th scope="col" { "effect" } th.number scope="col" { "evaluations" }
                th.number scope="col" { "time, s" } th.number scope="col" { "share, %" }
            } }
            tbody { @for (effect, evaluations, seconds, percent) in ledger_rows(&report.outcome.summary) { tr {
                td { (effect) }
                td.number { @if let Some(evaluations) = evaluations { (evaluations) } }
                td.number { (format!("{seconds:.4}")) }
                td.number { (format!("{percent:.1}")) }
            } } }
        } }
    }
}

fn ablation(report: &Report) -> Markup {
    html! {
        p.note { "What each effect adds to a metric: the run as it is, less a run without the effect." }
        div.scroll tabindex="0" { table {
            thead { tr {
                th scope="col" { "metric" } th.number scope="col" { "all effects" }
                @for without in report.ablated { th.number scope="col" { (without.effect) } }
            } }
            tbody { @for (name, value, others) in differences(&report.outcome.measured, report.ablated) { tr {
                td { code { (name) } }
                td.number { (shown(value)) }
                @for other in others { td.number { (difference(value, other)) } }
            } } }
        } }
    }
}

/// Title of a group, its metrics, and number of its broken bounds.
type Group = (&'static str, Vec<&'static Metric>, usize);

/// Returns all metrics. Groups with a broken bound are first.
fn groups(verdicts: &[Verdict]) -> [Group; GROUPS.len()] {
    // A verdict may name the metric of one finger.
    let is_of = |verdict: &Verdict, metric: &Metric| verdict.metric.rsplit('.').next() == Some(metric.name);
    let group = |title| {
        let metrics: Vec<&Metric> = METRICS.iter().filter(|metric| metric.group == title).collect();
        let is_broken = |verdict: &&Verdict| !verdict.held && metrics.iter().any(|metric| is_of(verdict, metric));
        let broken = verdicts.iter().filter(is_broken).count();
        (title, metrics, broken)
    };
    let mut groups = GROUPS.map(group);
    groups.sort_by_key(|(.., broken)| *broken == 0);
    groups
}

/// Version of the format of the data. Another version is refused.
pub const FORMAT: u64 = 1;
/// Text before the data in a page.
pub const BEGIN: &str = "<script type=\"application/json\" id=\"run\">";
const END: &str = "</script>";

pub fn data(report: &Report) -> Value {
    json!({
        "format": FORMAT,
        "scene": report.scene.name,
        "seed": report.scene.seed,
        "board": report.board,
        "digest": report.outcome.summary.digest,
        "metrics": report.outcome.measured.json(),
        "fingers": report.trace.fingers.iter().map(finger_data).collect::<Vec<_>>(),
    })
}

fn finger_data(tracks: &Tracks) -> Value {
    json!({
        "times_s": tracks.time.means().into_iter().map(rounded).collect::<Vec<_>>(),
        "plots": plots::all(tracks).iter().map(plot_data).collect::<Vec<_>>(),
        "strip": rows(&tracks.states),
        "maps": maps_data(&tracks.instants),
    })
}

fn plot_data(Plot { title, unit, about, range, lines }: &Plot) -> Value {
    let mut data = json!({ "title": title, "unit": unit, "about": about });
    if range.is_some() {
        data["range"] = json!(range);
    }
    data["lines"] = lines.iter().map(line_data).collect();
    data
}

fn line_data(Line { label, style, kept }: &Line) -> Value {
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
fn maps_data(instants: &[Instant]) -> Value {
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
    pub fn read(path: &Path) -> Result<Self, RunError> {
        let page = fs::read_to_string(path).map_err(|error| format!("cannot read {}: {error}", path.display()))?;
        Self::of(&page).map_err(|why| format!("{}: {why}", path.display()).into())
    }

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
