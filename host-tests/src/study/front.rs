//! Which variants are worth choosing: those that no other beats in both error and time.

use super::kernels::Kernel;
use super::output::Cost;
use output::plot::{Dot, Front, PlotError, front};

/// A variant with its cost and its errors.
#[derive(Clone, Debug)]
pub struct Point {
    /// Its name.
    pub name: String,
    /// True if it is the firmware's.
    pub firmware: bool,
    /// Cost of a call.
    pub cost: Cost,
    /// The largest error over the inputs.
    pub error_max: f64,
    /// The root of the mean of the errors' squares.
    pub error_rms: f64,
    /// Another error that the kernel has: largest and root mean square.
    pub other: Option<[f64; 2]>,
}

impl Point {
    /// Cost that is compared with the error: estimated cycles of the median call, without wait states.
    pub fn cycles(&self) -> i64 {
        self.cost.estimate.median
    }

    /// True if it competes with the others; a closed form among sums does not, nor what has no error.
    pub fn competes(&self) -> bool {
        !self.name.contains("closed form") && !self.error_max.is_nan()
    }

    /// True if it is no worse in error and in time, and better in one.
    fn beats(&self, other: &Self) -> bool {
        if !(self.competes() && other.competes()) {
            return false;
        }
        let no_worse = self.cycles() <= other.cycles() && self.error_max <= other.error_max;
        no_worse && (self.cycles() < other.cycles() || self.error_max < other.error_max)
    }
}

/// Who beats each: the cheapest of those that do.
pub fn beaten_by(points: &[Point]) -> Vec<Option<usize>> {
    let beats = |point: &Point| {
        let better = points.iter().enumerate().filter(|(_, other)| other.beats(point));
        better.min_by_key(|(_, other)| other.cycles()).map(|(place, _)| place)
    };
    points.iter().map(beats).collect()
}

/// Extent of the front: points on it, its errors' ratio, its cycles' ratio.
pub fn span(points: &[Point]) -> (usize, f64, f64) {
    let beaten = beaten_by(points);
    let front: Vec<_> = points
        .iter()
        .zip(beaten)
        .filter(|(point, by)| by.is_none() && point.competes())
        .map(|(point, _)| point)
        .collect();
    let ratio = |of: &dyn Fn(&Point) -> f64| {
        let values = || front.iter().map(|point| of(point)).filter(|value| *value > 0.0);
        values().fold(0.0, f64::max) / values().fold(f64::INFINITY, f64::min)
    };
    (front.len(), ratio(&|point| point.error_max), ratio(&|point| point.cycles() as f64))
}

// Error against cycles, a plot for each kernel.

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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::study::output::Passes;

    fn point(cycles: i64, error_max: f64) -> Point {
        let cost = Cost { estimate: Passes { median: cycles, max: cycles }, ..Cost::default() };
        Point { name: String::new(), firmware: false, cost, error_max, error_rms: 0.0, other: None }
    }

    #[test]
    fn the_front_is_what_nobody_beats() {
        let points = [point(10, 1e-2), point(30, 1e-4), point(20, 2e-2), point(40, 1e-4), point(90, 1e-6)];
        assert_eq!(beaten_by(&points), [None, None, Some(0), Some(1), None]);
        let (count, errors, cycles) = span(&points);
        assert_eq!((count, cycles), (3, 9.0));
        assert!((errors - 1e4).abs() < 1e-6);
    }

    #[test]
    fn equals_do_not_beat_each_other() {
        assert_eq!(beaten_by(&[point(10, 1e-2), point(10, 1e-2)]), [None, None]);
    }
}
