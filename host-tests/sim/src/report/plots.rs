//! A report's plots: each drawn twice, wide and narrow, so that its letters can be read on a screen and on a phone.

use super::trace::{Track, Tracks};
use host_tests::plot::{Curve, Curves, PlotError, curves};

/// Width and height of a plot on a screen and on a phone.
const SIZES_PX: [(u32, u32); 2] = [(860, 230), (360, 220)];

/// A plot.
#[derive(Clone, Debug)]
pub struct Plot {
    /// What it shows, in a line: the caption, and the text for who does not see it.
    pub about: String,
    /// The wide and the narrow drawing.
    pub svgs: [String; 2],
}

/// All plots of a finger.
///
/// # Errors
/// One cannot be drawn.
pub fn all(tracks: &Tracks) -> Result<Vec<Plot>, PlotError> {
    let Tracks { goal, force, sensed, indentation, duty, current, supply, winding, slip, height, .. } = tracks;
    let Tracks { force_difference, travel_difference, .. } = tracks;
    let force = [Curve::Pale(sensed.points()), Curve::Dashed(steps(&goal.points())), Curve::Solid(force.points())];
    let force_about = "True force (solid), sensed force (pale), goal (dashed)";
    let mut plots = vec![
        plot("Contact force", "N", force_about, force.into())?,
        line("Indentation of the tip", "mm", indentation)?,
        with_mean("Duty of the bridge", "%", duty)?,
        with_mean("Current in the winding", "A", current)?,
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
        let points = track.points();
        if points.iter().any(|(_, value)| *value != points[0].1) {
            plots.push(line(title, unit, track)?);
        }
    }
    Ok(plots)
}

fn line(title: &str, unit: &'static str, track: &Track) -> Result<Plot, PlotError> {
    plot(title, unit, title, vec![Curve::Solid(track.points())])
}

/// For what changes from step to step.
fn with_mean(title: &str, unit: &'static str, track: &Track) -> Result<Plot, PlotError> {
    let about = format!("{title}: as it was (pale) and its mean over a hundredth of the run");
    plot(title, unit, &about, vec![Curve::Pale(track.points()), Curve::Solid(track.means())])
}

fn plot(title: &str, y: &'static str, about: &str, lines: Vec<Curve>) -> Result<Plot, PlotError> {
    let (x_range, y_range) = ranges(&lines);
    let panel = Curves { title: title.into(), x: "time, s", y, x_range, y_range, curves: lines };
    let [wide, narrow] = SIZES_PX;
    Ok(Plot {
        about: format!("{about}, in {y}, over time in s"),
        svgs: [curves(core::slice::from_ref(&panel), wide)?, curves(&[panel], narrow)?],
    })
}

/// From 0 to the end, and around all values with a little air; 0 is in sight where it is not far.
fn ranges(lines: &[Curve]) -> ([f64; 2], [f64; 2]) {
    let points = lines.iter().flat_map(|curve| match curve {
        Curve::Solid(points) | Curve::Pale(points) | Curve::Dashed(points) | Curve::Circles(points) => points,
    });
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
