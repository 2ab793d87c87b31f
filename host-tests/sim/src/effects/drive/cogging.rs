//! The magnet pulls the rotor's teeth: a torque that changes with the angle and gives back what it takes.

use super::Potential;
use crate::effects::{Build, Part};
use crate::key::Key;
use crate::registry::{Description, Family};

/// What a scene names.
pub const EFFECT: Description = Description {
    name: "cogging",
    family: Family::Drive,
    about: "The magnet pulls the rotor's teeth: a torque that changes with the angle and gives back what it takes.",
    equations: &[
        "E = torque_mnm / N (1 - cos(N a)),  T = -dE/da = -torque_mnm sin(N a)",
        "over a step: the mean torque is the difference in E over the way, torque_mnm sin(N a_mean) sin(h) / h, h = N way / 2",
    ],
    state: "none",
    reference: "ironless motors such as the reference have none; a few percent of the stall torque in slotted ones",
    keys: &[
        Key::number("torque_mnm", "Amplitude at the motor's shaft.", 0.0, 20.0, 0.05),
        Key::whole("teeth", "Periods for one turn of the motor: N.", 1, 1000, 12),
    ],
    zero: &[("torque_mnm", 0.0)],
    build: |build: &Build| {
        Part::Potential(Box::new(Cogging {
            torque_nm: build.values.number("torque_mnm") * 1e-3,
            teeth: build.values.number("teeth"),
        }))
    },
};

struct Cogging {
    torque_nm: f64,
    teeth: f64,
}

impl Potential for Cogging {
    fn energy_j(&self, angle_rad: f64) -> f64 {
        // 1 - cos = 2 sin^2 of the half keeps its digits near 0.
        let half = libm::sin(0.5 * self.teeth * angle_rad);
        2.0 * self.torque_nm / self.teeth * half * half
    }

    fn mean_nm(&mut self, from_rad: f64, to_rad: f64) -> f64 {
        let half = 0.5 * self.teeth * (to_rad - from_rad);
        let spread = if half.abs() < 1e-4 { 1.0 - half * half / 6.0 } else { libm::sin(half) / half };
        self.torque_nm * libm::sin(0.5 * self.teeth * (from_rad + to_rad)) * spread
    }

    fn steepest_nm_per_rad(&self) -> f64 {
        self.torque_nm * self.teeth
    }
}
