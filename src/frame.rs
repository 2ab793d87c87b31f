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
/// Columns that each converter reads.
pub const BANK_COLUMNS: usize = COLUMNS / BANKS;
/// A code from which a taxel counts as saturated (12-bit converter).
pub const SATURATED: u16 = 4090;

/// 110 codes of 12 bits, in the order in which the two converters write them.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Frame {
    /// `banks[column / 5][slot][column % 5]`.
    pub banks: [[[u16; BANK_COLUMNS]; SLOTS]; BANKS],
    /// Counts frames scanned, missed ones too; wraps.
    pub sequence: u32,
}

impl Frame {
    /// A frame of zeros.
    pub const EMPTY: Self = Self { banks: [[[0; BANK_COLUMNS]; SLOTS]; BANKS], sequence: 0 };

    /// The code of a taxel (`slot` below [`ROWS`]) or of a column with nothing driven (`slot` = [`ROWS`]).
    ///
    /// Out of range reads as 0.
    pub fn code(&self, slot: usize, column: usize) -> u16 {
        self.banks
            .get(column / BANK_COLUMNS)
            .and_then(|bank| bank.get(slot))
            .and_then(|codes| codes.get(column % BANK_COLUMNS))
            .copied()
            .unwrap_or(0)
    }

    /// Sets what [`Frame::code`] reads; out of range does nothing.
    pub fn set_code(&mut self, slot: usize, column: usize, code: u16) {
        if let Some(place) = self
            .banks
            .get_mut(column / BANK_COLUMNS)
            .and_then(|bank| bank.get_mut(slot))
            .and_then(|codes| codes.get_mut(column % BANK_COLUMNS))
        {
            *place = code;
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
}
