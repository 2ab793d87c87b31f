//! Captures on the host: reads their bytes ([`fingertip::capture`] has the layout), and feeds the frames through the core
//! again, whose answers must be the same to the bit.

mod bits;
mod frames;
mod head;

pub use frames::{Frames, Refusal, Taken};

use fingertip::capture::{Head, digest_step, digest_words, short_digest};
use fingertip::config::Shaped;
use fingertip::control::Winding;
use fingertip::pipeline::{Pipeline, Status};
use fingertip::pressure::Calibration;
use fingertip::scan::Clocks;

/// A capture that was fed through the core again.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Replayed<const ROWS: usize, const COLUMNS: usize> {
    /// Its beginning.
    pub head: Head<ROWS, COLUMNS>,
    /// Where the core answered otherwise first.
    pub difference: Option<Difference>,
}

/// Where a replay leaves its capture.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Difference {
    /// The frame, from 0.
    pub frame: u32,
    /// What differs.
    pub field: Field,
    /// Its value as captured.
    pub captured: i64,
    /// Its value in the replay.
    pub replayed: i64,
}

/// What a step answers, as far as a capture keeps it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Field {
    /// The duty, Q15.
    Duty,
    /// The mode's number.
    Mode,
    /// The fault's number.
    Fault,
    /// The digest of the whole status.
    Digest,
}

impl Field {
    /// Its name.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Duty => "duty",
            Self::Mode => "mode",
            Self::Fault => "fault",
            Self::Digest => "digest",
        }
    }
}

impl std::fmt::Display for Difference {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let Self { frame, field, captured, replayed } = self;
        write!(f, "differs first at frame {frame}: {} captured {captured}, replayed {replayed}", field.name())
    }
}

/// Replays a capture; `each` is handed every frame with what the core reports here. It goes on behind a difference.
///
/// # Errors
/// The bytes are no capture that this version replays, or damaged.
pub fn replay<const ROWS: usize, const COLUMNS: usize>(
    bytes: &[u8],
    clocks: &Clocks,
    mut each: impl FnMut(&Taken<ROWS, COLUMNS>, &Status),
) -> Result<Replayed<ROWS, COLUMNS>, Refusal> {
    let (head, frames) = Frames::<ROWS, COLUMNS>::new(bytes)?;
    let config = Shaped::new(&head.params, clocks).map_err(Refusal::Config)?;
    let (captured, here) = (head.frame_ns, config.timing.frame_ns);
    if captured != here {
        return Err(Refusal::FrameTime { captured, here });
    }
    let mut pipeline = Pipeline::new(&config);
    pipeline.calibrate(&Calibration::of(&head.gains));
    let winding = Winding::of_words(&head.winding, &config).ok_or(Refusal::Damaged)?;
    pipeline.renew(head.taken, head.missed_frames, winding);
    let (mut difference, mut running) = (None, head.seed());
    for (frame, taken) in (0..).zip(frames) {
        let taken = taken?;
        let (duty, status) = pipeline.step(&taken.frame, &taken.sense, &taken.command);
        running = digest_step(running, duty, status);
        let fields = [
            (Field::Duty, i64::from(taken.duty.0), i64::from(duty.0)),
            (Field::Mode, taken.mode.into(), status.mode as i64),
            (Field::Fault, taken.fault.into(), status.fault.map_or(0, |fault| fault as i64)),
            (Field::Digest, taken.digest.into(), short_digest(running).into()),
        ];
        let first = fields.into_iter().find(|(_, captured, replayed)| captured != replayed);
        difference =
            difference.or(first.map(|(field, captured, replayed)| Difference { frame, field, captured, replayed }));
        each(&taken, status);
    }
    let running = digest_words(running, std::iter::once(head.ended as u32));
    if running != head.digest && difference.is_none() {
        let frame = head.frames.saturating_sub(1);
        let [captured, replayed] = [head.digest, running].map(i64::from);
        difference = Some(Difference { frame, field: Field::Digest, captured, replayed });
    }
    Ok(Replayed { head, difference })
}
