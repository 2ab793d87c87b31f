//! Charts over time: the whole run, and each change of the goal at a larger scale.

use super::{Area, Curve, Curves, FINE, FONT, LABEL_PX, PlotError, fine_picture};
use plotters::prelude::*;
use plotters::style::text_anchor::{HPos, Pos, VPos};

/// Points that a line has at most: two for each pixel of the widest chart.
const POINTS_MAX: usize = 1_800;
const WIDTH_PX: u32 = 900;
/// Narrow, so that the letters can be read on a phone.
const STEPS_WIDTH_PX: u32 = 640;
const SMOOTH_S: f64 = 0.01;

/// The world and the controller at one instant.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Sample {
    pub time_s: f64,
    pub goal_n: f64,
    pub true_force_n: f64,
    pub travel_mm: f64,
    pub indentation_mm: f64,
    /// Share of the supply at the motor, -1 to 1; positive presses.
    pub duty: f64,
}

/// A stretch of the run to look at more closely.
#[derive(Clone, Debug)]
pub struct Panel<'a> {
    pub title: String,
    /// Those of the time that is shown.
    pub samples: &'a [Sample],
    /// The instant that counts as 0.
    pub zero_s: f64,
    /// Time before and after it that is shown.
    pub shown_ms: [f64; 2],
    /// Least time that the motor needs, if known.
    pub time_optimal_ms: Option<f64>,
}

/// Force against goal, indentation and duty over the whole run.
pub fn overview(trace: &[Sample]) -> Result<String, PlotError> {
    let end_s = trace.last().ok_or("cannot draw: the trace is empty")?.time_s;
    let points = |value: fn(&Sample) -> f64| thinned(trace.iter().map(|s| (s.time_s, value(s))).collect());
    let (force, goal) = (points(|s| s.true_force_n), steps_of(trace, |s| (s.time_s, s.goal_n)));
    let top_n = top(force.iter().chain(&goal).map(|(_, n)| *n));
    let indentation = points(|s| s.indentation_mm);
    let top_mm = top(indentation.iter().map(|(_, mm)| *mm));
    let duty = points(|s| 100.0 * s.duty);
    let mean = thinned(smoothed(trace.iter().map(|s| (s.time_s, 100.0 * s.duty)).collect()));
    let panel = |title: &str, y, y_range, curves| Curves {
        title: title.into(),
        x: "time, s",
        y,
        x_range: [0.0, end_s],
        y_range,
        curves,
    };
    let panels = [
        panel(
            "Contact force (solid) and goal (dashed)",
            "N",
            [0.0, top_n],
            vec![Curve::Dashed(goal), Curve::Solid(force)],
        ),
        panel("Indentation of the fingertip", "mm", [0.0, top_mm], vec![Curve::Solid(indentation)]),
        panel(
            "Duty of the bridge: as it was (pale) and its mean of 10 ms",
            "%",
            [-100.0, 100.0],
            vec![Curve::Pale(duty), Curve::Solid(mean)],
        ),
    ];
    fine_picture((WIDTH_PX, 640), |area| {
        panels.iter().zip(area.split_evenly((3, 1))).try_for_each(|(panel, area)| panel.draw(&area))
    })
}

