//! What the first converter sees of the microcontroller itself: its reference, its temperature's sensor, and what the
//! factory read of both.

use fingertip::chip::Factory;

/// The converter that they are inputs of, and which ones.
pub const CONVERTER: usize = 0;
pub const REFERENCE_INPUT: usize = 17;
pub const SENSOR_INPUT: usize = 18;
/// Both want to be sampled for so long (DS10693).
pub const SAMPLING_NS: u64 = 10_000;
/// Where the factory keeps its codes: the reference's, and the sensor's at 30 and 110 degrees Celsius.
pub const FACTORY_AT: u64 = 0x1fff_7a2a;
/// What is around a board of which nothing else is said.
pub const ROOM_C: f64 = 25.0;

/// By its sheet (DS10693), typical.
const REFERENCE_V: f64 = 1.21;
const SENSOR_V: f64 = 0.76;
const SENSOR_V_PER_K: f64 = 0.0025;
const FACTORY_V: f64 = 3.3;
const CODES: f64 = 4096.0;

/// What an input carries at a temperature; none where it is none of these.
pub fn volts(converter: usize, input: usize, chip_c: f64) -> Option<f64> {
    match (converter, input) {
        (CONVERTER, REFERENCE_INPUT) => Some(REFERENCE_V),
        (CONVERTER, SENSOR_INPUT) => Some(SENSOR_V + SENSOR_V_PER_K * (chip_c - 25.0)),
        _ => None,
    }
}

/// The factory's codes.
pub fn factory() -> Factory {
    let code = |input, chip_c| (volts(CONVERTER, input, chip_c).unwrap_or(0.0) / FACTORY_V * CODES) as u16;
    Factory { reference: code(REFERENCE_INPUT, 30.0), sensor: [30.0, 110.0].map(|chip_c| code(SENSOR_INPUT, chip_c)) }
}
