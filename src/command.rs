//! What the host asks of the loop.

use crate::contact::FitLevel;
use crate::units::Newtons;

/// What the host asks of the loop; a snapshot, replaced as a whole.
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
    /// Whether the bridge may be driven.
    pub torque: bool,
    /// The force to hold, 0 to let go.
    pub goal: Newtons,
    /// Bus watchdog in ms; 0 is off.
    pub bus_watchdog_ms: u16,
    /// How much work may be put into the contact.
    pub fit_level: FitLevel,
    /// A change of this number asks for a tare.
    pub tare_request: u8,
    /// Whether a tare is made, and torque may be enabled after it, although something touches the tip: every force then
    /// reads less by what presses.
    pub tare_forced: bool,
    /// A change of this number clears a fault.
    pub clear_request: u8,
    /// A change of this number asks for a [`crate::measure::Task`], which its lowest bits name.
    pub measure_request: u8,
}
