//! Readout from the pressures on the taxels to the codes of the frame.
//!
//! The stages in order: pressure (kPa, by row), conductance (S, by row), network (what a column sees of the driven
//! row), volts (at the column amplifiers), codes (before the converter rounds down). Without effects the readout is
//! ideal: equal taxels, a perfect row switch, a perfect virtual ground, settled at once, 12 bits.

mod floating;

use crate::effects::{Description, Metered, NamedEffect, Stage, family_of, normal_within_3, normals};
use crate::events::ArrayEvents;
use crate::mechanics::decay;
use crate::plant::{self, ArrayFaults};
use crate::scene::tables::{Key, Kind};
use crate::setup::Array;
use crate::watch::Cost;
use fingertip::shipped::{COLUMNS, ROWS, SLOTS};
use floating::Floating;

/// A number for each column.
pub type Row = [f64; COLUMNS];

/// Effect on the numbers of a slot (a row, or [`ROWS`] without one): slot, time of its sample (never before the last one)
/// and numbers.
pub type Slot = dyn FnMut(usize, f64, &mut Row) + Send;

/// Temperature of the microcontroller at a time, degrees Celsius.
pub type Chip = dyn Fn(f64) -> f64 + Send;

/// Effect on the conductances that the columns see of the driven row, S: row, conductances of all taxels at the last
/// sample of their row, and conductances seen.
pub type Network = dyn FnMut(usize, &[Row; ROWS], &mut Row) + Send;

/// True if an effect gives the same codes in each scan of a contact at rest, and remembers the last slot at most.
pub fn repeats(named: &NamedEffect) -> bool {
    match named.effect.name {
        "gain_spread" | "row_sag" | "saturation" | "offset" | "converter" => true,
        // Then nothing is left of a voltage after a slot of 9 us.
        "settling" => named.values.number("tau_us") <= 0.2,
        _ => matches!(family_of(named.effect), "contact" | "drive"),
    }
}

named! {
    // Pressures on the taxels of a row, kPa.
    pressure: Slot,
    chip: Chip,
    // Conductances of the taxels of a row, S.
    conductance: Slot,
    network: Network,
    // Output voltages of the column amplifiers.
    volts: Slot,
    // Codes of the converter before rounding.
    codes: Slot,
}

impl Named {
    /// Temperature of the microcontroller, degrees Celsius, if an effect has one.
    pub fn chip_c(&self, time_s: f64) -> Option<f64> {
        self.chip.parts().next().map(|chip_c| chip_c(time_s))
    }

    /// Counts calls that were skipped because their results are known; negative for an extra call.
    pub(crate) fn repeat(&mut self, rows: i64, slots: i64) {
        self.pressure.repeat(rows);
        self.conductance.repeat(rows);
        self.network.repeat(rows);
        self.volts.repeat(slots);
        self.codes.repeat(slots);
    }
}

/// Readout of the array of one finger.
pub struct Readout {
    array: Array,
    siemens: [Row; ROWS],
    pub events: Option<ArrayEvents>,
    /// Defects; none if the array is sound.
    pub faults: Option<ArrayFaults>,
}

impl Readout {
    /// Readout with perfect row switches, with the events of the scene that change codes. Effects decide on `row_ohm` and
    /// `settle_tau_s` of the array.
    pub fn new(array: &Array, events: Option<ArrayEvents>) -> Self {
        let siemens = [[array.preload_siemens; COLUMNS]; ROWS];
        Self { array: *array, siemens, events, faults: None }
    }

