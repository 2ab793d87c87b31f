//! Counting inputs and keeping the worst, over all cores.

use std::fmt;
use std::ops::Range;
use std::sync::atomic::{AtomicU64, Ordering};
use std::thread;

/// How far a result is from its exact value.
#[derive(Clone, Copy, Debug)]
pub struct Judged {
    /// Result less exact value, in units of the result's last place.
    pub error_ulp: f64,
    /// Whether no other representable value is closer, where that was asked; decided without rounding.
    pub nearest: Option<bool>,
    /// Whether the result is within the bound claimed; decided without rounding where the judge can.
    pub within: bool,
}

impl Judged {
    /// From an error known well beyond the unit's size.
    pub fn by_error(error_ulp: f64, bound_ulp: f64) -> Self {
        Self { error_ulp, nearest: None, within: error_ulp.abs() <= bound_ulp }
    }
}

/// What one function did over a set of inputs.
#[derive(Clone, Debug)]
pub struct Tally {
    /// The function.
    pub name: &'static str,
    /// What is claimed, in units of the last place; 1/2 claims that every result is correctly rounded.
    pub bound_ulp: f64,
    /// How many inputs were judged.
    pub inputs: u64,
    /// How many results were the nearest representable value, where that was asked.
    pub nearest: u64,
    /// How many results were outside the bound.
    pub outside: u64,
    /// The largest error, in units of the last place, with its sign.
    pub worst_ulp: f64,
    /// The raw inputs of the largest error.
    pub worst_at: [i64; 4],
}

impl Tally {
    /// Nothing judged yet.
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

    /// Whether inputs were judged and all of them were as claimed.
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

/// Splits a range into chunks, judges them on all cores and adds up; `progress` is told the share done.
pub fn parallel<const N: usize>(
    range: Range<u64>,
    chunk: u64,
    tallies: [Tally; N],
    progress: &(dyn Fn(u64, u64) + Sync),
    judge: impl Fn(Range<u64>, &mut [Tally; N]) + Sync,
) -> [Tally; N] {
    let next = AtomicU64::new(range.start);
    let mut total = tallies.clone();
    thread::scope(|scope| {
        let work = || {
            let mut own = tallies.clone();
            loop {
                let start = next.fetch_add(chunk, Ordering::Relaxed);
                if start >= range.end {
                    return own;
                }
                judge(start..range.end.min(start + chunk), &mut own);
                progress(start - range.start, range.end - range.start);
            }
        };
        let cores = thread::available_parallelism().map_or(1, |cores| cores.get());
        let threads: Vec<_> = (0..cores).map(|_| scope.spawn(work)).collect();
        for thread in threads {
            // A panic in a judge is a failed proof: let it out.
            let part = thread.join().unwrap_or_else(|panic| std::panic::resume_unwind(panic));
            for (total, part) in total.iter_mut().zip(&part) {
                total.merge(part);
            }
        }
    });
    total
}
