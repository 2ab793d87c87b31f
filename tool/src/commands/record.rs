//! `fingertip record`.

mod csv;
mod mcap;

use super::{Interrupt, aside, say_json};
use crate::state::{ANEW, Clock, State};
use crate::whole::Part;
use crate::{Client, Error, numbers};
use clap::ValueEnum;
use serde_json::json;
use std::io::{self, BufWriter};
use std::path::PathBuf;
use std::time::{Duration, Instant};

/// So many reads in a row that fail end it.
const LOST_MAX: u64 = 20;
/// What is later is not made up for.
const LATE_MAX: Duration = Duration::from_millis(100);

/// What to record.
#[derive(Debug, clap::Args)]
#[command(after_help = "Examples:\n  \
    fingertip record --seconds 10 --rate-hz 200 force.csv\n  \
    fingertip record --pressures --seconds 60 grip.mcap    (opens in Foxglove)\n  \
    fingertip record --seconds 1 - | head")]
pub struct Args {
    /// The file, `.csv` or `.mcap`; `-` is the standard output, as CSV
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
    /// One more, so long after the first.
    fn put(&mut self, time_s: f64, state: &State) -> io::Result<()>;
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
    let part = whole.then(|| Part::begin(&args.file)).transpose()?;
    let to = part.as_ref().map(Part::file).transpose();
    let file = |why: io::Error| Error::file("write", &args.file, why);
    let sink: io::Result<Box<dyn Sink>> = match (format, to.map_err(file)?) {
        (Format::Csv, Some(to)) => csv::Csv::new(BufWriter::new(to), args.pressures).map(|sink| Box::new(sink) as _),
        (Format::Csv, None) => csv::Csv::new(io::stdout().lock(), args.pressures).map(|sink| Box::new(sink) as _),
        (Format::Mcap, Some(to)) => mcap::Mcap::new(to, client.id, args.pressures).map(|sink| Box::new(sink) as _),
        (Format::Mcap, None) => {
            let why = "MCAP needs a file: it is finished at its beginning and its end";
            return Err(Error::NotUnderstood(why.into()));
        }
    };
    let mut sink = match sink {
        // Who closed the pipe wanted nothing at all.
        Err(why) if why.kind() == io::ErrorKind::BrokenPipe => return Ok(()),
        other => other.map_err(file)?,
    };
    let begun = Instant::now();
    let taken = take(args, client, &interrupt, &mut *sink);
    let wall_s = begun.elapsed().as_secs_f64();
    sink.finish().map_err(file)?;
    if let Some(part) = part {
        part.place().map_err(file)?;
    }
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
    let (mut counts, mut clock, mut frame, mut row) = (Counts::default(), Clock::default(), None, 0);
    let mut due = Instant::now();
    while !interrupt.came() {
        let read = if args.pressures { State::read_picture(client) } else { State::read(client) };
        match read {
            Ok(state) => {
                row = 0;
                let Some(time_s) = clock.time_s(&state) else { return Ok((counts, Some(ANEW.into()))) };
                if args.seconds.is_some_and(|seconds| time_s > seconds) {
                    break;
                }
                counts.last_s = time_s;
                if frame.replace(state.frame) == Some(state.frame) {
                    counts.repeated += 1;
                } else {
                    counts.states += 1;
                    match sink.put(time_s, &state) {
                        Ok(()) => {}
                        // Who closed the pipe wanted no more.
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
