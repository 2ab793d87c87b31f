//! The force loop: a goal in d, a speed reference, and the voltage that makes the tip follow it.
//!
//! Force grows with the square of the indentation, so a loop closed in force sees its gain vary 8.4 times between 0.1 N
//! and 7 N. Closed in d = sqrt(F / (pi Y)) it sees the finger's own dynamics, which are linear:
//!
//! ```text
//! x' = v,   v' = g V - c v + w
//! ```
//!
//! with the tip's travel x, the voltage V, g = k_t N / (R m), c = k_t^2 N^2 / (R m), m = J N^2 (N the motor's angle for
//! a travel of the tip) and everything else, the contact force and friction among it, in the disturbance w.
//!
//! Its parts, each a file: [`profile`] turns the way still to go into the fastest speed from which the tip can still
//! stop there; [`pace`] says how quick the loop is, by the [`gains`](crate::config::gains) of the paces; [`observer`]
//! estimates x, v and w from the encoder and the voltage; [`drive`] keeps the voltage within its limits, of which [`winding`]
//! lowers the current's before the motor is too warm. The law that joins them is
//!
//! ```text
//! g V = k_v (v_ref - v) + a_ref + c v - w
//! ```
//!
//! What was asked beyond a limit never enters the observer, so nothing winds up; and every mode only chooses v_ref, so
//! a change of mode is bumpless.

pub mod creep;
pub mod drive;
pub mod observer;
pub mod pace;
pub mod profile;
pub mod warmth;
pub mod winding;

use crate::arith::{clamp_bits, high, product};
use crate::config::{BRAKE_SHARE_Q8, Config};
use crate::state::Limits;
use crate::units::{Duty, Millimetres, MillimetresPerSecond, MillimetresPerSecond2};
use drive::Drive;
use observer::Observer;
use pace::Pace;
use profile::Reference;
use winding::{SHARE_BITS, Winding};

/// The state of the speed loop.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct SpeedLoop {
    /// Where the tip is, how fast it goes and what pushes it.
    pub observer: Observer,
    /// The limits between the law and the bridge.
    pub drive: Drive,
    /// How quick the loop is.
    pub pace: Pace,
    /// How warm the motor's winding is.
    pub winding: Winding,
}

impl SpeedLoop {
    /// At rest.
    pub const fn new() -> Self {
        Self { observer: Observer::new(), drive: Drive::new(), pace: Pace::QUICK, winding: Winding::new() }
    }

    /// The duty that makes the tip follow a speed reference.
    #[inline(always)]
    pub fn follow(&mut self, reference: Reference, supply_mv: u16, config: &Config, limits: &mut Limits) -> Duty {
        self.pull(reference, supply_mv, config, limits);
        self.drive.duty(supply_mv, config)
    }

    /// The duty for a voltage (g V, Q8 mm/s^2) that no law asks for.
    pub fn push(&mut self, voltage: i32, supply_mv: u16, config: &Config, limits: &mut Limits) -> Duty {
        self.drive.allow(self.winding.share());
        self.drive.apply(voltage, self.back_emf(config), supply_mv, config, limits);
        self.drive.duty(supply_mv, config)
    }

    /// The law, and the limits of what it asks for: the voltage.
    #[inline(always)]
    pub fn pull(&mut self, reference: Reference, supply_mv: u16, config: &Config, limits: &mut Limits) {
        // Speeds are held to 2,048 mm/s, which is beyond every reference, and to twice that where they are subtracted:
        // so no product here leaves 32 bits. Accelerations are Q4, of which 28 bits are Q8's 32.
        let speed = clamp_bits(self.observer.speed.to_bits(), 28);
        let behind = clamp_bits(reference.speed.to_bits().saturating_sub(speed), 30);
        // c v, the acceleration that the back-EMF takes away.
        let back_emf = high(speed << 3, config.damping_q17_per_s);
        let wanted = high(behind << 2, self.pace.gains(config).speed_q18_per_s)
            + (reference.acceleration.to_bits() >> 4)
            + back_emf
            - (self.observer.disturbance.to_bits() >> 4);
        self.drive.allow(self.winding.share());
        let [wanted, back_emf] = [clamp_bits(wanted, 28) << 4, clamp_bits(back_emf, 28) << 4];
        self.drive.apply(wanted, back_emf, supply_mv, config, limits);
    }

    /// Takes the encoder's count of this frame into the observer, which then stands at this instant.
    #[inline(always)]
    pub fn observe(&mut self, encoder: i32, config: &Config) {
        self.winding.observe(self.drive.acceleration(), config);
        self.observer.update(encoder, self.drive.acceleration(), self.pace.gains(config), config);
    }

    /// The speed to follow over a way still to go, at most `limit`; whether it was held to that.
    ///
    /// Once the loop is calm, a way within `slack` is none: a tip that sticks would else be driven from count to count
    /// for ever.
    #[inline(always)]
    pub fn towards(
        &mut self,
        way: Millimetres,
        slack: Millimetres,
        limit: MillimetresPerSecond,
        config: &Config,
    ) -> (Reference, bool) {
        self.pace.note(way, config);
        let way = if self.pace.calm() { Millimetres(way.0 - way.0.max(-slack.0).min(slack.0)) } else { way };
        let brake = self.brake(way, config);
        let reference = Reference::towards(way, self.observer.speed, brake, self.pace.gains(config));
        // A motor that may be driven with less brakes with less, also where it meets something.
        let limit = MillimetresPerSecond::from_bits(product(limit.to_bits(), self.winding.share(), SHARE_BITS));
        let limited = reference.limited(limit);
        (limited, limited != reference)
    }

    /// The bridge is open: no current flows, so neither voltage nor back-EMF acts.
    pub fn coast(&mut self) {
        self.drive = Drive::new();
        self.pace = Pace::QUICK;
    }

    /// The motor is shorted: only the back-EMF acts.
    pub fn short(&mut self, config: &Config) {
        self.coast();
        self.drive.short(self.back_emf(config));
    }

    /// No farther than to the end of the travel.
    pub fn within_travel(&self, distance: Millimetres, config: &Config, limits: &mut Limits) -> Millimetres {
        let left = Millimetres(config.travel_max.0.saturating_sub(self.observer.travel.0));
        if left < distance {
            limits.set(Limits::TRAVEL);
        }
        distance.min(left)
    }

    /// c v, what the back-EMF takes away at this speed, Q8 mm/s^2.
    fn back_emf(&self, config: &Config) -> i32 {
        let speed = clamp_bits(self.observer.speed.to_bits(), 28);
        clamp_bits(high(speed << 3, config.damping_q17_per_s), 28) << 4
    }

    /// The deceleration that the motor can surely give to a motion in the direction of `way`, with the current that its
    /// winding leaves.
    ///
    /// The contact force brakes a tip that presses in and drives one that lets go: the disturbance says how much.
    #[inline(always)]
    pub fn brake(&self, way: Millimetres, config: &Config) -> MillimetresPerSecond2 {
        let disturbance = product(self.observer.disturbance.to_bits(), BRAKE_SHARE_Q8, 8);
        let [least, usual, most] = config.brake.map(|brake| product(brake, self.winding.share(), SHARE_BITS));
        let pressing = way >= Millimetres::ZERO;
        let whole = if pressing { usual.saturating_sub(disturbance) } else { usual.saturating_add(disturbance) };
        MillimetresPerSecond2::from_bits(whole.max(least).min(most))
    }
}

impl Default for SpeedLoop {
    fn default() -> Self {
        Self::new()
    }
}
