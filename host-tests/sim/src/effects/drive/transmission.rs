//! From the rotor to the tip, and the encoder.

use super::Potential;
use crate::effects::{Build, Part};
use crate::key::Key;
use crate::registry::{Description, Family};

pub(super) const INERTIA: Description = Description {
    name: "inertia",
    family: Family::Drive,
    about: "Inertia of the gear and mass of the finger, beside the rotor's.",
    equations: &["J = J_rotor + gear_g_cm2 + finger_g (r / n)^2, r / n the tip's way for each angle of the shaft"],
    state: "none",
    reference: "docs/runs.md: 30 g at the tip are 3 % of the rotor's inertia; none is published for the gear",
    keys: &[
        Key::number("gear_g_cm2", "Of the gear, at the motor's shaft.", 0.0, 100.0, 0.05),
        Key::number("finger_g", "Mass that moves with the tip.", 0.0, 1000.0, 30.0),
    ],
    zero: &[("gear_g_cm2", 0.0), ("finger_g", 0.0)],
    build: |build: &Build| {
        let gear_kg_m2 = build.values.number("gear_g_cm2") * 1e-7;
        let finger_kg = build.values.number("finger_g") * 1e-3;
        Part::Inertia(Box::new(move |m_per_rad| gear_kg_m2 + finger_kg * m_per_rad * m_per_rad))
    },
};

pub(super) const COGGING: Description = Description {
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

pub(super) const BACKLASH: Description = Description {
    name: "backlash",
    family: Family::Drive,
    about: "The gear has play: between its flanks the tip stays where it is.",
    equations: &[
        "flank <= tip <= flank + play_um, flank the motor's angle times r / n",
        "pressed, the tip rests on the pressing flank; where the flank retreats from a contact the tip stays at the object's surface, then hangs back by play_um",
        "the tip has no mass between the flanks, and starts on the pressing one",
    ],
    state: "place of the tip, mm",
    reference: "the play operator; FAULHABER 14/1: at most 3 degrees without load at the output, which are 0.6 mm on a drum of 12 mm radius",
    keys: &[Key::number("play_um", "Play at the tip.", 0.0, 10000.0, 100.0)],
    zero: &[("play_um", 0.0)],
    build: |build: &Build| {
        let play_mm = build.values.number("play_um") * 1e-3;
        let mut tip_mm = 0.0_f64;
        Part::Play(Box::new(move |flank_mm, surface_mm| {
            tip_mm = tip_mm.min(surface_mm).min(flank_mm + play_mm).max(flank_mm);
            tip_mm
        }))
    },
};

pub(super) const ENCODER_RESOLUTION: Description = Description {
    name: "encoder_resolution",
    family: Family::Drive,
    about: "The encoder's disc is coarser than what is counted: the count jumps.",
    equations: &["n = step_counts floor(n_fine / step_counts)"],
    state: "none",
    reference: "an IE2-400 in place of one with 1600 counts a turn: 4",
    keys: &[Key::whole("step_counts", "Counts by which the reading jumps.", 1, 4096, 4)],
    zero: &[("step_counts", 1.0)],
    build: |build: &Build| {
        let step = build.values.whole("step_counts") as i32;
        Part::Encoder(Box::new(move |count| count.div_euclid(step).wrapping_mul(step)))
    },
};
