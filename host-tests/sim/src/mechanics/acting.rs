//! What acts on one finger's shaft through a step: the winding's current, friction, and the load at the tip.

use crate::effects::drive::{Circuit, Friction, Stages};
use crate::mechanics::decay::decay;
use crate::mechanics::rotor::{Acting, Resistance, Source};

/// The source without what an inductance adds.
pub fn resistive(circuit: &Circuit, open: bool) -> Source {
    if open {
        return Source::OPEN;
    }
    let ohms = circuit.winding_ohm + circuit.bridge_ohm + circuit.duty * circuit.duty * circuit.source_ohm;
    Source { volts: circuit.duty * circuit.source_v, ohms, ..Source::OPEN }
}

/// What acts on a finger's shaft.
pub struct Acts<'a, D, L> {
    /// The effects on the drive.
    pub drive: &'a mut D,
    /// Whether there are none, so that none need be asked.
    pub alone: bool,
    /// What the winding is connected to.
    pub circuit: &'a Circuit,
    /// Whether the bridge is open.
    pub open: bool,
    /// What takes energy from the shaft.
    pub friction: &'a Friction,
    /// Way of the tip for each angle.
    pub mm_per_rad: f64,
    /// The tip's load: its mean between two places of the pressing flank.
    pub load_n: L,
    /// Torque constant.
    pub torque_nm_per_a: f64,
    /// Current in the winding, at the start and then at the end.
    pub winding_a: f64,
    /// The integral of its square over the step.
    pub square_a2_s: f64,
}

impl<D, L> Acts<'_, D, L> {
    /// exp(-x) and its mean from 0 to x, x the time in units of L / R.
    fn kept(&self, dt_s: f64, ohms: f64) -> [f64; 2] {
        let x = dt_s * ohms / self.circuit.henry;
        let end = decay(x);
        let mean = if x < 0.01 {
            1.0 - x / 2.0 * (1.0 - x / 3.0 * (1.0 - x / 4.0 * (1.0 - x / 5.0)))
        } else {
            (1.0 - end) / x
        };
        [end, mean]
    }
}

impl<D: Stages, L: Fn(f64, f64) -> f64> Acting for Acts<'_, D, L> {
    fn resistance(&mut self, from_rad: f64, to_rad: f64) -> Resistance {
        let load_n = (self.load_n)(from_rad * self.mm_per_rad, to_rad * self.mm_per_rad);
        let load_nm = self.mm_per_rad * 1e-3 * load_n;
        let shared = self.friction.load_share * load_nm;
        let potential_nm = if self.alone { 0.0 } else { self.drive.potential_nm(from_rad, to_rad) };
        Resistance {
            load_nm: load_nm + potential_nm,
            sliding_nm: self.friction.sliding_nm + shared,
            holding_nm: self.friction.holding_nm + shared,
        }
    }

    fn source(&self, dt_s: f64) -> Source {
        let source = resistive(self.circuit, self.open);
        if self.circuit.henry == 0.0 || self.open {
            return source;
        }
        // Exact for a speed that holds: i = i_end + (i_0 - i_end) exp(-t R / L).
        let [_, mean] = self.kept(dt_s, source.ohms);
        let given = 1.0 - mean;
        Source { ohms: source.ohms / given, kept_a: mean * self.winding_a, ..source }
    }

    fn viscous_nm_s(&self) -> f64 {
        self.friction.viscous_nm_s
    }

    fn took(&mut self, dt_s: f64, mean_rad_per_s: f64) {
        let source = resistive(self.circuit, self.open);
        let end_a = (source.volts - self.torque_nm_per_a * mean_rad_per_s) / source.ohms;
        if self.circuit.henry == 0.0 || self.open {
            self.winding_a = end_a;
            self.square_a2_s += end_a * end_a * dt_s;
            return;
        }
        let [end, mean] = self.kept(dt_s, source.ohms);
        let over_a = self.winding_a - end_a;
        self.winding_a = end_a + over_a * end;
        // Mean of the square: the transient's own mean square is mean (1 + end) / 2.
        let square = end_a * (end_a + 2.0 * over_a * mean) + over_a * over_a * mean * 0.5 * (1.0 + end);
        self.square_a2_s += square * dt_s;
    }
}
