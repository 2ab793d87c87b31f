//! Captures as files: MCAP, with the capture as the board kept it attached, and what it shows as messages.
//!
//! | part | what |
//! | --- | --- |
//! | attachment `capture.bin` | the capture, byte for byte (`fingertip::capture`): all that a replay needs |
//! | metadata `fingertip.capture` | whose it is: board, firmware, image, notes, licence; and for people parameters, gains, frame time |
//! | `/fingerN/scalars`, `/fingerN/frame`, N the ID less one | as in a scene's recording: what the core on this machine makes of the frames |

mod read;
mod write;

pub use read::{Kept, of_bytes, open};
pub use write::write;

use fingertip::pipeline::Status;
use fingertip::shipped::{CLOCKS, COLUMNS, ROWS};
use replay::{Refusal, Replayed, Taken, replay};

/// The attachment's name, and the metadata record's.
const ATTACHED: &str = "capture.bin";
const ABOUT: &str = "fingertip.capture";
/// Entry of the metadata: host's time of the last frame, ns since 1970.
pub const ENDED: &str = "ended_unix_ns";

/// What is known of a capture beside its bytes, by name.
pub type About = std::collections::BTreeMap<String, String>;

/// Feeds a capture through the core on this machine.
///
/// # Errors
/// It is none that this version replays.
pub fn through_the_core(
    bytes: &[u8],
    each: impl FnMut(&Taken<ROWS, COLUMNS>, &Status),
) -> Result<Replayed<ROWS, COLUMNS>, Refusal> {
    replay(bytes, &CLOCKS, each)
}
