//! Shaft of the motor: one degree of freedom with friction that sticks; and its quickest motion from rest to rest.
//!
//! The step is the trapezoidal rule with the contact force replaced by its mean over the step (a discrete gradient of
//! the energy of the contact). It is of second order, and the energy balance is exact at any length of the step: only
//! friction and the winding remove energy. If the shaft comes to rest inside a step, the step is cut there. From rest
//! it moves only if the drive exceeds friction.

use crate::setup::Setup;

/// Angle and speed of the motor's shaft.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Shaft {
    /// Angle, 0 at travel 0 of the tip.
    pub angle_rad: f64,
    /// Speed; positive presses the tip into the object.
    pub speed_rad_per_s: f64,
}

/// Supply of the winding: a voltage behind the resistance of the whole circuit, with a limit to the current.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Source {
    /// Voltage without current.
    pub volts: f64,
    /// Resistance of the whole circuit.
    pub ohms: f64,
    /// Largest current in either direction.
    pub limit_a: f64,
    /// Mean current that an inductance maintains; 0 without one.
    pub kept_a: f64,
}

impl Source {
    pub const OPEN: Self = Self { volts: 0.0, ohms: f64::INFINITY, limit_a: f64::INFINITY, kept_a: 0.0 };
}

/// Torques that resist the shaft over a distance.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Resistance {
    /// Mean torque of everything that stores energy: the difference in energy over the distance.
    pub load_nm: f64,
    /// Friction while it slides, against the motion.
    pub sliding_nm: f64,
    /// Friction to be exceeded from rest.
    pub holding_nm: f64,
}

/// Torques and supply of a shaft during a step.
pub(crate) trait Acting {
    fn resistance(&mut self, from_rad: f64, to_rad: f64) -> Resistance;

    /// Mean supply of the winding over a time.
    fn source(&self, dt_s: f64) -> Source;

    fn viscous_nm_s(&self) -> f64 {
        0.0
    }

    /// Ends a part of the step with its length and mean speed.
    fn took(&mut self, _dt_s: f64, _mean_rad_per_s: f64) {}
}

/// Rotor, and how its step is solved.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Rotor {
    pub inertia_kg_m2: f64,
    pub torque_nm_per_a: f64,
    /// Most iterations of the fixed point. Each gains a factor of (step x contact frequency)^2 / 4.
    pub rounds: usize,
    /// Share of the mean speed below whose change the iterations end.
    pub tolerance: f64,
}

/// Rests within one step after which the shaft stays at rest until the end of the step.
const RESTS_MAX: usize = 8;

impl Rotor {
    pub fn current_a(&self, source: &Source, speed_rad_per_s: f64) -> f64 {
        let back_emf = self.torque_nm_per_a * speed_rad_per_s;
        ((source.volts - back_emf) / source.ohms + source.kept_a).clamp(-source.limit_a, source.limit_a)
    }

    pub(crate) fn advance(&self, mut shaft: Shaft, dt_s: f64, acting: &mut impl Acting) -> Shaft {
        let mut left_s = dt_s;
        for _ in 0..RESTS_MAX {
            let Some((next, taken_s)) = self.advance_to_rest(&shaft, left_s, acting) else { break };
            shaft = next;
            if shaft.speed_rad_per_s != 0.0 {
                return shaft;
            }
            left_s -= taken_s;
        }
        acting.took(left_s, 0.0);
        shaft
    }

    /// Advances until the shaft comes to rest, at most for `dt_s`. Returns the time taken; none while friction holds it.
    fn advance_to_rest(&self, shaft: &Shaft, dt_s: f64, acting: &mut impl Acting) -> Option<(Shaft, f64)> {
        let direction = self.direction(shaft, dt_s, acting)?;
        let (mut next, mut mean_speed) = self.slide(shaft, dt_s, direction, acting);
        let mut taken_s = dt_s;
        if next.speed_rad_per_s * direction < 0.0 {
            (next, taken_s) = self.come_to_rest(shaft, dt_s, direction, acting);
            mean_speed = 0.5 * shaft.speed_rad_per_s;
        }
        acting.took(taken_s, mean_speed);
        Some((next, taken_s))
    }

    /// Direction in which the shaft moves or starts to move; none while friction holds it.
    fn direction(&self, shaft: &Shaft, dt_s: f64, acting: &mut impl Acting) -> Option<f64> {
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

    /// Solves for the length of the step that ends at rest.
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

/// Mean of `factor` max(x, 0)^2 between two places, exact to rounding at any distance.
pub(crate) fn mean_square(factor: f64, x0: f64, x1: f64) -> f64 {
    let (d0, d1) = (x0.max(0.0), x1.max(0.0));
    let share = if (x0 > 0.0) == (x1 > 0.0) { 1.0 } else { (d1 - d0) / (x1 - x0) };
    factor * (d0 * d0 + d0 * d1 + d1 * d1) / 3.0 * share
}

/// Step of the shooting. Its error is of second order.
const STEP_S: f64 = 20e-6;
/// Duration from which on a motion counts as impossible.
const LONGEST_S: f64 = 10.0;
/// Iterations of a step. At 10 us each gains a factor of 1e-7.
const ROUNDS: usize = 3;
/// Halvings of the interval of switch times: its end is 10^12 times narrower, far below a step.
const HALVINGS: usize = 40;
/// Largest distance of the end from the target. Beyond it no switch time makes the motion stop there.
const END_MM: f64 = 1e-6;

#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Profile {
    /// Time of the change from full drive to full brake.
    pub switch_s: f64,
    /// Time at which the tip is at rest.
    pub total_s: f64,
}

/// Reason why the motor cannot reach a place within its limits.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum Unreachable {
    /// Full drive stops, or creeps for more than 10 s, before the target: allow more voltage or current.
    #[error("full drive stops short of it: allow more voltage or current")]
    TooWeak,
    /// Full brake does not stop the motion.
    #[error("full brake does not stop there")]
    RunsAway,
}