/// Each change of the goal at a larger scale, two panels side by side.
pub fn steps(panels: &[Panel<'_>]) -> Result<String, PlotError> {
    if panels.iter().any(|panel| panel.samples.is_empty()) {
        return Err("cannot draw: a panel has no samples".into());
    }
    let rows = panels.len() / 2 + 1;
    fine_picture((STEPS_WIDTH_PX, 230 * rows as u32), |area| {
        let mut areas = area.split_evenly((rows, 2)).into_iter();
        for (panel, area) in panels.iter().zip(&mut areas) {
            draw_panel(panel, &area)?;
        }
        areas.next().map_or(Ok(()), |area| draw_key(&area))
    })
}

/// Legend of the panels' lines.
fn draw_key(area: &Area<'_>) -> Result<(), PlotError> {
    let chart = ChartBuilder::on(area).margin(20 * FINE).build_cartesian_2d(0.0..1.0, 0.0..6.0);
    let mut chart = chart?;
    for curve in [
        Curve::Solid(vec![(0.08, 5.0), (0.22, 5.0)]),
        Curve::Dashed(vec![(0.08, 4.0), (0.22, 4.0)]),
        Curve::Dotted(vec![(0.15, 2.6), (0.15, 3.4)]),
    ] {
        curve.draw(&mut chart)?;
    }
    for (y, text) in [(5.0, "contact force"), (4.0, "goal"), (3.0, "earliest arrival that"), (2.4, "the motor allows")]
    {
        let style = TextStyle::from((FONT, LABEL_PX * FINE)).pos(Pos::new(HPos::Left, VPos::Center));
        chart.draw_series([Text::new(text, (0.3, y), style)])?;
    }
    Ok(())
}

fn draw_panel(panel: &Panel<'_>, area: &Area<'_>) -> Result<(), PlotError> {
    let [before_ms, after_ms] = panel.shown_ms;
    let ms = |sample: &Sample| (sample.time_s - panel.zero_s) * 1e3;
    let force: Vec<_> = panel.samples.iter().map(|s| (ms(s), s.true_force_n)).collect();
    let goal = steps_of(panel.samples, |s| (ms(s), s.goal_n));
    let high = top(force.iter().chain(&goal).map(|(_, n)| *n));
    let earliest = panel.time_optimal_ms.map(|optimal_ms| Curve::Dotted(vec![(optimal_ms, 0.0), (optimal_ms, high)]));
    let curves = earliest.into_iter().chain([Curve::Dashed(goal), Curve::Solid(force)]).collect();
    let (title, x_range) = (panel.title.clone(), [-before_ms, after_ms]);
    Curves { title, x: "time, ms", y: "N", x_range, y_range: [0.0, high], curves }.draw(area)
}

/// The top of an axis: a little above the largest value.
fn top(values: impl Iterator<Item = f64>) -> f64 {
    1.08 * values.fold(0.1, f64::max)
}

/// The corners of a line of steps.
fn steps_of(samples: &[Sample], point: impl Fn(&Sample) -> (f64, f64)) -> Vec<(f64, f64)> {
    let mut corners: Vec<(f64, f64)> = samples.first().map(&point).into_iter().collect();
    for pair in samples.windows(2) {
        let ((_, before), (x, after)) = (point(&pair[0]), point(&pair[1]));
        if before != after {
            corners.extend([(x, before), (x, after)]);
        }
    }
    corners.extend(samples.last().map(&point));
    corners
}

/// The mean over time of the last 10 ms at each point; a value holds until the next.
fn smoothed(points: Vec<(f64, f64)>) -> Vec<(f64, f64)> {
    let (mut oldest, mut sum) = (0, 0.0);
    let held = |at: usize| points[at].1 * (points[at + 1].0 - points[at].0);
    let mut smooth = Vec::with_capacity(points.len());
    for at in 1..points.len() {
        sum += held(at - 1);
        while oldest + 1 < at && points[at].0 - points[oldest].0 > SMOOTH_S {
            sum -= held(oldest);
            oldest += 1;
        }
        smooth.push((points[at].0, sum / (points[at].0 - points[oldest].0)));
    }
    smooth
}

/// The least and the largest of as many points as fall together, so that no spike is lost.
fn thinned(points: Vec<(f64, f64)>) -> Vec<(f64, f64)> {
    if points.len() <= POINTS_MAX {
        return points;
    }
    let extremes = |together: &[(f64, f64)]| {
        let place = |wanted: fn(&(f64, f64), &(f64, f64)) -> bool| {
            (1..together.len()).fold(0, |best, at| if wanted(&together[at], &together[best]) { at } else { best })
        };
        let (least, largest) = (place(|a, b| a.1 < b.1), place(|a, b| a.1 > b.1));
        [together[least.min(largest)], together[least.max(largest)]]
    };
    points.chunks((2 * points.len()).div_ceil(POINTS_MAX)).flat_map(extremes).collect()
}
