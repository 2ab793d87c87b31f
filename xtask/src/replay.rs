//! Captures of boards through the core on this machine.

use crate::{console::Console, host, paths, sim};
use anyhow::Result;
use std::path::PathBuf;

/// Flags of `cargo xtask replay`.
#[derive(clap::Args)]
#[command(
    after_help = "Examples:\n  cargo xtask replay\n  cargo xtask replay my/captures\n  cargo xtask replay press.mcap"
)]
pub struct Args {
    /// A folder with captures, or one of them; without it `captures/`
    place: Option<PathBuf>,
}

/// Replays all captures in a folder: a line for each.
pub fn run(args: &Args, console: &mut Console) -> Result<()> {
    let place = args.place.clone().unwrap_or_else(|| paths::root().join("captures"));
    sim::start(host::TOOL.build(console)?.arg("replay").arg(place))
}
