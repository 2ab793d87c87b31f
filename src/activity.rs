//! The activity of the finger: one variant for each, which owns the state of that activity.
//!
//! Entering an activity creates its state and leaving drops it, so no activity can find what another one left behind.
//! The few states that outlive an activity are updated in every frame: the tactile image with its baseline, the
//! [`crate::touch`], the motion with its zero and winding, the temperature compensation, and the time budget.

use crate::config::Config;
use crate::control::SpeedLoop;
use crate::grip::Grip;
use crate::measure::{Press, Strokes};
use crate::state::{Fault, Mode};
use crate::touch::Touch;
use crate::units::{Millimetres, MillimetresPerSecond};

/// Distance, besides a count of the encoder, within which a tip is at rest: 5 um, Q24 mm.
const REST: i32 = (1 << 24) / 200;
/// Time within that distance after which a tip is at rest, ns.
const REST_NS: u32 = 20_000_000;

/// Activity of the finger.
#[derive(Clone, Debug)]
pub enum Activity {
    /// The bridge is off.
    Off(Halt),
    /// The zero of every taxel is measured, with the bridge off. After a release the tip is known to be free: what
    /// the array reads is a residue.
    Tare {
        /// Braking of the motor.
        halt: Halt,
        /// True if the tip was released before.
        free: bool,
    },
    /// Approach, hold and release.
    Grip(Grip),
    /// A press that measures tip and array.
    Press(Press),
    /// Motions in the air that measure the drive.
    Strokes(Strokes),
    /// Stopped by a fault.
    Fault(Fault),
}

impl Activity {
    /// Mode as reported.
    pub fn mode(&self, touch: &Touch) -> Mode {
        match self {
            Self::Off(_) => Mode::Off,
            Self::Tare { .. } => Mode::Tare,
            Self::Grip(grip) => grip.mode(touch),
            Self::Press(_) => Mode::Press,
            Self::Strokes(_) => Mode::Strokes,
            Self::Fault(_) => Mode::Fault,
        }
    }

    /// Returns true in the mode release.
    pub fn releases(&self, touch: &Touch) -> bool {
        matches!(self, Self::Grip(grip) if grip.mode(touch) == Mode::Release)
    }

    /// Returns true if the motor is driven: then guard and monitor judge the motion.
    pub fn drives(&self) -> bool {
        matches!(self, Self::Grip(_) | Self::Press(_) | Self::Strokes(_))
    }

    /// Returns true if the contact is fitted to the model. A press must not depend on the configured modulus.
    pub fn fits(&self) -> bool {
        !matches!(self, Self::Press(_) | Self::Strokes(_))
    }

    /// Returns true if the baseline may follow the array's readings.
    pub fn learns(&self) -> bool {
        matches!(self, Self::Off(_) | Self::Grip(_))
    }
}

/// Braking of a motor that is no longer driven: shorted until the tip is at rest, then open. An open bridge would let
/// a pressed tip fly back, and a moving one run into the object.
#[derive(Clone, Copy, Debug, Default)]
pub struct Halt {
    /// Travel at which the tip last moved.
    at: Millimetres,
    /// Time since then while the motor is shorted, ns; none once the bridge is open.
    still_ns: Option<u32>,
}

impl Halt {
    /// State of a motor at rest, with the bridge open.
    pub const OPEN: Self = Self { at: Millimetres::ZERO, still_ns: None };
    /// A motor that was driven just now.
    pub const BRAKES: Self = Self { at: Millimetres::ZERO, still_ns: Some(0) };

    /// Returns true if the tip is at rest and the bridge open.
    pub fn rests(&self) -> bool {
        self.still_ns.is_none()
    }

    /// Takes a frame. Returns true while the motor is shorted.
    pub fn brakes(&mut self, motion: &SpeedLoop, config: &Config) -> bool {
        let Some(still_ns) = &mut self.still_ns else { return false };
        let travel = motion.observer.travel;
        let moved = travel.0.saturating_sub(self.at.0).saturating_abs().to_bits();
        if moved > REST.saturating_add(config.count.to_bits()) {
            (self.at, *still_ns) = (travel, 0);
        }
        *still_ns = still_ns.saturating_add(config.timing.frame_ns);
        if *still_ns > REST_NS {
            self.still_ns = None;
        }
        self.still_ns.is_some()
    }

    /// Returns true if the tip is slow enough for the motor to be driven from here. A faster one is braked first.
    pub fn slow(&mut self, motion: &SpeedLoop, config: &Config) -> bool {
        let MillimetresPerSecond(speed) = motion.observer.speed;
        let slow = speed.saturating_abs() <= config.approach.0 / 2;
        if !slow && self.still_ns.is_none() {
            *self = Self::BRAKES;
        }
        slow
    }
}