    /// Returns the codes of a slot sampled at a time, for the pressures on its row (unused where no row is driven).
    pub fn codes(&mut self, stages: &mut Named, slot: usize, time_s: f64, kpa: &Row) -> [u16; COLUMNS] {
        let mut volts = [self.array.ground_v; COLUMNS];
        if slot < ROWS {
            self.add_row(stages, slot, time_s, kpa, &mut volts);
        }
        stages.volts.each(|part| part(slot, time_s, &mut volts));
        let codes_per_volt = Array::CODES / self.array.reference_v;
        let mut codes = volts.map(|volts| volts * codes_per_volt);
        stages.codes.each(|part| part(slot, time_s, &mut codes));
        // The conversion to an integer rounds down, and negative values become 0.
        let mut codes = codes.map(|code| (code as u16).min(Array::CODES as u16 - 1));
        if let Some(events) = &mut self.events {
            events.change(slot, time_s, &mut codes);
        }
        codes
    }

    /// Adds the voltages of a driven row under these pressures.
    pub fn add_row(&mut self, stages: &mut Named, row: usize, time_s: f64, kpa: &Row, volts: &mut Row) {
        let (array, mut kpa) = (&self.array, *kpa);
        stages.pressure.each(|part| part(row, time_s, &mut kpa));
        self.siemens[row] = core::array::from_fn(|column| {
            let loaded = array.preload_siemens + array.siemens_per_kpa * kpa[column];
            if loaded > 0.0 { loaded } else { 0.0 }
        });
        stages.conductance.each(|part| part(row, time_s, &mut self.siemens[row]));
        if let Some(faults) = &self.faults {
            for (siemens, taxel) in self.siemens[row].iter_mut().zip(faults.taxels[row]) {
                *siemens = match taxel {
                    plant::Taxel::Sound => *siemens,
                    plant::Taxel::Dead => 0.0,
                    plant::Taxel::Shorted => array.short_siemens,
                };
            }
        }
        let volts_per_siemens = array.feedback_ohm * array.drive_v;
        let mut seen = self.siemens[row];
        stages.network.each(|part| part(row, &self.siemens, &mut seen));
        for (volts, siemens) in volts.iter_mut().zip(seen) {
            *volts += siemens * volts_per_siemens;
        }
    }
}

