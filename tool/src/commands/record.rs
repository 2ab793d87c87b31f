//! `fingertip record`.

use super::{Interrupt, aside, say_json};
use crate::recordings::{About, Topic, device, in_words, write_options};
use crate::state::{RESTARTED, SHAPE, Stamp, Stamps, State};
use crate::whole::Part;
use crate::{Client, Error, numbers};
use mcap::Writer;
use mcap::records::{MessageHeader, Metadata};
use mcap::write::NoSeek;
use serde_json::json;
use std::fs::File;
use std::io::{self, BufWriter, Seek as _, Write};
use std::path::PathBuf;
use std::time::{Duration, Instant};

/// Number of failed reads in a row that ends the recording.
const LOST_MAX: u64 = 20;
/// Time without a new frame that ends it: a controller whose scan has stopped still answers, and its clock stands still.
const FRAME_WITHIN: Duration = Duration::from_secs(2);
/// Delay beyond which missed states are not made up for.
const LATE_MAX: Duration = Duration::from_millis(100);
/// Time after which what was recorded goes to the file: a killed program loses no more.
const FLUSH_EVERY: Duration = Duration::from_millis(200);
/// Buffer that holds more than that, so that the file gets whole lines, each time by one call of the system.
const BUFFER: usize = 1 << 20;

#[derive(Debug, clap::Args)]
#[command(after_help = "Examples:\n  \
    fingertip record --seconds 10 --rate-hz 200 force.csv\n  \
    fingertip record --pressures --seconds 60 grip.mcap    (opens in Foxglove)\n  \
    fingertip record --seconds 1 - | head")]
pub struct Args {
    /// The file, `.csv` or `.mcap`; `-` is the standard output, as CSV
    file: PathBuf,
    /// Duration; without it, until Ctrl-C
    #[arg(long, value_parser = numbers::seconds)]
    seconds: Option<f64>,
    /// Requested states per second; 0 requests as fast as answers come
    #[arg(long, default_value_t = 200.0, value_parser = numbers::rate_hz_or_all)]
    rate_hz: f64,
    /// Also records the pressure of each taxel
    #[arg(long)]
    pressures: bool,
    /// Write over a file that is there
    #[arg(long)]
    force: bool,
}

impl Args {
    /// True for MCAP, by the end of the file's name.
    pub fn mcap(&self) -> Result<bool, Error> {
        let file = &self.file;
        match file.extension().and_then(|extension| extension.to_str()) {
            Some("mcap") => Ok(true),
            Some("csv") => Ok(false),
            _ if file.as_os_str() == "-" => Ok(false),
            _ => Err(Error::NotUnderstood(format!(
                "{}: a name that ends with .csv or .mcap is asked for",
                file.display()
            ))),
        }
    }
}

trait Sink {
    fn put(&mut self, stamp: &Stamp, state: &State) -> io::Result<()>;
    /// Writes out all samples so far, so that the file is readable.
    fn flush(&mut self) -> io::Result<()>;
    fn finish(mut self: Box<Self>) -> io::Result<()> {
        self.flush()
    }
}

