//! Plots of a report, which its script draws, and the strip of modes, faults and limits.

use crate::metrics::shown;
use crate::report::trace::{Drawn, Kept, QUANTITIES, Row, Track, Tracks};
use maud::{Markup, html};
use serde::Serialize;

#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Style {
    /// Solid, with a pale band from the least to the largest value behind it.
    Main,
    /// Thin, in a second colour, on top.
    Second,
    Goal,
}

#[derive(Clone, Debug)]
pub struct Line {
    pub label: &'static str,
    pub style: Style,
    /// Values in each stretch of the time of the finger.
    pub kept: Vec<Option<Kept>>,
}

#[derive(Clone, Debug)]
pub struct Plot {
    /// Title. Plots of two runs with the same title are drawn over each other.
    pub title: &'static str,
    pub unit: &'static str,
    /// Description for the caption, and for readers who do not see the plot.
    pub about: String,
    /// Lower and upper end of the axis; none if all values are shown.
    pub range: Option<[f64; 2]>,
    /// Lines; the first is the main one.
    pub lines: Vec<Line>,
}

pub fn all(tracks: &Tracks) -> Vec<Plot> {
    let Tracks { goal, force, sensed, control_error, held_error, quantities, differences, .. } = tracks;
    let line = |label, style, track: &Track| Line { label, style, kept: track.along(&tracks.time) };
    // A goal is not averaged within a stretch: its last value counts.
    let mut goal_line = line("goal", Style::Goal, goal);
    goal_line.kept.iter_mut().flatten().for_each(|kept| kept.mean = kept.last);
    let one = |title, unit, track: &Track, smooth: bool| {
        let mut line = line(title, Style::Main, track);
        if smooth {
            line.kept.iter_mut().flatten().zip(track.smooth()).for_each(|(kept, mean)| kept.mean = mean);
        }
        let over = if smooth { " over a hundredth of the run" } else { "" };
        let about = format!("{title}: its mean{over} (solid), from the least to the largest (pale), in {unit}");
        Plot { title, unit, about, range: None, lines: vec![line] }
    };
    let mut control_error = one("True force less the goal", "mN", control_error, false);
    if held_error.ends().is_some() {
        control_error.about += "; the axis fits the holds, what is beyond it is cut off";
    }
    control_error.range = held_error.ends().map(|[low, high]| around(low.min(0.0), high.max(0.0)));
    let mut plots = vec![
        Plot {
            title: "Contact force",
            unit: "N",
            about: "True force (solid), sensed force (thin, on top), goal (dashed), in N".into(),
            range: None,
            lines: vec![line("true", Style::Main, force), goal_line, line("sensed", Style::Second, sensed)],
        },
        control_error,
    ];
    let others = [("True force less the native board's", "N"), ("Travel less the native board's", "mm")];
    let others = others.map(|(title, unit)| (title, unit, Drawn::IfItMoves)).into_iter().zip(differences);
    let own = QUANTITIES.map(|(title, unit, drawn, _)| (title, unit, drawn)).into_iter().zip(quantities);
    for ((title, unit, drawn), track) in own.chain(others) {
        if drawn != Drawn::IfItMoves || track.moves() {
            plots.push(one(title, unit, track, drawn == Drawn::Smooth));
        }
    }
    plots
}

pub fn around(low: f64, high: f64) -> [f64; 2] {
    if low > high {
        return [0.0, 1.0];
    }
    let near_zero = |value: f64| value.abs() < 2.0 * (high - low);
    let low = if low > 0.0 && near_zero(low) { 0.0 } else { low };
    let high = if high < 0.0 && near_zero(high) { 0.0 } else { high };
    let air = 0.06 * (high - low);
    // An axis narrower than the resolution of its numbers would have endless marks.
    let air = if air > 1e-9 * low.abs().max(high.abs()) { air } else { (0.1 * high.abs()).max(0.1) };
    [if low == 0.0 { 0.0 } else { low - air }, if high == 0.0 { air } else { high + air }]
}

/// Units of the whole width.
const WIDE: f64 = 1000.0;

/// Strip with a line of text and a bar for each mode, fault and limit that occurred.
pub fn strip(rows: &[Row], times: &[f64]) -> Markup {
    let end = times.last().copied().unwrap_or(0.0).max(1e-9);
    // A state of a stretch lasts until the next one.
    let place = |at: usize| times.get(at).map_or(WIDE, |time_s| if at == 0 { 0.0 } else { WIDE * time_s / end });
    html! {
        div.strip {
            @for Row { kind, name, spans } in rows {
                @let about = format!("{kind} {name}: {} times", spans.len());
                div.row {
                    span { (kind) ": " (name) }
                    @let all = format!("0 0 {WIDE} 10");
                    svg.(kind) viewBox=(all) preserveAspectRatio="none" role="img" aria-label=(about) {
                        @for [from, to] in spans {
                            rect x=(format!("{:.2}", place(*from))) y="0" height="10"
                                width=(format!("{:.2}", (place(*to) - place(*from)).max(1.0))) {}
                        }
                    }
                }
            }
            p.note { "From 0 to " (shown(times.last().copied())) " s." }
        }
    }
}
