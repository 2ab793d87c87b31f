//! The stored parameters: flash sector 7, above the image.

use embassy_stm32::Peri;
use embassy_stm32::flash::{Blocking, Flash};
use embassy_stm32::pac;
use embassy_stm32::peripherals::FLASH;
use fingertip::store::{self, Record, StoreError};

/// From the start of the flash.
const SECTOR_OFFSET: u32 = 0x6_0000;
const SECTOR_BYTES: u32 = 128 * 1024;
const FLASH_START: u32 = 0x0800_0000;

/// The sector that holds the records.
pub struct Store {
    flash: Flash<'static, Blocking>,
}

/// Why a record was not saved.
#[derive(Clone, Copy, PartialEq, Eq, defmt::Format)]
pub enum SaveError {
    /// The sector is full; the next start erases it.
    Full,
    /// The flash refused the write.
    Write(embassy_stm32::flash::Error),
    /// The flash reads back something else.
    Verify,
}

impl Store {
    /// Takes the flash.
    pub fn new(flash: Peri<'static, FLASH>) -> Self {
        Self { flash: Flash::new_blocking(flash) }
    }

    /// The newest record, or none where the sector is blank.
    ///
    /// # Errors
    /// The newest record is damaged.
    pub fn latest(&self) -> Result<Option<Record>, StoreError> {
        store::latest(self.sector())
    }

    /// The newest record that is whole.
    pub fn newest_whole(&self) -> Option<Record> {
        store::newest_whole(self.sector())
    }

    /// Makes room where there is none left, and writes `keep` again. Takes up to 2 s in which the core stands, so call it
    /// before the watchdog and the scan start.
    pub fn make_room(&mut self, keep: &Record) -> Result<bool, SaveError> {
        if store::next_offset(self.sector()).is_some() {
            return Ok(false);
        }
        self.flash.blocking_erase(SECTOR_OFFSET, SECTOR_OFFSET + SECTOR_BYTES).map_err(SaveError::Write)?;
        drop_cached_data();
        self.save(keep).map(|()| true)
    }

    /// Appends a record. The core stands while each word is written, 16 us, so the motor must be off.
    ///
    /// # Errors
    /// The sector is full, or the flash does not hold the record afterwards.
    pub fn save(&mut self, record: &Record) -> Result<(), SaveError> {
        let offset = store::next_offset(self.sector()).ok_or(SaveError::Full)?;
        let slot = store::encode(record);
        self.flash.blocking_write(SECTOR_OFFSET + offset as u32, &slot).map_err(SaveError::Write)?;
        drop_cached_data();
        let written = self.sector().get(offset..offset + slot.len());
        if written == Some(&slot[..]) { Ok(()) } else { Err(SaveError::Verify) }
    }

    fn sector(&self) -> &[u8] {
        // SAFETY: the sector is flash that is always readable, and the image ends below it (memory.x). Only `save` and
        // `make_room` change it, and they borrow `self` exclusively.
        unsafe { core::slice::from_raw_parts((FLASH_START + SECTOR_OFFSET) as *const u8, SECTOR_BYTES as usize) }
    }
}

/// The data cache may still hold what the flash was before.
fn drop_cached_data() {
    let acr = pac::FLASH.acr();
    acr.modify(|w| w.set_dcen(false));
    acr.modify(|w| w.set_dcrst(true));
    acr.modify(|w| w.set_dcrst(false));
    acr.modify(|w| w.set_dcen(true));
}
