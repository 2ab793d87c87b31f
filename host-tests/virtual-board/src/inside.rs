//! Internal inputs of the first converter: the reference and the temperature sensor of the microcontroller, and the
//! factory's readings of both.

use fingertip::chip::Factory;

/// The converter that they are inputs of, and which ones.
pub const CONVERTER: usize = 0;
pub const REFERENCE_INPUT: usize = 17;
pub const SENSOR_INPUT: usize = 18;
/// Minimum sampling time of both inputs, ns (DS10693).
pub const SAMPLING_NS: u64 = 10_000;
/// Address of the factory's codes: of the reference, and of the temperature sensor at 30 and 110 degrees Celsius.
pub const FACTORY_AT: u64 = 0x1fff_7a2a;
/// Default ambient temperature of the board, degrees Celsius.
pub const ROOM_C: f64 = 25.0;

/// Typical values of the data sheet (DS10693), V.
const REFERENCE_V: f64 = 1.21;
const SENSOR_V: f64 = 0.76;
const SENSOR_V_PER_K: f64 = 0.0025;
const FACTORY_V: f64 = 3.3;
const CODES: f64 = 4096.0;

/// Voltage at an internal input of a converter for a chip temperature, V; `None` for any other input.
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
