//! One scan of the array, as the converters leave it in memory.

/// Driven rows of the array.
pub const ROWS: usize = 10;
/// Sensed columns of the array.
pub const COLUMNS: usize = 10;
/// Taxels in the array.
pub const TAXELS: usize = ROWS * COLUMNS;
/// Steps of a scan: the rows, and one with no row driven.
///
/// The last slot reads what the columns show with nothing selected: the amplifiers' offsets, and a row that is stuck
/// in the driven state.
pub const SLOTS: usize = ROWS + 1;
/// Converters that work side by side.
pub const BANKS: usize = 2;
/// Columns that each converter reads: the pairs of codes that come at the same instant.
pub const BANK_COLUMNS: usize = COLUMNS / BANKS;
/// A code from which a taxel counts as saturated (12-bit converter).
pub const SATURATED: u16 = 4090;

/// 110 codes of 12 bits, in pairs as the two converters read them at the same instant.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Frame {
    /// `pairs[slot][column % 5]`: columns 0 to 4 in the low halves, 5 to 9 in the high ones.
    pub pairs: [[u32; BANK_COLUMNS]; SLOTS],
    /// Counts frames scanned, missed ones too; wraps.
    pub sequence: u32,
}

impl Frame {
    /// A frame of zeros.
    pub const EMPTY: Self = Self { pairs: [[0; BANK_COLUMNS]; SLOTS], sequence: 0 };

    /// The code of a taxel (`slot` below [`ROWS`]) or of a column with nothing driven (`slot` = [`ROWS`]).
    ///
    /// Out of range reads as 0.
    pub fn code(&self, slot: usize, column: usize) -> u16 {
        let pair = self.pairs.get(slot).and_then(|pairs| pairs.get(column % BANK_COLUMNS)).copied().unwrap_or(0);
        match column / BANK_COLUMNS {
            0 => pair as u16,
            1 => (pair >> 16) as u16,
            _ => 0,
        }
    }

    /// Sets what [`Frame::code`] reads; out of range does nothing.
    pub fn set_code(&mut self, slot: usize, column: usize, code: u16) {
        if let Some(pair) = self.pairs.get_mut(slot).and_then(|pairs| pairs.get_mut(column % BANK_COLUMNS)) {
            match column / BANK_COLUMNS {
                0 => *pair = *pair & 0xffff_0000 | u32::from(code),
                1 => *pair = *pair & 0x0000_ffff | u32::from(code) << 16,
                _ => {}
            }
        }
    }
}

/// What the control step learns beside the frame, sampled at the frame's end.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Sense {
    /// Quadrature count of the motor's encoder, unwrapped; grows as the tip presses in.
    pub encoder: i32,
    /// The bridge's supply in mV.
    pub supply_mv: u16,
    /// Since the last valid packet on the bus, ms; holds at its top.
    pub bus_silent_ms: u16,
    /// The bridge's driver reports a fault (its nFAULT pin, which also broke the PWM in hardware).
    pub bridge_fault: bool,
    /// From the last frame's end to its duty, ticks of [`crate::scan::TIMER_HZ`]; 0 where that was not measured.
    pub answer_ticks: u32,
}
