//! The force loop: a goal in d, a speed reference, and the voltage that makes the tip follow it.
//!
//! Force grows with the square of the indentation, so a loop closed in force sees its gain vary 8.4 times between 0.1 N
//! and 7 N. Closed in d = sqrt(F / (pi Y)) it sees the finger's own dynamics, which are linear:
//!
//! ```text
//! x' = v,   v' = g V - c v + w
//! ```
//!
//! with the tip's travel x, the voltage V, g = k_t N / (R m), c = k_t^2 N^2 / (R m), m = J N^2 (N the motor's angle for a
//! travel of the tip) and everything else, the contact force and friction among it, in the disturbance w.
//!
//! Three parts, each a file: [`profile`] turns the way still to go into the fastest speed from which the tip can still stop there;
//! [`observer`] estimates x, v and w from the encoder and the voltage; [`drive`] keeps the voltage within its limits.
//! The law that joins them is
//!
//! ```text
//! g V = k_v (v_ref - v) + a_ref + c v - w
//! ```
//!
//! What was asked beyond a limit never enters the observer, so nothing winds up; and every mode only chooses v_ref, so a
//! change of mode is bumpless.

pub mod drive;
pub mod goal;
pub mod observer;
pub mod profile;

use crate::config::Config;
use crate::safety::Limits;
use crate::units::{Duty, Millimetres, MillimetresPerSecond2};
use drive::Drive;
use observer::Observer;
use profile::Reference;

/// Share of the braking that the profile counts on, Q8; the rest is left to the speed loop.
const BRAKE_SHARE_Q8: i64 = 218;
/// Largest braking that the profile's arithmetic takes: 1000 m/s^2 in Q8 mm/s^2.
const BRAKE_MAX: i64 = 1_000_000 << 8;

/// The state of the speed loop.
#[derive(Clone, Debug)]
pub struct SpeedLoop {
    /// Where the tip is, how fast it goes and what pushes it.
    pub observer: Observer,
    /// The limits between the law and the bridge.
    pub drive: Drive,
}

impl SpeedLoop {
    /// At rest.
    pub const fn new() -> Self {
        Self { observer: Observer::new(), drive: Drive::new() }
    }

    /// The duty that makes the tip follow a speed reference.
    pub fn follow(&mut self, reference: Reference, supply_mv: u16, config: &Config, limits: &mut Limits) -> Duty {
        let speed = self.observer.speed.to_bits();
        let lag = i64::from(reference.speed.to_bits()) - i64::from(speed);
        // k_v in 1/s (Q0) times Q16 speed, to Q8 acceleration.
        let wanted = ((lag * i64::from(config.speed_gain_per_s)) >> 8)
            + i64::from(reference.acceleration.to_bits())
            + self.back_emf(config)
            - i64::from(self.observer.disturbance.to_bits());
        self.drive.apply(wanted, self.back_emf(config), supply_mv, config, limits)
    }

    /// Takes the encoder's count of this frame into the observer, which then stands at this instant.
    pub fn observe(&mut self, encoder: i32, config: &Config) {
        self.observer.update(encoder, self.drive.acceleration(), config);
    }

    /// The bridge is off: no current flows, so neither voltage nor back-EMF acts.
    pub fn coast(&mut self) -> Duty {
        self.drive = Drive::new();
        Duty::ZERO
    }

    /// The deceleration that the motor can surely give to a motion in the direction of `way`.
    ///
    /// The contact force brakes a tip that presses in and drives one that lets go: the disturbance says how much.
    pub fn brake(&self, way: Millimetres, config: &Config) -> MillimetresPerSecond2 {
        let disturbance = i64::from(self.observer.disturbance.to_bits());
        let helping = if way >= Millimetres::ZERO { -disturbance } else { disturbance };
        let motor = config.current_limit.min(config.voltage_limit);
        let whole = (motor + helping).max(motor / 4).min(2 * motor);
        MillimetresPerSecond2::from_bits(((whole * BRAKE_SHARE_Q8) >> 8).min(BRAKE_MAX) as i32)
    }

    /// c v, the acceleration that the back-EMF takes away (Q8).
    fn back_emf(&self, config: &Config) -> i64 {
        (i64::from(self.observer.speed.to_bits()) * config.damping_q8_per_s) >> 16
    }
}

impl Default for SpeedLoop {
    fn default() -> Self {
        Self::new()
    }
}
