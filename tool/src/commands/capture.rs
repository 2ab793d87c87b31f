//! `fingertip capture`, and `fingertip replay` of what it wrote.

use super::stop::{Moving, no_tare};
use super::{Interrupt, TOUCHED, answer, at_rest, press, report, say, say_json, stopped, wait_for};
use crate::recordings::{self, About, ENDED, device};
use crate::state::unix_ns;
use crate::whole::Part;
use crate::{Client, Error, numbers, table};
use fingertip::capture::CaptureState;
use fingertip::pipeline::Taring;
use fingertip::shipped::address;
use fingertip::state::Limits;
use serde_json::{Value, json};
use std::fs;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

const LOOK: Duration = Duration::from_millis(5);
const ARMED: i64 = CaptureState::Armed as i64;
const RECORDING: i64 = CaptureState::Recording as i64;
const DONE: i64 = CaptureState::Done as i64;
const LICENCE: &str = "Apache-2.0 OR MIT, as the project: contributed by who captured it";

#[derive(Debug, clap::Args)]
#[command(after_help = "Examples:\n  \
    fingertip capture --out tare.mcap    (nothing moves: a tare, and the frames after it)\n  \
    fingertip capture --press 0.5 --out press.mcap --board \"NUCLEO-F446RE, DRV8876\" --notes \"steel plate, 1 mm away\"\n  \
    fingertip replay press.mcap")]
pub struct Args {
    /// The file, `.mcap`
    #[arg(long)]
    out: PathBuf,
    /// Write over a file that is there
    #[arg(long)]
    force: bool,
    /// Force to touch and hold after the tare, N, until the memory is full; then the finger releases
    #[arg(long, value_name = "NEWTONS", value_parser = numbers::goal_mn)]
    press: Option<i64>,
    /// Number of frames after which the capture ends; without it, when the memory is full
    #[arg(long, value_parser = clap::value_parser!(u32).range(1..))]
    frames: Option<u32>,
    /// Description of the board and its connections
    #[arg(long, default_value = "not told")]
    board: String,
    /// Image on the board, by its SHA-256 as `cargo xtask flash` prints it
    #[arg(long, default_value = "not told")]
    image: String,
    /// Notes: object, distance, what happened
    #[arg(long, default_value = "")]
    notes: String,
    /// Contribute it to the project under the project's licences
    #[arg(long)]
    contribute: bool,
    /// Longest time until the capture is done
    #[arg(long, default_value_t = 10.0, value_parser = numbers::seconds)]
    within_s: f64,
}

impl Args {
    pub fn check(&self) -> Result<(), Error> {
        if self.out.extension().is_some_and(|ending| ending == "mcap") {
            return Ok(());
        }
        Err(Error::NotUnderstood(format!("{}: a name that ends with .mcap is asked for", self.out.display())))
    }
}

/// Arms a capture, tares and, where asked to, presses; reads what the board kept, and writes it as a file.
pub fn run(args: &Args, client: &mut Client, json: bool) -> Result<(), Error> {
    at_rest(client)?;
    if client.number(address::CAPTURE_STATE)? == RECORDING {
        client.set(address::CAPTURE, 0)?;
    }
    if args.press.is_some() {
        press::direction_confirmed(client)?;
    }
    let part = Part::begin(&args.out, args.force)?;
    let interrupt = Interrupt::catch()?;
    let count = if args.press.is_some() {
        let moving = Moving::begin(client, &interrupt)?;
        let kept = keep(args, moving.client, &interrupt, json);
        moving.finish(kept)?
    } else {
        keep(args, client, &interrupt, json)?
    };
    let ended_ns = unix_ns();
    let bytes = fetch(client, count, json)?;
    let mut touched = false;
    let replayed =
        recordings::through_the_core(&bytes, |_, status| touched |= status.limits.has(Limits::TARED_TOUCHING))
            .map_err(|why| format!("what the board kept is of no use here: {why}"))?;
    let about = about(args, ended_ns, client)?;
    let file = |why: &dyn std::fmt::Display| Error::file("write", &args.out, why);
    recordings::write(part.file().map_err(|why| file(&why))?, &bytes, &about).map_err(|why| file(&why))?;
    part.place()?;
    let ended = table::meaning(address::CAPTURE_ENDED, replayed.head.ended as i64);
    let (frames, seconds) =
        (replayed.head.frames, f64::from(replayed.head.frames) * f64::from(replayed.head.frame_ns) * 1e-9);
    let difference = replayed.difference.map(|difference| difference.to_string());
    let value = json!({
        "file": args.out, "frames": frames, "seconds": seconds, "bytes": bytes.len(), "ended": ended,
        "replays": difference.is_none(), "difference": difference, "touched": touched,
    });
    let replays = difference.as_ref().map_or("replays here to the bit".to_owned(), |at| format!("here it {at}"));
    let text = format_args!("{frames} frames, {seconds:.4} s, {} bytes; ended: {ended}; {replays}", bytes.len());
    answer(json, &value, text);
    // The file is what shows it, so it is kept.
    match difference {
        None if touched => Err(TOUCHED.into()),
        None if args.press.is_some() => interrupt.check(),
        None => Ok(()),
        Some(at) => {
            let why = format!("the core of this version does not answer as the board did: it {at}");
            Err(format!("{why}. Are both of one version?").into())
        }
    }
}

