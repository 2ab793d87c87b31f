//! What a taxel makes of its pressure.

use super::{Pressure, Row};
use crate::effects::normal_within_3;
use crate::effects::{Build, Part};
use crate::key::{Key, Kind};
use crate::mechanics::decay::decay;
use crate::registry::{Description, Family};
use crate::setup::Array;
use fastrand::Rng;
use fingertip::shipped::{COLUMNS, ROWS};

/// When each row was sampled last.
#[derive(Clone, Debug, Default)]
pub struct Since([Option<f64>; ROWS]);

impl Since {
    /// The time since the row's sample before; 0 at its first.
    pub fn step_s(&mut self, row: usize, time_s: f64) -> f64 {
        self.0[row].replace(time_s).map_or(0.0, |before| (time_s - before).max(0.0))
    }
}

pub(super) const HYSTERESIS: Description = Description {
    name: "hysteresis",
    family: Family::Sensor,
    about: "Pressing reads low, letting go reads high, by a share of the pressure.",
    equations: &[
        "a play whose width grows with the pressure: y = clamp(y, p (1 - h/2), p (1 + h/2)), h = width_percent / 100",
        "a cycle 0, P, 0 encloses P^2 w (1 - w) / (1 + w), w = h/2",
    ],
    state: "y of each taxel (100 numbers)",
    reference: "Interlink FSR 400 integration guide: hysteresis +10 %; the play operator: Brokate and Sprekels, Hysteresis and \
                Phase Transitions, 1996, section 2.1",
    keys: &[Key::number(
        "width_percent",
        "How much more it reads letting go than pressing, of the pressure.",
        0.0,
        100.0,
        10.0,
    )],
    zero: &[("width_percent", 0.0)],
    build: |build: &Build| {
        let half = build.values.number("width_percent") / 200.0;
        let mut held_kpa = [Row::default(); ROWS];
        Part::Pressure(Box::new(move |row: usize, _: f64, kpa: &mut Row| {
            for (held, kpa) in held_kpa[row].iter_mut().zip(kpa) {
                // Not clamp(): it panics where a pressure below 0 turns the bounds round.
                *held = held.max(*kpa * (1.0 - half)).min(*kpa * (1.0 + half));
                *kpa = *held;
            }
        }))
    },
};

pub(super) const CREEP: Description = Description {
    name: "creep",
    family: Family::Sensor,
    about: "Under a held pressure the reading grows by a share of it in each decade of time.",
    equations: &[
        "p' = p + c sum of x_k, dx_k/dt = (p - x_k) / tau_k, tau_k = 1 ms, 10 ms, ... 10^5 s; c = rate_percent_per_decade / 100",
        "each step exact for a held p: x_k += (p - x_k) (1 - exp(-dt / tau_k))",
        "after a step of p: c p for each decade, within 0.1 % from 1 ms to 1000 s, within 1 % to 3 hours; inside a decade the slope ripples by 11 %",
    ],
    state: "9 numbers for each taxel",
    reference: "Interlink FSR 400 integration guide: drift under 5 % per decade of time; a Prony series with a term for each decade",
    keys: &[Key::number("rate_percent_per_decade", "Growth of the reading.", 0.0, 50.0, 5.0)],
    zero: &[("rate_percent_per_decade", 0.0)],
    build: |build: &Build| {
        let share = build.values.number("rate_percent_per_decade") / 100.0;
        let (mut since, mut crept_kpa) = (Since::default(), [[[0.0; COLUMNS]; TERMS]; ROWS]);
        Part::Pressure(Box::new(move |row: usize, time_s: f64, kpa: &mut Row| {
            let step_s = since.step_s(row, time_s);
            let mut sum = [0.0; COLUMNS];
            for (crept, tau_s) in crept_kpa[row].iter_mut().zip(TAUS_S) {
                let taken = gone(step_s / tau_s);
                for ((crept, kpa), sum) in crept.iter_mut().zip(&*kpa).zip(&mut sum) {
                    *crept += taken * (*kpa - *crept);
                    *sum += *crept;
                }
            }
            for (kpa, sum) in kpa.iter_mut().zip(sum) {
                *kpa += share * sum;
            }
        }))
    },
};

