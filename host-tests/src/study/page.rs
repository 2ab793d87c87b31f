//! The tables of `docs/study.md`, the short one of the README, and the figures as JSON.

use super::front::{Point, beaten_by};
use super::kernels::Kernel;
use super::output::{Cost, Passes};
use super::{scan, simulation};
use crate::page::Page;
use std::fmt::Write as _;
use std::iter;

/// The page of the study; the README has a short table between the same lines.
pub const PAGE: Page = Page { name: "docs/study.md", tables: "study", command: "cargo xtask study" };
/// See [`PAGE`].
pub const README: Page = Page { name: "README.md", ..PAGE };

/// Largest number of variants of which the page shows also the beaten ones.
const SHOWN_MAX: usize = 20;

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
    // A string takes every write.
    let _ = write!(page, "\n## {title}\n\n{text}\n\n![{title}: {error} over cycles](pictures/study-{name}.svg)\n\n");
    let (more, rule) =
        other.map_or((String::new(), ""), |other| (format!(" rms | {other}, max | rms |"), " --- | --- | --- |"));
    let _ = writeln!(
        page,
        "| variant | cycles | {error}, max |{more} |\n\
        | --- | --- | --- |{rule} --- |"
    );
    let beaten = beaten_by(points);
    let few = points.len() <= SHOWN_MAX;
    for (point, by) in points.iter().zip(&beaten).filter(|(_, by)| few || by.is_none()) {
        let Point { name, firmware, cost, error_max, error_rms, other } = point;
        let bold = if *firmware { "**" } else { "" };
        let more = other.iter().flat_map(|[max, rms]| [*error_rms, *max, *rms]);
        let errors = [*error_max].into_iter().chain(more).map(figure);
        let cells = iter::once(cycles(cost)).chain(errors).collect::<Vec<_>>().join(" | ");
        let place = by.map_or_else(|| verdict(point, None), |_| String::new());
        let _ = writeln!(page, "| {bold}{name}{bold} | {cells} | {place} |");
    }
    if !few {
        let hidden = beaten.iter().flatten().count();
        let _ = writeln!(page, "\nThe picture and `--json` also have the {hidden} beaten variants.");
    }
    let beats_firmware = points.iter().zip(&beaten).any(|(point, by)| point.firmware && by.is_some());
    if beats_firmware {
        let _ = writeln!(page, "\nWhy the firmware uses it: {}", kernel.why);
    }
}

/// A table without errors.
fn costs(page: &mut String, kernel: &Kernel, points: &[Point]) {
    let _ = write!(
        page,
        "\n## {}\n\n{}\n\n| part | {} |\n| --- | --- | --- | --- | --- | --- | --- | --- | --- |\n",
        kernel.title,
        kernel.text,
        Cost::HEADS
    );
    for Point { name, cost, .. } in points.iter().rev() {
        let _ = writeln!(page, "| {name} | {} |", cost.cells());
    }
}

/// Cell with the estimated cycles of a call.
fn cycles(cost: &Cost) -> String {
    let Passes { median, max } = cost.estimate;
    if median == max { median.to_string() } else { format!("{median} ({max})") }
}

/// Position of a variant among the others.
pub fn verdict(point: &Point, by: Option<&Point>) -> String {
    match by {
        Some(by) => format!("beaten by {}", by.name),
        None if point.competes() => "front".into(),
        None => "apart".into(),
    }
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
            let _ = write!(
                text,
                "{{\"kernel\":\"{}\",\"variant\":\"{name}\",\"firmware\":{firmware},\"front\":{}",
                kernel.name,
                by.is_none()
            );
            let Cost { instructions, low, estimate, high, flash } = cost;
            for (key, passes) in [
                ("instructions", instructions),
                ("cycles_low", low),
                ("cycles_estimate", estimate),
                ("cycles_high", high),
                ("cycles_flash", flash),
            ] {
                let _ = write!(text, ",\"{key}_median\":{},\"{key}_max\":{}", passes.median, passes.max);
            }
            let number = |value: f64| if value.is_finite() { format!("{value:e}") } else { "null".into() };
            let _ = write!(text, ",\"error\":\"{}\"", kernel.error);
            let _ = write!(text, ",\"error_max\":{},\"error_rms\":{}", number(*error_max), number(*error_rms));
            if let (Some([max, rms]), Some(unit)) = (other, kernel.other) {
                let _ = write!(
                    text,
                    ",\"other_error\":\"{unit}\",\"other_max\":{},\"other_rms\":{}",
                    number(*max),
                    number(*rms)
                );
            }
            text.push_str("}\n");
        }
    }
    text
}
