//! The page's parts.

use super::{Report, Tracks, plots};
use crate::ledger::{difference, differences, rows};
use crate::metrics::{METRICS, Verdict, shown};
use crate::run::{RunError, asked};
use host_tests::heatmap::Pressures;
use host_tests::plot::PlotError;
use maud::{DOCTYPE, Markup, PreEscaped, html};

/// The page.
///
/// # Errors
/// A plot cannot be drawn.
pub fn page(report: &Report) -> Result<String, RunError> {
    let Report { scene, board, outcome, trace, .. } = report;
    let summary = &outcome.summary;
    let fingers: Result<Vec<Markup>, PlotError> =
        trace.fingers.iter().enumerate().map(|(n, tracks)| finger(n, tracks, trace.fingers.len() > 1)).collect();
    let page = html! {
        (DOCTYPE)
        html lang="en" {
            head {
                meta charset="utf-8";
                meta name="viewport" content="width=device-width, initial-scale=1";
                title { (scene.name) ": simulated run" }
                style { (PreEscaped(include_str!("style.css"))) }
            }
            body {
                header {
                    h1 { (scene.about) }
                    p.note {
                        "Scene " code { (scene.name) } ", seed " (scene.seed) ", board " (board) ". "
                        strong { "Simulated: nothing here was measured on hardware." }
                    }
                    p { (verdict_line(&outcome.verdicts)) }
                }
                main {
                    section id="bounds" { h2 { "What must hold" } (bounds(&outcome.verdicts)) }
                    section id="plots" { h2 { "Over time" } @for finger in fingers? { (finger) } }
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
            }
        }
    };
    Ok(page.into_string())
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

fn bounds(verdicts: &[Verdict]) -> Markup {
    html! {
        @if verdicts.is_empty() { p { "Nothing: the scene has no bounds." } }
        @else {
            div.scroll tabindex="0" { table {
                thead { tr { th scope="col" { "metric" } th scope="col" { "asked" } th.number scope="col" { "measured" } th scope="col" { "" } } }
                tbody { @for verdict in verdicts { tr {
                    td { code { (verdict.bound.metric) } }
                    td.asked { (asked(verdict.bound.min, verdict.max)) }
                    td.number { (shown(verdict.value)) }
                    td { @if verdict.held { span.held { "held" } } @else { span.broken { "broken" } } }
                } } }
            } }
        }
    }
}

fn finger(number: usize, tracks: &Tracks, several: bool) -> Result<Markup, PlotError> {
    let plots = plots::all(tracks)?;
    let full_kpa = tracks.maps.iter().flat_map(|(_, map)| map.iter().flatten()).copied().fold(1.0, f64::max);
    Ok(html! {
        @if several { h3 { "Finger " (number) } }
        @for plot in &plots {
            figure.plot {
                @for (svg, class) in plot.svgs.iter().zip(["wide", "narrow"]) {
                    div class=(class) role="img" aria-label=(plot.about) { (PreEscaped(svg)) }
                }
                figcaption { (plot.about) }
            }
        }
        h3 { "Pressure on the array" }
        p.note { "True mean pressure on each taxel; full colour is " (format!("{full_kpa:.1}")) " kPa." }
        div.maps { @for (time_s, map) in &tracks.maps { (pressures(*time_s, map, full_kpa)) } }
    })
}

fn pressures(time_s: f64, map: &Pressures, full_kpa: f64) -> Markup {
    let peak = format!("{:.1}", map.iter().flatten().copied().fold(0.0, f64::max));
    let time = shown(Some((time_s * 1e3).round() / 1e3));
    let about = format!("Pressure map at {time} s, at most {peak} kPa");
    // The last row on top, as everywhere.
    let cells =
        map.iter().rev().enumerate().flat_map(|(y, row)| row.iter().enumerate().map(move |(x, kpa)| (x, y, kpa)));
    html! {
        figure {
            svg viewBox="0 0 10 10" role="img" aria-label=(about) shape-rendering="crispEdges" {
                @for (x, y, kpa) in cells.filter(|(.., kpa)| **kpa > 0.0) {
                    rect x=(x) y=(y) width="1" height="1" fill-opacity=(format!("{:.3}", kpa / full_kpa)) {}
                }
            }
            figcaption { (time) " s, " (peak) " kPa" }
        }
    }
}

fn metrics(report: &Report) -> Markup {
    let measured = &report.outcome.measured;
    let fingers = report.trace.fingers.len();
    let columns = if fingers > 1 { 0..fingers } else { 0..0 };
    html! {
        div.scroll tabindex="0" { table.metrics[columns.is_empty()] {
            thead { tr {
                th scope="col" { "metric" } th.number scope="col" { "value" }
                @for finger in columns.clone() { th.number scope="col" { "finger " (finger) } }
                th scope="col" { "what it is" }
            } }
            tbody { @for metric in METRICS { tr {
                td { code { (metric.name) } }
                td.number { (shown(measured.get(metric.name))) }
                @for finger in columns.clone() {
                    td.number { (shown(measured.get(&format!("finger{finger}.{}", metric.name)))) }
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
            tbody { @for (effect, evaluations, seconds, percent) in rows(&report.outcome.summary) { tr {
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
