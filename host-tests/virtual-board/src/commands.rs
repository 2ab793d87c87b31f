//! The commands of `virtual-board`.

use output::{kept, say};
use serve::{Place, Port};
use sim::demo::{DemoError, draw, missed, table};
use sim::plant::{Plant, Setup};
use std::io::Write as _;
use std::path::{Path, PathBuf};
use std::time::Duration;
use virtual_board::demo::{self, Plan};
use virtual_board::serve::Board;
use virtual_board::{Error, Options, Rig};

/// Time after which an answer is reported as late: the shortest time-out of the known clients.
const LATE: Duration = Duration::from_millis(10);

/// Runs the image and reports.
#[cfg(feature = "log")]
pub fn run(image: &Path, ms: u64) -> Result<(), Error> {
    /// Maximum number of edges and resets that are listed.
    const LISTED: usize = 10;
    let begun = std::time::Instant::now();
    let mut rig = Rig::new(image, Plant::new(&Setup::default()), &Options::default())?;
    let started = begun.elapsed();
    rig.run_until_ns(ms * 1_000_000)?;
    let wall = begun.elapsed();
    let ran_ms = rig.now_ns() as f64 * 1e-6;
    println!(
        "virtual      {ran_ms:.3} ms in {:.3} s, {:.3} s of it to start",
        wall.as_secs_f64(),
        started.as_secs_f64()
    );
    println!("ratio        {:.3} of real time", ran_ms * 1e-3 / wall.as_secs_f64());
    let instructions = rig.instructions()?;
    println!("instructions {instructions}, {:.1} million a second", instructions as f64 / ran_ms / 1e3);
    let scan = rig.scan_counts()?;
    println!("scan         {} frames, {} conversions, {} triggers", scan.frames, scan.conversions, scan.triggers);
    let latency = rig.latency()?;
    if latency.frames > 0 {
        let (least, most) = (latency.min_ns as f64 * 1e-3, latency.max_ns as f64 * 1e-3);
        println!("latency      {least:.3} to {most:.3} us from conversion to duty, {} duties", latency.frames);
    }
    if let Some(stack) = rig.stack_use()? {
        println!("stack        {} of {} bytes used", stack.used, stack.size);
    }
    println!("trace        {}", rig.trace_hash()?);
    let edges = rig.bridge_edges()?;
    println!("bridge       switched {} times", edges.len());
    for edge in edges.iter().take(LISTED) {
        println!("bridge       {} at {:.3} ms", if edge.on { "on" } else { "off" }, edge.at_ns as f64 * 1e-6);
    }
    let resets = rig.resets()?;
    println!("resets       {}", resets.len());
    for reset in resets.iter().take(LISTED) {
        println!("reset        at {:.3} ms, by {}", reset.at_ns as f64 * 1e-6, reset.cause);
    }
    for line in rig.log()? {
        println!("log          {} {}", line.level.as_deref().unwrap_or("-"), line.text);
    }
    for pin in rig.miswired_pins()? {
        println!("pin          {pin}");
    }
    for gap in rig.gaps()? {
        let reason = gap.reason().unwrap_or("NOT ON THE ALLOW-LIST");
        println!("gap          {} {} {}: {reason}", gap.kind, gap.place, gap.detail);
    }
    rig.check_gaps()
}

/// Runs it and prints the table.
#[cfg(feature = "bringup")]
pub fn bringup(image: &Path, frames: u32, estimates: Option<&Path>, json: Option<&Path>) -> Result<(), Error> {
    let estimates = estimates.map(::bringup::judge::estimates).transpose().map_err(Error::Report)?.unwrap_or_default();
    let told = &mut |said: &str| say::line(said);
    let (judgement, _) = virtual_board::bringup::run(image, &Options::default(), frames, &estimates, told)?;
    if let Some(path) = json {
        let text = serde_json::to_string_pretty(&judgement).map_err(std::io::Error::from).map_err(Error::Report)?;
        kept::write(path, text + "\n").map_err(Error::Report)?;
    }
    say::text(judgement.text());
    match judgement.failed {
        0 => Ok(()),
        failed => Err(Error::Failed(failed)),
    }
}

/// Runs it, prints the table, writes figures and pictures.
pub fn demo(image: PathBuf, json: Option<&Path>, out: &Path, quick: bool) -> Result<(), Error> {
    let (figures, run) = demo::run(&Plan { image, quick })?;
    // The files first: the reader of the output may close the pipe.
    let drawn = draw(&run, &figures.forces, out);
    if let Some(path) = json {
        let written = serde_json::to_string_pretty(&figures).map_err(std::io::Error::from);
        let written = written.and_then(|text| kept::write(path, text + "\n"));
        written.map_err(|error| DemoError::from(format!("cannot write {}: {error}", path.display())))?;
    }
    say::line(format_args!("sha-256  {} ({} bytes, as flashed)\n", figures.image_sha256, figures.image_bytes));
    say::text(table(&figures.checks, &figures.forces));
    say::line(format_args!("\ntrace    {}", figures.trace_sha256));
    if let Some(repeated) = &figures.repeated_trace_sha256 {
        say::line(format_args!("repeated {repeated}"));
    }
    let (virtual_s, wall_s) = (figures.virtual_time_s, figures.wall_time_s);
    say::line(format_args!("time     {virtual_s:.1} s of virtual time in {wall_s:.1} s"));
    drawn?.iter().for_each(|path| say::line(format_args!("picture  {}", path.display())));
    if let Some(path) = json {
        say::line(format_args!("figures  {}", path.display()));
    }
    match missed(&figures.checks) {
        0 => Ok(()),
        missed => Err(Error::Missed(missed)),
    }
}

/// Serves the board until Ctrl-C.
pub fn serve(image: &Path, place: &Place, distance_mm: f64) -> Result<(), Error> {
    let mut setup = Setup::default();
    setup.wall.distance_mm = distance_mm;
    let mut board = Board::warm(Rig::new(image, Plant::new(&setup), &Options::confirmed())?)?;
    let mut port = Port::open(place)?;
    let stop = port.stopper();
    ctrlc::set_handler(move || stop.stop()).map_err(|why| Error::Client(std::io::Error::other(why)))?;
    say::line(format_args!("serving  {} (DYNAMIXEL Protocol 2.0, 1 Mbaud, ID 1; Ctrl-C ends)", port.name()));
    std::io::stdout().flush()?;
    let served = ::serve::serve(&mut board, &mut port, LATE, true)?;
    say::line(served.text());
    Ok(())
}
