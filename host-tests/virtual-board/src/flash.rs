//! What the flash holds, for the sector of the stored parameters.
//!
//! The crate's flash interface times operations but keeps nothing: its memory map names nobody who programs the flash. The
//! part therefore shows the emulator a map of its own while that lays out memory ([`layout`]), and the run then programs
//! and erases here, under the interface's registers. Errors that the interface would flag are not modelled.

use crate::board::FingerBoard;
use rigless::emulator::{Access, AccessKind, Host};
use rigless::mcu::Operate;
use rigless::session::Session;
use rigless::soc::stm32f427::generated::FLASH;
use rigless::soc::stm32f427::generated::flash::{Register, cr};
use rigless::soc::stm32f427::{CPU, MEMORY};
use rigless::soc::{Bus, Error, Layout as _, Region, Width};
use serde::{Deserialize, Serialize};
use std::ops::Range;

/// Sector 7: the stored parameters.
pub const SECTOR: Range<u64> = 0x0806_0000..0x0808_0000;
const SECTOR_NUMBER: u64 = 7;
/// Flash of the F446, which has less than the emulated part.
const FLASH_BYTES: u64 = 512 << 10;

/// The part's memory with the F446's flash, and somebody to program it.
static PROGRAMMABLE: [Region; MEMORY.len()] = {
    let mut memory = MEMORY;
    memory[0] = Region::flash("flash", MEMORY[0].base, FLASH_BYTES).erased_to(0xff).programmed_by("FLASH");
    memory
};

/// A bus that serves only to lay out memory.
///
/// # Errors
/// The part's description does not fit this crate: another release of `rigless`.
pub fn layout(of: &Bus) -> Result<Bus, Error> {
    Bus::builder(CPU, &PROGRAMMABLE, of.peripherals().copied()).build()
}

/// What was changed in the sector. A snapshot keeps the bytes.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
pub struct Kept {
    changed: bool,
    bytes: Vec<u8>,
}

impl Kept {
    /// The core stored something somewhere.
    pub fn stored(&mut self, session: &mut Session<FingerBoard>, host: &mut dyn Host, access: &Access) {
        if access.kind != AccessKind::Write {
            return;
        }
        let control = |session: &mut Session<FingerBoard>| {
            session.mcu().registers("FLASH").map_or(0, |registers| registers.get(Register::Cr))
        };
        if SECTOR.contains(&access.address) {
            if cr::PG.is_set(control(session)) {
                let before = host.read(access.address, access.width).unwrap_or(0);
                self.program(host, access.address, access.width, before & access.value);
            }
        } else if access.address == FLASH.base + u64::from(Register::Cr.spec().offset) {
            let control = control(session);
            let this = cr::SER.is_set(control) && cr::SNB.get(control) == SECTOR_NUMBER;
            if cr::STRT.is_set(control) && this {
                for address in SECTOR.step_by(8) {
                    self.program(host, address, Width::W64, u64::MAX);
                }
            }
        }
    }

    fn program(&mut self, host: &mut dyn Host, address: u64, width: Width, value: u64) {
        self.changed |= host.program(address, width, value).is_ok();
    }

    /// Takes the bytes in, before a snapshot.
    pub fn keep(&mut self, host: &mut dyn Host) {
        let byte = |address| host.read(address, Width::W8).unwrap_or(0xff) as u8;
        self.bytes = if self.changed { SECTOR.map(byte).collect() } else { Vec::new() };
    }

    /// Puts the bytes back, after a snapshot or into a fresh run.
    pub fn put_back(&mut self, host: &mut dyn Host) {
        for (address, byte) in SECTOR.zip(std::mem::take(&mut self.bytes)) {
            self.program(host, address, Width::W8, u64::from(byte));
        }
    }
}
