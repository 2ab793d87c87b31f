//! What the finger does: one variant for each activity, which owns the state of that activity.
//!
//! Entering an activity makes its state and leaving drops it, so no activity can find what another one left behind. What
//! outlives them is few and observed in every frame: the tactile image with its baseline, the [`crate::touch`], the
//! motion with its zero and winding, the temperature compensation, and the time budget.

use crate::config::Config;
use crate::control::SpeedLoop;
use crate::grip::Grip;
use crate::measure::{Press, Strokes};
use crate::state::{Fault, Mode};
use crate::touch::Touch;
use crate::units::{Millimetres, MillimetresPerSecond};

/// A tip that moves by no more than this and a count of the encoder is at rest: 5 um, Q24 mm,
const REST: i32 = (1 << 24) / 200;
/// once it has done so for this time, ns.
const REST_NS: u32 = 20_000_000;

/// What the finger does.
#[derive(Clone, Debug)]
pub enum Activity {
    /// The bridge is off.
    Off(Halt),
    /// The zero of every taxel is measured, with the bridge off. Behind a release the tip is known to be free: what the
    /// array reads is a residue.
    Tare {
        /// The motor's way to rest.
        halt: Halt,
        /// Whether the tip was released before.
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
    /// As reported.
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

    /// Whether the motor is driven: then guard and monitor watch.
    pub fn drives(&self) -> bool {
        matches!(self, Self::Grip(_) | Self::Press(_) | Self::Strokes(_))
    }

    /// Whether the contact is fitted to the model. A press must not lean on the configured modulus.
    pub fn fits(&self) -> bool {
        !matches!(self, Self::Press(_) | Self::Strokes(_))
    }

    /// Whether the baseline may follow what the array reads.
    pub fn learns(&self) -> bool {
        matches!(self, Self::Off(_) | Self::Grip(_))
    }
}

/// The way to rest of a motor that is no longer driven: shorted until the tip stands, then open. An open bridge would let
/// a pressed tip fly back, and a moving one run into the object.
#[derive(Clone, Copy, Debug, Default)]
pub struct Halt {
    /// Travel at which the tip was last seen to move.
    at: Millimetres,
    /// Time since then while the motor is shorted, ns; none once the bridge is open.
    still_ns: Option<u32>,
}

impl Halt {
    /// At rest, with the bridge open.
    pub const OPEN: Self = Self { at: Millimetres::ZERO, still_ns: None };
    /// The motor was driven just now.
    pub const BRAKES: Self = Self { at: Millimetres::ZERO, still_ns: Some(0) };

    /// Whether the tip is at rest, and the bridge open.
    pub fn rests(&self) -> bool {
        self.still_ns.is_none()
    }

    /// Takes a frame; whether the motor is shorted.
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

    /// Whether the tip is slow enough for the motor to be driven from here. One that is not is braked first.
    pub fn slow(&mut self, motion: &SpeedLoop, config: &Config) -> bool {
        let MillimetresPerSecond(speed) = motion.observer.speed;
        let slow = speed.saturating_abs() <= config.approach.0 / 2;
        if !slow && self.still_ns.is_none() {
            *self = Self::BRAKES;
        }
        slow
    }
}
