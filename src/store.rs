//! Parameters in flash: records, in two sectors that take turns.
//!
//! | bytes | content |
//! | --- | --- |
//! | 0 to 3 | magic "FTPR" |
//! | 4 to 7 | sequence number: one more than the record before; wraps |
//! | 8 to 11 | n, how many values follow |
//! | 12 to 12 + 8 n | n times the number of a value's name, and the value, 32 bits each |
//! | then 4 | CRC-32 (ISO-HDLC) of all before |
//!
//! All little-endian; FF up to the next multiple of 16. The number of a name is its CRC-32, so a firmware with other
//! values takes those that it knows. Behind the parameters come the taxels' gains, two in a value, under the numbers from
//! [`gains_number`] on; they are left out where all are 1.
//!
//! [`Journal`] has the order of writing and erasing: the sector that holds the newest whole record is never erased. So
//! a loss of power leaves the old record or the new one. A record that was cut short fails the CRC: the one before it
//! counts, and [`Loaded::sound`] says that something was lost.

mod format;
mod journal;
mod names;
mod taken;

use crc::{CRC_32_ISO_HDLC, Crc, NoTable};

use crate::contact::FitLevel;
use crate::params::Params;
use crate::pressure::Gains;

pub use format::{SLOT_BYTES, words};
pub use journal::{Flash, Journal, Loaded, SaveError, Sector};
pub use names::{gains_number, number};
pub use taken::{Remark, settle};

/// The largest ID of a device on the bus.
pub const ID_MAX: u8 = 252;
/// The bus speeds that the clocks allow, by the protocol's code (APB1 runs at 42 MHz: 4 and 4.5 Mbaud are 4 % off).
pub const BAUD_RATES: [u32; 6] = [9_600, 57_600, 115_200, 1_000_000, 2_000_000, 3_000_000];

const CRC: Crc<u32, NoTable> = Crc::<u32, NoTable>::new(&CRC_32_ISO_HDLC);

/// What outlives a reset.
///
/// ```
/// use fingertip::shipped::Record;
/// use fingertip::store::{Flash, Journal, Sector};
///
/// /// Two sectors in memory.
/// struct Sectors([[u8; 1024]; 2]);
///
/// impl Flash for Sectors {
///     type Error = ();
///     fn bytes(&self, sector: Sector) -> &[u8] {
///         &self.0[sector as usize]
///     }
///     fn program(&mut self, sector: Sector, offset: usize, word: u32) -> Result<(), ()> {
///         self.0[sector as usize][offset..offset + 4].copy_from_slice(&word.to_le_bytes());
///         Ok(())
///     }
///     fn erase(&mut self, sector: Sector) -> Result<(), ()> {
///         self.0[sector as usize].fill(0xff);
///         Ok(())
///     }
/// }
///
/// let mut flash = Sectors([[0xff; 1024]; 2]);
/// let record = Record { id: 7, ..Record::DEFAULT };
/// Journal::new(&flash).save(&mut flash, &record, || ()).unwrap();
/// assert_eq!(Journal::new(&flash).load(&flash, |_| ()).record, record);
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Record<const ROWS: usize, const COLUMNS: usize> {
    /// Address on the bus, 0 to 252.
    pub id: u8,
    /// Bus speed by the protocol's code: [`BAUD_RATES`].
    pub baud_code: u8,
    /// Pause before a reply, in units of 2 us.
    pub return_delay_2us: u8,
    /// How much work the loop may put into a contact.
    pub fit_level: FitLevel,
    /// The parameters.
    pub params: Params,
    /// The taxels' gains.
    pub gains: Gains<ROWS, COLUMNS>,
}

impl<const ROWS: usize, const COLUMNS: usize> Record<ROWS, COLUMNS> {
    /// What a blank flash stands for: ID 1, 1 Mbaud, 500 us.
    pub const DEFAULT: Self = Self {
        id: 1,
        baud_code: 3,
        return_delay_2us: 250,
        fit_level: FitLevel::OneRow,
        params: Params::DEFAULT,
        gains: Gains::ONE,
    };
}

impl<const ROWS: usize, const COLUMNS: usize> Default for Record<ROWS, COLUMNS> {
    fn default() -> Self {
        Self::DEFAULT
    }
}
