//! A Chromium for the test that opens reports.

use crate::{apt, console::Console, paths};
use anyhow::{Context, Result};
use std::path::PathBuf;

/// What it is called on various systems.
const NAMES: [&str; 4] = ["chromium", "chromium-browser", "google-chrome", "google-chrome-stable"];

/// Finds a Chromium, or installs Debian's; with fonts, without which a page has no letters.
///
/// # Errors
/// There is none, and it cannot be installed: says what to install by hand.
pub fn ensure(console: &mut Console) -> Result<PathBuf> {
    let find = || NAMES.into_iter().find_map(paths::find_program);
    if let Some(program) = find() {
        return Ok(program);
    }
    apt::ensure(&["chromium", "fonts-dejavu-core"], "the test that opens reports in a browser", console)?;
    find().context("Debian's package `chromium` is installed, but no `chromium` is in PATH")
}
