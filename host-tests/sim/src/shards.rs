//! Shares of many runs, on all cores, continued after a stop, and merged.

use crate::cores;
use crate::run::RunError;
use indicatif::{ProgressBar, ProgressStyle};
use std::collections::BTreeMap;
use std::fmt;
use std::str::FromStr;

/// Share of the runs for one of several machines: every n-th run.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Shard {
    /// Number of the share, from 1.
    pub number: usize,
    pub of: usize,
}

impl Shard {
    pub const WHOLE: Self = Self { number: 1, of: 1 };

    pub const fn is_whole(self) -> bool {
        self.of == 1
    }

    /// Carries out the runs of the share that are not done yet, numbered from 1. Passes each new result to `keep`, and
    /// returns the results of all runs.
    pub(crate) fn go_on<T: Send>(
        self,
        all: usize,
        things: &str,
        mut done: BTreeMap<usize, T>,
        work: impl Fn(usize) -> Result<T, RunError> + Sync,
        mut keep: impl FnMut(&T) -> Result<(), RunError>,
    ) -> Result<BTreeMap<usize, T>, RunError> {
        let mut left: Vec<usize> = (self.number..=all).step_by(self.of).collect();
        let template = format!("{{bar:40}} {{pos}} of {{len}} {things}, {{eta}} to go");
        let progress = ProgressBar::new(left.len() as u64).with_style(ProgressStyle::with_template(&template)?);
        left.retain(|number| !done.contains_key(number));
        progress.set_position(done.len() as u64);
        let placed = |number: usize| Ok((number, work(number)?));
        cores::each(left, placed, |(number, result)| {
            progress.inc(1);
            keep(&result)?;
            done.insert(number, result);
            Ok::<_, RunError>(())
        })?;
        progress.finish_and_clear();
        Ok(done)
    }
}

impl fmt::Display for Shard {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}/{}", self.number, self.of)
    }
}

impl FromStr for Shard {
    type Err = String;

    /// Parses `i/n`.
    fn from_str(text: &str) -> Result<Self, String> {
        let wrong = || format!("`{text}`: needs I/N, I from 1 to N");
        let (number, of) = text.split_once('/').ok_or_else(wrong)?;
        let shard = Self { number: number.parse().map_err(|_| wrong())?, of: of.parse().map_err(|_| wrong())? };
        if (1..=shard.of).contains(&shard.number) { Ok(shard) } else { Err(wrong()) }
    }
}

/// Returns the results of merged shards, which must have every number from 1 to `all`.
pub(crate) fn complete<T>(results: BTreeMap<usize, T>, all: usize, thing: &str) -> Result<Vec<T>, String> {
    if let Some(first) = (1..=all).find(|number| !results.contains_key(number)) {
        let missing = all - results.len();
        return Err(format!("{missing} of {all} {thing}s are missing, {thing} {first} the first: is a shard missing?"));
    }
    Ok(results.into_values().collect())
}
