//! Commissioning of the drive: what the motor is like, from bounded motions in the air.
//!
//! A jog first proves that motor and encoder go the same way; nothing is closed over the encoder until then. Strokes
//! under known voltages then give what voltage and encoder can tell: the torque constant, the mechanical time constant
//! and the friction's voltage either way. Resistance, inertia and friction torque could all be twice as large, or half,
//! and nothing on this board would look different; so inertia and friction follow from the resistance that the
//! parameters hold. `docs/commissioning.md` has the derivation, the bounds and what was found.
//!
//! [`Run`] is the mode of the controller that makes the motions. What it finds is a proposal: a host accepts it.

mod estimate;
mod line;
mod run;
mod strokes;

pub use run::{Run, View};

/// What is asked for.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[repr(u8)]
pub enum Task {
    /// To stop what is under way.
    #[default]
    Stop = 0,
    /// The jog, which proves the direction.
    Jog = 1,
    /// The jog, then the strokes that measure.
    Measure = 2,
}

impl Task {
    /// The task in a request's number: its two lowest bits.
    pub const fn of(request: u8) -> Self {
        match request & 3 {
            1 => Self::Jog,
            2 => Self::Measure,
            _ => Self::Stop,
        }
    }

    /// The number that asks for this task behind another request.
    pub const fn after(self, request: u8) -> u8 {
        (request & !3).wrapping_add(4) | self as u8
    }
}

/// A drive as measured. Standard uncertainties are in permille of their values.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Drive {
    /// Torque constant, uN m/A: the back-EMF constant in uV s/rad.
    pub torque_constant_unm_per_a: u32,
    /// Its uncertainty.
    pub torque_constant_sigma: u16,
    /// Time constant of a run-up, R J / k^2, us.
    pub time_constant_us: u32,
    /// Its uncertainty.
    pub time_constant_sigma: u16,
    /// Inertia at the motor's shaft, ug m^2, with the resistance of the parameters.
    pub inertia_ug_m2: u32,
    /// Its uncertainty, that of the resistance left out.
    pub inertia_sigma: u16,
    /// Friction at the motor's shaft forward and back, uN m, with the resistance of the parameters.
    pub friction_unm: [u16; 2],
    /// Their uncertainty, that of the resistance left out.
    pub friction_sigma: [u16; 2],
}

/// Why there is no result. The numbers are stable.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u8)]
#[non_exhaustive]
pub enum Refusal {
    /// A stop, torque, a fault, a tare or new parameters ended it.
    Interrupted = 1,
    /// The array is not tared, something touches the tip, or torque is on.
    NotReady = 2,
    /// Measuring waits for the direction to be confirmed.
    Unconfirmed = 3,
    /// The encoder did not count while the jog's voltage rose to its limit.
    Still = 4,
    /// The encoder counts against the motor.
    Reversed = 5,
    /// The encoder does not follow: it counted one way for both, or went astray in a stroke.
    Astray = 6,
    /// The array felt a touch.
    Touched = 7,
    /// The motor felt a force that the array did not.
    Blocked = 8,
    /// The guard or a limit held the voltage back.
    HeldBack = 9,
    /// The tip did not come to rest.
    Restless = 10,
    /// The strokes do not agree with each other.
    Unsteady = 11,
    /// A result is outside of its parameter's range.
    Range = 12,
}

/// How commissioning stands.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Commissioning {
    /// None was asked for since reset.
    #[default]
    None,
    /// It is under way: so many percent of it are done.
    Running(u8),
    /// The jog found motor and encoder to go the same way.
    Directed,
    /// The strokes gave this.
    Measured(Drive),
    /// It gave nothing.
    Refused(Refusal),
}

impl Commissioning {
    /// 0 none, 1 running, 2 the direction is proven, 3 measured, 4 refused. The numbers are stable.
    pub const fn number(&self) -> u8 {
        match self {
            Self::None => 0,
            Self::Running(_) => 1,
            Self::Directed => 2,
            Self::Measured(_) => 3,
            Self::Refused(_) => 4,
        }
    }

    /// How much of it is done, in percent.
    pub const fn progress(&self) -> u8 {
        match self {
            Self::Running(percent) => *percent,
            Self::Directed | Self::Measured(_) => 100,
            Self::None | Self::Refused(_) => 0,
        }
    }

    /// The result; zeros where there is none.
    pub const fn drive(&self) -> Drive {
        match self {
            Self::Measured(drive) => *drive,
            _ => Drive {
                torque_constant_unm_per_a: 0,
                torque_constant_sigma: 0,
                time_constant_us: 0,
                time_constant_sigma: 0,
                inertia_ug_m2: 0,
                inertia_sigma: 0,
                friction_unm: [0; 2],
                friction_sigma: [0; 2],
            },
        }
    }

    /// The number of the [`Refusal`]; 0 where it was not refused.
    pub const fn refusal(&self) -> u8 {
        if let Self::Refused(refusal) = self { *refusal as u8 } else { 0 }
    }
}

impl core::fmt::Display for Refusal {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        f.write_str(match self {
            Self::Interrupted => "a stop, torque, a fault, a tare or new parameters ended it",
            Self::NotReady => "tare first, with torque off; nothing may touch the tip",
            Self::Unconfirmed => "jog first, and confirm the direction",
            Self::Still => {
                "the encoder did not count at 5 % of duty: is the motor connected, the encoder supplied, and does the tip \
                 move freely?"
            }
            Self::Reversed => "the encoder counts against the motor: swap the motor's leads or the encoder's channels",
            Self::Astray => "the encoder does not follow the motor: is one of its channels open?",
            Self::Touched => "the tip touched something: leave it 2 mm of air",
            Self::Blocked => "the motor felt a force that the array did not: leave the finger 2 mm to both sides",
            Self::HeldBack => "the guard or a limit held the voltage back: are slew, current and speed limits wide enough?",
            Self::Restless => "the tip did not come to rest: does something move it?",
            Self::Unsteady => "the strokes do not agree: does friction or a spring change along the way?",
            Self::Range => "a result is outside of its parameter's range: check gear, encoder and resistance",
        })
    }
}

impl core::error::Error for Refusal {}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_request_tells_its_task_and_differs_from_the_one_before() {
        let mut request = 0;
        for task in [Task::Jog, Task::Jog, Task::Measure, Task::Stop].into_iter().cycle().take(300) {
            let next = task.after(request);
            assert_ne!(next, request);
            assert_eq!(Task::of(next), task);
            request = next;
        }
    }
}
