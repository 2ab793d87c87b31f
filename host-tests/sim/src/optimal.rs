//! Shortest time in which the motor can move the tip from rest to rest, with which force steps are compared.
//!
//! The drive uses the limits of voltage and current, then brakes with them, and switches once: the time-optimal profile
//! for a shaft with friction against a load that depends on the place. Bisection (shooting) on the equations of motion
//! of the plant, [`crate::mechanics::rotor::Dynamics`], finds the switch time.

use crate::mechanics::rotor::{Dynamics, Shaft, Source};
use crate::setup::Setup;

/// Step of the shooting. Its error is of second order.
const STEP_S: f64 = 20e-6;
/// Duration from which on a motion counts as impossible.
const LONGEST_S: f64 = 10.0;
/// Halvings of the interval of switch times: its end is 10^12 times narrower, far below a step.
const HALVINGS: usize = 40;
/// Largest distance of the end from the target. Beyond it no switch time makes the motion stop there.
const END_MM: f64 = 1e-6;

/// The time-optimal profile.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Profile {
    /// Time of the change from full drive to full brake.
    pub switch_s: f64,
    /// Time at which the tip is at rest.
    pub total_s: f64,
    /// Place of the tip at rest.
    pub end_mm: f64,
}

/// Motion that the motor cannot make within its limits.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
#[error("no way from {from_mm} mm to {to_mm} mm of indentation: {reason}")]
pub struct Unreachable {
    pub from_mm: f64,
    pub to_mm: f64,
    pub reason: Reason,
}

/// Reason why the motor cannot reach a place.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum Reason {
    /// Full drive stops, or creeps for more than 10 s, before the target: allow more voltage or current.
    #[error("full drive stops short of it: allow more voltage or current")]
    TooWeak,
    /// Full brake does not stop the motion.
    #[error("full brake does not stop there")]
    RunsAway,
}

/// Shortest time from rest at one indentation to rest at another; see [`profile`].
pub fn minimum_time_s(
    setup: &Setup,
    d_from_mm: f64,
    d_to_mm: f64,
    voltage_limit: f64,
    current_limit: f64,
) -> Result<f64, Unreachable> {
    profile(setup, d_from_mm, d_to_mm, voltage_limit, current_limit).map(|profile| profile.total_s)
}

/// The time-optimal motion from rest at one indentation to rest at another. The voltage is at most that of the supply.
pub fn profile(
    setup: &Setup,
    d_from_mm: f64,
    d_to_mm: f64,
    voltage_limit: f64,
    current_limit: f64,
) -> Result<Profile, Unreachable> {
    let fail = |reason| Unreachable { from_mm: d_from_mm, to_mm: d_to_mm, reason };
    if d_from_mm == d_to_mm {
        return Ok(Profile { switch_s: 0.0, total_s: 0.0, end_mm: d_to_mm });
    }
    let shooting = Shooting::new(setup, d_from_mm, d_to_mm, voltage_limit, current_limit);
    let (mut short_s, mut long_s) = (0.0, STEP_S);
    while !shooting.shoot(long_s).map_err(fail)?.far_enough {
        short_s = long_s;
        long_s *= 2.0;
        if long_s > LONGEST_S {
            return Err(fail(Reason::TooWeak));
        }
    }
    for _ in 0..HALVINGS {
        let middle_s = 0.5 * (short_s + long_s);
        if shooting.shoot(middle_s).map_err(fail)?.far_enough {
            long_s = middle_s;
        } else {
            short_s = middle_s;
        }
    }
    let hit = shooting.shoot(short_s).map_err(fail)?;
    let end_mm = shooting.dynamics.travel_mm(hit.end_rad) - setup.wall.distance_mm;
    if (end_mm - d_to_mm).abs() > END_MM {
        return Err(fail(Reason::RunsAway));
    }
    Ok(Profile { switch_s: short_s, total_s: hit.total_s, end_mm })
}

struct Shooting {
    dynamics: Dynamics,
    drive: Source,
    from_rad: f64,
    to_rad: f64,
}

struct Hit {
    end_rad: f64,
    total_s: f64,
    far_enough: bool,
}

impl Shooting {
    fn new(setup: &Setup, d_from_mm: f64, d_to_mm: f64, voltage_limit: f64, current_limit: f64) -> Self {
        let dynamics = Dynamics::new(setup);
        let supply = &setup.supply;
        let duty = (voltage_limit / supply.source_v).min(1.0);
        let drive = Source {
            volts: duty * supply.source_v * (d_to_mm - d_from_mm).signum(),
            ohms: supply.circuit_ohm(&setup.motor, duty),
            limit_a: current_limit,
            kept_a: 0.0,
        };
        let angle_rad = |d_mm: f64| dynamics.angle_rad(setup.wall.distance_mm + d_mm);
        Self { dynamics, drive, from_rad: angle_rad(d_from_mm), to_rad: angle_rad(d_to_mm) }
    }

    /// Drives until `switch_s`, brakes to rest.
    fn shoot(&self, switch_s: f64) -> Result<Hit, Reason> {
        let mut shaft = Shaft { angle_rad: self.from_rad, speed_rad_per_s: 0.0 };
        let mut time_s = 0.0;
        while time_s < switch_s && !self.passed(&shaft) {
            let step_s = STEP_S.min(switch_s - time_s);
            let (next, taken_s) = self.dynamics.advance_to_rest(shaft, step_s, &self.drive);
            if taken_s < step_s {
                return Err(Reason::TooWeak);
            }
            shaft = next;
            time_s += step_s;
        }
        let brake = Source { volts: -self.drive.volts, ..self.drive };
        while shaft.speed_rad_per_s != 0.0 && !self.passed(&shaft) {
            let (next, taken_s) = self.dynamics.advance_to_rest(shaft, STEP_S, &brake);
            shaft = next;
            time_s += taken_s;
            if time_s > 2.0 * LONGEST_S {
                return Err(Reason::RunsAway);
            }
        }
        Ok(Hit { end_rad: shaft.angle_rad, total_s: time_s, far_enough: self.passed(&shaft) })
    }

    fn passed(&self, shaft: &Shaft) -> bool {
        (shaft.angle_rad - self.to_rad) * self.drive.volts >= 0.0
    }
}
