//! A capture's beginning: what the loop knew before its first frame.

use super::{Ended, VERSION, digest};
use crate::control::WINDING_WORDS;
use crate::params::Params;
use crate::pipeline::Taken;
use crate::pressure::Gains;

/// What a capture begins with.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Head<const ROWS: usize, const COLUMNS: usize> {
    /// Why it ended.
    pub ended: Ended,
    /// Frames in it.
    pub frames: u32,
    /// Bits of all its frames.
    pub bits: u32,
    /// The digest after the last one.
    pub digest: u32,
    /// The check sum of its frames' bits.
    pub check: u32,
    /// Frames missed since reset, before the first one.
    pub missed_frames: u32,
    /// Requests taken up before.
    pub taken: Taken,
    /// What is known of the motor's winding, as [`Winding`](crate::control::Winding) tells it.
    pub winding: [u32; WINDING_WORDS],
    /// From frame to frame.
    pub frame_ns: u32,
    /// The parameters in force.
    pub params: Params,
    /// The gains in force.
    pub gains: Gains<ROWS, COLUMNS>,
}

/// First bytes of a capture.
pub const MAGIC: [u8; 4] = [b'F', b'T', b'C', VERSION];
/// Bytes before the parameters.
const FIXED: usize = 40 + 4 * WINDING_WORDS;

/// A number for the names and the order of the parameters (FNV-1a of 32 bits).
pub const LAYOUT: u32 = {
    let (mut hash, mut place) = (0x811C_9DC5_u32, 0);
    while place < Params::COUNT {
        let name = Params::RANGES[place].0.as_bytes();
        let mut at = 0;
        while at <= name.len() {
            let byte = if at < name.len() { name[at] } else { 0 };
            hash = (hash ^ byte as u32).wrapping_mul(0x0100_0193);
            at += 1;
        }
        place += 1;
    }
    hash
};

impl<const ROWS: usize, const COLUMNS: usize> Head<ROWS, COLUMNS> {
    /// Its bytes.
    pub const BYTES: usize = FIXED + 4 * Params::COUNT + 4 * Gains::<ROWS, COLUMNS>::WORDS;

    /// What the digest of the steps goes on from: all that is known before the first one.
    pub fn seed(&self) -> u32 {
        let first = [self.missed_frames, self.taken.word(), self.frame_ns];
        let params = self.params.to_array().map(i32::cast_unsigned);
        let gains = (0..Gains::<ROWS, COLUMNS>::WORDS).map(|word| self.gains.word(word));
        digest::words(LAYOUT, first.into_iter().chain(self.winding).chain(params).chain(gains))
    }

    pub(super) fn write(&self, bytes: &mut [u8]) {
        let mut rest = bytes;
        let mut put = |word: [u8; 4]| {
            if let Some((place, after)) = core::mem::take(&mut rest).split_first_chunk_mut() {
                *place = word;
                rest = after;
            }
        };
        put(MAGIC);
        put([ROWS as u8, COLUMNS as u8, self.ended as u8, 0]);
        for word in [LAYOUT, self.frames, self.bits, self.digest, self.check, self.missed_frames] {
            put(word.to_le_bytes());
        }
        put(self.taken.word().to_le_bytes());
        put(self.frame_ns.to_le_bytes());
        self.winding.iter().for_each(|word| put(word.to_le_bytes()));
        self.params.to_array().iter().for_each(|value| put(value.to_le_bytes()));
        (0..Gains::<ROWS, COLUMNS>::WORDS).for_each(|word| put(self.gains.word(word).to_le_bytes()));
    }

    /// Says in one that was written why the capture ended, and its frames, bits, digest and check sum.
    pub(super) fn close(bytes: &mut [u8], ended: Ended, words: [u32; 4]) {
        if let Some(place) = bytes.get_mut(6) {
            *place = ended as u8;
        }
        for (place, word) in bytes.get_mut(12..28).unwrap_or_default().as_chunks_mut::<4>().0.iter_mut().zip(words) {
            *place = word.to_le_bytes();
        }
    }
}
