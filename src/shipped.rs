//! The array that this controller is built for, and the types of its shape.
//!
//! The core takes any [`Shape`]; board and host code take it from here.

use crate::config::ConfigError;
use crate::frame::Shape;
use crate::link::table;
use crate::params::Params;
use crate::scan::Clocks;

/// Driven rows of the array.
pub const ROWS: usize = 10;
/// Sensed columns of the array.
pub const COLUMNS: usize = 10;
/// Taxels in the array.
pub const TAXELS: usize = Shape::<ROWS, COLUMNS>::TAXELS;
/// Steps of a scan: the rows, and one with no row driven.
pub const SLOTS: usize = Shape::<ROWS, COLUMNS>::SLOTS;
/// Columns that each converter reads.
pub const BANK_COLUMNS: usize = Shape::<ROWS, COLUMNS>::BANK_COLUMNS;
/// Frames of a tare.
pub const TARE_FRAMES: u32 = Array::TARE_FRAMES;

/// The STM32F446's clocks: core and TIM8 at 168 MHz, converters at 21 MHz with 12 bits (RM0390, 13). Slots
/// of whole dozens of ticks let the bridge's PWM of 20 to 40 kHz keep step with the frames.
pub const CLOCKS: Clocks = Clocks {
    timer_hz: 168_000_000,
    core_hz: 168_000_000,
    converter_hz: 21_000_000,
    converters: 2,
    sample_cycles: &[3, 15, 28, 56, 84, 112, 144, 480],
    conversion_cycles: 12,
    trigger_cycles: 5,
    slot_step: 12,
    frame_ns: None,
};

impl Config {
    /// Configuration of this array on this board; see [`crate::config::Shaped::new`].
    pub fn shipped(params: &Params) -> Result<Self, ConfigError> {
        Self::new(params, &CLOCKS)
    }
}

/// See [`crate::frame::Frame`].
pub type Frame = crate::frame::Frame<ROWS, COLUMNS>;
/// See [`crate::config::Shaped`].
pub type Config = crate::config::Shaped<ROWS, COLUMNS>;
/// See [`crate::pressure::TactileImage`].
pub type TactileImage = crate::pressure::TactileImage<ROWS, COLUMNS>;
/// See [`crate::pressure::Gains`].
pub type Gains = crate::pressure::Gains<ROWS, COLUMNS>;
/// See [`crate::pressure::Calibration`].
pub type Calibration = crate::pressure::Calibration<ROWS, COLUMNS>;
/// See [`crate::pressure::Array`].
pub type Array = crate::pressure::Array<ROWS, COLUMNS>;
/// See [`crate::contact::Fit`].
pub type Fit = crate::contact::Fit<ROWS, COLUMNS>;
/// See [`crate::pipeline::budget::Budget`].
pub type Budget = crate::pipeline::budget::Budget<ROWS, COLUMNS>;
/// See [`crate::pipeline::Pipeline`].
pub type Pipeline = crate::pipeline::Pipeline<ROWS, COLUMNS>;
/// Bytes that a board keeps for a capture: 44 KiB.
pub const CAPTURE_BYTES: usize = 44 << 10;
/// See [`crate::capture::Capture`].
pub type Capture = crate::capture::Capture<ROWS, COLUMNS, CAPTURE_BYTES>;
/// See [`crate::store::Record`].
pub type Record = crate::store::Record<ROWS, COLUMNS>;
/// See [`crate::store::Loaded`].
pub type Loaded = crate::store::Loaded<ROWS, COLUMNS>;
/// See [`crate::link::Settings`].
pub type Settings = crate::link::Settings<ROWS, COLUMNS>;
/// See [`crate::link::Snapshot`].
pub type Snapshot<'a> = crate::link::Snapshot<'a, ROWS, COLUMNS>;
/// See [`crate::link::Server`].
pub type Server = crate::link::Server<ROWS, COLUMNS>;

/// Every register of the control table, in the order of the addresses.
pub const REGISTERS: &[table::Register] = &ALL;
static ALL: [table::Register; table::COUNT] = table::registers::<ROWS, COLUMNS>();

/// Address of each register.
pub mod address {
    use super::{COLUMNS, ROWS, table};

    pub use table::address::*;

    const PICTURES: [u16; table::PICTURES] = table::pictures_at::<ROWS, COLUMNS>();

    /// Pressure on each taxel, row by row.
    pub const PRESSURES: u16 = PICTURES[0];
    /// Converter codes of the last frame, row by row.
    pub const RAW_CODES: u16 = PICTURES[1];
    /// Zero of each taxel in converter codes, row by row.
    pub const TARE_CODES: u16 = PICTURES[2];
    /// The gain of each taxel, row by row.
    pub const GAINS: u16 = PICTURES[3];
}
