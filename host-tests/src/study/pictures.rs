//! Error against cycles, a picture for each kernel.

use super::front::{Point, beaten_by};
use super::kernels::Kernel;
use output::plot::{Dot, Front, PlotError, front};

/// Draws a kernel.
///
/// # Errors
/// There is no variant, or no room for its label.
pub fn draw(kernel: &Kernel, points: &[Point]) -> Result<String, PlotError> {
    let dot = |(point, by): (&Point, Option<usize>)| Dot {
        // An axis of logarithms has no place for less than a cycle.
        x: point.cycles().max(1) as f64,
        y: point.error_max,
        label: point.name.replace('`', ""),
        best: by.is_none() && point.competes(),
        own: point.firmware,
    };
    let square = match points.iter().find(|point| point.firmware) {
        Some(point) if point.competes() => "; the square is the firmware's",
        Some(_) => " of the sums; the square is the firmware's, no sum",
        None => "",
    };
    front(&Front {
        title: &format!("{}: filled points are the front{square}", kernel.title),
        x: "estimated cycles on a Cortex-M4F, median, without wait states",
        y: &format!("largest {}", kernel.error),
        dots: points
            .iter()
            .zip(beaten_by(points))
            .filter(|(point, _)| point.competes() || point.firmware)
            .map(dot)
            .collect(),
    })
}
