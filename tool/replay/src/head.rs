//! A capture's beginning, read.

use crate::Refusal;
use fingertip::capture::{Ended, Head, LAYOUT, MAGIC};
use fingertip::control::WINDING_WORDS;
use fingertip::params::Params;
use fingertip::pipeline::Taken;
use fingertip::pressure::Gains;

/// Reads the head of a capture.
///
/// # Errors
/// The bytes are no capture, or one of another array, layout or version.
pub fn read<const ROWS: usize, const COLUMNS: usize>(bytes: &[u8]) -> Result<Head<ROWS, COLUMNS>, Refusal> {
    let mut words = bytes.as_chunks::<4>().0.iter().copied();
    let mut next = || words.next().ok_or(Refusal::Cut);
    let magic = next()?;
    if magic[..3] != MAGIC[..3] {
        return Err(Refusal::NoCapture);
    }
    if magic != MAGIC {
        return Err(Refusal::Version(magic[3]));
    }
    let [rows, columns, ended, zero] = next()?;
    if [usize::from(rows), usize::from(columns)] != [ROWS, COLUMNS] {
        return Err(Refusal::Shape { rows, columns });
    }
    if u32::from_le_bytes(next()?) != LAYOUT {
        return Err(Refusal::Layout);
    }
    let ended = Ended::of(ended).filter(|&ended| ended != Ended::No).ok_or(Refusal::Unfinished)?;
    let [frames, bits] = [u32::from_le_bytes(next()?), u32::from_le_bytes(next()?)];
    let [digest, check] = [u32::from_le_bytes(next()?), u32::from_le_bytes(next()?)];
    let missed_frames = u32::from_le_bytes(next()?);
    let taken = Taken::from_word(u32::from_le_bytes(next()?)).filter(|_| zero == 0);
    let taken = taken.ok_or(Refusal::Damaged)?;
    let frame_ns = u32::from_le_bytes(next()?);
    let mut winding = [0; WINDING_WORDS];
    for word in &mut winding {
        *word = u32::from_le_bytes(next()?);
    }
    let mut values = [0; Params::COUNT];
    for value in &mut values {
        *value = i32::from_le_bytes(next()?);
    }
    let mut gains = Gains::ONE;
    for word in 0..Gains::<ROWS, COLUMNS>::WORDS {
        if !gains.set_word(word, u32::from_le_bytes(next()?)) {
            return Err(Refusal::Damaged);
        }
    }
    let params = Params::from_array(&values);
    Ok(Head { ended, frames, bits, digest, check, missed_frames, taken, winding, frame_ns, params, gains })
}
