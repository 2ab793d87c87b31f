//! `fingertip record`.

mod csv;
mod mcap;

use super::{Interrupt, aside, say_json};
use crate::messages::device;
use crate::state::{ANEW, Stamp, Stamps, State};
use crate::whole::Part;
use crate::{Client, Error, numbers};
use clap::ValueEnum;
use serde_json::json;
use std::io::{self, BufWriter, Write};
use std::path::PathBuf;
use std::time::{Duration, Instant};

/// So many reads in a row that fail end it.
const LOST_MAX: u64 = 20;
/// What is later is not made up for.
const LATE_MAX: Duration = Duration::from_millis(100);
/// Time after which what was recorded goes to the file: a killed program loses no more.
const FLUSH_EVERY: Duration = Duration::from_millis(200);
/// Buffer that holds more than that, so that the file gets whole lines, each time by one call of the system.
const BUFFER: usize = 1 << 20;

/// What to record.
#[derive(Debug, clap::Args)]
#[command(after_help = "Examples:\n  \
    fingertip record --seconds 10 --rate-hz 200 force.csv\n  \
    fingertip record --pressures --seconds 60 grip.mcap    (opens in Foxglove)\n  \
    fingertip record --seconds 1 - | head")]
pub struct Args {
    /// The file, `.csv` or `.mcap`; `-` is the standard output, as CSV without --format
    file: PathBuf,
    /// For how long; without it, until Ctrl-C
    #[arg(long, value_parser = numbers::seconds)]
    seconds: Option<f64>,
    /// How many states a second to ask for; 0 asks as fast as answers come
    #[arg(long, default_value_t = 200.0, value_parser = numbers::rate_hz_or_all)]
    rate_hz: f64,
    /// With the pressure of each taxel
    #[arg(long)]
    pressures: bool,
    /// Write over a file that is there
    #[arg(long)]
    force: bool,
    /// In place of what the file's name ends with
    #[arg(long, value_enum)]
    format: Option<Format>,
}

/// How a recording is written.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum Format {
    /// A row for each state.
    Csv,
    /// A message for each state.
    Mcap,
}

/// Takes states in turn.
trait Sink {
    /// One more, with its times.
    fn put(&mut self, stamp: &Stamp, state: &State) -> io::Result<()>;
    /// Hands on what was put, readable as it is.
    fn flush(&mut self) -> io::Result<()>;
    /// There are no more.
    fn finish(self: Box<Self>) -> io::Result<()>;
}

/// Records until the time is over, Ctrl-C, or the line is lost; what was recorded by then is whole.
///
/// # Errors
/// The file cannot be written, or the line was lost.
pub fn run(args: &Args, format: Format, client: &mut Client, json: bool) -> Result<(), Error> {
    let interrupt = Interrupt::catch()?;
    let whole = args.file.as_os_str() != "-";
    let part = whole.then(|| Part::begin(&args.file, args.force)).transpose()?;
    let file = |why: io::Error| Error::file("write", &args.file, why);
    let device = device(client)?;
    let to = part.as_ref().map(Part::file).transpose().map_err(file)?;
    let mut sink: Box<dyn Sink> = match format {
        Format::Csv => {
            let to: Box<dyn Write> = to.map_or_else(|| Box::new(io::stdout()) as _, |file| Box::new(file) as _);
            let to = BufWriter::with_capacity(BUFFER, to);
            Box::new(csv::Csv::new(to, args.pressures).map_err(file)?)
        }
        Format::Mcap => Box::new(mcap::Mcap::new(to, client.id, device, args.pressures).map_err(file)?),
    };
    let begun = Instant::now();
    let taken = take(args, client, &interrupt, &mut *sink);
    let wall_s = begun.elapsed().as_secs_f64();
    // Who closed the pipe wanted no more.
    sink.finish().or_else(ended).map_err(file)?;
    part.map_or(Ok(()), Part::place)?;
    let (counts, lost) = taken?;
    let Counts { states, repeated, missed, .. } = counts;
    let rate_hz = states as f64 / wall_s;
    if json && whole {
        say_json(&json!({
            "file": args.file, "states": states, "seconds": counts.last_s, "states_per_s": rate_hz,
            "repeated_frames": repeated, "unanswered": missed,
        }));
    } else {
        aside(format_args!(
            "{states} states over {:.3} s of the controller's time, {rate_hz:.0} a second; {missed} reads unanswered, \
             {repeated} frames read twice and left out",
            counts.last_s
        ));
    }
    lost.map_or(Ok(()), |why| Err(Error::Other(format!("the recording ends after {:.3} s: {why}", counts.last_s))))
}

/// A pipe that its reader closed is no error.
fn ended(why: io::Error) -> io::Result<()> {
    if why.kind() == io::ErrorKind::BrokenPipe { Ok(()) } else { Err(why) }
}

#[derive(Default)]
struct Counts {
    states: u64,
    repeated: u64,
    missed: u64,
    last_s: f64,
}

/// Takes states until something ends it: what was counted, and what was lost.
fn take(
    args: &Args,
    client: &mut Client,
    interrupt: &Interrupt,
    sink: &mut dyn Sink,
) -> Result<(Counts, Option<Error>), Error> {
    let period = if args.rate_hz > 0.0 { Duration::from_secs_f64(1.0 / args.rate_hz) } else { Duration::ZERO };
    let (mut counts, mut stamps, mut frame, mut row) = (Counts::default(), Stamps::default(), None, 0);
    let (mut due, mut flushed) = (Instant::now(), Instant::now());
    while !interrupt.came() {
        let read = if args.pressures { State::read_picture(client) } else { State::read(client) };
        match read {
            Ok(state) => {
                row = 0;
                let Some(stamp) = stamps.stamp(&state) else { return Ok((counts, Some(ANEW.into()))) };
                if args.seconds.is_some_and(|seconds| stamp.time_s > seconds) {
                    break;
                }
                counts.last_s = stamp.time_s;
                if frame.replace(state.frame) == Some(state.frame) {
                    counts.repeated += 1;
                } else {
                    counts.states += 1;
                    let mut put = sink.put(&stamp, &state);
                    if flushed.elapsed() >= FLUSH_EVERY {
                        flushed = Instant::now();
                        put = put.and_then(|()| sink.flush());
                    }
                    match put {
                        Ok(()) => {}
                        Err(why) if why.kind() == io::ErrorKind::BrokenPipe => break,
                        Err(why) => return Err(Error::file("write", &args.file, why)),
                    }
                }
            }
            Err(why) if why.is_noise() => {
                counts.missed += 1;
                row += 1;
                if row >= LOST_MAX {
                    return Ok((counts, Some(why)));
                }
            }
            Err(why) => return Ok((counts, Some(why))),
        }
        // The rate holds on average: a state that came late is made up for, where it was not too late.
        due = (due + period).max(Instant::now().checked_sub(LATE_MAX).unwrap_or(due));
        interrupt.pause(due);
    }
    Ok((counts, None))
}

/// The format: the one requested, else that of the file's name.
///
/// # Errors
/// The name has no known ending.
pub fn format(args: &Args) -> Result<Format, Error> {
    let file = &args.file;
    match (args.format, file.extension().and_then(|extension| extension.to_str())) {
        (Some(format), _) => Ok(format),
        _ if file.as_os_str() == "-" => Ok(Format::Csv),
        (None, Some("csv")) => Ok(Format::Csv),
        (None, Some("mcap")) => Ok(Format::Mcap),
        _ => Err(Error::NotUnderstood(format!(
            "{}: a name that ends with .csv or .mcap is asked for, or --format",
            file.display()
        ))),
    }
}
