//! From the taxels' conductance to codes: lines, amplifiers and converter.

use super::Row;
use crate::effects::{Build, Part};
use crate::effects::{normal_within_3, normals};
use crate::key::Key;
use crate::mechanics::decay::decay;
use crate::registry::{Description, Family};
use crate::setup::Array;
use fastrand::Rng;
use fingertip::shipped::{COLUMNS, ROWS, SLOTS};

pub(super) const GHOSTING: Description = Description {
    name: "ghosting",
    family: Family::Sensor,
    about: "The rows that are not driven and the columns that are not read are held at the virtual ground only through a resistance.",
    equations: &[
        "the whole network of 100 taxels, the driven row i at 1 V, every line tied to ground by h = 1 / hold_ohm",
        "rows eliminated: A = diag(h + sum over k of G_kc) - sum over k != i of G_k G_k^T / (h + sum over c of G_kc), b = G_i",
        "the read column's short-circuit current, which is the conductance seen: (A^-1 b)_j / (A^-1)_jj",
        "hold_ohm = 0: G_ij; lines afloat and all taxels alike: G M N / (M + N - 1), a resistance of 0.19 R for 10 x 10",
    ],
    state: "none; it sees each other row as of its last sample, at most a frame ago",
    reference: "D'Alessio, Measurement errors in the scanning of piezoresistive sensors arrays, Sensors and Actuators A 72 (1999)",
    keys: &[Key::number(
        "hold_ohm",
        "Resistance through which lines are held; 0 is a perfect virtual ground, 1e12 none.",
        0.0,
        1e12,
        1000.0,
    )],
    zero: &[("hold_ohm", 0.0)],
    build: |build: &Build| {
        let hold_ohm = build.values.number("hold_ohm");
        Part::Network(Box::new(move |row, array, seen| {
            if hold_ohm > 0.0 {
                *seen = short_circuit(row, array, 1.0 / hold_ohm);
            }
        }))
    },
};

fn short_circuit(driven: usize, array: &[Row; ROWS], hold: f64) -> Row {
    let mut a = [[0.0; COLUMNS]; COLUMNS];
    for (row, siemens) in array.iter().enumerate() {
        let line = hold + siemens.iter().sum::<f64>();
        for (c, g) in siemens.iter().enumerate() {
            a[c][c] += g;
            if row != driven {
                let share = g / line;
                a[c].iter_mut().zip(siemens).for_each(|(a, other)| *a -= share * other);
            }
        }
    }
    for (c, line) in a.iter_mut().enumerate() {
        line[c] += hold;
    }
    let inverse = inverse(a);
    core::array::from_fn(|j| {
        let open: f64 = inverse[j].iter().zip(&array[driven]).map(|(a, b)| a * b).sum();
        (open / inverse[j][j]).max(0.0)
    })
}

/// Of a symmetric positive definite matrix, by Gauss and Jordan; such a one needs no pivots.
fn inverse(mut a: [Row; COLUMNS]) -> [Row; COLUMNS] {
    for p in 0..COLUMNS {
        let pivot = 1.0 / a[p][p];
        a[p][p] = 1.0;
        a[p].iter_mut().for_each(|entry| *entry *= pivot);
        let line = a[p];
        for (_, other) in a.iter_mut().enumerate().filter(|(row, _)| *row != p) {
            let factor = core::mem::replace(&mut other[p], 0.0);
            other.iter_mut().zip(line).for_each(|(entry, part)| *entry -= factor * part);
        }
    }
    a
}

pub(super) const ROW_SAG: Description = Description {
    name: "row_sag",
    family: Family::Sensor,
    about: "The driven row's switch and trace take a part of its voltage. The controller corrects for it, unless [controller] says \
            otherwise.",
    equations: &["G' = G / (1 + R_on S), S = the row's sum of G: a loss of R_on S / (1 + R_on S)"],
    state: "none",
    reference: "docs/board.md: 30 Ohm; R_min 1 kOhm in all ten columns loses 41 % at 70 Ohm and 4.8 % at 5 Ohm",
    keys: &[Key::number("switch_ohm", "Resistance of switch and trace, R_on.", 0.0, 300.0, 30.0)],
    zero: &[("switch_ohm", 0.0)],
    build: |build: &Build| {
        let switch_ohm = build.values.number("switch_ohm");
        Part::Network(Box::new(move |_, _, seen| {
            let left = 1.0 + switch_ohm * seen.iter().sum::<f64>();
            seen.iter_mut().for_each(|siemens| *siemens /= left);
        }))
    },
};

pub(super) const SETTLING: Description = Description {
    name: "settling",
    family: Family::Sensor,
    about: "Each column still carries a part of the slot before when it is sampled.",
    equations: &[
        "dv/dt = (V - v) / tau_us, V what the slot settles to",
        "sampled at after_us behind the slot's edge: v = V + (v_edge - V) exp(-after_us / tau_us), exact",
    ],
    state: "voltage of each column at the last edge, and what it settles to (20 numbers)",
    reference: "docs/runs.md, Readout: 0.2 us; half a bit of 12 takes 9.0 tau",
    keys: &[
        Key::number("tau_us", "Time constant.", 0.0, 100.0, 0.2),
        Key::number("after_us", "From the edge to the sample.", 0.1, 1000.0, 2.4),
    ],
    zero: &[("tau_us", 0.0)],
    build: |build: &Build| {
        let [tau_s, after_s] = ["tau_us", "after_us"].map(|key| build.values.number(key) * 1e-6);
        let mut settling = Settling::new(tau_s, after_s);
        Part::Volts(Box::new(move |_, time_s, volts| settling.sample(time_s, volts)))
    },
};

