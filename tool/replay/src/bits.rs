//! Reads bits, and the numbers that a capture folds into them.

use fingertip::capture::{ESCAPE, digest_words};

/// Reads the bits of a capture's frames.
#[derive(Clone, Debug)]
pub struct Reader<'a> {
    bytes: &'a [u8],
    at: u32,
    /// How many bits there are.
    end: u32,
}

impl<'a> Reader<'a> {
    /// From the first bit on.
    pub fn new(bytes: &'a [u8], bits: u32) -> Self {
        Self { bytes, at: 0, end: bits }
    }

    /// Whether all was read.
    pub fn is_empty(&self) -> bool {
        self.at == self.end
    }

    /// A number of so many bits, at most 32; none where they are not there.
    pub fn get(&mut self, count: u32) -> Option<u32> {
        let end = self.at.checked_add(count).filter(|&end| end <= self.end)?;
        let mut value = 0;
        for (place, bit) in (self.at..end).enumerate() {
            let byte = self.bytes.get((bit / 8) as usize)?;
            value |= u32::from(byte >> (bit % 8) & 1) << place;
        }
        self.at = end;
        Some(value)
    }

    /// A folded number of at most `all` bits.
    pub fn folded(&mut self, width: u32, all: u32) -> Option<u32> {
        let mut ones = 0;
        while ones < ESCAPE && self.get(1)? == 1 {
            ones += 1;
        }
        if ones == ESCAPE { self.get(all) } else { Some(ones << width | self.get(width)?) }
    }

    /// A difference of 32 bits.
    pub fn signed(&mut self, width: u32) -> Option<i32> {
        let folded = self.folded(width, 32)?;
        Some((folded >> 1).cast_signed() ^ -(folded & 1).cast_signed())
    }
}

/// The check sum over all words of the frames' bits, the last one filled up with zeros.
pub fn check(bytes: &[u8], bits: u32) -> u32 {
    let words = (0..=bits / 32).map(|place| {
        let rest = bytes.get(4 * place as usize..).unwrap_or_default();
        let mut word = [0; 4];
        word.iter_mut().zip(rest).for_each(|(to, byte)| *to = *byte);
        u32::from_le_bytes(word)
    });
    digest_words(0, words)
}

/// Undoes the folding of a difference of 16 bits.
pub fn unfold(folded: u32, last: u16) -> u16 {
    let difference = (folded >> 1) as u16 ^ ((folded & 1) as u16).wrapping_neg();
    last.wrapping_add(difference)
}
