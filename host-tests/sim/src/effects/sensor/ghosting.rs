//! Without a virtual ground, current finds its way through other taxels.

use super::Row;
use crate::effects::{Build, Part};
use crate::key::Key;
use crate::registry::{Description, Family};
use fingertip::shipped::{COLUMNS, ROWS};

/// What a scene names.
pub const EFFECT: Description = Description {
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
