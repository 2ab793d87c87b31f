//! A running digest of all that steps report: quick enough for the board.

use super::bits::mix;
use crate::pipeline::Status;
use crate::units::Duty;

/// The digest after one more step. What differs once makes all that follow differ.
pub fn add(digest: u32, duty: Duty, status: &Status) -> u32 {
    let mut sum = digest;
    status.words(duty, |word| sum = mix(sum, word));
    sum
}

/// A digest of words, to begin with or to go on from.
pub fn words(digest: u32, words: impl Iterator<Item = u32>) -> u32 {
    words.fold(digest, mix)
}

/// What of a digest is kept with each frame: the upper bits, which all others reach.
pub const fn short(digest: u32) -> u16 {
    (digest >> 16) as u16
}
