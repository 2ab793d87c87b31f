//! `virtual-board run`.

use sim::plant::{Plant, Setup};
use std::path::PathBuf;
use std::time::Instant;
use virtual_board::{Error, Options, Rig};

/// Maximum number of edges and resets that are listed.
const LISTED: usize = 10;

/// Image to run, and duration.
#[derive(Debug, clap::Args)]
pub struct Arguments {
    /// The flash image, an ELF for the STM32F446RE.
    #[arg(long)]
    image: PathBuf,
    /// Virtual time to run, ms.
    #[arg(long, default_value_t = 1_000)]
    ms: u64,
}

/// Runs the image and reports.
pub fn run(arguments: &Arguments) -> Result<(), Error> {
    let begun = Instant::now();
    let mut rig = Rig::new(&arguments.image, Plant::new(&Setup::default()), &Options::default())?;
    let started = begun.elapsed();
    rig.run_until_ns(arguments.ms * 1_000_000)?;
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
