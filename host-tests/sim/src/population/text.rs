//! A population's report for people.

use super::Counted;
use super::report::{Promise, Ran, Report};
use super::spread::Spread;
use crate::metrics::shown;
use crate::run::asked;
use std::fmt::Write as _;

/// Fingers that are named each.
const NAMED: usize = 30;

/// The table of promises, the forces' errors, and who broke what.
pub fn text(report: &Report) -> String {
    let Report { population, board, seed, of_fingers, fingers, .. } = report;
    let count = fingers.len();
    let percent = |part: usize| 100.0 * part as f64 / count.max(1) as f64;
    let mut text = format!("{population}: {}\n", report.about);
    // Writing to a string does not fail.
    let _ = writeln!(text, "{count} of {of_fingers} fingers, seed {seed}, board {board}; simulated\n");
    let promises = report.promises();
    let width = promises.iter().map(|row| row.metric.len()).max().unwrap_or(0);
    let _ = writeln!(
        text,
        "  {:width$} {:>8} {:>8} {:>10} {:>10} {:>10}",
        "promise", "broken", "%", "median", "95 %", "worst"
    );
    for row in &promises {
        let [median, most, worst] = values(&row.spread);
        let (broken, share) = (row.broken, percent(row.broken));
        let _ = writeln!(text, "  {:width$} {broken:>8} {share:>8.1} {median:>10} {most:>10} {worst:>10}", row.metric);
    }
    for (Counted { metric, above }, fingers) in report.counted() {
        let _ = writeln!(text, "  {metric} above {above}: {fingers} fingers ({:.1} %)", percent(fingers));
    }
    let [of_goal, mn] = report.errors();
    let _ = writeln!(text, "\n  true force off the goal in {} holds that touched: median, 95 %, worst", of_goal.count);
    for (spread, unit) in [(of_goal, "% of the goal"), (mn, "mN")] {
        let _ = writeln!(text, "  {} {unit}", values(&spread).join(", "));
    }
    let worst: Vec<&Ran> = report.worst().into_iter().filter(|ran| !ran.inside).collect();
    if !worst.is_empty() {
        text += "\n  outside, the worst first:\n";
    }
    worst.iter().take(NAMED).for_each(|ran| text += &format!("  {}\n", judged(ran)));
    if worst.len() > NAMED {
        let _ = writeln!(text, "  and {} more: --json FILE has them all", worst.len() - NAMED);
    }
    let _ = writeln!(
        text,
        "\n{} of {count} fingers inside the envelope ({:.1} %)",
        report.inside(),
        percent(report.inside())
    );
    text
}

/// A line with the promises that a finger broke, or the one that it kept most narrowly.
pub fn judged(ran: &Ran) -> String {
    let promise = |Promise { metric, value, min, max, .. }: &Promise| {
        format!("{metric} {} ({})", shown(*value), asked(*min, *max))
    };
    let about = match ran.nearest().filter(|_| ran.inside) {
        Some(nearest) => format!("broke no promise, nearest to its bound is {}", promise(nearest)),
        None => ran.broken().map(promise).collect::<Vec<_>>().join("; "),
    };
    format!("finger {}: {about}", ran.finger)
}

fn values(spread: &Spread) -> [String; 3] {
    [spread.median, spread.most, spread.worst].map(shown)
}
