//! Modes, faults and limits: what the controller is doing, why it stopped, and what holds it back.
//!
//! | mode | bridge | leaves when |
//! | --- | --- | --- |
//! | 0 off | shorted until the tip is at rest, then open | torque is enabled on a tared array and the tip is slow: approach, force or release |
//! | 1 tare | as in off | enough frames are averaged: off |
//! | 2 approach | at the set speed towards the object | contact: force; goal = 0: release |
//! | 3 force | holds the goal in d = sqrt(F/(pi Y)) | goal = 0, or the force vanished at once: release; contact is lost: approach |
//! | 4 release | backs off to the set clearance behind the surface, farther while something is pressed, then holds there | goal > 0: approach, or force where something is pressed |
//! | 7 strokes | small steps of voltage in the air, to measure the drive | done, refused or stopped: off |
//! | 6 press | backs off, seeks the contact, presses twice to 0.3 a or 7/8 of the largest force, to measure tip and array | done, refused or stopped: as from off |
//! | 5 fault | brakes; a bridge that reports a fault sleeps | the fault is cleared with torque off: off |
//!
//! Strokes are requested in off, with torque off; a press in approach, force or release. `pipeline/activity.rs` owns
//! the state behind each mode.
//!
//! Torque off ends approach, force, release and press: off follows, or fault 7 in a release for a silent bus. A tare is
//! taken while nothing presses on the array, and with a fault that is cleared in the same frame. A fault (stop) is latched until it is cleared; a limit (a present
//! restriction of the loop) sets and clears by itself. The numbers are stable: hosts may store them.

/// Defines an enumeration with stable numbers, and the list of its values.
macro_rules! numbered {
    ($(#[$attribute:meta])* pub enum $name:ident { $($(#[$value_attribute:meta])* $value:ident = $number:literal,)* }) => {
        $(#[$attribute])*
        #[derive(Clone, Copy, Debug, PartialEq, Eq)]
        #[repr(u8)]
        pub enum $name { $($(#[$value_attribute])* $value = $number,)* }

        impl $name {
            /// All values, in the order of their numbers.
            pub const ALL: [Self; [$($number),*].len()] = [$(Self::$value),*];

            /// Returns the value with this number; none for an unknown number.
            pub fn of(number: u8) -> Option<Self> {
                Self::ALL.into_iter().find(|value| *value as u8 == number)
            }
        }
    };
}
pub(crate) use numbered;

numbered! {
    /// Activity of the controller.
    #[derive(Default)]
    pub enum Mode {
        /// The motor is not driven.
        #[default]
        Off = 0,
        /// The zero of every taxel is being measured; the motor is not driven.
        Tare = 1,
        /// Towards the object at the set speed.
        Approach = 2,
        /// Holding the goal force.
        Force = 3,
        /// Releasing the object, then holding clear of it.
        Release = 4,
        /// Stopped by a fault.
        Fault = 5,
        /// Pressing into a plate, to measure tip and array.
        Press = 6,
        /// Moving a little in the air, to measure the drive.
        Strokes = 7,
    }
}

numbered! {
    /// Reason why the motor was stopped.
    #[non_exhaustive]
    pub enum Fault {
        /// No frame came within 1.75 frame times of the last one: the scan has stopped.
        LostFrames = 1,
        /// More taxels are dead or saturated than allowed, or their sum is far below that of the tare, or jumped up.
        ArrayBroken = 2,
        /// A column shows current with no row driven: a row is stuck on.
        RowStuck = 3,
        /// The array does not follow the motion that the encoder reports.
        ArrayFrozen = 4,
        /// The encoder does not follow the motor's voltage: the encoder is stuck, or the motor is blocked.
        EncoderFrozen = 5,
        /// The contact force passed its limit.
        OverForce = 6,
        /// No valid packet within the bus watchdog's time.
        BusSilent = 7,
        /// The stored parameters are damaged or out of range.
        BrokenParameters = 8,
        /// The supply is below its limit.
        SupplyLow = 9,
        /// The supply is above its limit.
        SupplyHigh = 10,
        /// The bridge's driver reported a fault.
        Bridge = 11,
        /// The control step came later than its deadline.
        MissedDeadline = 12,
        /// The firmware was reset by its watchdog, a panic or a hard fault; see the crash record.
        Crash = 13,
        /// The tip left its envelope: an end of the travel, a retreat without end, or speed where nothing is touched.
        Runaway = 14,
        /// The encoder counts against the motor's voltage: its channels or the motor's leads are swapped.
        Reversed = 15,
        /// The motor presses on something that the array does not see.
        Unseen = 16,
        /// The external clock was missing at the start, so times are known to a few percent only. The fault remains until
        /// the next start.
        NoClock = 17,
        /// The microcontroller would not be reset before its supply is too low for its speed: the option bytes have
        /// another brown-out level than 3. The fault remains until they are programmed.
        BrownOutLevel = 18,
    }
}

/// Present restrictions of the loop: a set of flags, stable by bit.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Limits(pub u16);

impl Limits {
    /// The voltage or the supply is used up.
    pub const VOLTAGE: u16 = 1 << 0;
    /// The current limit (by the motor's model) reduces the voltage.
    pub const CURRENT: u16 = 1 << 1;
    /// The speed limit is reached.
    pub const SPEED: u16 = 1 << 2;
    /// The goal is above the largest allowed force or below the smallest contact force, and was clamped to it.
    pub const GOAL: u16 = 1 << 3;
    /// The goal lies beyond the end of the travel: the way there is cut.
    pub const TRAVEL: u16 = 1 << 4;
    /// Some taxels are dead or saturated and are left out.
    pub const TAXELS: u16 = 1 << 5;
    /// The array has no tare.
    pub const NOT_TARED: u16 = 1 << 6;
    /// A frame was missed since the last step.
    pub const FRAME_MISSED: u16 = 1 << 7;
    /// The slew limit delays a change of the voltage.
    pub const SLEW: u16 = 1 << 8;
    /// The requested fit level takes too long; see [`crate::pipeline::budget`].
    pub const FIT_LEVEL: u16 = 1 << 9;
    /// Something touched the tip during the last tare: the readings are too low by that force, and torque is refused.
    pub const TARED_TOUCHING: u16 = 1 << 10;
    /// The force is known only from below (saturated, cut off, or without confidence): the travel since the touch
    /// bounds it from above.
    pub const FROM_BELOW: u16 = 1 << 11;
    /// The guard blocks the duty, see [`crate::safety::guard`].
    pub const GUARD: u16 = 1 << 12;
    /// The estimated temperature of the winding reduces the current.
    pub const WINDING: u16 = 1 << 13;
    /// The motor's direction is not confirmed: torque is refused.
    pub const DIRECTION: u16 = 1 << 14;
    /// Torque has been on since before the tare or the configuration: it drives nothing until it was off.
    pub const TORQUE_HELD: u16 = 1 << 15;

    /// Adds a flag.
    pub fn set(&mut self, flag: u16) {
        self.0 |= flag;
    }

    /// Returns true if a flag is set.
    pub fn has(self, flag: u16) -> bool {
        self.0 & flag != 0
    }
}
