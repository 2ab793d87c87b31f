//! Output of a program. A reader that goes away, such as `head`, or a full disk behind the output ends the output,
//! not the run.

use std::fmt::{Arguments, Display};
use std::io::{self, ErrorKind, Write as _};
use std::sync::OnceLock;

/// Why nothing more is said.
static LOST: OnceLock<io::Error> = OnceLock::new();

pub fn line(text: impl Display) {
    show(format_args!("{text}\n"));
}

/// Says a text that has its lines' ends.
pub fn text(text: impl Display) {
    show(format_args!("{text}"));
}

fn show(text: Arguments) {
    if LOST.get().is_none() {
        keep(io::stdout().lock().write_fmt(text));
    }
}

/// Prints a line to standard error; a failure is ignored.
pub fn aside(text: impl Display) {
    // In one piece: what several processes say stays lines.
    let _ = io::stderr().write_all(format!("{text}\n").as_bytes());
}

/// Flushes standard output and reports a failed write. Returns true if the program may exit with success: a closed pipe
/// is not an error, as the reader has seen enough; a full disk is one.
pub fn end() -> bool {
    keep(io::stdout().flush());
    match LOST.get() {
        None => true,
        Some(error) if error.kind() == ErrorKind::BrokenPipe => {
            aside("the reader of the output went away: the rest is not shown, the files are written as ever");
            true
        }
        Some(error) => {
            aside(format_args!("cannot write to the standard output: {error}; the files are written as ever"));
            false
        }
    }
}

fn keep(said: io::Result<()>) {
    if let Err(error) = said {
        let _ = LOST.set(error);
    }
}
