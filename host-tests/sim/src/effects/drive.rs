//! Drive from the duty of the bridge to the place of the tip.
//!
//! A step of the drive calls each stage once: the supply of the winding (circuit), and the friction of the shaft.
//! Torques that store energy (potential) are called in every iteration of the step and return their mean over the step,
//! so that no energy is lost. After the step the heat of the winding and the place of the tip behind the play of the
//! gear follow. The count of the encoder is computed where it is read. Without effects the drive has a rotor without
//! friction, a winding that is a resistance, an ideal source, and a rigid transmission.

use crate::effects::{Description, Metered, Stage};
use crate::mechanics::rotor::Source;
use crate::mechanics::{Bridge, decay};
use crate::scene::tables::Key;
use crate::setup::Setup;
use crate::watch::Cost;

/// Circuit of the winding during a step.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Circuit {
    pub source_v: f64,
    /// Resistance of the source. The motor sees duty^2 of it.
    pub source_ohm: f64,
    /// True if both half bridges are open.
    pub open: bool,
    /// Share of the supply at the motor, -1 to 1.
    pub duty: f64,
    pub winding_ohm: f64,
    /// Resistance of the two switches of the bridge.
    pub bridge_ohm: f64,
    /// Inductance of the winding; 0 lets the current follow at once.
    pub henry: f64,
    /// Torque constant, and back-EMF constant in V s/rad.
    pub torque_nm_per_a: f64,
}

impl Circuit {
    /// Circuit of a setup, before any effect.
    pub fn of(setup: &Setup, bridge: Bridge) -> Self {
        let (open, duty) = match bridge {
            Bridge::Coast => (true, 0.0),
            Bridge::Driven { duty } => (false, duty.clamp(-1.0, 1.0)),
        };
        Self {
            source_v: setup.supply.source_v,
            open,
            duty,
            winding_ohm: setup.motor.resistance_ohm,
            bridge_ohm: setup.supply.bridge_ohm,
            torque_nm_per_a: setup.motor.torque_nm_per_a,
            ..Self::default()
        }
    }

    /// Source of the winding, without the effect of an inductance.
    pub(crate) fn source(&self) -> Source {
        if self.open {
            return Source::OPEN;
        }
        let ohms = self.winding_ohm + self.bridge_ohm + self.duty * self.duty * self.source_ohm;
        Source { volts: self.duty * self.source_v, ohms, ..Source::OPEN }
    }
}

/// Friction of the shaft during a step.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Friction {
    /// Torque while it slides, independent of the load.
    pub sliding_nm: f64,
    /// Torque to be exceeded from rest, independent of the load.
    pub holding_nm: f64,
    /// Share of the load of the tip, sliding and from rest.
    pub load_share: f64,
    /// Torque per speed, N m s.
    pub viscous_nm_s: f64,
}

/// Inertia added at the shaft, kg m^2, for the travel of the tip per angle, m/rad. Called once.
pub type Inertia = dyn FnMut(f64) -> f64 + Send;

/// Effect on the circuit of the winding in the next step.
pub type Electric = dyn FnMut(&mut Circuit) + Send;

/// Effect that adds friction to a step with about this mean speed, rad/s.
pub type Resist = dyn FnMut(f64, &mut Friction) + Send;

/// Play between shaft and tip: returns the place of the tip for the pressing flank and the surface of the object, mm.
pub type Play = dyn FnMut(f64, f64) -> f64 + Send;

/// Effect on a count of the encoder. It has no memory, as each read calls it.
pub type Encoder = dyn FnMut(i32) -> i32 + Send;

named! {
    inertia: Inertia,
    electric: Electric,
    heat: ThermalDerating,
    resist: Resist,
    potential: Cogging,
    play: Play,
    encoder: Encoder,
}

