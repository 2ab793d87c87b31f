//! Counting inputs and keeping the worst, over all cores.

use crate::page::Page;
use indicatif::HumanCount;
use std::fmt;
use std::fmt::Write as _;
use std::ops::Range;

/// Difference of a result from its exact value.
#[derive(Clone, Copy, Debug)]
pub struct Judged {
    /// Result less exact value, in units of the result's last place.
    pub error_ulp: f64,
    /// True if no other representable value is closer, where that was asked; decided without rounding.
    pub nearest: Option<bool>,
    /// True if the result is within the bound claimed; decided without rounding where the judge can.
    pub within: bool,
}

impl Judged {
    /// Judges an error that is known much more exactly than the unit of the last place.
    pub fn by_error(error_ulp: f64, bound_ulp: f64) -> Self {
        Self { error_ulp, nearest: None, within: error_ulp.abs() <= bound_ulp }
    }
}

/// Tally of one function over a set of inputs.
#[derive(Clone, Debug)]
pub struct Tally {
    pub name: &'static str,
    /// Claimed bound in units of the last place; 1/2 claims that every result is correctly rounded.
    pub bound_ulp: f64,
    /// Number of inputs that were judged.
    pub inputs: u64,
    /// Number of results that are the nearest representable value, if that was asked.
    pub nearest: u64,
    /// Number of results outside the bound.
    pub outside: u64,
    /// The largest error, in units of the last place, with its sign.
    pub worst_ulp: f64,
    /// The raw inputs of the largest error.
    pub worst_at: [i64; 4],
}

impl Tally {
    /// Tally without results.
    pub const fn new(name: &'static str, bound_ulp: f64) -> Self {
        Self { name, bound_ulp, inputs: 0, nearest: 0, outside: 0, worst_ulp: 0.0, worst_at: [0; 4] }
    }

    /// Counts a result; `at` holds its inputs as raw integers.
    pub fn add(&mut self, judged: Judged, at: [i64; 4]) {
        self.inputs += 1;
        self.nearest += u64::from(judged.nearest == Some(true));
        self.outside += u64::from(!judged.within);
        if judged.error_ulp.abs() > self.worst_ulp.abs() || self.inputs == 1 {
            self.worst_ulp = judged.error_ulp;
            self.worst_at = at;
        }
    }

    /// Adds another thread's part of the same function.
    pub fn merge(&mut self, other: &Self) {
        if other.inputs > 0 && (self.inputs == 0 || other.worst_ulp.abs() > self.worst_ulp.abs()) {
            self.worst_ulp = other.worst_ulp;
            self.worst_at = other.worst_at;
        }
        self.inputs += other.inputs;
        self.nearest += other.nearest;
        self.outside += other.outside;
    }

    /// True if inputs were judged and all of them were as claimed.
    pub fn holds(&self) -> bool {
        let rounded = self.bound_ulp != 0.5 || self.nearest == self.inputs;
        self.inputs > 0 && self.outside == 0 && rounded
    }
}

impl fmt::Display for Tally {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let rounding = match self.nearest {
            0 => String::new(),
            all if all == self.inputs => "  all correctly rounded".to_owned(),
            some => format!("  {:.4} % correctly rounded", 100.0 * some as f64 / self.inputs as f64),
        };
        let verdict = if self.holds() { "" } else { "  FAILED" };
        write!(
            f,
            "{:<34} {:>11} inputs  worst {:>+10.4} ulp (bound {:>5}){}  at {:?}{verdict}",
            self.name, self.inputs, self.worst_ulp, self.bound_ulp, rounding, self.worst_at
        )
    }
}

/// Splits a range into chunks, judges them on all cores and adds up the tallies; `progress` gets the share done.
pub fn parallel<const N: usize>(
    range: Range<u64>,
    chunk: u64,
    tallies: [Tally; N],
    progress: &(dyn Fn(u64, u64) + Sync),
    judge: impl Fn(Range<u64>, &mut [Tally; N]) + Sync,
) -> [Tally; N] {
    let parts = sim::cores::map(range.clone().step_by(chunk as usize), |start| {
        let mut own = tallies.clone();
        judge(start..range.end.min(start + chunk), &mut own);
        progress(start - range.start, range.end - range.start);
        own
    });
    let mut total = tallies.clone();
    for part in &parts {
        total.iter_mut().zip(part).for_each(|(total, part)| total.merge(part));
    }
    total
}

// The proof's figures as the tables of `docs/model.md`.

pub const PAGE: Page = Page { name: "docs/model.md", tables: "bounds", command: "cargo xtask prove --write" };

/// One table: each section's title, then its functions.
pub fn markdown(sections: &[(String, Vec<Tally>)]) -> String {
    let mut text = String::from("| function | inputs | worst, ulp | claimed |\n| --- | --- | --- | --- |\n");
    for (title, tallies) in sections {
        let _ = writeln!(text, "| **{title}** | | | |");
        for tally in tallies {
            let rounded = if tally.nearest == tally.inputs { "*" } else { "" };
            let (worst, claimed) = (number(tally.worst_ulp.abs()), number(tally.bound_ulp));
            let _ = writeln!(text, "| {} | {} | {worst}{rounded} | {claimed} |", tally.name, HumanCount(tally.inputs));
        }
    }
    let inputs = sections.iter().flat_map(|(_, tallies)| tallies).map(|tally| tally.inputs).sum();
    let _ = writeln!(text, "\n{} results in all.", HumanCount(inputs));
    text
}

/// Whole units as they are, anything else to 4 digits after the point. Rounded up: a worst case must not look better
/// than it is.
fn number(ulp: f64) -> String {
    if ulp == ulp.trunc() { HumanCount(ulp as u64).to_string() } else { format!("{:.4}", (ulp * 1e4).ceil() / 1e4) }
}
