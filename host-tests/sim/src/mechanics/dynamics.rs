//! The motion of the reference finger's shaft against a rigid wall.

use super::rotor::{Acting, Resistance, Rotor, Shaft, Source, mean_square};
use crate::setup::Setup;

/// The constants of the motion against a rigid wall, in SI units at the motor's shaft and mm at the tip.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Dynamics {
    rotor: Rotor,
    friction_nm: f64,
    friction_share: f64,
    mm_per_rad: f64,
    nm_per_n: f64,
    wall_mm: f64,
    force_per_mm2: f64,
}

/// At 10 us each round gains a factor of 1e-7.
const ROUNDS: usize = 3;

impl Dynamics {
    /// Of a setup.
    pub fn new(setup: &Setup) -> Self {
        let gear = &setup.transmission;
        let mm_per_rad = gear.drum_radius_mm / gear.ratio;
        Self {
            rotor: Rotor {
                inertia_kg_m2: setup.motor.inertia_kg_m2,
                torque_nm_per_a: setup.motor.torque_nm_per_a,
                rounds: ROUNDS,
                tolerance: 0.0,
            },
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
        self.rotor.current_a(source, speed_rad_per_s)
    }

    /// One step. The source holds through it.
    pub fn advance(&self, shaft: Shaft, dt_s: f64, source: &Source) -> Shaft {
        self.rotor.advance(shaft, dt_s, &mut Against { dynamics: self, source })
    }

    /// As [`Dynamics::advance`] while the shaft moves; the time taken is less than `dt_s` where it comes to rest.
    pub fn advance_to_rest(&self, shaft: Shaft, dt_s: f64, source: &Source) -> (Shaft, f64) {
        self.rotor.advance_to_rest(shaft, dt_s, &mut Against { dynamics: self, source })
    }
}

/// The wall, friction and a source.
struct Against<'a> {
    dynamics: &'a Dynamics,
    source: &'a Source,
}

impl Acting for Against<'_> {
    fn resistance(&mut self, from_rad: f64, to_rad: f64) -> Resistance {
        let Dynamics { friction_nm, friction_share, wall_mm, force_per_mm2, nm_per_n, .. } = *self.dynamics;
        let from_mm = self.dynamics.travel_mm(from_rad) - wall_mm;
        let to_mm = self.dynamics.travel_mm(to_rad) - wall_mm;
        let load_nm = mean_square(nm_per_n * force_per_mm2, from_mm, to_mm);
        let friction = friction_nm + friction_share * load_nm;
        Resistance { load_nm, sliding_nm: friction, holding_nm: friction }
    }

    fn source(&self, _dt_s: f64) -> Source {
        *self.source
    }
}