/// Effects of this family, in the order in which they act within a stage.
pub const EFFECTS: &[Description] = &[
    Description {
        name: "inertia",
        about: "Inertia of the gear and mass of the finger, in addition to the rotor.",
        equations: &[
            "J = J_rotor + gear_g_cm2 + finger_g (r / n)^2, r / n the travel of the tip per angle of the shaft",
        ],
        state: "none",
        reference: "docs/runs.md: 30 g at the tip are 3 % of the rotor's inertia; the gear's is not published",
        keys: &[
            Key::number("gear_g_cm2", "Inertia of the gear at the shaft of the motor.", 0.0, 100.0, 0.05).idle(0.0),
            Key::number("finger_g", "Mass that moves with the tip.", 0.0, 1000.0, 30.0).idle(0.0),
        ],
        build: |build, parts| {
            let gear_kg_m2 = build.number("gear_g_cm2") * 1e-7;
            let finger_kg = build.number("finger_g") * 1e-3;
            let inertia_kg_m2 = move |m_per_rad| gear_kg_m2 + finger_kg * m_per_rad * m_per_rad;
            parts.drive.inertia.push(build.part(Box::new(inertia_kg_m2)));
        },
    },
    Description {
        name: "supply_sag",
        about: "Resistance of source, wires and connectors.",
        equations: &[
            "the bridge takes the share u of the current: V = source_v - source_ohm u i",
            "so the motor sees u^2 source_ohm in series",
        ],
        state: "none",
        reference: "docs/runs.md: 0.1 Ohm",
        keys: &[Key::number("source_ohm", "Resistance of source, wires and connectors.", 0.0, 100.0, 0.1).idle(0.0)],
        build: |build, parts| {
            let ohm = build.number("source_ohm");
            parts.drive.electric.push(build.part(Box::new(move |circuit: &mut Circuit| circuit.source_ohm += ohm)))
        },
    },
    Description {
        name: "thermal_derating",
        about: "Heating of the winding: its resistance rises, and the warm magnet is weaker.",
        equations: &[
            "C dT/dt = i^2 R(T) - (T - ambient_c) / R_th,  C R_th = tau_s",
            "R(T) = R (1 + 0.0039 (T - 25)),  k(T) = k (1 + magnet_per_k (T - 25))",
            "in a step T approaches its end exponentially, exact at constant current",
        ],
        state: "temperature of the winding, degC",
        reference: "copper 0.39 %/K (IEC 60034-1); FAULHABER data sheet 1331 ... SR, thermal resistance winding to ambient 20 + 26 K/W",
        keys: &[
            Key::number("ambient_c", "Ambient temperature, and that of the winding at the start.", -40.0, 120.0, 25.0)
                .idle(25.0),
            Key::number("k_per_w", "Thermal resistance from the winding to the surroundings.", 0.0, 1000.0, 46.0)
                .idle(0.0),
            Key::number("tau_s", "Thermal time constant.", 0.1, 100000.0, 400.0),
            Key::number("magnet_per_k", "Change of the torque constant per K.", -0.01, 0.01, -0.001),
        ],
        build: |build, parts| {
            let [ambient_c, k_per_w, tau_s, magnet_per_k] =
                ["ambient_c", "k_per_w", "tau_s", "magnet_per_k"].map(|name| build.number(name));
            let heat = ThermalDerating { ambient_c, k_per_w, tau_s, magnet_per_k, winding_c: ambient_c, cold_ohm: 0.0 };
            parts.drive.heat.push(build.part(Box::new(heat)))
        },
    },
    Description {
        name: "winding_inductance",
        about: "Inductance of the winding: the current takes time to follow.",
        equations: &[
            "L di/dt = u V - R i - k w",
            "over a step: i = i_end + (i_0 - i_end) exp(-t R / L), i_end = (u V - k w) / R, exact at constant speed",
            "an open bridge ends the current at once",
        ],
        state: "current in the winding, A",
        reference: "FAULHABER data sheet 1331 T 006 SR: 70 uH",
        keys: &[Key::number("inductance_uh", "Inductance of the winding.", 0.0, 100000.0, 70.0).idle(0.0)],
        build: |build, parts| {
            let henry = build.number("inductance_uh") * 1e-6;
            parts.drive.electric.push(build.part(Box::new(move |circuit: &mut Circuit| circuit.henry += henry)))
        },
    },
    Description {
        name: "dry_friction",
        about: "Friction of brushes and bearings that is independent of speed, and sticks.",
        equations: &["T = -sign(w) torque_mnm while it turns", "at rest it holds any torque up to torque_mnm"],
        state: "none",
        reference: "FAULHABER data sheet 1331 ... SR: 0.12 mNm",
        keys: &[Key::number("torque_mnm", "Friction torque at the motor's shaft.", 0.0, 20.0, 0.12).idle(0.0)],
        build: |build, parts| {
            let torque_nm = build.number("torque_mnm") * 1e-3;
            parts.drive.resist.push(build.part(Box::new(move |_, friction| {
                friction.sliding_nm += torque_nm;
                friction.holding_nm += torque_nm;
            })))
        },
    },
    Description {
        name: "stribeck",
        about: "Friction that is higher at low speed, so the motion starts with a jump.",
        equations: &[
            "T = -sign(w) torque_mnm / (1 + (w / speed)^2), added to other friction",
            "at rest it holds up to torque_mnm more",
            "w is the speed in the middle of the step, predicted from the step before",
        ],
        state: "none",
        reference: "the Lorentzian form after Hess and Soom, J. Tribology 112 (1990); here without an exponential",
        keys: &[
            Key::number("torque_mnm", "Additional torque at rest, at the shaft of the motor.", 0.0, 20.0, 0.06)
                .idle(0.0),
            Key::number("speed_rad_per_s", "Speed at which half of it remains.", 0.01, 10000.0, 5.0),
        ],
        build: |build, parts| {
            let torque_nm = build.number("torque_mnm") * 1e-3;
            let half_rad_per_s = build.number("speed_rad_per_s");
            parts.drive.resist.push(build.part(Box::new(move |speed_rad_per_s, friction| {
                let share = speed_rad_per_s / half_rad_per_s;
                friction.sliding_nm += torque_nm / (1.0 + share * share);
                friction.holding_nm += torque_nm;
            })))
        },
    },
    Description {
        name: "viscous_friction",
        about: "Friction that grows with the speed.",
        equations: &["T = -torque_unm_s w"],
        state: "none",
        reference: "grease and eddy currents; a tenth of k_t^2 / R of the reference motor is 1 uNm s",
        keys: &[Key::number("torque_unm_s", "Torque per speed at the shaft of the motor.", 0.0, 10000.0, 0.1).idle(0.0)],
        build: |build, parts| {
            let nm_s = build.number("torque_unm_s") * 1e-6;
            parts.drive.resist.push(build.part(Box::new(move |_, friction| friction.viscous_nm_s += nm_s)))
        },
    },
    Description {
        name: "gear_efficiency",
        about: "Loss of a share of the torque in the gear.",
        equations: &[
            "T_f = (1 / efficiency - 1) T, T the tip's load at the shaft; it takes the sign of the motion and holds at rest",
            "pressing, the load gets the share efficiency; pushed back, the motor receives T (2 - 1 / efficiency)",
        ],
        state: "none",
        reference: "docs/runs.md: FAULHABER 14/1 at 43:1, 70 %, github.com/ekrimsk/MGDB",
        keys: &[Key::number("efficiency", "Share of the torque that drives the load.", 0.1, 1.0, 0.7).idle(1.0)],
        build: |build, parts| {
            let share = 1.0 / build.number("efficiency") - 1.0;
            parts.drive.resist.push(build.part(Box::new(move |_, friction| friction.load_share += share)))
        },
    },
    Description {
        name: "cogging",
        about: "Attraction between magnet and rotor teeth: a torque that depends on the angle and stores energy.",
        equations: &[
            "E = torque_mnm / N (1 - cos(N a)),  T = -dE/da = -torque_mnm sin(N a)",
            "mean over a step: torque_mnm sin(N a_mean) sin(h) / h, h = N (a_1 - a_0) / 2, the difference in E over the angle",
        ],
        state: "none",
        reference: "ironless motors such as the reference have none; a few percent of the stall torque in slotted ones",
        keys: &[
            Key::number("torque_mnm", "Amplitude at the shaft of the motor.", 0.0, 20.0, 0.05).idle(0.0),
            Key::whole("teeth", "Periods per turn of the motor, N.", 1, 1000, 12),
        ],
        build: |build, parts| {
            let (torque_nm, teeth) = (build.number("torque_mnm") * 1e-3, build.number("teeth"));
            parts.drive.potential.push(build.part(Box::new(Cogging { torque_nm, teeth })));
        },
    },
    Description {
        name: "backlash",
        about: "Play of the gear: the tip does not move between its flanks.",
        equations: &[
            "flank <= tip <= flank + play_um, flank the motor's angle times r / n",
            "pressed, the tip rests on the pressing flank; if the flank retreats, the tip stays at the object's surface, then follows play_um behind",
            "the tip has no mass between the flanks, and starts on the pressing flank",
        ],
        state: "place of the tip, mm",
        reference: "the play operator; FAULHABER 14/1: at most 3 degrees at the output without load, 0.6 mm on a drum of 12 mm radius",
        keys: &[Key::number("play_um", "Play at the tip.", 0.0, 10000.0, 100.0).idle(0.0)],
        build: |build, parts| {
            let play_mm = build.number("play_um") * 1e-3;
            let mut tip_mm = 0.0_f64;
            parts.drive.play.push(build.part(Box::new(move |flank_mm, surface_mm| {
                tip_mm = tip_mm.min(surface_mm).min(flank_mm + play_mm).max(flank_mm);
                tip_mm
            })))
        },
    },
    Description {
        name: "encoder_resolution",
        about: "A coarse disc of the encoder: the count jumps.",
        equations: &["n = step_counts floor(n_fine / step_counts)"],
        state: "none",
        reference: "an IE2-400 instead of one with 1600 counts per turn: 4",
        keys: &[Key::whole("step_counts", "Counts by which the reading jumps.", 1, 4096, 4).idle(1.0)],
        build: |build, parts| {
            let step = build.values.whole("step_counts") as i32;
            parts.drive.encoder.push(build.part(Box::new(move |count| count.div_euclid(step).wrapping_mul(step))))
        },
    },
];

