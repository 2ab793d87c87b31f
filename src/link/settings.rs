//! What the host may change, and what it may ask the firmware to do.

use crate::command::Command;
use crate::config::{ConfigError, Shaped};
use crate::scan::Clocks;
use crate::store::{BAUD_RATES, Record};
use crate::units::Newtons;

use super::packet::StatusError;
use super::table::indirect;

/// Everything that a write can change.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Settings<const ROWS: usize, const COLUMNS: usize> {
    /// What outlives a reset once it is saved.
    pub record: Record<ROWS, COLUMNS>,
    /// What the loop is asked for.
    pub command: Command,
    /// 0: only Ping is answered; 1: reads too; 2: everything.
    pub status_return_level: u8,
    /// The bus watchdog has tripped and was not reset.
    pub watchdog_tripped: bool,
    /// How the record stands to the flash.
    pub saved: Saved,
    /// Where the bytes of the indirect data stand; 0 is nowhere.
    pub indirect: [u16; indirect::COUNT],
    /// Which byte of the capture is read first.
    pub capture_offset: u32,
}

/// How the stored registers stand to the flash. The numbers are stable.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u8)]
pub enum Saved {
    /// Flash holds the same, or both hold the defaults.
    Same = 0,
    /// Changed since the last save.
    Changed = 1,
    /// The last save failed.
    Failed = 2,
}

/// What a packet asks the firmware to do once the reply is sent.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Actions {
    /// Reset the microcontroller.
    pub reboot: bool,
    /// Write [`Settings::record`] to flash, and say how it went with [`super::Server::note_saved`].
    pub save: bool,
    /// The parameters changed: make a new configuration.
    pub configure: bool,
    /// The taxels' gains changed: take them, and forget the tare.
    pub calibrate: bool,
    /// The bus speed changed.
    pub baud: bool,
    /// A capture is to be armed (true) or ended (false).
    pub capture: Option<bool>,
}

impl<const ROWS: usize, const COLUMNS: usize> Settings<ROWS, COLUMNS> {
    /// The settings after a reset.
    pub fn new(record: Record<ROWS, COLUMNS>) -> Self {
        Self {
            record,
            command: Command::default(),
            status_return_level: 2,
            watchdog_tripped: false,
            saved: Saved::Same,
            indirect: [0; indirect::COUNT],
            capture_offset: 0,
        }
    }

    /// The bus speed in baud.
    pub fn baud(&self) -> u32 {
        BAUD_RATES.get(usize::from(self.record.baud_code)).copied().unwrap_or(BAUD_RATES[1])
    }

    /// The pause before a reply.
    pub fn return_delay_us(&self) -> u32 {
        u32::from(self.record.return_delay_2us) * 2
    }

    /// Refuses what no register's own range can catch.
    ///
    /// # Errors
    /// A parameter out of its range, parameters that contradict each other, or a goal beyond the largest force.
    pub(super) fn check(&self, params_changed: bool, clocks: &Clocks) -> Result<(), StatusError> {
        if params_changed {
            Shaped::<ROWS, COLUMNS>::new(&self.record.params, clocks).map_err(|error| match error {
                ConfigError::Param(_) => StatusError::Range,
                _ => StatusError::Limit,
            })?;
        }
        if goal_mn(self.command.goal) > self.record.params.force_max_mn {
            return Err(StatusError::Limit);
        }
        Ok(())
    }
}

/// A force in mN, rounded.
pub(super) fn goal_mn(force: Newtons) -> i32 {
    super::table::thousandths(force.to_bits(), 16)
}