/// Effects of this family, in the order in which they act within a stage.
pub const EFFECTS: &[Description] = &[
    Description {
        name: "hysteresis",
        about: "Hysteresis: the reading is low while pressing and high on release, by a share of the pressure.",
        equations: &[
            "a play whose width grows with the pressure: y = clamp(y, p (1 - h/2), p (1 + h/2)), h = width_percent / 100",
            "a cycle 0, P, 0 encloses P^2 w (1 - w) / (1 + w), w = h/2",
        ],
        state: "y of each taxel (100 numbers)",
        reference: "Interlink FSR 400 integration guide: hysteresis +10 %; the play operator: Brokate and Sprekels, Hysteresis and \
                Phase Transitions, 1996, section 2.1",
        keys: &[Key::number("width_percent", "Width of the loop, of the pressure.", 0.0, 100.0, 10.0).idle(0.0)],
        build: |build, parts| {
            let half = build.number("width_percent") / 200.0;
            let mut held_kpa = [Row::default(); ROWS];
            parts.sensor.pressure.push(build.part(Box::new(move |row, _, kpa| {
                for (held, kpa) in held_kpa[row].iter_mut().zip(kpa) {
                    // Not clamp(): it panics at a negative pressure, which swaps the bounds.
                    *held = held.max(*kpa * (1.0 - half)).min(*kpa * (1.0 + half));
                    *kpa = *held;
                }
            })))
        },
    },
    Description {
        name: "creep",
        about: "Creep: under a constant pressure the reading grows by a share of it in each decade of time.",
        equations: &[
            "p' = p + c sum of x_k, dx_k/dt = (p - x_k) / tau_k, tau_k = 1 ms, 10 ms, ... 10^5 s; c = rate_percent_per_decade / 100",
            "each step exact for a constant p: x_k += (p - x_k) (1 - exp(-dt / tau_k))",
            "after a step of p: c p for each decade, within 0.1 % from 1 ms to 1000 s, within 1 % to 3 hours; inside a decade the slope ripples by 11 %",
        ],
        state: "9 numbers per taxel",
        reference: "Interlink FSR 400 integration guide: drift under 5 % per decade of time; a Prony series with a term per decade",
        keys: &[Key::number("rate_percent_per_decade", "Growth of the reading.", 0.0, 50.0, 5.0).idle(0.0)],
        build: |build, parts| {
            let share = build.number("rate_percent_per_decade") / 100.0;
            let (mut sampled_s, mut crept_kpa) = ([None; ROWS], [[[0.0; COLUMNS]; TERMS]; ROWS]);
            let (mut last_s, mut shares) = (0.0, [0.0; TERMS]);
            parts.sensor.pressure.push(build.part(Box::new(move |row, time_s, kpa| {
                let step_s = sampled_s[row].replace(time_s).map_or(0.0, |before_s: f64| (time_s - before_s).max(0.0));
                if step_s != last_s {
                    (last_s, shares) = (step_s, TAUS_S.map(|tau_s| gone(step_s / tau_s)));
                }
                let mut sum = [0.0; COLUMNS];
                for (crept, taken) in crept_kpa[row].iter_mut().zip(shares) {
                    for ((crept, kpa), sum) in crept.iter_mut().zip(&*kpa).zip(&mut sum) {
                        *crept += taken * (*kpa - *crept);
                        *sum += *crept;
                    }
                }
                for (kpa, sum) in kpa.iter_mut().zip(sum) {
                    *kpa += share * sum;
                }
            })))
        },
    },
    Description {
        name: "gain_spread",
        about: "Different gains of the taxels.",
        equations: &[
            "p' = p max(0, 1 + s g), s = rms_percent / 100, g of each taxel normal, drawn once, within 3 deviations",
        ],
        state: "none; 100 gains drawn at the start",
        reference: "Interlink FSR 400 integration guide: part to part +-6 %; Tekscan sensors differ by 5 to 32 %",
        keys: &[Key::number("rms_percent", "Deviation of the taxels' gains.", 0.0, 50.0, 6.0).idle(0.0)],
        build: |build, parts| {
            let mut rng = build.rng();
            let share = build.number("rms_percent") / 100.0;
            let gains: [Row; ROWS] =
                [(); ROWS].map(|()| Row::default().map(|_| (1.0 + share * normal_within_3(&mut rng)).max(0.0)));
            parts.sensor.pressure.push(build.part(Box::new(move |row, _, kpa| {
                kpa.iter_mut().zip(gains[row]).for_each(|(kpa, gain)| *kpa *= gain);
            })))
        },
    },
    Description {
        name: "temperature_drift",
        about: "Warming of the array from time 0 on, with drift of gain and zero.",
        equations: &[
            "T = warming_k (1 - exp(-t / time_constant_s)), t from the start, 0 before it",
            "the microcontroller shows 25 + chip_share * warming_k (1 - exp(-t / chip_time_constant_s))",
            "p' = p (1 + a T) + b T, a = gain_percent_per_k / 100, b = zero_kpa_per_k",
        ],
        state: "none: T is a function of time",
        reference: "Tekscan FlexiForce A201 data sheet: 0.36 %/K; the zero's drift is an assumption",
        keys: &[
            Key::number("warming_k", "Final temperature above that at the start.", -60.0, 100.0, 20.0).idle(0.0),
            Key::number("time_constant_s", "Time to 63 % of that.", 0.001, 1e6, 600.0),
            Key::number("gain_percent_per_k", "Change of the gain.", -1.0, 1.0, 0.36),
            Key::number("zero_kpa_per_k", "Change of the reading without pressure.", -1.0, 1.0, 0.01),
            Key::number("chip_share", "Share of the warming that the chip shows.", -2.0, 4.0, 1.0),
            Key::number("chip_time_constant_s", "Time constant of the chip; 0 is that of the array.", 0.0, 1e6, 0.0),
        ],
        build: |build, parts| {
            let [warming_k, time_constant_s, zero_kpa_per_k, chip_share] =
                ["warming_k", "time_constant_s", "zero_kpa_per_k", "chip_share"].map(|name| build.number(name));
            let gain_per_k = build.number("gain_percent_per_k") / 100.0;
            let chip_k = warming_k * chip_share;
            let own_s = build.number("chip_time_constant_s");
            let chip_time_constant_s = if own_s == 0.0 { time_constant_s } else { own_s };
            parts.sensor.pressure.push(build.part(Box::new(move |_, time_s, kpa| {
                let warmer_k = warming_k * gone(time_s.max(0.0) / time_constant_s);
                let (gain, zero_kpa) = (1.0 + gain_per_k * warmer_k, zero_kpa_per_k * warmer_k);
                kpa.iter_mut().for_each(|kpa| *kpa = *kpa * gain + zero_kpa);
            })));
            let chip_c = move |time_s: f64| 25.0 + chip_k * gone(time_s.max(0.0) / chip_time_constant_s);
            parts.sensor.chip.push(build.part(Box::new(chip_c)));
        },
    },
    Description {
        name: "broken_taxels",
        about: "Taxels that are dead, stuck or shorted from a time on.",
        equations: &["dead: G = 0", "shorted: G = 0.1 S (10 Ohm)", "stuck: G stays as at the first sample after at_s"],
        state: "conductance of each stuck taxel",
        reference: "docs/runs.md, Readout: defects of the array",
        keys: &[
            Key::new("dead", "Open circuits, by row and column.", Kind::Taxels),
            Key::new("shorted", "Short circuits, by row and column.", Kind::Taxels),
            Key::new("stuck", "Taxels that no longer change, by row and column.", Kind::Taxels),
            Key::number("at_s", "Time of the defect; -10 is before the tare.", -10.0, 1e6, -10.0),
        ],
        build: |build, parts| {
            let mut taxels = [[Taxel::Sound; COLUMNS]; ROWS];
            let shorted = Taxel::Fixed(Array::default().short_siemens);
            for (name, taxel) in [("stuck", Taxel::Stuck), ("shorted", shorted), ("dead", Taxel::Fixed(0.0))] {
                for [row, column] in build.values.pairs(name) {
                    taxels[*row as usize][*column as usize] = taxel;
                }
            }
            let at_s = build.number("at_s");
            parts.sensor.conductance.push(build.part(Box::new(move |row, time_s, siemens| {
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
            })))
        },
    },
    Description {
        name: "ghosting",
        about: "Ghosting: a resistance between the virtual ground and all undriven rows and unread columns.",
        equations: &[
            "the whole network of 100 taxels, the driven row i at 1 V, every line tied to ground by h = 1 / hold_ohm",
            "rows eliminated: A = diag(h + sum over k of G_kc) - sum over k != i of G_k G_k^T / (h + sum over c of G_kc), b = G_i",
            "the short-circuit current of the read column is the conductance seen: (A^-1 b)_j / (A^-1)_jj",
            "hold_ohm = 0: G_ij; floating lines and equal taxels: G M N / (M + N - 1), a resistance of 0.19 R for 10 x 10",
        ],
        state: "none; other rows have the values of their last sample, at most a frame ago",
        reference: "D'Alessio, Measurement errors in the scanning of piezoresistive sensors arrays, Sensors and Actuators A 72 (1999)",
        keys: &[Key::number("hold_ohm", "Resistance to the virtual ground; 0 is perfect.", 0.0, 1e12, 1000.0).idle(0.0)],
        build: |build, parts| {
            let hold_ohm = build.number("hold_ohm");
            let mut floating = Floating::new(1.0 / hold_ohm);
            parts.sensor.network.push(build.part(Box::new(move |row, array, seen| {
                if hold_ohm > 0.0 {
                    *seen = floating.seen(row, array);
                }
            })))
        },
    },
    Description {
        name: "row_sag",
        about: "Voltage loss in the switch and trace of the driven row. The controller corrects for it by default.",
        equations: &["G' = G / (1 + R_on S), S = the row's sum of G: a loss of R_on S / (1 + R_on S)"],
        state: "none",
        reference: "docs/board.md: 30 Ohm; R_min 1 kOhm in all ten columns loses 41 % at 70 Ohm and 4.8 % at 5 Ohm",
        keys: &[Key::number("switch_ohm", "Resistance of switch and trace, R_on.", 0.0, 300.0, 30.0).idle(0.0)],
        build: |build, parts| {
            let switch_ohm = build.number("switch_ohm");
            parts.sensor.network.push(build.part(Box::new(move |_, _, seen| {
                let left = 1.0 + switch_ohm * seen.iter().sum::<f64>();
                seen.iter_mut().for_each(|siemens| *siemens /= left);
            })))
        },
    },
    Description {
        name: "settling",
        about: "Settling: a sample still contains a part of the slot before.",
        equations: &[
            "dv/dt = (V - v) / tau_us, V the final voltage of the slot",
            "sampled at after_us after the edge of the slot: v = V + (v_edge - V) exp(-after_us / tau_us), exact",
        ],
        state: "voltage of each column at the last edge, and its final voltage (20 numbers)",
        reference: "docs/runs.md, Readout: 0.2 us; half a bit of 12 takes 9.0 tau",
        keys: &[
            Key::number("tau_us", "Time constant.", 0.0, 100.0, 0.2).idle(0.0),
            Key::number("after_us", "Time from the edge to the sample.", 0.1, 1000.0, 2.4),
        ],
        build: |build, parts| {
            let [tau_s, after_s] = ["tau_us", "after_us"].map(|key| build.number(key) * 1e-6);
            let mut settling = Settling::new(tau_s, after_s);
            parts.sensor.volts.push(build.part(Box::new(move |_, time_s, volts| settling.sample(time_s, volts))))
        },
    },
    Description {
        name: "saturation",
        about: "Saturation: the column amplifiers cannot reach the reference of the converter.",
        equations: &["v' = min(v, V_ref - headroom_mv)"],
        state: "none",
        reference: "output swing to the rail in data sheets of amplifiers, 5 to 200 mV",
        keys: &[Key::number("headroom_mv", "Distance of their upper rail from 3.3 V.", 0.0, 3000.0, 50.0).idle(0.0)],
        build: |build, parts| {
            let rail_v = Array::default().reference_v - build.number("headroom_mv") * 1e-3;
            parts.sensor.volts.push(
                build.part(Box::new(move |_, _, volts| volts.iter_mut().for_each(|volts| *volts = volts.min(rail_v)))),
            )
        },
    },
    Description {
        name: "noise",
        about: "White noise on every conversion.",
        equations: &["code' = code + rms_codes g, g normal, drawn for each conversion"],
        state: "random numbers (8 bytes)",
        reference: "ST application note AN4073, averaging against converter noise: a few codes",
        keys: &[Key::number("rms_codes", "Deviation, 12-bit codes.", 0.0, 500.0, 1.5).idle(0.0)],
        build: |build, parts| {
            let rms_codes = build.number("rms_codes");
            let mut rng = build.rng();
            parts.sensor.codes.push(build.part(Box::new(move |_, _, codes| {
                let noise: Row = normals(&mut rng);
                codes.iter_mut().zip(noise).for_each(|(code, noise)| *code += rms_codes * noise);
            })))
        },
    },
    Description {
        name: "offset",
        about: "Different zero levels of taxels and of columns without a driven row. The tare removes them.",
        equations: &["code' = code + rms_codes g, g of each taxel normal, drawn once, within 3 deviations"],
        state: "none; 110 levels drawn at the start",
        reference: "docs/board.md: the preload's spread and the amplifiers' offsets",
        keys: &[Key::number("rms_codes", "Deviation of the levels, 12-bit codes.", 0.0, 200.0, 5.0).idle(0.0)],
        build: |build, parts| {
            let mut rng = build.rng();
            let rms_codes = build.number("rms_codes");
            let offsets = [(); SLOTS].map(|()| Row::default().map(|_| rms_codes * normal_within_3(&mut rng)));
            parts.sensor.codes.push(build.part(Box::new(move |slot, _, codes| {
                codes.iter_mut().zip(offsets[slot]).for_each(|(code, offset)| *code += offset);
            })))
        },
    },
    Description {
        name: "converter",
        about: "A converter with fewer bits than 12 and with an integral non-linearity.",
        equations: &[
            "bow: c = code + inl_codes 4 x (1 - x), x = code / 4096 within 0 to 1",
            "code' = floor(c / q) q, q = 2^(12 - bits)",
        ],
        state: "none",
        reference: "Tekscan I-Scan, the paper's kind of sensor: 8 bits; STM32F446 data sheet: INL 2 to 3 codes of 12 bits",
        keys: &[
            Key::whole("bits", "Resolution.", 1, 12, 8).idle(12.0),
            Key::number("inl_codes", "Largest deviation from the line, in the middle, 12-bit codes.", -50.0, 50.0, 0.0)
                .idle(0.0),
        ],
        build: |build, parts| {
            let step = f64::from(1 << (12 - build.values.whole("bits")));
            let inl_codes = build.number("inl_codes");
            parts.sensor.codes.push(build.part(Box::new(move |_, _, codes| {
                for code in codes {
                    let x = (*code / Array::CODES).clamp(0.0, 1.0);
                    let steps = (*code + inl_codes * 4.0 * x * (1.0 - x)) / step;
                    // The same as floor(), which is a call on most machines.
                    let whole = f64::from(steps as i32);
                    *code = if whole > steps { whole - 1.0 } else { whole } * step;
                }
            })))
        },
    },
];