/// Returns the time-optimal motion from rest at one indentation to rest at another, with which force steps are compared.
/// The limits are in V and A, the voltage at most that of the supply.
///
/// The drive uses the limits of voltage and current, then brakes with them, and switches once: the time-optimal profile
/// for a shaft with friction against a load that depends on the place. The switch time is found by shooting: bisection on
/// the plant's equations of motion.
pub fn profile(setup: &Setup, d_mm: [f64; 2], volts: f64, amperes: f64) -> Result<Profile, Unreachable> {
    let [d_from_mm, d_to_mm] = d_mm;
    if d_from_mm == d_to_mm {
        return Ok(Profile { switch_s: 0.0, total_s: 0.0 });
    }
    let shooting = Shooting::new(setup, d_mm, volts, amperes);
    let reaches = |switch_s| Ok(shooting.passed(&shooting.shoot(switch_s)?.0));
    let (mut short_s, mut long_s) = (0.0, STEP_S);
    while !reaches(long_s)? {
        short_s = long_s;
        long_s *= 2.0;
        if long_s > LONGEST_S {
            return Err(Unreachable::TooWeak);
        }
    }
    for _ in 0..HALVINGS {
        let middle_s = 0.5 * (short_s + long_s);
        *(if reaches(middle_s)? { &mut long_s } else { &mut short_s }) = middle_s;
    }
    let (end, total_s) = shooting.shoot(short_s)?;
    if (shooting.indentation_mm(end.angle_rad) - d_to_mm).abs() > END_MM {
        return Err(Unreachable::RunsAway);
    }
    Ok(Profile { switch_s: short_s, total_s })
}

/// Motions against a rigid wall, in SI units at the shaft of the motor and mm at the tip.
struct Shooting<'a> {
    setup: &'a Setup,
    rotor: Rotor,
    mm_per_rad: f64,
    drive: Source,
    from_rad: f64,
    to_rad: f64,
}

impl<'a> Shooting<'a> {
    fn new(setup: &'a Setup, [d_from_mm, d_to_mm]: [f64; 2], volts: f64, amperes: f64) -> Self {
        let (supply, mm_per_rad) = (&setup.supply, setup.transmission.mm_per_rad());
        let duty = (volts / supply.source_v).min(1.0);
        let drive = Source {
            volts: duty * supply.source_v * (d_to_mm - d_from_mm).signum(),
            ohms: supply.circuit_ohm(&setup.motor, duty),
            limit_a: amperes,
            kept_a: 0.0,
        };
        let rotor = Rotor {
            inertia_kg_m2: setup.motor.inertia_kg_m2,
            torque_nm_per_a: setup.motor.torque_nm_per_a,
            rounds: ROUNDS,
            tolerance: 0.0,
        };
        let [from_rad, to_rad] = [d_from_mm, d_to_mm].map(|d_mm| (setup.wall.distance_mm + d_mm) / mm_per_rad);
        Self { setup, rotor, mm_per_rad, drive, from_rad, to_rad }
    }

    fn indentation_mm(&self, angle_rad: f64) -> f64 {
        angle_rad * self.mm_per_rad - self.setup.wall.distance_mm
    }

    /// Drives until `switch_s`, then brakes. Returns the shaft at rest or past the target, and the time.
    fn shoot(&self, switch_s: f64) -> Result<(Shaft, f64), Unreachable> {
        let mut shaft = Shaft { angle_rad: self.from_rad, speed_rad_per_s: 0.0 };
        let mut time_s = 0.0;
        while time_s < switch_s && !self.passed(&shaft) {
            let step_s = STEP_S.min(switch_s - time_s);
            let moved = self.rotor.advance_to_rest(&shaft, step_s, &mut (self, &self.drive));
            let Some((next, _)) = moved.filter(|(_, taken_s)| *taken_s == step_s) else {
                return Err(Unreachable::TooWeak);
            };
            shaft = next;
            time_s += step_s;
        }
        let brake = Source { volts: -self.drive.volts, ..self.drive };
        while shaft.speed_rad_per_s != 0.0 && !self.passed(&shaft) {
            let Some((next, taken_s)) = self.rotor.advance_to_rest(&shaft, STEP_S, &mut (self, &brake)) else { break };
            shaft = next;
            time_s += taken_s;
            if time_s > 2.0 * LONGEST_S {
                return Err(Unreachable::RunsAway);
            }
        }
        Ok((shaft, time_s))
    }

    fn passed(&self, shaft: &Shaft) -> bool {
        (shaft.angle_rad - self.to_rad) * self.drive.volts >= 0.0
    }
}

impl Acting for (&Shooting<'_>, &Source) {
    fn resistance(&mut self, from_rad: f64, to_rad: f64) -> Resistance {
        let Shooting { setup: Setup { tip, motor, transmission, .. }, mm_per_rad, .. } = self.0;
        let [from_mm, to_mm] = [from_rad, to_rad].map(|angle_rad| self.0.indentation_mm(angle_rad));
        let load_nm = mean_square(mm_per_rad * 1e-3 * tip.force_per_mm2(), from_mm, to_mm);
        let friction = motor.friction_nm + transmission.load_share() * load_nm;
        Resistance { load_nm, sliding_nm: friction, holding_nm: friction }
    }

    fn source(&self, _dt_s: f64) -> Source {
        *self.1
    }
}
