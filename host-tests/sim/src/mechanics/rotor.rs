//! The motor's shaft: one degree of freedom with friction that sticks.
//!
//! The step is the trapezoidal rule with the contact force replaced by its mean over the step's way (a discrete
//! gradient of the contact's energy). It is of second order, and the energy balance holds exactly whatever the step:
//! what friction and the winding take is taken, and nothing appears from nowhere. Where the shaft comes to rest inside
//! a step, the step is cut there; from rest it moves only if what drives it exceeds friction.

use serde::{Deserialize, Serialize};

/// Angle and speed of the motor's shaft.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Shaft {
    /// From where the tip is at travel 0.
    pub angle_rad: f64,
    /// Positive presses the tip into the object.
    pub speed_rad_per_s: f64,
}

/// What the winding is connected to: a voltage behind the whole circuit's resistance, with a limit to the current.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Source {
    /// Voltage without current.
    pub volts: f64,
    /// Winding and everything before it.
    pub ohms: f64,
    /// Largest current either way.
    pub limit_a: f64,
    /// Mean current beside what voltage and resistance give: what an inductance keeps up; 0 without one.
    pub kept_a: f64,
}

impl Source {
    /// An open circuit.
    pub const OPEN: Self = Self { volts: 0.0, ohms: f64::INFINITY, limit_a: f64::INFINITY, kept_a: 0.0 };
}

/// What resists the shaft over a way.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Resistance {
    /// Mean torque of all that stores energy: its difference in energy over the way.
    pub load_nm: f64,
    /// Friction while it slides; it takes the sign of the motion.
    pub sliding_nm: f64,
    /// Friction that has to be exceeded from rest.
    pub holding_nm: f64,
}

/// What acts on the shaft. It holds through a step.
pub trait Acting {
    /// Between two angles; at one where they are equal.
    fn resistance(&mut self, from_rad: f64, to_rad: f64) -> Resistance;

    /// What feeds the winding, on average over so long.
    fn source(&self, dt_s: f64) -> Source;

    /// Friction torque for each speed, N m s.
    fn viscous_nm_s(&self) -> f64 {
        0.0
    }

    /// A part of the step is done: so long, at this mean speed.
    fn took(&mut self, _dt_s: f64, _mean_rad_per_s: f64) {}
}

/// What turns: inertia and torque constant, and how its step is solved.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Rotor {
    /// Inertia at the shaft.
    pub inertia_kg_m2: f64,
    /// Torque constant; also the back-EMF constant in V s/rad.
    pub torque_nm_per_a: f64,
    /// Rounds of the fixed point at most: each gains a factor of (step x contact frequency)^2 / 4.
    pub rounds: usize,
    /// Share of the mean speed below whose change the rounds end.
    pub tolerance: f64,
}

/// Rests inside one step after which it counts as at rest until the step's end.
const RESTS_MAX: usize = 8;

impl Rotor {
    /// Current at a speed.
    pub fn current_a(&self, source: &Source, speed_rad_per_s: f64) -> f64 {
        let back_emf = self.torque_nm_per_a * speed_rad_per_s;
        ((source.volts - back_emf) / source.ohms + source.kept_a).clamp(-source.limit_a, source.limit_a)
    }

    /// One step.
    pub fn advance(&self, mut shaft: Shaft, dt_s: f64, acting: &mut impl Acting) -> Shaft {
        let mut left_s = dt_s;
        for _ in 0..RESTS_MAX {
            let Some(direction) = self.direction(&shaft, left_s, acting) else { break };
            let (next, mean_speed) = self.slide(&shaft, left_s, direction, acting);
            if next.speed_rad_per_s * direction >= 0.0 {
                acting.took(left_s, mean_speed);
                return next;
            }
            let (rest, taken_s) = self.come_to_rest(&shaft, left_s, direction, acting);
            acting.took(taken_s, 0.5 * shaft.speed_rad_per_s);
            shaft = rest;
            left_s -= taken_s;
        }
        acting.took(left_s, 0.0);
        Shaft { speed_rad_per_s: 0.0, ..shaft }
    }