pub struct Settling {
    tau_s: f64,
    /// Share of a difference that remains at the sample.
    left: f64,
    /// Time, voltages at the edge and final voltages of the slot before.
    before: Option<(f64, Row, Row)>,
}

impl Settling {
    pub fn new(tau_s: f64, after_s: f64) -> Self {
        Self { tau_s, left: decay(after_s / tau_s), before: None }
    }
    /// Replaces the final voltages by those at the sample.
    pub fn sample(&mut self, time_s: f64, volts: &mut Row) {
        let end_v = *volts;
        let edge_v = match &self.before {
            None => end_v,
            Some((before_s, edge_v, end_v)) => {
                let left = decay((time_s - before_s) / self.tau_s);
                core::array::from_fn(|column| end_v[column] + left * (edge_v[column] - end_v[column]))
            }
        };
        for (volts, edge) in volts.iter_mut().zip(edge_v) {
            *volts += self.left * (edge - *volts);
        }
        self.before = Some((time_s, edge_v, end_v));
    }
}

const TERMS: usize = 9;
const TAUS_S: [f64; TERMS] = [1e-3, 1e-2, 1e-1, 1.0, 1e1, 1e2, 1e3, 1e4, 1e5];

/// 1 - exp(-x) without cancellation at small x: a frame is 1e-8 of the slowest term. The series are exact to 4e-14.
fn gone(x: f64) -> f64 {
    const SHARES: [f64; 9] =
        [1.0 / 10.0, 1.0 / 9.0, 1.0 / 8.0, 1.0 / 7.0, 1.0 / 6.0, 1.0 / 5.0, 1.0 / 4.0, 1.0 / 3.0, 1.0 / 2.0];
    let series = |shares: &[f64]| x * shares.iter().fold(1.0, |sum, share| 1.0 - x * share * sum);
    match x {
        ..1e-4 => series(&SHARES[7..]),
        ..0.125 => series(&SHARES),
        _ => 1.0 - decay(x),
    }
}

#[derive(Clone, Copy)]
enum Taxel {
    Sound,
    Stuck,
    Fixed(f64),
}
