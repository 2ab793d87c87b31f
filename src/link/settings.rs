//! Settings that the host may change, and actions that it may request of the firmware.

use super::table::indirect;
use crate::command::Command;
use crate::store::{BAUD_RATES, Record};

/// Settings that a write can change.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Settings<const ROWS: usize, const COLUMNS: usize> {
    /// Record that outlives a reset once it is saved.
    pub record: Record<ROWS, COLUMNS>,
    /// Requests to the loop.
    pub command: Command,
    /// 0: only Ping is answered; 1: reads too; 2: everything.
    pub status_return_level: u8,
    /// True if the bus watchdog has tripped and was not reset.
    pub watchdog_tripped: bool,
    /// State of the record compared with the flash.
    pub saved: Saved,
    /// Addresses of the bytes of the indirect data; 0 is nowhere.
    pub indirect: [u16; indirect::COUNT],
    /// Offset of the byte of the capture that is read first.
    pub capture_offset: u32,
}

/// State of the stored registers compared with the flash. The numbers are stable.
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

/// Actions that a packet requests of the firmware, after the reply is sent.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Actions {
    /// Reset the microcontroller.
    pub reboot: bool,
    /// Write [`Settings::record`] to flash, and report the result with [`super::Server::note_saved`].
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
}
