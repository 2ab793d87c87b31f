//! Record of a motion, as it is stored in the memory of a capture and read over the bus; little-endian.
//!
//! | byte | what |
//! | --- | --- |
//! | 0 | the letters `FTS` and [`VERSION`] |
//! | 4 | 1 press or 2 strokes, rows, columns, the number of [`Ended`] |
//! | 8 | rows that follow; check sum of their bytes (FNV-1a, 32 bits) |
//! | 16 | from frame to frame, ns |
//! | 20 | the encoder's count of travel 0 (press), or where the strokes began |
//! | 24 | from the count of a sample to the moment at which the voltage acts, ns; 0 in a press |
//! | 28 | the number behind the end, see [`Ended`] |
//! | 32 | the rows |
//!
//! A row of a press is a step: numbers of its first and last frame, the encoder's counts at these, frames taken (2
//! bytes), whether it unloads, 0, mean voltage of the bridge in mV (2), temperature of the
//! microcontroller in 0.1 K (2, 0 unknown). Then of every taxel, row by row: the mean above tare in eighths of a
//! corrected code, plus 1,024 (2 bytes each); the variance of a frame in quarters of a code, squared, as `(8 + (byte &
//! 7)) << (byte >> 3) >> 3`, 0 below 1 (a byte each); a bit that is 1 where it was bad or saturated in any frame,
//! lowest bit first. Zeros fill it up to a multiple of 4 bytes.
//!
//! A row of strokes is a sample: count from the origin, mean voltage since the sample before in quarters of a mV (2
//! bytes each). A count of -32,768 begins a stroke.

use super::press::Step;
use super::{Ended, Row};

/// Version of the layout.
pub const VERSION: u8 = 1;
/// Number of bytes of the head.
pub const HEAD: usize = 32;
/// First value of the check sum.
pub const CHECK: u32 = 0x811C_9DC5;
const PRIME: u32 = 0x0100_0193;
/// Number of bytes of a step before its taxels.
const STEP: usize = 24;
/// Offset that is added to a mean, eighths of a code.
const OFFSET: i32 = 1_024;

/// Computes the check sum of all rows.
pub fn check(rows: &[u8]) -> u32 {
    rows.iter().fold(CHECK, |check, byte| (check ^ u32::from(*byte)).wrapping_mul(PRIME))
}

/// Number of bytes of a step.
pub const fn step_bytes(taxels: usize) -> usize {
    (STEP + 3 * taxels + taxels.div_ceil(8)).next_multiple_of(4)
}

/// Head of a record, before the rows.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Head {
    /// 0 none, 1 a press, 2 strokes.
    pub kind: u8,
    /// Rows and columns of the array.
    pub shape: [u8; 2],
    /// End of the motion.
    pub ended: Ended,
    /// Number of rows that follow.
    pub rows: u32,
    /// Check sum of the rows.
    pub check: u32,
    /// Time from frame to frame, ns.
    pub frame_ns: u32,
    /// Encoder count of travel 0, or of the start of the strokes.
    pub origin: i32,
    /// Time from the count of a sample to the moment at which the voltage acts, ns.
    pub delay_ns: u32,
    /// Number that explains the end.
    pub value: i32,
}

impl Head {
    /// Head of no record: all zeros, so an image does not grow by it.
    pub const NONE: Self = Self {
        kind: 0,
        shape: [0; 2],
        ended: Ended::Complete,
        rows: 0,
        check: 0,
        frame_ns: 0,
        origin: 0,
        delay_ns: 0,
        value: 0,
    };

    /// Returns the bytes of the head.
    pub fn bytes(&self) -> [u8; HEAD] {
        let mut bytes = [0; HEAD];
        let [rows, columns] = self.shape;
        let words = [
            [b'F', b'T', b'S', VERSION],
            [self.kind, rows, columns, self.ended as u8],
            self.rows.to_le_bytes(),
            self.check.to_le_bytes(),
            self.frame_ns.to_le_bytes(),
            self.origin.to_le_bytes(),
            self.delay_ns.to_le_bytes(),
            self.value.to_le_bytes(),
        ];
        bytes.as_chunks_mut().0.iter_mut().zip(words).for_each(|(to, word)| *to = word);
        bytes
    }
}

/// Bytes put one after the other, with their check sum; what does not fit shows in [`Out::full`].
pub struct Out<'a> {
    room: &'a mut [u8],
    /// Check sum so far.
    pub check: u32,
    /// Number of bytes written so far.
    pub count: usize,
    /// True if some bytes did not fit.
    pub full: bool,
}

impl<'a> Out<'a> {
    /// Creates an output into `room`, after `count` bytes of the same row, with the check sum of all before.
    pub fn new(room: &'a mut [u8], count: usize, check: u32) -> Self {
        let full = room.len() < count;
        Self { room: room.get_mut(count..).unwrap_or_default(), check, count, full }
    }

    // Inlined, as all of a row's loops: a part of it must fit into a frame beside its step.
    #[inline(always)]
    fn put<const BYTES: usize>(&mut self, bytes: [u8; BYTES]) {
        let Some((place, rest)) = core::mem::take(&mut self.room).split_first_chunk_mut() else {
            self.full = true;
            return;
        };
        (*place, self.room) = (bytes, rest);
        for byte in bytes {
            self.check = (self.check ^ u32::from(byte)).wrapping_mul(PRIME);
        }
        self.count += BYTES;
    }

