//! Parameters and clocks of the finger.

use fingertip::params::Params;
use fingertip::scan::Clocks;

/// The driven rows.
pub const ROWS: usize = 6;
/// The sensed columns.
pub const COLUMNS: usize = 4;

/// A small tip on a coarse array, and a motor for 12 V. Set `direction_confirmed` to 1 once you have seen that a positive duty moves
/// the tip towards the object and makes the encoder count up: nothing drives the motor before.
pub const PARAMS: Params = Params {
    tip_radius_um: 7_000,
    pitch_um: 1_500,
    settle_ns: 2_000,
    sample_cycles: 3,
    supply_min_mv: 10_000,
    supply_max_mv: 14_000,
    ..Params::DEFAULT
};

/// Core and timers at 125 MHz, one converter at 48 MHz, of whose 96 cycles for a code the core counts 3 as sampling.
pub const CLOCKS: Clocks = Clocks {
    timer_hz: 125_000_000,
    core_hz: 125_000_000,
    converter_hz: 48_000_000,
    converters: 1,
    sample_cycles: &[3],
    conversion_cycles: 93,
    // A slot's interrupt may come 2 us late, behind one of the encoder's.
    trigger_cycles: 96,
    slot_step: 1,
    frame_ns: Some(500_000),
};