/// How far the columns have settled.
pub struct Settling {
    tau_s: f64,
    /// What is left of a difference at the sample.
    left: f64,
    before: Option<Before>,
}

impl Settling {
    /// Not scanned yet.
    pub fn new(tau_s: f64, after_s: f64) -> Self {
        Self { tau_s, left: decay(after_s / tau_s), before: None }
    }
    /// What the columns have come to, in place of what they settle to, at a sample.
    pub fn sample(&mut self, time_s: f64, volts: &mut Row) {
        let end_v = *volts;
        let edge_v = match &self.before {
            None => end_v,
            Some(Before { time_s: before_s, edge_v, end_v }) => {
                let left = decay((time_s - before_s) / self.tau_s);
                core::array::from_fn(|column| end_v[column] + left * (edge_v[column] - end_v[column]))
            }
        };
        for (volts, edge) in volts.iter_mut().zip(edge_v) {
            *volts += self.left * (edge - *volts);
        }
        self.before = Some(Before { time_s, edge_v, end_v });
    }
}

struct Before {
    time_s: f64,
    edge_v: Row,
    end_v: Row,
}

pub(super) const SATURATION: Description = Description {
    name: "saturation",
    family: Family::Sensor,
    about: "The column amplifiers cannot reach the converter's reference.",
    equations: &["v' = min(v, V_ref - headroom_mv)"],
    state: "none",
    reference: "output swing to the rail in data sheets of amplifiers, 5 to 200 mV",
    keys: &[Key::number("headroom_mv", "How far below the reference of 3.3 V they end.", 0.0, 3000.0, 50.0)],
    zero: &[("headroom_mv", 0.0)],
    build: |build: &Build| {
        let rail_v = Array::default().reference_v - build.values.number("headroom_mv") * 1e-3;
        Part::Volts(Box::new(move |_, _, volts| volts.iter_mut().for_each(|volts| *volts = volts.min(rail_v))))
    },
};

pub(super) const NOISE: Description = Description {
    name: "noise",
    family: Family::Sensor,
    about: "White noise on every conversion.",
    equations: &["code' = code + rms_codes g, g normal, drawn for each conversion"],
    state: "the random numbers' (8 bytes)",
    reference: "ST application note AN4073, averaging against converter noise: a few codes",
    keys: &[Key::number("rms_codes", "Its deviation, in codes of the 12-bit converter.", 0.0, 500.0, 1.5)],
    zero: &[("rms_codes", 0.0)],
    build: |build: &Build| {
        let rms_codes = build.values.number("rms_codes");
        let mut rng = Rng::with_seed(build.seed);
        Part::Codes(Box::new(move |_, _, codes| {
            let noise: Row = normals(&mut rng);
            codes.iter_mut().zip(noise).for_each(|(code, noise)| *code += rms_codes * noise);
        }))
    },
};

pub(super) const OFFSET: Description = Description {
    name: "offset",
    family: Family::Sensor,
    about: "Each taxel, and each column with no row driven, reads from a level of its own; the tare takes it out.",
    equations: &["code' = code + rms_codes g, g of each taxel normal, drawn once, within 3 deviations"],
    state: "none; 110 levels drawn at the start",
    reference: "docs/board.md: the preload's spread and the amplifiers' offsets",
    keys: &[Key::number("rms_codes", "Deviation of the levels, in codes of the 12-bit converter.", 0.0, 200.0, 5.0)],
    zero: &[("rms_codes", 0.0)],
    build: |build: &Build| {
        let mut rng = Rng::with_seed(build.seed);
        let rms_codes = build.values.number("rms_codes");
        let offsets = [(); SLOTS].map(|()| Row::default().map(|_| rms_codes * normal_within_3(&mut rng)));
        Part::Codes(Box::new(move |slot, _, codes| {
            codes.iter_mut().zip(offsets[slot]).for_each(|(code, offset)| *code += offset);
        }))
    },
};

pub(super) const CONVERTER: Description = Description {
    name: "converter",
    family: Family::Sensor,
    about: "A converter with fewer bits than 12 and with an integral non-linearity.",
    equations: &[
        "bow: c = code + inl_codes 4 x (1 - x), x = code / 4096 within 0 to 1",
        "code' = floor(c / q) q, q = 2^(12 - bits)",
    ],
    state: "none",
    reference: "Tekscan I-Scan, the paper's kind of sensor: 8 bits; STM32F446 data sheet: INL 2 to 3 codes of 12 bits",
    keys: &[
        Key::whole("bits", "Resolution.", 1, 12, 8),
        Key::number(
            "inl_codes",
            "Largest deviation from the straight line, in the middle, in codes of the 12-bit converter.",
            -50.0,
            50.0,
            0.0,
        ),
    ],
    zero: &[("bits", 12.0), ("inl_codes", 0.0)],
    build: |build: &Build| {
        let step = f64::from(1 << (12 - build.values.whole("bits")));
        let inl_codes = build.values.number("inl_codes");
        Part::Codes(Box::new(move |_, _, codes| {
            for code in codes {
                let x = (*code / Array::CODES).clamp(0.0, 1.0);
                *code = ((*code + inl_codes * 4.0 * x * (1.0 - x)) / step).floor() * step;
            }
        }))
    },
};
