//! The stored parameters in flash sectors 6 and 7, above the image, and the option bytes as the last reset loaded them.

use embassy_stm32::flash::{Blocking, Error, Flash};
use embassy_stm32::pac::flash::vals::Psize;
use embassy_stm32::peripherals::FLASH;
use embassy_stm32::{Peri, pac};
use fingertip::shipped::{Loaded, Record};
use fingertip::store::{self, Journal, Remark, Sector};

const FLASH_START: u32 = 0x0800_0000;
const SECTOR_BYTES: u32 = 128 * 1024;

/// Offset from the start of the flash.
const fn offset(sector: Sector) -> u32 {
    match sector {
        // Sector 7, and sector 6 below it.
        Sector::A => 0x6_0000,
        Sector::B => 0x4_0000,
    }
}

/// The sectors that hold the records.
pub struct Store {
    chip: Chip,
    journal: Journal,
}

/// Reason why a record was not saved, or no room made.
pub type SaveError = store::SaveError<Error>;

impl Store {
    /// Takes the flash, and reads the positions of its records.
    pub fn new(flash: Peri<'static, FLASH>) -> Self {
        let chip = Chip::new(flash);
        let journal = Journal::new(&chip);
        Self { chip, journal }
    }

    /// The newest whole record; see [`Journal::load`].
    pub fn load(&self, tell: impl FnMut(Remark)) -> Loaded {
        self.journal.load(&self.chip, tell)
    }

    /// See [`Journal::make_room`]. Takes up to 2 s in which the core halts, so call it before the watchdog and the
    /// scan start.
    pub fn make_room(&mut self) -> Result<bool, SaveError> {
        self.journal.make_room(&mut self.chip, Record::SLOT_MAX)
    }

    /// Appends a record. The core halts while each of its words (`Record::slot_bytes`) is programmed, 16 us and at
    /// most 100 us: the motor must be off and the scan stopped, and `between` must feed the watchdog.
    ///
    /// # Errors
    /// The sectors are full, or the flash does not hold the record afterwards.
    pub fn save(&mut self, record: &Record, between: impl FnMut()) -> Result<(), SaveError> {
        self.journal.save(&mut self.chip, record, between)
    }
}

/// The flash itself.
pub struct Chip(Flash<'static, Blocking>);

impl Chip {
    /// Takes it.
    pub fn new(flash: Peri<'static, FLASH>) -> Self {
        Self(Flash::new_blocking(flash))
    }
}

impl store::Flash for Chip {
    type Error = Error;

    fn bytes(&self, sector: Sector) -> &[u8] {
        // SAFETY: the sector is flash that is always readable, and the image ends below it (memory.x). Only `program`
        // and `erase` change it, and they borrow `self` exclusively.
        unsafe { core::slice::from_raw_parts((FLASH_START + offset(sector)) as *const u8, SECTOR_BYTES as usize) }
    }

    fn program(&mut self, sector: Sector, place: usize, word: u32) -> Result<(), Error> {
        let result = self.0.blocking_write(offset(sector) + place as u32, &word.to_le_bytes());
        drop_cached_data();
        result
    }

    fn erase(&mut self, sector: Sector) -> Result<(), Error> {
        set_width();
        let result = self.0.blocking_erase(offset(sector), offset(sector) + SECTOR_BYTES);
        drop_cached_data();
        result
    }
}

/// Lets the next erase take 32 bits at a time. The driver sets that for a write and clears it after; an erase it leaves
/// at the 8 bits of the reset, which takes twice as long, up to 4 s. The driver locks the registers again.
fn set_width() {
    if pac::FLASH.cr().read().lock() {
        pac::FLASH.keyr().write_value(0x4567_0123);
        pac::FLASH.keyr().write_value(0xCDEF_89AB);
    }
    pac::FLASH.cr().modify(|w| w.set_psize(Psize::PSIZE32));
}

/// Clears the data cache, which may still hold the old content of the flash.
fn drop_cached_data() {
    let acr = pac::FLASH.acr();
    acr.modify(|w| w.set_dcen(false));
    acr.modify(|w| w.set_dcrst(true));
    acr.modify(|w| w.set_dcrst(false));
    acr.modify(|w| w.set_dcen(true));
}

/// The code of level 3 in the register: it resets before the supply is below 2.7 V, the least for 168 MHz with five
/// wait states (docs/board.md, Option bytes).
const LEVEL_3: u8 = 0b00;

/// Returns all option bytes.
pub fn option_bytes() -> u32 {
    pac::FLASH.optcr().read().0
}

/// Returns true if a supply that is too low for the core's speed resets it. The factory setting does not.
pub fn brown_out_resets() -> bool {
    pac::FLASH.optcr().read().bor_lev() == LEVEL_3
}
