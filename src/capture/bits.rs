//! Bits, and numbers that are mostly small.
//!
//! A number is folded (0, -1, 1, -2 .. are 0, 1, 2, 3 ..) and written as its part above a width in ones, a zero, and as
//! many low bits as the width says (a Rice code). What would take [`ESCAPE`] ones or more is written as these ones and
//! all its bits.

/// Count of ones after which a number follows with all its bits.
pub const ESCAPE: u32 = 12;
/// The largest width.
pub(super) const WIDTH_MAX: u32 = 16;

/// Where the next bit goes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Place {
    /// Bits that are not yet a word, from the lowest one on: fewer than 32.
    held: u32,
    count: u32,
    /// Where their word will be.
    at: usize,
    /// Of the words before.
    check: u32,
}

impl Place {
    /// At the beginning.
    pub const START: Self = Self { held: 0, count: 0, at: 0, check: 0 };

    /// Bits written.
    pub fn bits(&self) -> u32 {
        8 * self.at as u32 + self.count
    }
}

/// Writes bits.
pub(super) struct Writer<'a> {
    bytes: &'a mut [u8],
    pub place: Place,
    /// There was no room for a word: what is behind it is lost.
    pub full: bool,
}

impl<'a> Writer<'a> {
    pub fn new(bytes: &'a mut [u8], place: Place) -> Self {
        Self { bytes, place, full: false }
    }

    /// The low bits of a number, at most 32; those above must be 0.
    #[inline(always)]
    pub fn put(&mut self, value: u32, count: u32) {
        self.place.held |= value << self.place.count;
        self.place.count += count;
        if self.place.count >= 32 {
            self.word(self.place.held);
            self.place.count -= 32;
            // What did not fit: none of 32 bits that fill a word.
            self.place.held = value.checked_shr(count - self.place.count).unwrap_or(0);
        }
    }

    /// A whole word.
    #[inline(always)]
    fn word(&mut self, word: u32) {
        let place = &mut self.place;
        match self.bytes.get_mut(place.at..).and_then(|rest| rest.first_chunk_mut()) {
            Some(to) => *to = word.to_le_bytes(),
            None => self.full = true,
        }
        place.at += 4;
        place.check = mix(place.check, word);
    }

    /// Codes as their folded differences to those before, each of 16 bits at most; what these add up to.
    ///
    /// [`Writer::folded`] for each, with the word under way in registers: a frame has a hundred of them.
    #[inline(never)]
    pub fn codes(&mut self, codes: &[u16], before: &[u16], width: u32) -> u32 {
        let width = width & 31;
        let (mut sum, mask) = (0_u32, (1 << width) - 1);
        let (mut held, mut filled) = (self.place.held, self.place.count);
        for (&code, &before) in codes.iter().zip(before) {
            let value = fold(code, before);
            sum = sum.wrapping_add(value);
            let ones = value >> width;
            if ones >= ESCAPE {
                (self.place.held, self.place.count) = (held, filled);
                self.escaped(value);
                (held, filled) = (self.place.held, self.place.count);
                continue;
            }
            let bits = (value & mask) << (ones + 1) | ((1 << ones) - 1);
            let count = ones + 1 + width;
            held |= bits << (filled & 31);
            filled += count;
            if filled >= 32 {
                self.word(held);
                filled -= 32;
                held = bits >> (count.wrapping_sub(filled) & 31);
            }
        }
        (self.place.held, self.place.count) = (held, filled);
        sum
    }

    #[cold]
    #[inline(never)]
    fn escaped(&mut self, value: u32) {
        self.put((1 << ESCAPE) - 1, ESCAPE);
        self.put(value, 16);
    }

    /// Brings what is not yet a word to its place; the check sum of all.
    pub fn finish(self) -> u32 {
        let place = self.place;
        if let Some(to) = self.bytes.get_mut(place.at..).and_then(|rest| rest.first_chunk_mut()) {
            *to = place.held.to_le_bytes();
        }
        mix(place.check, place.held)
    }

    /// A folded number of at most `all` bits.
    #[inline(always)]
    fn folded(&mut self, value: u32, width: u32, all: u32) {
        let ones = value >> width;
        if ones < ESCAPE {
            let low = value & ((1 << width) - 1);
            self.put(low << (ones + 1) | ((1 << ones) - 1), ones + 1 + width);
        } else {
            self.put((1 << ESCAPE) - 1, ESCAPE);
            self.put(value, all);
        }
    }

    /// A difference of 32 bits.
    pub fn signed(&mut self, value: i32, width: u32) {
        self.folded((value << 1 ^ value >> 31).cast_unsigned(), width, 32);
    }
}

/// Turned, mixed, multiplied by an odd number (2^32 over the golden ratio): no word that differs is lost.
#[inline(always)]
pub(super) const fn mix(sum: u32, word: u32) -> u32 {
    (sum.rotate_left(5) ^ word).wrapping_mul(0x9E37_79B1)
}

/// A difference of 16 bits, folded.
#[inline(always)]
pub(super) fn fold(value: u16, last: u16) -> u32 {
    let difference = value.wrapping_sub(last).cast_signed();
    (difference << 1 ^ difference >> 15).cast_unsigned().into()
}
