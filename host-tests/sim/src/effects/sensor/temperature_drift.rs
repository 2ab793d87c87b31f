//! The array warms up and reads differently.

use super::{Pressure, Row};
use crate::effects::{Build, Part};
use crate::key::Key;
use crate::mechanics::decay::decay;
use crate::registry::{Description, Family};

/// What a scene names.
pub const EFFECT: Description = Description {
    name: "temperature_drift",
    family: Family::Sensor,
    about: "The array warms up from the scene's start; its gain and its zero drift along.",
    equations: &[
        "T = warming_k (1 - exp(-t / time_constant_s)), t from the start, 0 before it",
        "the microcontroller shows 25 + chip_share * warming_k (1 - exp(-t / chip_time_constant_s))",
        "p' = p (1 + a T) + b T, a = gain_percent_per_k / 100, b = zero_kpa_per_k",
    ],
    state: "none: T is a function of time",
    reference: "Tekscan FlexiForce A201 data sheet: 0.36 %/K; the zero's drift is an assumption",
    keys: &[
        Key::number("warming_k", "How much warmer it is in the end.", -60.0, 100.0, 20.0),
        Key::number("time_constant_s", "Time in which it has come to 63 % of that.", 0.001, 1e6, 600.0),
        Key::number("gain_percent_per_k", "Change of the gain.", -1.0, 1.0, 0.36),
        Key::number("zero_kpa_per_k", "Change of the reading without pressure.", -1.0, 1.0, 0.01),
        Key::number(
            "chip_share",
            "How much of the array's warming the microcontroller's temperature shows.",
            -2.0,
            4.0,
            1.0,
        ),
        Key::number(
            "chip_time_constant_s",
            "The microcontroller's time constant; 0 is that of the array.",
            0.0,
            1e6,
            0.0,
        ),
    ],
    zero: &[("warming_k", 0.0)],
    build: |build: &Build| {
        let number = |name| build.values.number(name);
        Part::Pressure(Box::new(TemperatureDrift {
            warming_k: number("warming_k"),
            time_constant_s: number("time_constant_s"),
            gain_per_k: number("gain_percent_per_k") / 100.0,
            zero_kpa_per_k: number("zero_kpa_per_k"),
            chip_k: number("warming_k") * number("chip_share"),
            chip_time_constant_s: match number("chip_time_constant_s") {
                0.0 => number("time_constant_s"),
                own => own,
            },
        }))
    },
};

struct TemperatureDrift {
    warming_k: f64,
    time_constant_s: f64,
    gain_per_k: f64,
    zero_kpa_per_k: f64,
    chip_k: f64,
    chip_time_constant_s: f64,
}

impl Pressure for TemperatureDrift {
    fn chip_c(&self, time_s: f64) -> Option<f64> {
        Some(25.0 + self.chip_k * (1.0 - decay(time_s.max(0.0) / self.chip_time_constant_s)))
    }

    fn apply(&mut self, _row: usize, time_s: f64, kpa: &mut Row) {
        let warmer_k = self.warming_k * (1.0 - decay(time_s.max(0.0) / self.time_constant_s));
        let (gain, zero_kpa) = (1.0 + self.gain_per_k * warmer_k, self.zero_kpa_per_k * warmer_k);
        kpa.iter_mut().for_each(|kpa| *kpa = *kpa * gain + zero_kpa);
    }
}
