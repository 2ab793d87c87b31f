//! The winding and what feeds it.

use super::{Circuit, Electric};
use crate::effects::{Build, Part};
use crate::key::Key;
use crate::mechanics::decay::decay;
use crate::registry::{Description, Family};
use crate::watch::Truth;

pub(super) const SUPPLY_SAG: Description = Description {
    name: "supply_sag",
    family: Family::Drive,
    about: "The source, its wires and connectors have a resistance.",
    equations: &[
        "the bridge takes the share u of the current: V = source_v - source_ohm u i",
        "so the motor sees u^2 source_ohm in series",
    ],
    state: "none",
    reference: "docs/runs.md: 0.1 Ohm",
    keys: &[Key::number("source_ohm", "Resistance of source, wires and connectors.", 0.0, 100.0, 0.1)],
    zero: &[("source_ohm", 0.0)],
    build: |build: &Build| {
        let ohm = build.values.number("source_ohm");
        Part::Electric(Box::new(move |circuit: &mut Circuit| circuit.source_ohm += ohm))
    },
};

/// Copper's temperature coefficient of resistance.
const COPPER_PER_K: f64 = 0.0039;

pub(super) const THERMAL_DERATING: Description = Description {
    name: "thermal_derating",
    family: Family::Drive,
    about: "The winding heats up: its resistance rises, and the warm magnet is weaker.",
    equations: &[
        "C dT/dt = i^2 R(T) - (T - ambient_c) / R_th,  C R_th = tau_s",
        "R(T) = R (1 + 0.0039 (T - 25)),  k(T) = k (1 + magnet_per_k (T - 25))",
        "over a step at its mean square current: T goes to its end exponentially, exact at constant current",
    ],
    state: "temperature of the winding, degC",
    reference: "copper 0.39 %/K (IEC 60034-1); FAULHABER data sheet 1331 ... SR, thermal resistance winding to ambient 20 + 26 K/W",
    keys: &[
        Key::number("ambient_c", "Temperature around it, and of the winding at the start.", -40.0, 120.0, 25.0),
        Key::number("k_per_w", "From the winding to its surroundings.", 0.0, 1000.0, 46.0),
        Key::number("tau_s", "Thermal time constant.", 0.1, 100000.0, 400.0),
        Key::number("magnet_per_k", "Change of the torque constant for each K.", -0.01, 0.01, -0.001),
    ],
    zero: &[("k_per_w", 0.0), ("ambient_c", 25.0)],
    build: |build: &Build| {
        let [ambient_c, k_per_w, tau_s, magnet_per_k] =
            ["ambient_c", "k_per_w", "tau_s", "magnet_per_k"].map(|name| build.values.number(name));
        Part::Electric(Box::new(ThermalDerating {
            ambient_c,
            k_per_w,
            tau_s,
            magnet_per_k,
            winding_c: ambient_c,
            cold_ohm: 0.0,
        }))
    },
};

struct ThermalDerating {
    ambient_c: f64,
    k_per_w: f64,
    tau_s: f64,
    magnet_per_k: f64,
    winding_c: f64,
    /// Resistance at 25 degC, as the step found it.
    cold_ohm: f64,
}

impl Electric for ThermalDerating {
    fn apply(&mut self, circuit: &mut Circuit) {
        self.cold_ohm = circuit.winding_ohm;
        circuit.winding_ohm *= 1.0 + COPPER_PER_K * (self.winding_c - 25.0);
        circuit.torque_nm_per_a *= 1.0 + self.magnet_per_k * (self.winding_c - 25.0);
    }

    fn after(&mut self, dt_s: f64, _circuit: &Circuit, square_a2_s: f64) {
        if dt_s == 0.0 {
            return;
        }
        // With R(T) put in: tau dT/dt = (heat at 25 degC) + ambient - ... is linear in T, with this rate and end.
        let kelvin = square_a2_s / dt_s * self.cold_ohm * self.k_per_w;
        let rate = 1.0 - COPPER_PER_K * kelvin;
        let source = self.ambient_c + kelvin * (1.0 - COPPER_PER_K * 25.0);
        let x = dt_s / self.tau_s;
        // A winding that runs away grows instead: exp of a negative argument is one over the other's.
        let left = if rate >= 0.0 { decay(x * rate) } else { 1.0 / decay(-x * rate) };
        let change = source - rate * self.winding_c;
        self.winding_c +=
            if (x * rate).abs() < 1e-6 { change * x * (1.0 - 0.5 * x * rate) } else { change * (1.0 - left) / rate };
    }

    fn tell(&self, truth: &mut Truth) {
        truth.winding_c = self.winding_c;
    }
}

pub(super) const WINDING_INDUCTANCE: Description = Description {
    name: "winding_inductance",
    family: Family::Drive,
    about: "The winding's current takes time to follow.",
    equations: &[
        "L di/dt = u V - R i - k w",
        "over a step: i = i_end + (i_0 - i_end) exp(-t R / L), i_end = (u V - k w) / R, exact at a held speed",
        "an open bridge takes the current at once",
    ],
    state: "current in the winding, A",
    reference: "FAULHABER data sheet 1331 T 006 SR: 70 uH",
    keys: &[Key::number("inductance_uh", "Inductance of the winding.", 0.0, 100000.0, 70.0)],
    zero: &[("inductance_uh", 0.0)],
    build: |build: &Build| {
        let henry = build.values.number("inductance_uh") * 1e-6;
        Part::Electric(Box::new(move |circuit: &mut Circuit| circuit.henry += henry))
    },
};
