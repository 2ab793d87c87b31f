//! A report's plots: what they show, and each as it is drawn where no script runs.

use super::trace::{Kept, Track, Tracks};
use output::plot::{Curve, Curves, PlotError, curves};
use serde::Serialize;

/// Width and height of a plot without a script: as wide as leaves its letters to be read on a phone.
const SIZE_PX: (u32, u32) = (400, 200);

/// How a line is drawn.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Style {
    /// Solid, with a pale band from the least to the largest value behind it.
    Main,
    /// Thin, in a second colour, on top.
    Second,
    /// Dashed.
    Goal,
}

/// A line of a plot.
#[derive(Clone, Debug)]
pub struct Line {
    /// What it is.
    pub label: &'static str,
    /// How it is drawn.
    pub style: Style,
    /// What it was in each stretch of the finger's time.
    pub kept: Vec<Option<Kept>>,
}

/// A plot.
#[derive(Clone, Debug)]
pub struct Plot {
    /// What it shows, in a word or two: two runs' plots of the same title lie over each other.
    pub title: &'static str,
    /// Of its values.
    pub unit: &'static str,
    /// What it shows, in a line: the caption, and the text for who does not see it.
    pub about: String,
    /// Lower and upper end of the axis; none where all values are to be seen.
    pub range: Option<[f64; 2]>,
    /// The lines; the first is the main one.
    pub lines: Vec<Line>,
}

/// All plots of a finger.
pub fn all(tracks: &Tracks) -> Vec<Plot> {
    let Tracks { goal, force, sensed, control_error, held_error, sensing_error, .. } = tracks;
    let Tracks { indentation, duty, current, supply, winding, slip, height, .. } = tracks;
    let Tracks { force_difference, travel_difference, .. } = tracks;
    let line = |label, style, track: &Track| Line { label, style, kept: track.along(&tracks.time) };
    // Within a stretch a goal has no mean: it is what was asked for last.
    let mut goal_line = line("goal", Style::Goal, goal);
    goal_line.kept.iter_mut().flatten().for_each(|kept| kept.mean = kept.last);
    let one = |title, unit, track| Plot {
        title,
        unit,
        about: format!("{title}: its mean (solid), from the least to the largest (pale), in {unit}"),
        range: None,
        lines: vec![line(title, Style::Main, track)],
    };
    let smooth = |title, unit, track: &Track| {
        let mut line = line(title, Style::Main, track);
        line.kept.iter_mut().flatten().zip(track.smooth()).for_each(|(kept, mean)| kept.mean = mean);
        let about = format!(
            "{title}: its mean over a hundredth of the run (solid), from the least to the largest (pale), in {unit}"
        );
        Plot { title, unit, about, range: None, lines: vec![line] }
    };
    let mut control_error = one("True force less the goal", "mN", control_error);
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
        one("Sensed less the true force", "mN", sensing_error),
        one("Indentation of the tip", "mm", indentation),
        smooth("Duty of the bridge", "%", duty),
        smooth("Current in the winding", "A", current),
    ];
    // What a scene does not move is not drawn.
    for (title, unit, track) in [
        ("Supply at the bridge", "V", supply),
        ("Temperature of the winding", "C", winding),
        ("Slip of the contact", "mm", slip),
        ("Height of the object", "mm", height),
        ("True force less the native board's", "N", force_difference),
        ("Travel less the native board's", "mm", travel_difference),
    ] {
        if track.moves() {
            plots.push(one(title, unit, track));
        }
    }
    plots
}

/// A plot without a script.
///
/// # Errors
/// It cannot be drawn.
pub fn drawn(plot: &Plot, times: &[f64]) -> Result<String, PlotError> {
    let mut lines: Vec<Curve> = plot.lines.iter().flat_map(|line| curves_of(line, times)).collect();
    let (x_range, all) = ranges(&mut lines);
    let y_range @ [low, high] = plot.range.unwrap_or(all);
    lines.iter_mut().flat_map(Curve::points_mut).for_each(|(_, y)| *y = y.clamp(low, high));
    let panel = Curves { title: plot.title.into(), x: "time, s", y: plot.unit, x_range, y_range, curves: lines };
    curves(&[panel], SIZE_PX)
}

fn curves_of(line: &Line, times: &[f64]) -> Vec<Curve> {
    let kept = || times.iter().zip(&line.kept).filter_map(|(time_s, kept)| Some((*time_s, (*kept)?)));
    let means = || kept().map(|(time_s, kept)| (time_s, kept.mean)).collect::<Vec<_>>();
    let band = || kept().flat_map(|(time_s, Kept { low, high, .. })| [(time_s, low), (time_s, high)]).collect();
    match line.style {
        Style::Main => vec![Curve::Pale(band()), Curve::Solid(means())],
        Style::Second => vec![Curve::Second(means())],
        Style::Goal => vec![Curve::Dashed(steps(&means()))],
    }
}

/// From 0 to the end, and around all values with a little air; 0 is in sight where it is not far.
fn ranges(lines: &mut [Curve]) -> ([f64; 2], [f64; 2]) {
    let points = lines.iter_mut().flat_map(Curve::points_mut);
    let (mut end, mut low, mut high) = (0.0_f64, f64::INFINITY, f64::NEG_INFINITY);
    for (x, y) in points {
        (end, low, high) = (end.max(*x), low.min(*y), high.max(*y));
    }
    ([0.0, if end > 0.0 { end } else { 1e-3 }], around(low, high))
}

/// An axis around values.
pub fn around(low: f64, high: f64) -> [f64; 2] {
    if low > high {
        return [0.0, 1.0];
    }
    let near_zero = |value: f64| value.abs() < 2.0 * (high - low);
    let low = if low > 0.0 && near_zero(low) { 0.0 } else { low };
    let high = if high < 0.0 && near_zero(high) { 0.0 } else { high };
    let air = 0.06 * (high - low);
    // Of less than its numbers can tell apart an axis would have marks without end.
    let air = if air > 1e-9 * low.abs().max(high.abs()) { air } else { (0.1 * high.abs()).max(0.1) };
    [if low == 0.0 { 0.0 } else { low - air }, if high == 0.0 { air } else { high + air }]
}

/// The corners of a line of steps.
fn steps(points: &[(f64, f64)]) -> Vec<(f64, f64)> {
    let corners = points.windows(2).flat_map(|pair| [pair[0], (pair[1].0, pair[0].1)]);
    corners.chain(points.last().copied()).collect()
}
