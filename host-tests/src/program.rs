//! How the programs of this package end, and how they tell how far they are.

use std::fmt::Display;
use std::io::{self, IsTerminal, Write};
use std::process::ExitCode;
use std::sync::Mutex;
use std::time::{Duration, Instant};

/// The exit code; says what went wrong.
pub fn ended(result: Result<(), String>) -> ExitCode {
    match result {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("error: {error}");
            ExitCode::FAILURE
        }
    }
}

/// A line that tells how far a program is: on a terminal only, a log wants the results.
pub struct Progress(Option<Mutex<Instant>>);

impl Progress {
    /// Nothing is shown yet.
    pub fn begin() -> Self {
        Self(io::stderr().is_terminal().then(|| Mutex::new(Instant::now())))
    }

    /// Shows a text, twice a second at most.
    pub fn show(&self, text: impl Display) {
        if let Some(shown) = &self.0
            && let Ok(mut shown) = shown.try_lock()
            && shown.elapsed() > Duration::from_millis(500)
        {
            *shown = Instant::now();
            eprint!("\r{text}");
            // Progress is a courtesy; a closed terminal is no reason to stop.
            let _ = io::stderr().flush();
        }
    }

    /// Ends the line with what takes it away.
    pub fn end(&self, text: impl Display) {
        if self.0.is_some() {
            eprint!("{text}");
        }
    }
}
