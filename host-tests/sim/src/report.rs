//! A run as one page of HTML: no network, no other file, light and dark, for a screen and a phone.

mod data;
mod page;
mod plots;
mod states;
mod trace;

pub use page::page;
pub use plots::around;
pub use trace::{Instant, Kept, Trace, Track, Tracks};

use crate::ledger::Without;
use crate::run::Outcome;
use crate::scene::Scene;

/// What a page is made from.
#[derive(Clone, Copy)]
pub struct Report<'a> {
    /// What was run.
    pub scene: &'a Scene,
    /// On which board.
    pub board: &'a str,
    /// How it went.
    pub outcome: &'a Outcome,
    /// What it looked like.
    pub trace: &'a Trace,
    /// What each effect was worth, where that was asked for.
    pub ablated: &'a [Without],
    /// Another run, drawn over this one.
    pub over: Option<&'a Over>,
}

/// The run in another report.
#[derive(Clone, Debug)]
pub struct Over(serde_json::Value);
