//! Questions to the person at the terminal.

use crate::Error;
use crate::commands::{Interrupt, aside};
use rustix::event::{PollFd, PollFlags, Timespec, poll};
use std::io;

/// Time without a look at the signals, ns.
const POLL_NS: i64 = 50_000_000;
/// Wrong answers to one question after which the procedure ends.
const TRIES: u32 = 3;

/// Asks, unless answers are for scripts.
pub struct Ask {
    interrupt: Interrupt,
    json: bool,
}

impl Ask {
    /// Questions that a signal ends.
    pub fn new(interrupt: Interrupt, json: bool) -> Self {
        Self { interrupt, json }
    }

    /// Asks until the answer can be parsed. `idle` runs every 50 ms meanwhile. `option` gives the answer without a question.
    ///
    /// # Errors
    /// With `--json` there are no questions; the text names the option. Nobody answers, a signal came, or three answers
    /// were wrong.
    pub fn parsed<T>(
        &self,
        question: &str,
        option: &str,
        parse: impl Fn(&str) -> Result<T, String>,
        idle: &mut dyn FnMut() -> Result<(), Error>,
    ) -> Result<T, Error> {
        if self.json {
            return Err(Error::NotUnderstood(format!("--json asks no questions: give {option} (\"{question}\")")));
        }
        let mut why = String::new();
        for _ in 0..TRIES {
            aside(question);
            let line = self.line(option, idle)?;
            match parse(line.trim()) {
                Ok(answer) => return Ok(answer),
                Err(wrong) => why = format!("`{}`: {wrong}", line.trim()),
            }
            aside(&why);
        }
        Err(format!("{why}. {TRIES} answers to \"{question}\" were not understood; {option} gives the answer").into())
    }

    /// Yes or no.
    ///
    /// # Errors
    /// As [`Self::parsed`].
    pub fn yes(&self, question: &str, option: &str) -> Result<bool, Error> {
        self.parsed(&format!("{question} [yes/no]"), option, yes_or_no, &mut || Ok(()))
    }

    /// Waits for Enter.
    ///
    /// # Errors
    /// As [`Self::parsed`].
    pub fn enter(&self, question: &str, option: &str) -> Result<(), Error> {
        self.parsed(&format!("{question}; then press Enter"), option, |_| Ok(()), &mut || Ok(()))
    }

    fn line(&self, option: &str, idle: &mut dyn FnMut() -> Result<(), Error>) -> Result<String, Error> {
        let input = io::stdin();
        let wait = Timespec { tv_sec: 0, tv_nsec: POLL_NS };
        loop {
            self.interrupt.check()?;
            idle()?;
            match poll(&mut [PollFd::new(&input, PollFlags::IN)], Some(&wait)) {
                Ok(0) | Err(rustix::io::Errno::INTR) => continue,
                Ok(_) => {}
                Err(why) => return Err(format!("cannot read an answer: {why}").into()),
            }
            let line = unbuffered_line().map_err(|why| format!("cannot read an answer: {why}"))?;
            return line.ok_or_else(|| format!("nobody answers: give {option}").into());
        }
    }
}

/// A line of the standard input; none at its end. Bytes behind the line stay for the next question.
fn unbuffered_line() -> io::Result<Option<String>> {
    let (mut line, mut byte) = (Vec::new(), [0]);
    loop {
        match rustix::io::read(io::stdin(), &mut byte) {
            Ok(0) if line.is_empty() => return Ok(None),
            Ok(0) => break,
            Ok(_) if byte == *b"\n" => break,
            Ok(_) => line.extend(byte),
            Err(rustix::io::Errno::INTR) => {}
            Err(why) => return Err(why.into()),
        }
    }
    Ok(Some(String::from_utf8_lossy(&line).into_owned()))
}

/// Parses yes or no.
pub fn yes_or_no(text: &str) -> Result<bool, String> {
    match text.to_lowercase().as_str() {
        "y" | "yes" => Ok(true),
        "n" | "no" => Ok(false),
        _ => Err("yes or no is expected".into()),
    }
}
