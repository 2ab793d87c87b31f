//! Control's side of a capture: it keeps frames while nobody else reaches the memory, then leaves it to the link.

use core::sync::atomic::{AtomicU8, Ordering};

use fingertip::capture::{Ended, Standing, State};
use fingertip::command::Command;
use fingertip::frame::Sense;
use fingertip::pipeline::Status;
use fingertip::shipped::{Frame, Pipeline};

use super::exchange::CAPTURE;

/// What the host asked for last, and nobody took up.
static ASKED: AtomicU8 = AtomicU8::new(NOTHING);
const NOTHING: u8 = 0;
const ARM: u8 = 1;
const END: u8 = 2;

/// Asks for a capture, or for its end.
pub fn ask(arm: bool) {
    ASKED.store(if arm { ARM } else { END }, Ordering::Relaxed);
}

/// What control knows of the capture without reaching for it.
#[derive(Clone, Copy, Default)]
pub struct Keeper(Standing);

impl Keeper {
    /// How it stands.
    pub fn standing(self) -> Standing {
        self.0
    }

    /// Takes up what the host asked for.
    pub fn take_asked(&mut self) {
        match ASKED.load(Ordering::Relaxed) {
            NOTHING => return,
            // The link may be reading the one before: then in a later turn.
            ARM if self.0.state == State::Done => {
                if CAPTURE.take(|_| ()).is_none() {
                    return;
                }
                self.work(|capture| capture.arm());
            }
            ARM => self.work(|capture| capture.arm()),
            _ => self.end(Ended::Asked),
        }
        ASKED.store(NOTHING, Ordering::Relaxed);
    }

    /// Whether the next step is to be the first one kept.
    pub fn is_due(&mut self, status: &Status, command: impl FnOnce() -> Command) -> bool {
        if self.0.state != State::Armed {
            return false;
        }
        let (mut due, command) = (false, command());
        self.work(|capture| due = capture.is_due(status, &command));
        due
    }

    /// Begins.
    #[inline(never)]
    pub fn begin(&mut self, pipeline: &mut Pipeline) {
        self.work(|capture| capture.begin(pipeline));
    }

    /// Keeps a step, where one is to be kept.
    pub fn record(&mut self, frame: &Frame, sense: &Sense, command: &Command, status: &Status) {
        if self.0.state == State::Recording {
            self.work(|capture| capture.record(frame, sense, command, status));
        }
    }

    /// Ends it.
    pub fn end(&mut self, why: Ended) {
        if matches!(self.0.state, State::Armed | State::Recording) {
            self.work(|capture| capture.end(why));
        }
    }

    /// What is done goes to the link, which alone reaches it from then on.
    #[inline(never)]
    fn work(&mut self, act: impl FnOnce(&mut fingertip::shipped::Capture)) {
        let standing = CAPTURE.work(|capture| {
            act(capture);
            capture.standing()
        });
        self.0 = standing.unwrap_or(self.0);
        if self.0.state == State::Done {
            CAPTURE.fill(|_| ());
        }
    }
}
