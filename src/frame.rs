//! One scan of the array: a row's codes in pairs, as two converters read them at the same instant.
//!
//! Every type that depends on the array's shape has the rows and columns as parameters: `ROWS` driven rows and
//! `COLUMNS` sensed columns, a [`Shape`]. A scan has a slot with no row driven, then one for each row. The first slot
//! shows the amplifiers' offsets, and a row that is stuck in the driven state; with it the rows can be read while later
//! ones are still being scanned.

use crate::units::{Celsius, CoreCycles};
pub use lanes::Codes;

/// Converters that work side by side.
pub const BANKS: usize = 2;
/// Largest code of the 12-bit converter.
pub const CODE_MAX: u16 = 4_095;

/// The rows and columns of an array: 3 x 3 to 16 x 32. Another shape does not compile.
pub struct Shape<const ROWS: usize, const COLUMNS: usize>;

impl<const ROWS: usize, const COLUMNS: usize> Shape<ROWS, COLUMNS> {
    /// Check of the shape at compile time. Every type with a shape evaluates this constant.
    pub(crate) const CHECKED: () = assert!(
        3 <= ROWS && ROWS <= 16 && 3 <= COLUMNS && COLUMNS <= 32,
        "an array has 3 to 16 rows and 3 to 32 columns"
    );
    /// Taxels in the array.
    pub const TAXELS: usize = ROWS * COLUMNS;
    /// Steps of a scan.
    pub const SLOTS: usize = ROWS + 1;
    /// Columns of the first bank, which is the number of pairs of codes read at the same instant. With an odd number of
    /// columns the second bank has one fewer.
    pub const BANK_COLUMNS: usize = lanes::pairs(COLUMNS);
    /// The larger of rows and columns.
    pub(crate) const SIDE: usize = if ROWS > COLUMNS { ROWS } else { COLUMNS };
}

/// Codes of 12 bits, in pairs as the two converters read them at the same instant.
///
/// ```
/// use fingertip::frame::Frame;
///
/// let mut frame = Frame::<3, 5>::EMPTY;
/// frame.set_code(2, 4, 1_000); // the last row's last column
/// frame.set_code(3, 4, 372); // the same column with no row driven
/// assert_eq!((frame.code(2, 4), frame.code(3, 4), frame.code(0, 0)), (1_000, 372, 0));
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Frame<const ROWS: usize, const COLUMNS: usize> {
    /// Codes in pairs: the first half of the columns in the low halves of words, the second half in the high ones.
    pub codes: Codes<ROWS, COLUMNS>,
    /// Number of the frame; counts missed frames too, and wraps.
    pub sequence: u32,
}

impl<const ROWS: usize, const COLUMNS: usize> Frame<ROWS, COLUMNS> {
    /// A frame of zeros.
    pub const EMPTY: Self = Self { codes: Codes::ZERO, sequence: 0 };

    /// The code of a taxel (`slot` below `ROWS`) or of a column with nothing driven (`slot` = `ROWS`).
    ///
    /// Out of range reads as 0.
    pub fn code(&self, slot: usize, column: usize) -> u16 {
        self.codes.slot(slot).and_then(|codes| codes.get(lanes::place(column, COLUMNS))).copied().unwrap_or(0)
    }

    /// Sets what [`Frame::code`] reads; out of range does nothing.
    pub fn set_code(&mut self, slot: usize, column: usize, code: u16) {
        if let Some(place) = self.codes.slot_mut(slot).and_then(|codes| codes.get_mut(lanes::place(column, COLUMNS))) {
            *place = code;
        }
    }
}

/// Measurements beside the frame: the encoder at the frame's end, the supply by its last conversion.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Sense {
    /// Quadrature count of the motor's encoder, unwrapped; grows as the tip presses in.
    pub encoder: i32,
    /// The bridge's supply in mV.
    pub supply_mv: u16,
    /// Time since the last valid packet on the bus, ms; saturates.
    pub bus_silent_ms: u16,
    /// True while the bridge's driver reports a fault (its nFAULT pin, which also broke the PWM in hardware).
    pub bridge_fault: bool,
    /// Temperature of the microcontroller; none if it was not measured.
    pub chip: Option<Celsius>,
    /// Time from the last frame's end to its duty; 0 if it was not measured.
    pub answer: CoreCycles,
}
