//! The motor's shaft: one degree of freedom with friction that sticks.
//!
//! The step is the trapezoidal rule with the contact force replaced by its mean over the step's way (a discrete
//! gradient of the contact's energy). It is of second order, and the energy balance holds exactly whatever the step:
//! what friction and the winding take is taken, and nothing appears from nowhere. Where the shaft comes to rest inside
//! a step, the step is cut there; from rest it moves only if what drives it exceeds friction.

use super::setup::Setup;
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
}

impl Source {
    /// An open circuit.
    pub const OPEN: Self = Self { volts: 0.0, ohms: f64::INFINITY, limit_a: f64::INFINITY };
}

/// The constants of the motion, in SI units at the motor's shaft and mm at the tip.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Dynamics {
    inertia_kg_m2: f64,
    torque_nm_per_a: f64,
    friction_nm: f64,
    friction_share: f64,
    mm_per_rad: f64,
    nm_per_n: f64,
    wall_mm: f64,
    force_per_mm2: f64,
}

/// Rests inside one step after which it counts as at rest until the step's end.
const RESTS_MAX: usize = 8;
/// Rounds of the fixed point: each gains a factor of (step x contact frequency)^2 / 4, 1e-7 at 10 us.
const ROUNDS: usize = 3;

impl Dynamics {
    /// Of a setup.
    pub fn new(setup: &Setup) -> Self {
        let gear = &setup.transmission;
        let mm_per_rad = gear.drum_radius_mm / gear.ratio;
        Self {
            inertia_kg_m2: setup.motor.inertia_kg_m2,
            torque_nm_per_a: setup.motor.torque_nm_per_a,
            friction_nm: setup.motor.friction_nm,
            friction_share: 1.0 / gear.efficiency - 1.0,
            mm_per_rad,
            nm_per_n: mm_per_rad * 1e-3,
            wall_mm: setup.wall.distance_mm,
            force_per_mm2: setup.tip.force_per_mm2(),
        }
    }

    /// The tip's travel at an angle of the shaft.
    pub fn travel_mm(&self, angle_rad: f64) -> f64 {
        angle_rad * self.mm_per_rad
    }

    /// The shaft's angle at a travel of the tip.
    pub fn angle_rad(&self, travel_mm: f64) -> f64 {
        travel_mm / self.mm_per_rad
    }

    /// Current at a speed.
    pub fn current_a(&self, source: &Source, speed_rad_per_s: f64) -> f64 {
        let back_emf = self.torque_nm_per_a * speed_rad_per_s;
        ((source.volts - back_emf) / source.ohms).clamp(-source.limit_a, source.limit_a)
    }

    /// One step. The source holds through it.
    pub fn advance(&self, mut shaft: Shaft, dt_s: f64, source: &Source) -> Shaft {
        let mut left_s = dt_s;
        for _ in 0..RESTS_MAX {
            let Some(direction) = self.direction(&shaft, source) else { break };
            let next = self.slide(&shaft, left_s, direction, source);
            if next.speed_rad_per_s * direction >= 0.0 {
                return next;
            }
            let (rest, taken_s) = self.come_to_rest(&shaft, left_s, direction, source);
            shaft = rest;
            left_s -= taken_s;
        }
        Shaft { speed_rad_per_s: 0.0, ..shaft }
    }

    /// As [`Dynamics::advance`] while the shaft moves; the time taken is less than `dt_s` where it comes to rest.
    pub fn advance_to_rest(&self, shaft: Shaft, dt_s: f64, source: &Source) -> (Shaft, f64) {
        let Some(direction) = self.direction(&shaft, source) else { return (shaft, 0.0) };
        let next = self.slide(&shaft, dt_s, direction, source);
        if next.speed_rad_per_s * direction > 0.0 {
            (next, dt_s)
        } else {
            self.come_to_rest(&shaft, dt_s, direction, source)
        }
    }

    /// Where the shaft moves or starts to move; none while friction holds it.
    pub fn direction(&self, shaft: &Shaft, source: &Source) -> Option<f64> {
        if shaft.speed_rad_per_s != 0.0 {
            return Some(shaft.speed_rad_per_s.signum());
        }
        let load = self.mean_load_nm(shaft.angle_rad, shaft.angle_rad);
        let net = self.torque_nm_per_a * self.current_a(source, 0.0) - load;
        (net.abs() > self.friction_nm + self.friction_share * load).then_some(net.signum())
    }

    fn slide(&self, from: &Shaft, dt_s: f64, direction: f64, source: &Source) -> Shaft {
        let half = 0.5 * dt_s / self.inertia_kg_m2;
        let k = self.torque_nm_per_a;
        let mut mean_speed = from.speed_rad_per_s;
        for _ in 0..ROUNDS {
            let against = self.against_nm(from.angle_rad, from.angle_rad + dt_s * mean_speed, direction);
            let free = from.speed_rad_per_s + half * (k * source.volts / source.ohms - against);
            mean_speed = free / (1.0 + half * k * k / source.ohms);
            if ((source.volts - k * mean_speed) / source.ohms).abs() > source.limit_a {
                let current = self.current_a(source, mean_speed);
                mean_speed = from.speed_rad_per_s + half * (k * current - against);
            }
        }
        Shaft {
            angle_rad: from.angle_rad + dt_s * mean_speed,
            speed_rad_per_s: 2.0 * mean_speed - from.speed_rad_per_s,
        }
    }

    /// The same step with its length such that it ends at rest.
    fn come_to_rest(&self, from: &Shaft, at_most_s: f64, direction: f64, source: &Source) -> (Shaft, f64) {
        let mean_speed = 0.5 * from.speed_rad_per_s;
        let torque = self.torque_nm_per_a * self.current_a(source, mean_speed);
        let mut taken_s = 0.0;
        for _ in 0..ROUNDS {
            let against = self.against_nm(from.angle_rad, from.angle_rad + taken_s * mean_speed, direction);
            taken_s = (self.inertia_kg_m2 * from.speed_rad_per_s / (against - torque)).clamp(0.0, at_most_s);
        }
        (Shaft { angle_rad: from.angle_rad + taken_s * mean_speed, speed_rad_per_s: 0.0 }, taken_s)
    }

    fn against_nm(&self, from_rad: f64, to_rad: f64, direction: f64) -> f64 {
        let load = self.mean_load_nm(from_rad, to_rad);
        load + direction * (self.friction_nm + self.friction_share * load)
    }

    /// The contact's mean torque between two angles: its difference in energy over the way.
    fn mean_load_nm(&self, from_rad: f64, to_rad: f64) -> f64 {
        let (x0, x1) = (self.travel_mm(from_rad) - self.wall_mm, self.travel_mm(to_rad) - self.wall_mm);
        let (d0, d1) = (x0.max(0.0), x1.max(0.0));
        let share = if (x0 > 0.0) == (x1 > 0.0) { 1.0 } else { (d1 - d0) / (x1 - x0) };
        self.nm_per_n * self.force_per_mm2 * (d0 * d0 + d0 * d1 + d1 * d1) / 3.0 * share
    }
}
