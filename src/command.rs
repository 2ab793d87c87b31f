//! Requests of the host to the loop.

use crate::contact::FitLevel;
use crate::units::Newtons;

/// Requests of the host to the loop: a snapshot, replaced as a whole.
///
/// ```
/// use fingertip::command::Command;
/// use fingertip::config::newtons;
///
/// let mut command = Command::default(); // torque off, nothing to hold
/// command.tare_request += 1; // a change asks for a tare
/// let hold = Command { torque: true, goal: newtons(1_500), ..command };
/// assert_eq!(hold.goal.0, 1.5);
/// ```
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Command {
    /// True if the bridge may be driven.
    pub torque: bool,
    /// Force to hold; 0 releases.
    pub goal: Newtons,
    /// Time of the bus watchdog, ms; 0 is off.
    pub bus_watchdog_ms: u16,
    /// Largest amount of work per frame for the contact.
    pub fit_level: FitLevel,
    /// Request number of a tare: a change requests one.
    pub tare_request: u8,
    /// True if a tare is made, and torque may be enabled after it, although something touches the tip: every force
    /// then reads less by what presses.
    pub tare_forced: bool,
    /// Request number of a clear: a change clears a fault. A clear with torque on is refused: turn torque off, then change
    /// the number again.
    pub clear_request: u8,
    /// Request number of a measurement: a change requests the [`crate::measure::Task`] in its lowest bits.
    pub measure_request: u8,
}
