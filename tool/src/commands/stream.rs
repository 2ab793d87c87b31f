//! `fingertip stream`.

#[cfg(feature = "foxglove")]
mod server;
#[cfg(feature = "foxglove")]
pub use server::run;

use crate::numbers;

/// Address of the stream.
#[derive(Debug, clap::Args)]
#[command(after_help = "Examples:\n  \
    fingertip stream    (in Foxglove: Open connection, Foxglove WebSocket, ws://localhost:8765)")]
pub struct Args {
    /// Address to listen on; 0.0.0.0 lets other machines in
    #[arg(long, default_value = "127.0.0.1")]
    listen: String,
    /// TCP port to listen on; 0 takes a free one
    #[arg(long, default_value_t = 8765)]
    tcp: u16,
    /// States a second
    #[arg(long, default_value_t = 60.0, value_parser = numbers::rate_hz)]
    rate_hz: f64,
}

/// Refuses to stream.
#[cfg(not(feature = "foxglove"))]
pub fn run(_: &Args, _: &mut crate::Client) -> Result<(), crate::Error> {
    Err("this build does not stream: `cargo install --path tool --features foxglove` makes one that does".into())
}