    /// Puts a row.
    pub fn row<const ROWS: usize, const COLUMNS: usize>(&mut self, row: &Row<'_, ROWS, COLUMNS>) {
        match row {
            Row::Stroke => self.put(0x8000_u32.to_le_bytes()),
            Row::Sample { count, voltage } => {
                self.put(count.to_le_bytes());
                self.put(voltage.to_le_bytes());
            }
            Row::Step(step, part) => self.step(step, *part),
        }
    }

    /// Puts a part: the numbers and half of the means, the other means, half of the variances, or the other variances
    /// and the bits.
    fn step<const ROWS: usize, const COLUMNS: usize>(&mut self, step: &Step<ROWS, COLUMNS>, part: u8) {
        let taken = i32::from(step.taken.max(1));
        let (sums, first) = (step.sums.as_flattened(), step.first.as_flattened());
        let half = ROWS / 2 * COLUMNS;
        match part {
            0 => {
                self.numbers(step, taken);
                self.means(sums.get(..half).unwrap_or_default(), taken);
            }
            1 => self.means(sums.get(half..).unwrap_or_default(), taken),
            _ => {
                let taxels = step.squares.as_flattened().iter().zip(sums.iter().zip(first));
                let (from, count) = if part == 2 { (0, half) } else { (half, ROWS * COLUMNS) };
                self.variances(taxels.skip(from).take(count), taken);
                if part > 2 {
                    self.bits(step);
                }
            }
        }
    }

    fn numbers<const ROWS: usize, const COLUMNS: usize>(&mut self, step: &Step<ROWS, COLUMNS>, taken: i32) {
        let voltage_mv = (step.voltage_mv / taken).max(i16::MIN.into()).min(i16::MAX.into()) as u16;
        // Tenths of a kelvin, from degrees Celsius with 16 fractional bits.
        let kelvin = step.chip.map_or(0, |chip| ((i64::from(chip.to_bits()) * 10) >> 16) + 2_731);
        let kelvin = kelvin.max(0).min(u16::MAX.into()) as u16;
        let ([first, last], [from, to]) = (step.frames, step.counts.map(i32::cast_unsigned));
        let taken = u32::from(step.taken) | u32::from(step.back) << 16;
        for word in [first, last, from, to, taken, u32::from(voltage_mv) | u32::from(kelvin) << 16] {
            self.put(word.to_le_bytes());
        }
    }

    fn means(&mut self, sums: &[i32], taken: i32) {
        // The offset makes every sum positive: rounded to the nearest, without a remainder's sign.
        let zero = taken / 2 + OFFSET * taken;
        for sum in sums {
            let eighths = (sum / 2 + zero) / taken;
            self.put((eighths.max(0).min(u16::MAX.into()) as u16).to_le_bytes());
        }
    }

    /// Adds the variances of taxels, from squares, sums and first readings.
    fn variances<'t>(&mut self, taxels: impl Iterator<Item = (&'t u32, (&'t i32, &'t i32))>, taken: i32) {
        for (square, (sum, first)) in taxels {
            // Mean difference to the first frame, quarters.
            let mean = (sum / taken).saturating_sub(*first) >> 2;
            let mean = mean.unsigned_abs().min(65_535);
            self.put([coded((square / taken.cast_unsigned()).saturating_sub(mean * mean))]);
        }
    }

    fn bits<const ROWS: usize, const COLUMNS: usize>(&mut self, step: &Step<ROWS, COLUMNS>) {
        let (mut byte, mut bits) = (0, 0);
        for row in step.bad {
            for column in 0..COLUMNS {
                byte |= ((row >> column) as u8 & 1) << bits;
                bits += 1;
                if bits == 8 {
                    self.put([byte]);
                    (byte, bits) = (0, 0);
                }
            }
        }
        if bits > 0 {
            self.put([byte]);
        }
        while !self.count.is_multiple_of(4) && !self.full {
            self.put([0]);
        }
    }
}

/// Code of a variance in a byte, as in the layout above.
#[inline(always)]
fn coded(variance: u32) -> u8 {
    if variance == 0 {
        return 0;
    }
    // The exponent of 8 + mantissa, which are the upper four bits.
    let exponent = 31 - variance.leading_zeros();
    // Shifted up until the highest bit is the uppermost one: the next three are the mantissa.
    let mantissa = (variance << (31 - exponent)) >> 28 & 7;
    (exponent << 3 | mantissa) as u8
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_variance_is_told_to_an_eighth() {
        for variance in (1..5_000).chain([100_000, 1 << 24, (1 << 31) - 1, u32::MAX]) {
            let byte = u64::from(coded(variance));
            let told = ((8 + (byte & 7)) << (byte >> 3)) >> 3;
            let variance = u64::from(variance);
            assert!(told <= variance && variance - told <= variance / 8, "{variance}: {told}");
        }
        // Small variances are exact; 0 and 1 share a byte with nothing else.
        assert_eq!((coded(0), coded(1)), (0, 0));
    }
}
