//! `virtual-board bringup`.

use ::bringup::judge::estimates;
use output::{kept, say};
use std::io;
use std::path::PathBuf;
use virtual_board::{Error, Options, bringup};

/// Image to run, and file for the figures.
#[derive(Debug, clap::Args)]
pub struct Arguments {
    /// The image, an ELF.
    #[arg(long, value_name = "ELF")]
    image: PathBuf,
    /// Number of frames for which the rows are read back.
    #[arg(long, default_value_t = 1_000)]
    frames: u32,
    /// Estimated cycles, a line `CYCLES KERNEL` each.
    #[arg(long, value_name = "FILE")]
    estimates: Option<PathBuf>,
    /// Writes the figures to this file.
    #[arg(long, value_name = "FILE")]
    json: Option<PathBuf>,
}

/// Runs it and prints the table.
pub fn run(arguments: &Arguments) -> Result<(), Error> {
    let Arguments { image, frames, estimates: path, json } = arguments;
    let estimates = path.as_deref().map(estimates).transpose().map_err(Error::Report)?.unwrap_or_default();
    let told = &mut |said: &str| say::line(said);
    let (judgement, _) = bringup::run(image, &Options::default(), *frames, &estimates, told)?;
    if let Some(path) = json {
        let text = serde_json::to_string_pretty(&judgement).map_err(io::Error::from).map_err(Error::Report)?;
        kept::write(path, text + "\n").map_err(Error::Report)?;
    }
    say::text(judgement.text());
    match judgement.failed {
        0 => Ok(()),
        failed => Err(Error::Failed(failed)),
    }
}