    /// As [`Rotor::advance`] while the shaft moves; the time taken is less than `dt_s` where it comes to rest.
    pub fn advance_to_rest(&self, shaft: Shaft, dt_s: f64, acting: &mut impl Acting) -> (Shaft, f64) {
        let Some(direction) = self.direction(&shaft, dt_s, acting) else { return (shaft, 0.0) };
        let (next, _) = self.slide(&shaft, dt_s, direction, acting);
        if next.speed_rad_per_s * direction > 0.0 {
            (next, dt_s)
        } else {
            self.come_to_rest(&shaft, dt_s, direction, acting)
        }
    }

    /// Where the shaft moves or starts to move; none while friction holds it.
    pub fn direction(&self, shaft: &Shaft, dt_s: f64, acting: &mut impl Acting) -> Option<f64> {
        if shaft.speed_rad_per_s != 0.0 {
            return Some(shaft.speed_rad_per_s.signum());
        }
        let resistance = acting.resistance(shaft.angle_rad, shaft.angle_rad);
        let net = self.torque_nm_per_a * self.current_a(&acting.source(dt_s), 0.0) - resistance.load_nm;
        (net.abs() > resistance.holding_nm).then_some(net.signum())
    }

    fn slide(&self, from: &Shaft, dt_s: f64, direction: f64, acting: &mut impl Acting) -> (Shaft, f64) {
        let half = 0.5 * dt_s / self.inertia_kg_m2;
        let k = self.torque_nm_per_a;
        let source = acting.source(dt_s);
        let slowing = 1.0 + (half * k * k / source.ohms + half * acting.viscous_nm_s());
        let drive = k * source.volts / source.ohms + k * source.kept_a;
        let mut mean_speed = from.speed_rad_per_s;
        for _ in 0..self.rounds {
            let before = mean_speed;
            let to_rad = from.angle_rad + dt_s * mean_speed;
            let against = against_nm(&acting.resistance(from.angle_rad, to_rad), direction);
            let free = from.speed_rad_per_s + half * (drive - against);
            mean_speed = free / slowing;
            if (source.volts - k * mean_speed).abs() > source.limit_a * source.ohms {
                let current = self.current_a(&source, mean_speed);
                mean_speed = from.speed_rad_per_s + half * (k * current - against);
            }
            if (mean_speed - before).abs() <= self.tolerance * mean_speed.abs() {
                break;
            }
        }
        let next = Shaft {
            angle_rad: from.angle_rad + dt_s * mean_speed,
            speed_rad_per_s: 2.0 * mean_speed - from.speed_rad_per_s,
        };
        (next, mean_speed)
    }

    /// The same step with its length such that it ends at rest.
    fn come_to_rest(&self, from: &Shaft, at_most_s: f64, direction: f64, acting: &mut impl Acting) -> (Shaft, f64) {
        let mean_speed = 0.5 * from.speed_rad_per_s;
        let mut taken_s = 0.0;
        for _ in 0..self.rounds {
            let before_s = taken_s;
            let torque = self.torque_nm_per_a * self.current_a(&acting.source(taken_s), mean_speed)
                - acting.viscous_nm_s() * mean_speed;
            let to_rad = from.angle_rad + taken_s * mean_speed;
            let against = against_nm(&acting.resistance(from.angle_rad, to_rad), direction);
            taken_s = (self.inertia_kg_m2 * from.speed_rad_per_s / (against - torque)).clamp(0.0, at_most_s);
            if (taken_s - before_s).abs() <= self.tolerance * taken_s {
                break;
            }
        }
        (Shaft { angle_rad: from.angle_rad + taken_s * mean_speed, speed_rad_per_s: 0.0 }, taken_s)
    }
}

fn against_nm(resistance: &Resistance, direction: f64) -> f64 {
    resistance.load_nm + direction * resistance.sliding_nm
}

/// The mean of `factor` max(x, 0)^2 between two places, to rounding at any distance between them.
pub fn mean_square(factor: f64, x0: f64, x1: f64) -> f64 {
    let (d0, d1) = (x0.max(0.0), x1.max(0.0));
    let share = if (x0 > 0.0) == (x1 > 0.0) { 1.0 } else { (d1 - d0) / (x1 - x0) };
    factor * (d0 * d0 + d0 * d1 + d1 * d1) / 3.0 * share
}
