//! Control's side of a capture: control alone fills the memory with frames, then hands the memory to the link.

use core::sync::atomic::{AtomicU8, Ordering};

use fingertip::capture::{CaptureState, CaptureStatus, Ended};
use fingertip::command::Command;
use fingertip::frame::Sense;
use fingertip::measure::{MeasureState, Task};
use fingertip::pipeline::Status;
use fingertip::shipped::{Frame, Pipeline};

use super::exchange::CAPTURE;

/// Last request of the host that was not acknowledged.
static ASKED: AtomicU8 = AtomicU8::new(NOTHING);
const NOTHING: u8 = 0;
const ARM: u8 = 1;
const END: u8 = 2;

/// Asks for a capture, or for its end.
pub fn ask(arm: bool) {
    ASKED.store(if arm { ARM } else { END }, Ordering::Relaxed);
}

/// State of the capture that control knows without access to it.
#[derive(Clone, Copy, Default)]
pub struct Keeper {
    /// Status of the capture.
    pub standing: CaptureStatus,
    /// A motion that measures was under way in the step before.
    measures: bool,
}

impl Keeper {
    /// Acknowledges the request of the host.
    pub fn take_asked(&mut self) {
        match ASKED.load(Ordering::Relaxed) {
            NOTHING => return,
            // The link may be reading the one before: then in a later turn.
            ARM if self.standing.state == CaptureState::Done => {
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

    /// Returns true if the next step is the first one to keep.
    pub fn is_due(&mut self, pipeline: &Pipeline, command: impl FnOnce() -> Command) -> bool {
        if self.standing.state != CaptureState::Armed {
            return false;
        }
        let (mut due, command) = (false, command());
        self.work(|capture| due = capture.is_due(pipeline, &command));
        due
    }

    /// Begins.
    #[inline(never)]
    pub fn begin(&mut self, pipeline: &mut Pipeline) {
        self.work(|capture| capture.begin(pipeline));
    }

    /// Keeps a step, where one is to be kept.
    pub fn record(&mut self, frame: &Frame, sense: &Sense, command: &Command, status: &Status) {
        if self.standing.state == CaptureState::Recording {
            self.work(|capture| capture.record(frame, sense, command, status));
        }
    }

    /// Keeps the record of a motion that measures.
    pub fn follow(&mut self, pipeline: &Pipeline) {
        let motion = pipeline.status().measure;
        let runs = motion.state == MeasureState::Running && motion.task != Task::Jog;
        if !runs && !self.measures {
            return;
        }
        // The link may be reading what was kept before: then in the next frame. A motion whose record was ended early
        // ends in the capture too, or the next one would have no record.
        if self.standing.state == CaptureState::Done && runs != self.measures && CAPTURE.take(|_| ()).is_none() {
            return;
        }
        self.work(|capture| capture.follow(pipeline));
        self.measures = runs;
    }

    /// Ends it.
    pub fn end(&mut self, why: Ended) {
        if matches!(self.standing.state, CaptureState::Armed | CaptureState::Recording) {
            self.work(|capture| capture.end(why));
        }
    }

    /// A finished capture goes to the link, which alone accesses it from then on.
    #[inline(never)]
    fn work(&mut self, act: impl FnOnce(&mut fingertip::shipped::Capture)) {
        let standing = CAPTURE.work(|capture| {
            act(capture);
            capture.standing()
        });
        self.standing = standing.unwrap_or(self.standing);
        if self.standing.state == CaptureState::Done {
            CAPTURE.fill(|_| ());
        }
    }
}
