//! Content of the flash sectors with the stored parameters.
//!
//! The crate's flash interface times operations but keeps nothing: its memory map has no device that programs the
//! flash. The part therefore shows the emulator a map of its own while that lays out memory ([`layout`]), and the run
//! then programs and erases here, under the interface's registers. While a word is programmed the core stalls, as one
//! that runs from the same bank does. Errors that the interface would flag are not modelled.

use crate::board::FingerBoard;
use rigless::emulator::{Access, AccessKind, Host};
use rigless::mcu::Operate;
use rigless::session::Session;
use rigless::soc::stm32f427::generated::FLASH;
use rigless::soc::stm32f427::generated::flash::{Register, cr};
use rigless::soc::stm32f427::{CPU, MEMORY};
use rigless::soc::{Bus, Error, Layout as _, Region, Width};
use rigless::time::VirtualNanos;
use serde::{Deserialize, Serialize};
use std::ops::Range;

/// Sector 7: the first of the two for stored parameters.
pub const SECTOR: Range<u64> = 0x0806_0000..0x0808_0000;
/// Sector 6: the other one.
pub const OTHER_SECTOR: Range<u64> = 0x0804_0000..0x0806_0000;
/// Both.
pub const SECTORS: Range<u64> = OTHER_SECTOR.start..SECTOR.end;
/// Sector of this number; `None` for any but the two.
fn sector(number: u64) -> Option<Range<u64>> {
    [(6, OTHER_SECTOR), (7, SECTOR)].into_iter().find_map(|(own, sector)| (own == number).then_some(sector))
}
/// Flash of the F446, which has less than the emulated part.
const FLASH_BYTES: u64 = 512 << 10;

/// The part's memory with the F446's flash and a device that programs it.
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

/// Changes of the flash sectors. A snapshot includes the bytes.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Kept {
    changed: bool,
    bytes: Vec<u8>,
    /// Time for which the core stalls while a word is programmed, ns: typically 16 us, at most 100 us (DS10693).
    pub word_ns: u64,
    /// Number of words programmed.
    pub words: u64,
    /// Number of sectors erased.
    pub erases: u64,
    /// Time at which a stall of the core ends.
    stands_until_ns: Option<u64>,
}

impl Default for Kept {
    fn default() -> Self {
        Self { changed: false, bytes: Vec::new(), word_ns: 16_000, words: 0, erases: 0, stands_until_ns: None }
    }
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
        if SECTORS.contains(&access.address) {
            if cr::PG.is_set(control(session)) {
                let before = host.read(access.address, access.width).unwrap_or(0);
                self.program(host, access.address, access.width, before & access.value);
                self.words += 1;
                let until_ns = access.virtual_time.0 + self.word_ns;
                self.stands_until_ns = Some(until_ns);
                host.hold(true);
                session.pause_at(Some(VirtualNanos(until_ns)));
            }
        } else if access.address == FLASH.base + u64::from(Register::Cr.spec().offset) {
            let control = control(session);
            if cr::STRT.is_set(control) && cr::SER.is_set(control) {
                let erased = sector(cr::SNB.get(control));
                self.erases += u64::from(erased.is_some());
                for address in erased.into_iter().flat_map(|sector| sector.step_by(8)) {
                    self.program(host, address, Width::W64, u64::MAX);
                }
            }
        }
    }

    /// Returns true if the programming of a word ends at this time, so that the core runs on.
    pub fn word_done(&mut self, now_ns: u64) -> bool {
        let done = self.stands_until_ns.is_some_and(|until_ns| until_ns <= now_ns);
        self.stands_until_ns = self.stands_until_ns.filter(|_| !done);
        done
    }

    fn program(&mut self, host: &mut dyn Host, address: u64, width: Width, value: u64) {
        self.changed |= host.program(address, width, value).is_ok();
    }

    /// Takes the bytes in, before a snapshot.
    pub fn keep(&mut self, host: &mut dyn Host) {
        let byte = |address| host.read(address, Width::W8).unwrap_or(0xff) as u8;
        self.bytes = if self.changed { SECTORS.map(byte).collect() } else { Vec::new() };
    }

    /// Puts the bytes back, after a snapshot or into a fresh run.
    pub fn put_back(&mut self, host: &mut dyn Host) {
        for (address, byte) in SECTORS.zip(std::mem::take(&mut self.bytes)) {
            self.program(host, address, Width::W8, u64::from(byte));
        }
    }
}