/// Temperature coefficient of the resistance of copper.
const COPPER_PER_K: f64 = 0.0039;

pub struct ThermalDerating {
    ambient_c: f64,
    k_per_w: f64,
    tau_s: f64,
    magnet_per_k: f64,
    pub winding_c: f64,
    /// Resistance at 25 degC before this effect.
    cold_ohm: f64,
}

impl ThermalDerating {
    /// Changes the circuit of the next step.
    pub fn apply(&mut self, circuit: &mut Circuit) {
        self.cold_ohm = circuit.winding_ohm;
        circuit.winding_ohm *= 1.0 + COPPER_PER_K * (self.winding_c - 25.0);
        circuit.torque_nm_per_a *= 1.0 + self.magnet_per_k * (self.winding_c - 25.0);
    }

    /// Ends a step with its length and the integral of the square of the current.
    pub fn after(&mut self, dt_s: f64, square_a2_s: f64) {
        if dt_s == 0.0 {
            return;
        }
        // With R(T) inserted, tau dT/dt is linear in T, with this rate and source.
        let kelvin = square_a2_s / dt_s * self.cold_ohm * self.k_per_w;
        let rate = 1.0 - COPPER_PER_K * kelvin;
        let source = self.ambient_c + kelvin * (1.0 - COPPER_PER_K * 25.0);
        let x = dt_s / self.tau_s;
        // In a thermal runaway the difference grows: exp(-x) = 1 / exp(x).
        let left = if rate >= 0.0 { decay(x * rate) } else { 1.0 / decay(-x * rate) };
        let change = source - rate * self.winding_c;
        self.winding_c +=
            if (x * rate).abs() < 1e-6 { change * x * (1.0 - 0.5 * x * rate) } else { change * (1.0 - left) / rate };
    }
}

/// Torque on the shaft that stores energy.
pub struct Cogging {
    torque_nm: f64,
    teeth: f64,
}

impl Cogging {
    pub fn energy_j(&self, angle_rad: f64) -> f64 {
        // 1 - cos x = 2 sin^2 (x / 2) without cancellation near 0.
        let half = libm::sin(0.5 * self.teeth * angle_rad);
        2.0 * self.torque_nm / self.teeth * half * half
    }

    /// Mean torque against the motion between two angles: the difference in energy over the distance.
    pub fn mean_nm(&self, from_rad: f64, to_rad: f64) -> f64 {
        let half = 0.5 * self.teeth * (to_rad - from_rad);
        let spread = if half.abs() < 1e-4 { 1.0 - half * half / 6.0 } else { libm::sin(half) / half };
        self.torque_nm * libm::sin(0.5 * self.teeth * (from_rad + to_rad)) * spread
    }

    pub fn steepest_nm_per_rad(&self) -> f64 {
        self.torque_nm * self.teeth
    }
}
