//! What the guided procedures (`commission`, `identify`, `calibrate`) have in common.

pub(super) mod ask;
pub(super) mod hold;
pub(super) mod motion;
pub(super) mod press;
pub(super) mod result;
pub(super) mod session;

use super::Interrupt;
use crate::{Error, numbers};
use ask::Ask;
use std::path::{Path, PathBuf};

/// Options of every guided procedure.
#[derive(Debug, clap::Args)]
pub struct Options {
    /// Folder that keeps each record and step; the same folder resumes the procedure
    #[arg(long, value_name = "DIR")]
    session: Option<PathBuf>,
    /// Write the parameters without asking
    #[arg(long)]
    apply: bool,
    /// Keep the parameters over a reset, once they are written
    #[arg(long)]
    save: bool,
    /// Longest time for one motion
    #[arg(long, default_value_t = 120.0, value_parser = numbers::seconds)]
    within_s: f64,
}

/// Options of the presses.
#[derive(Debug, clap::Args)]
pub struct Presses {
    /// Pause in the air before each tare: creep of the press before would shift the zeros
    #[arg(long, default_value_t = 10.0, value_parser = numbers::seconds)]
    pub(super) pause_s: f64,
    /// Do not ask for Enter before a press
    #[arg(long)]
    pub(super) no_wait: bool,
}

impl Options {
    /// Folder of the session.
    pub(super) fn session(&self) -> Option<&Path> {
        self.session.as_deref()
    }
}

impl Presses {
    /// Refuses questions that `--json` cannot ask.
    pub(super) fn check(&self, json: bool) -> Result<(), Error> {
        if !json || self.no_wait {
            return Ok(());
        }
        let why = "--json asks no questions: give --no-wait, with plate and finger in place";
        Err(Error::NotUnderstood(why.into()))
    }
}

/// What a procedure runs with.
pub(super) struct Run<'a> {
    options: &'a Options,
    interrupt: Interrupt,
    pub(super) ask: Ask,
    json: bool,
}

impl<'a> Run<'a> {
    /// Catches signals from here on.
    pub(super) fn begin(options: &'a Options, json: bool) -> Result<Self, Error> {
        let interrupt = Interrupt::catch()?;
        let ask = Ask::new(interrupt.clone(), json);
        Ok(Self { options, interrupt, ask, json })
    }

    /// Reports progress to people.
    pub(super) fn report(&self, text: impl std::fmt::Display) {
        if !self.json {
            super::aside(text);
        }
    }
}