const TERMS: usize = 9;
const TAUS_S: [f64; TERMS] = [1e-3, 1e-2, 1e-1, 1.0, 1e1, 1e2, 1e3, 1e4, 1e5];

/// 1 - exp(-x), without cancelling where x is small: frames are 1e-8 of the slowest term.
fn gone(x: f64) -> f64 {
    if x < 1e-4 { x - 0.5 * x * x + x * x * x / 6.0 } else { 1.0 - decay(x) }
}

pub(super) const GAIN_SPREAD: Description = Description {
    name: "gain_spread",
    family: Family::Sensor,
    about: "Each taxel has a gain of its own.",
    equations: &[
        "p' = p max(0, 1 + s g), s = rms_percent / 100, g of each taxel normal, drawn once, within 3 deviations",
    ],
    state: "none; 100 gains drawn at the start",
    reference: "Interlink FSR 400 integration guide: part to part +-6 %; Tekscan sensors differ by 5 to 32 %",
    keys: &[Key::number("rms_percent", "Deviation of the taxels' gains.", 0.0, 50.0, 6.0)],
    zero: &[("rms_percent", 0.0)],
    build: |build: &Build| {
        let mut rng = Rng::with_seed(build.seed);
        let share = build.values.number("rms_percent") / 100.0;
        let gains: [Row; ROWS] =
            [(); ROWS].map(|()| Row::default().map(|_| (1.0 + share * normal_within_3(&mut rng)).max(0.0)));
        Part::Pressure(Box::new(move |row: usize, _: f64, kpa: &mut Row| {
            kpa.iter_mut().zip(gains[row]).for_each(|(kpa, gain)| *kpa *= gain);
        }))
    },
};

pub(super) const TEMPERATURE_DRIFT: Description = Description {
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

const TAXELS: Kind = Kind::Pairs { below: ROWS as i64 };

pub(super) const BROKEN_TAXELS: Description = Description {
    name: "broken_taxels",
    family: Family::Sensor,
    about: "Taxels that are dead, stuck or shorted, from a time on.",
    equations: &["dead: G = 0", "shorted: G = 0.1 S (10 Ohm)", "stuck: G = what it was at the first sample after at_s"],
    state: "the conductance at which each stuck taxel is stuck",
    reference: "docs/runs.md, Readout: defects of the array",
    keys: &[
        Key { name: "dead", about: "Open circuits, by row and column.", kind: TAXELS },
        Key { name: "shorted", about: "Short circuits, by row and column.", kind: TAXELS },
        Key { name: "stuck", about: "Taxels that no longer change, by row and column.", kind: TAXELS },
        Key::number("at_s", "When they break; -10 is before the tare.", -10.0, 1e6, -10.0),
    ],
    zero: &[],
    build: |build: &Build| {
        let mut taxels = [[Taxel::Sound; COLUMNS]; ROWS];
        let shorted = Taxel::Fixed(Array::default().short_siemens);
        for (name, taxel) in [("stuck", Taxel::Stuck), ("shorted", shorted), ("dead", Taxel::Fixed(0.0))] {
            build.values.pairs(name).iter().for_each(|[row, column]| taxels[*row as usize][*column as usize] = taxel);
        }
        let at_s = build.values.number("at_s");
        Part::Conductance(Box::new(move |row, time_s, siemens| {
            if time_s < at_s {
                return;
            }
            for (taxel, siemens) in taxels[row].iter_mut().zip(siemens) {
                match *taxel {
                    Taxel::Sound => {}
                    Taxel::Stuck => *taxel = Taxel::Fixed(*siemens),
                    Taxel::Fixed(fixed) => *siemens = fixed,
                }
            }
        }))
    },
};

#[derive(Clone, Copy)]
enum Taxel {
    Sound,
    Stuck,
    Fixed(f64),
}
