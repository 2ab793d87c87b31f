//! The reference finger as its firmware knows it.

use fingertip::shipped::{Array, Calibration, Config, Frame, TARE_FRAMES};

/// The configuration that the default parameters make, with the motor's direction confirmed.
///
/// # Panics
/// If the core refuses its defaults: a mistake in the core.
pub fn config() -> Config {
    Config::shipped(&images::CONFIRMED).expect("the defaults are allowed")
}

/// An array that was tared with nothing on it.
pub fn tared(calibration: &Calibration, blank: &Frame, config: &Config) -> Array {
    let mut array = Array::new();
    array.calibrate(calibration);
    for _ in 0..TARE_FRAMES {
        array.read(blank, config);
        array.continue_tare();
    }
    array
}