/// Has the board keep frames: the number of the capture.
fn keep(args: &Args, client: &mut Client, interrupt: &Interrupt, json: bool) -> Result<i64, Error> {
    let within = Duration::from_secs_f64(args.within_s);
    let before = client.number(address::CAPTURE_COUNT)?;
    client.set(address::CAPTURE, 1)?;
    if wait_for(client, address::CAPTURE_STATE, within, |state| state == ARMED)? != ARMED {
        return Err("the controller does not arm a capture: do frames come in?".into());
    }
    report("armed; taring, nothing may touch the tip", json);
    client.set(address::TARE, 1)?;
    let until = Instant::now() + within;
    let begun = loop {
        if client.again(|client| client.number(address::CAPTURE_STATE))? != ARMED {
            break true;
        }
        if Instant::now() >= until || interrupt.came() {
            break false;
        }
        // After a refused tare no capture begins.
        let state = client.again(|client| client.number(address::TARE_STATE))?;
        if state == Taring::Refused as i64 {
            client.again(|client| client.set(address::CAPTURE, 0))?;
            return Err(no_tare(state, client));
        }
    };
    // Without a new tare a press would use the old zero. After a signal torque stays off.
    if let Some(goal_mn) = args.press.filter(|_| begun && !interrupt.came()) {
        // During the tare, so that the approach begins right after it.
        press::begin(goal_mn, client)?;
    }
    loop {
        let block = client.again(|client| client.block(address::CAPTURE_STATE, address::CAPTURE_FRAMES))?;
        let (state, frames) = (block.number(address::CAPTURE_STATE), block.number(address::CAPTURE_FRAMES));
        let count = block.number(address::CAPTURE_COUNT);
        if state == DONE {
            return Ok(count);
        }
        if count == before && state != ARMED {
            return Err("the capture is gone: the controller restarted, or another host cancelled it".into());
        }
        // Zeros that hide a touch would let it press harder than it was asked to.
        if args.press.is_some() && state == RECORDING {
            let limits = client.again(|client| client.number(address::LIMITS))?;
            if Limits(limits as u16).has(Limits::TARED_TOUCHING) {
                client.again(|client| client.set(address::CAPTURE, 0))?;
                return Err(TOUCHED.into());
            }
        }
        let enough = args.frames.is_some_and(|wanted| frames >= i64::from(wanted));
        let late = Instant::now() >= until;
        if enough || late || interrupt.came() {
            client.again(|client| client.set(address::CAPTURE, 0))?;
            if frames > 0 && wait_for(client, address::CAPTURE_STATE, within, |state| state == DONE)? == DONE {
                return client.number(address::CAPTURE_COUNT);
            }
            let fault = client.number(address::FAULT)?;
            return Err(if fault == 0 { "nothing was kept: no tare began".into() } else { stopped(fault) });
        }
        std::thread::sleep(LOOK);
    }
}

