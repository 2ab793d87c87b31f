//! The tables of `docs/study.md`, the short one of the README, and the figures as JSON.

use super::kernels::Kernel;
use super::output::{Cost, Passes};
use super::{scan, simulation};
use crate::page::Page;
use output::plot::{Dot, Front, PlotError, front};
use serde_json::json;
use std::fmt::Write as _;
use std::iter;

/// The page of the study; the README has a short table between the same lines.
pub const PAGE: Page = Page { name: "docs/study.md", tables: "study", command: "cargo xtask study" };
pub const README: Page = Page { name: "README.md", ..PAGE };

/// A kernel with its variants, cheapest first.
pub type Studied<'a> = (&'a Kernel, Vec<Point>);

/// All tables; the whole loop comes first.
pub fn markdown(studied: &[Studied], whole_loop: String) -> String {
    let mut page = whole_loop;
    for (kernel, points) in studied {
        section(&mut page, kernel, points);
    }
    page + &scan::markdown() + &simulation::markdown()
}

fn section(page: &mut String, kernel: &Kernel, points: &[Point]) {
    let Kernel { name, title, text, error, other, .. } = kernel;
    if !kernel.has_error() {
        return costs(page, kernel, points);
    }
    let _ = write!(page, "\n## {title}\n\n{text}\n\n![{title}: {error} over cycles](pictures/study-{name}.svg)\n\n");
    let (more, rule) =
        other.map_or((String::new(), ""), |other| (format!(" rms | {other}, max | rms |"), " --- | --- | --- |"));
    let _ = writeln!(
        page,
        "| variant | cycles | {error}, max |{more} |\n\
        | --- | --- | --- |{rule} --- |"
    );
    let beaten = beaten_by(points);
    for (point, by) in points.iter().zip(&beaten) {
        let Point { name, firmware, cost, error_max, error_rms, other } = point;
        let bold = if *firmware { "**" } else { "" };
        let more = other.iter().flat_map(|[max, rms]| [*error_rms, *max, *rms]);
        let errors = [*error_max].into_iter().chain(more).map(figure);
        let cells = iter::once(cycles(cost)).chain(errors).collect::<Vec<_>>().join(" | ");
        let place = if by.is_none() { "front" } else { "" };
        let _ = writeln!(page, "| {bold}{name}{bold} | {cells} | {place} |");
    }
    let beats_firmware = points.iter().zip(&beaten).any(|(point, by)| point.firmware && by.is_some());
    if beats_firmware {
        let _ = writeln!(page, "\nWhy the firmware uses it: {}", kernel.why);
    }
}

/// A table without errors.
fn costs(page: &mut String, kernel: &Kernel, points: &[Point]) {
    let (Kernel { title, text, .. }, heads) = (kernel, Cost::HEADS);
    let _ = write!(page, "\n## {title}\n\n{text}\n\n| part | {heads} |\n|{}\n", " --- |".repeat(9));
    for Point { name, cost, .. } in points.iter().rev() {
        let _ = writeln!(page, "| {name} | {} |", cost.cells());
    }
}

/// Cell with the estimated cycles of a call.
fn cycles(cost: &Cost) -> String {
    let Passes { median, max } = cost.estimate;
    if median == max { median.to_string() } else { format!("{median} ({max})") }
}

/// Two digits; a power of ten where it is small or large.
pub fn figure(value: f64) -> String {
    match value {
        0.0 => "0".into(),
        0.01..1000.0 => {
            let digits = (1.0 - value.log10().floor()).max(0.0) as usize;
            format!("{value:.digits$}")
        }
        _ => format!("{value:.1e}"),
    }
}

/// An object for each variant, a line each.
pub fn json_lines(studied: &[Studied]) -> String {
    let mut text = String::new();
    for (kernel, points) in studied {
        for (point, by) in points.iter().zip(beaten_by(points)) {
            let Point { name, firmware, cost, error_max, error_rms, other } = point;
            // What is not finite becomes `null`.
            let mut figures = json!({
                "kernel": kernel.name, "variant": name, "firmware": firmware, "front": by.is_none(),
                "error": kernel.error, "error_max": error_max, "error_rms": error_rms,
            });
            let Cost { instructions, low, estimate, high, flash } = cost;
            for (key, passes) in [
                ("instructions", instructions),
                ("cycles_low", low),
                ("cycles_estimate", estimate),
                ("cycles_high", high),
                ("cycles_flash", flash),
            ] {
                figures[format!("{key}_median")] = passes.median.into();
                figures[format!("{key}_max")] = passes.max.into();
            }
            if let (Some([max, rms]), Some(unit)) = (other, kernel.other) {
                figures["other_error"] = unit.into();
                (figures["other_max"], figures["other_rms"]) = (json!(max), json!(rms));
            }
            let _ = writeln!(text, "{figures}");
        }
    }
    text
}

// Which variants are worth choosing: those that no other beats in both error and time.

/// A variant with its cost and its errors.
#[derive(Clone, Debug)]
pub struct Point {
    pub name: String,
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

    /// True if it is no worse in error and in time, and better in one.
    fn beats(&self, other: &Self) -> bool {
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
    let front: Vec<_> = points.iter().zip(beaten).filter(|(_, by)| by.is_none()).map(|(point, _)| point).collect();
    let ratio = |of: &dyn Fn(&Point) -> f64| {
        let values = || front.iter().map(|point| of(point)).filter(|value| *value > 0.0);
        values().fold(0.0, f64::max) / values().fold(f64::INFINITY, f64::min)
    };
    (front.len(), ratio(&|point| point.error_max), ratio(&|point| point.cycles() as f64))
}

// Error against cycles, a plot for each kernel.

/// Draws a kernel.
pub fn draw(kernel: &Kernel, points: &[Point]) -> Result<String, PlotError> {
    let dot = |(point, by): (&Point, Option<usize>)| Dot {
        // An axis of logarithms has no place for less than a cycle.
        x: point.cycles().max(1) as f64,
        y: point.error_max,
        label: point.name.replace('`', ""),
        best: by.is_none(),
        own: point.firmware,
    };
    front(&Front {
        title: &format!("{}: filled points are the front; the square is the firmware's", kernel.title),
        x: "estimated cycles on a Cortex-M4F, median, without wait states",
        y: &format!("largest {}", kernel.error),
        dots: points.iter().zip(beaten_by(points)).map(dot).collect(),
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