/// Records until the time is over, Ctrl-C, or the line is lost; what was recorded by then is whole.
pub fn run(args: &Args, mcap: bool, client: &mut Client, json: bool) -> Result<(), Error> {
    let interrupt = Interrupt::catch()?;
    let whole = args.file.as_os_str() != "-";
    let part = whole.then(|| Part::begin(&args.file, args.force)).transpose()?;
    let file = |why: io::Error| Error::file("write", &args.file, why);
    let device = device(client)?;
    let to = part.as_ref().map(Part::file).transpose().map_err(file)?;
    let mut sink: Box<dyn Sink> = match to {
        Some(to) if mcap => Box::new(Mcap::new(to, client.id, device, args.pressures).map_err(in_words).map_err(file)?),
        to => {
            let to: Box<dyn Write> = to.map_or_else(|| Box::new(io::stdout()) as _, |file| Box::new(file) as _);
            let to = BufWriter::with_capacity(BUFFER, to);
            Box::new(Csv::new(to, args.pressures).map_err(file)?)
        }
    };
    let begun = Instant::now();
    let taken = take(args, client, &interrupt, &mut *sink);
    let wall_s = begun.elapsed().as_secs_f64();
    // A pipe that its reader closed is no error.
    let ended = |why: io::Error| if why.kind() == io::ErrorKind::BrokenPipe { Ok(()) } else { Err(why) };
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

#[derive(Default)]
struct Counts {
    states: u64,
    repeated: u64,
    missed: u64,
    last_s: f64,
}

type Taken = (Counts, Option<Error>);

/// Records states until the time is over, a signal comes, or the controller is lost.
fn take(args: &Args, client: &mut Client, interrupt: &Interrupt, sink: &mut dyn Sink) -> Result<Taken, Error> {
    let period = if args.rate_hz > 0.0 { Duration::from_secs_f64(1.0 / args.rate_hz) } else { Duration::ZERO };
    let (mut counts, mut stamps, mut frame, mut row) = (Counts::default(), Stamps::default(), None, 0);
    let [mut due, mut flushed, mut scanned] = [Instant::now(); 3];
    while !interrupt.came() {
        let read = if args.pressures { State::read_picture(client) } else { State::read(client) };
        match read {
            Ok(state) => {
                row = 0;
                let Some(stamp) = stamps.stamp(&state) else { return Ok((counts, Some(RESTARTED.into()))) };
                if args.seconds.is_some_and(|seconds| stamp.time_s > seconds) {
                    break;
                }
                counts.last_s = stamp.time_s;
                if frame.replace(state.frame) == Some(state.frame) {
                    counts.repeated += 1;
                    if scanned.elapsed() > FRAME_WITHIN {
                        let why = format!("no new frame came for {} s", FRAME_WITHIN.as_secs());
                        return Ok((counts, Some(why.into())));
                    }
                } else {
                    counts.states += 1;
                    scanned = Instant::now();
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

// A row for each state: numbers only, so there is nothing to quote.

struct Csv(BufWriter<Box<dyn Write>>);

impl Csv {
    fn new(mut out: BufWriter<Box<dyn Write>>, pressures: bool) -> io::Result<Self> {
        let names = State::default().numbers().map(|(name, _)| name.to_owned());
        let [rows, columns] = if pressures { SHAPE } else { [0, 0] };
        let taxels = (0..rows).flat_map(|row| (0..columns).map(move |column| format!("pressure_{row}_{column}_pa")));
        let names: Vec<String> = names.into_iter().chain(taxels).collect();
        writeln!(out, "time_s,unix_time_s,{}", names.join(","))?;
        Ok(Self(out))
    }
}

impl Sink for Csv {
    fn put(&mut self, stamp: &Stamp, state: &State) -> io::Result<()> {
        let (unix_s, unix_us) = (stamp.read_ns / 1_000_000_000, stamp.read_ns / 1_000 % 1_000_000);
        write!(self.0, "{:.6},{unix_s}.{unix_us:06}", stamp.time_s)?;
        for value in state.numbers().into_iter().map(|(_, value)| value).chain(state.pressures_pa.iter().copied()) {
            write!(self.0, ",{value}")?;
        }
        writeln!(self.0)
    }

    fn flush(&mut self) -> io::Result<()> {
        self.0.flush()
    }
}

// MCAP with the messages of [`crate::messages`].

struct Mcap {
    out: Writer<NoSeek<Chunks>>,
    channels: Vec<(Topic, u16)>,
    sequence: u32,
}

/// Chunks on their way to a file. The end of an MCAP file without a summary follows each chunk, by the same call of the
/// system, and the next chunk takes its place: a program that is killed leaves a file that every reader opens.
struct Chunks {
    file: File,
    buffer: Vec<u8>,
}

impl Chunks {
    fn hand_on(&mut self, end: &[u8]) -> io::Result<()> {
        self.buffer.extend(end);
        self.file.write_all(&self.buffer)?;
        self.file.seek_relative(-(end.len() as i64))?;
        self.buffer.clear();
        Ok(())
    }
}

impl Write for Chunks {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        self.buffer.extend(bytes);
        Ok(bytes.len())
    }

    /// `DataEnd` (15) without a checksum, `Footer` (2) without a summary, each with its length, and the magic.
    fn flush(&mut self) -> io::Result<()> {
        let records = [&[15, 4, 0, 0, 0, 0, 0, 0, 0][..], &[0; 4], &[2, 20, 0, 0, 0, 0, 0, 0, 0], &[0; 20]];
        self.hand_on(&[&records.concat(), mcap::MAGIC].concat())
    }
}

impl Mcap {
    fn new(file: File, id: u8, device: About, pressures: bool) -> mcap::McapResult<Self> {
        let to = NoSeek::new(Chunks { file, buffer: Vec::new() });
        let mut out = write_options().disable_seeking(true).create(to)?;
        let metadata = Metadata { name: "fingertip.device".into(), metadata: device };
        out.write_metadata(&metadata)?;
        let topics = [Some(Topic::Scalars), pressures.then_some(Topic::Image)];
        let channel = |topic: Topic| Ok((topic, topic.add_to(&mut out, id, &metadata.metadata)?));
        let channels = topics.into_iter().flatten().map(channel).collect::<mcap::McapResult<_>>()?;
        Ok(Self { out, channels, sequence: 0 })
    }
}

impl Sink for Mcap {
    fn put(&mut self, stamp: &Stamp, state: &State) -> io::Result<()> {
        let (sequence, log_time, publish_time) = (self.sequence, stamp.read_ns, stamp.frame_ns);
        for (topic, channel_id) in &self.channels {
            let header = MessageHeader { channel_id: *channel_id, sequence, log_time, publish_time };
            self.out.write_to_known_channel(&header, &topic.message(stamp, state)).map_err(in_words)?;
        }
        self.sequence += 1;
        Ok(())
    }

    fn flush(&mut self) -> io::Result<()> {
        self.out.flush().map_err(in_words)
    }

    fn finish(mut self: Box<Self>) -> io::Result<()> {
        self.out.finish().map_err(in_words)?;
        let mut chunks = self.out.into_inner().into_inner();
        chunks.hand_on(&[])?;
        // The library may have flushed behind the summary.
        let end = chunks.file.stream_position()?;
        chunks.file.set_len(end)
    }
}