/// Reads what was kept: the bytes of the capture with this number.
pub(super) fn fetch(client: &mut Client, count: i64, json: bool) -> Result<Vec<u8>, Error> {
    let length = client.number(address::CAPTURE_BYTES)? as usize;
    let window = table::register_at(address::CAPTURE_DATA).map_or(1, |register| register.count);
    let (mut bytes, mut said) = (Vec::with_capacity(length), Instant::now());
    while bytes.len() < length {
        let offset = bytes.len() as i64;
        let part = client.again(|client| {
            client.set(address::CAPTURE_OFFSET, offset)?;
            client.read(address::CAPTURE_DATA, window)
        })?;
        bytes.extend(part.into_iter().take(length - bytes.len()));
        if said.elapsed() >= Duration::from_secs(1) {
            said = Instant::now();
            report(format_args!("read {} of {length} bytes", bytes.len()), json);
        }
    }
    let block = client.block(address::CAPTURE_STATE, address::CAPTURE_COUNT)?;
    if [block.number(address::CAPTURE_STATE), block.number(address::CAPTURE_COUNT)] != [DONE, count] {
        return Err("another host began a capture while this one was read, or the controller restarted".into());
    }
    Ok(bytes)
}

fn about(args: &Args, ended_ns: u64, client: &mut Client) -> Result<About, Error> {
    let licence = if args.contribute { LICENCE } else { "not contributed: ask who captured it" };
    let entries = [
        ("board", args.board.clone()),
        ("image", args.image.clone()),
        ("notes", args.notes.clone()),
        ("licence", licence.to_owned()),
        (ENDED, ended_ns.to_string()),
    ];
    let mut about = device(client)?;
    about.extend(entries.map(|(name, value)| (name.to_owned(), value)));
    Ok(about)
}

#[derive(Debug, clap::Args)]
#[command(after_help = "Examples:\n  fingertip replay press.mcap\n  fingertip replay captures")]
pub struct Replay {
    /// Captures, or folders: all that ends with .mcap in them
    #[arg(required = true)]
    paths: Vec<PathBuf>,
}

/// Feeds captures through the core on this machine; a line for each.
pub fn replay_all(args: &Replay, json: bool) -> Result<(), Error> {
    let mut files = Vec::new();
    for path in &args.paths {
        find(path, &mut files).map_err(|why| Error::file("read", path, why))?;
    }
    let (mut told, mut wrong) = (Vec::new(), 0);
    for file in &files {
        let (verdict, text, good) = replay(file);
        wrong += usize::from(!good);
        if json {
            told.push(verdict);
        } else {
            say(format_args!("{}: {}", file.display(), text));
        }
    }
    if json {
        say_json(&Value::Array(told));
    }
    match (files.len(), wrong) {
        (0, _) => Err("no capture there: nothing was replayed".into()),
        (_, 0) => Ok(()),
        (all, wrong) => Err(format!("{wrong} of {all} captures do not replay").into()),
    }
}

/// Files that end with `.mcap`, in the order of the names; a file that is named counts whatever its name. A link to a
/// folder is not followed: it may lead back.
fn find(path: &Path, files: &mut Vec<PathBuf>) -> std::io::Result<()> {
    if !fs::metadata(path)?.is_dir() {
        files.push(path.into());
        return Ok(());
    }
    let mut inside: Vec<PathBuf> =
        fs::read_dir(path)?.map(|entry| Ok(entry?.path())).collect::<std::io::Result<_>>()?;
    inside.sort();
    for path in inside {
        let folder = fs::symlink_metadata(&path)?.is_dir();
        if folder || path.is_file() && path.extension().is_some_and(|ending| ending == "mcap") {
            find(&path, files)?;
        }
    }
    Ok(())
}

/// Result of a file in JSON and in words, and whether it is as expected.
fn replay(file: &Path) -> (Value, String, bool) {
    let kept = recordings::open(file);
    let firmware = kept.as_ref().ok().and_then(|kept| kept.about.get("firmware").cloned()).unwrap_or_default();
    let replayed =
        kept.and_then(|kept| recordings::through_the_core(&kept.bytes, |_, _| {}).map_err(|why| why.to_string()));
    match replayed {
        Err(why) => {
            let of = if firmware.is_empty() { String::new() } else { format!(" (firmware {firmware})") };
            let text = format!("refused: {why}{of}");
            (json!({ "file": file, "firmware": firmware, "refused": why }), text, false)
        }
        Ok(replayed) => {
            let frames = replayed.head.frames;
            let at = replayed.difference;
            let difference = at.map(
                |at| json!({ "frame": at.frame, "field": at.field, "captured": at.captured, "replayed": at.replayed }),
            );
            let text = at.map_or("the same to the bit".into(), |at| at.to_string());
            let verdict = json!({ "file": file, "firmware": firmware, "frames": frames, "difference": difference });
            (verdict, format!("{frames} frames, {text}"), at.is_none())
        }
    }
}
