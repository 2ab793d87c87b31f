//! `virtual-board demo`.

use output::{kept, say};
use sim::demo::figures;
use std::path::PathBuf;
use virtual_board::demo::{self, DemoError, Plan};

/// Image to demonstrate, and folder for the results.
#[derive(Debug, clap::Args)]
pub struct Arguments {
    /// The flash image, an ELF for the STM32F446RE.
    #[arg(long, value_name = "ELF")]
    image: PathBuf,
    /// Writes the figures to this file.
    #[arg(long, value_name = "FILE")]
    json: Option<PathBuf>,
    /// Draws the pictures into this folder.
    #[arg(long, value_name = "DIR", default_value = "target/demo")]
    out: PathBuf,
    /// Holds each force for a shorter time and leaves out the second run.
    #[arg(long)]
    quick: bool,
}

/// Runs it, prints the table, writes figures and pictures.
pub fn run(arguments: &Arguments) -> Result<(), DemoError> {
    let (figures, run) = demo::run(&Plan { image: arguments.image.clone(), quick: arguments.quick })?;
    // The files first: the reader of the output may close the pipe.
    let drawn = figures::draw(&run, &figures.forces, &arguments.out);
    if let Some(path) = &arguments.json {
        let written = serde_json::to_string_pretty(&figures).map_err(std::io::Error::from);
        let written = written.and_then(|text| kept::write(path, text + "\n"));
        written.map_err(|source| DemoError::Write { path: path.clone(), source })?;
    }
    say::line(format_args!("sha-256  {} ({} bytes, as flashed)\n", figures.image_sha256, figures.image_bytes));
    say::text(figures::table(&figures.checks, &figures.forces));
    say::line(format_args!("\ntrace    {}", figures.trace_sha256));
    if let Some(repeated) = &figures.repeated_trace_sha256 {
        say::line(format_args!("repeated {repeated}"));
    }
    let (virtual_s, wall_s) = (figures.virtual_time_s, figures.wall_time_s);
    say::line(format_args!("time     {virtual_s:.1} s of virtual time in {wall_s:.1} s"));
    drawn?.iter().for_each(|path| say::line(format_args!("picture  {}", path.display())));
    if let Some(path) = &arguments.json {
        say::line(format_args!("figures  {}", path.display()));
    }
    match figures::missed(&figures.checks) {
        0 => Ok(()),
        missed => Err(DemoError::Missed(missed)),
    }
}
