//! `fingertip replay`.

use super::{say, say_json};
use crate::{Error, captured};
use serde_json::{Value, json};
use std::fs;
use std::path::{Path, PathBuf};

/// Options of a replay.
#[derive(Debug, clap::Args)]
#[command(after_help = "Examples:\n  fingertip replay press.mcap\n  fingertip replay captures")]
pub struct Args {
    /// Captures, or folders: all that ends with .mcap in them
    #[arg(required = true)]
    paths: Vec<PathBuf>,
}

/// Feeds captures through the core on this machine; a line for each.
pub fn run(args: &Args, json: bool) -> Result<(), Error> {
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
    let kept = match captured::open(file) {
        Ok(kept) => kept,
        Err(why) => return (json!({ "file": file, "refused": why }), format!("refused: {why}"), false),
    };
    let firmware = kept.about.get("firmware").cloned().unwrap_or_default();
    match captured::through_the_core(&kept.bytes, |_, _| {}) {
        Err(why) => {
            let why = why.to_string();
            let of = if firmware.is_empty() { String::new() } else { format!(" (firmware {firmware})") };
            let text = format!("refused: {why}{of}");
            (json!({ "file": file, "firmware": firmware, "refused": why }), text, false)
        }
        Ok(replayed) => {
            let frames = replayed.head.frames;
            let at = replayed.difference;
            let difference = at.map(|at| {
                json!({ "frame": at.frame, "field": at.field.name(), "captured": at.captured, "replayed": at.replayed })
            });
            let text = at.map_or("the same to the bit".into(), |at| at.to_string());
            let verdict = json!({ "file": file, "firmware": firmware, "frames": frames, "difference": difference });
            (verdict, format!("{frames} frames, {text}"), at.is_none())
        }
    }
}
