//! A share of many runs, for array jobs and several machines.

use std::fmt;
use std::str::FromStr;

/// Every so-manieth of the runs.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Shard {
    /// Which share, from 1.
    pub number: usize,
    /// Of how many.
    pub of: usize,
}

impl Shard {
    /// All runs.
    pub const WHOLE: Self = Self { number: 1, of: 1 };

    /// Whether a run, counted from 0, is in it.
    pub const fn has(self, run: usize) -> bool {
        run % self.of == self.number - 1
    }

    /// Whether it is all of them.
    pub const fn is_whole(self) -> bool {
        self.of == 1
    }
}

/// The first number from 1 to `all` that is none of these, which are in order.
pub(crate) fn first_missing<'a>(numbers: impl Iterator<Item = &'a usize>, all: usize) -> Option<usize> {
    // In order, the first whose number is not its place; behind the last there is none.
    let mut numbers = numbers.copied();
    (1..=all).find(|place| numbers.next() != Some(*place))
}

impl fmt::Display for Shard {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}/{}", self.number, self.of)
    }
}

impl FromStr for Shard {
    type Err = String;

    /// Reads `i/n`.
    fn from_str(text: &str) -> Result<Self, String> {
        let wrong = || format!("`{text}`: I/N is asked for, I from 1 to N");
        let (number, of) = text.split_once('/').ok_or_else(wrong)?;
        let shard = Self { number: number.parse().map_err(|_| wrong())?, of: of.parse().map_err(|_| wrong())? };
        if (1..=shard.of).contains(&shard.number) { Ok(shard) } else { Err(wrong()) }
    }
}
