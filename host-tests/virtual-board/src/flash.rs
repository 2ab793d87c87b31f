//! Content of the flash sectors with the stored parameters.
//!
//! The crate's flash interface times operations but keeps nothing: its memory map has no device that programs the
//! flash. The part therefore shows the emulator a map of its own while that lays out memory ([`layout`]), and the run
//! then programs and erases here, under the interface's registers. While a word is programmed or a sector erased the core
//! stalls, as one that runs from the same bank does. Errors that the interface would flag are not modelled.

use crate::faults::program;
use crate::part::Part;
use rigless::emulator::{Access, AccessKind, Host};
use rigless::mcu::Operate;
use rigless::session::Session;
use rigless::soc::stm32f427::generated::FLASH;
use rigless::soc::stm32f427::generated::flash::{Register, cr};
use rigless::soc::stm32f427::{CPU, MEMORY};
use rigless::soc::{Bus, Error, Layout as _, Region, Width};
use rigless::time::VirtualNanos;
use std::ops::Range;

/// Sector 7: the first of the two for stored parameters.
pub const SECTOR: Range<u64> = 0x0806_0000..0x0808_0000;
/// Sector 6: the other one.
pub const OTHER_SECTOR: Range<u64> = 0x0804_0000..0x0806_0000;
pub const SECTORS: Range<u64> = OTHER_SECTOR.start..SECTOR.end;
/// Time of a sector's erase at 32 bits, ns. The crate takes as long.
pub const ERASE_NS: u64 = 1_000_000_000;
/// Flash of the F446, which has less than the emulated part.
const FLASH_BYTES: u64 = 512 << 10;

/// The part's memory with the F446's flash and a device that programs it.
static PROGRAMMABLE: [Region; MEMORY.len()] = {
    let mut memory = MEMORY;
    memory[0] = Region::flash("flash", MEMORY[0].base, FLASH_BYTES).erased_to(0xff).programmed_by("FLASH");
    memory
};

/// A bus that serves only to lay out memory.
pub fn layout(of: &Bus) -> Result<Bus, Error> {
    Bus::builder(CPU, &PROGRAMMABLE, of.peripherals().copied()).build()
}

#[derive(Clone, Debug)]
pub struct Programmer {
    /// Time for which the core stalls while a word is programmed, ns: typically 16 us, at most 100 us (DS10693).
    pub word_ns: u64,
    pub words: u64,
    pub erases: u64,
    /// Time at which a stall of the core ends.
    stands_until_ns: Option<u64>,
}

impl Default for Programmer {
    fn default() -> Self {
        Self { word_ns: 16_000, words: 0, erases: 0, stands_until_ns: None }
    }
}

impl Programmer {
    pub fn stored(&mut self, session: &mut Session<Part>, host: &mut dyn Host, access: &Access) {
        if access.kind != AccessKind::Write {
            return;
        }
        let to_sectors = SECTORS.contains(&access.address);
        if !to_sectors && access.address != FLASH.base + u64::from(Register::Cr.spec().offset) {
            return;
        }
        let control = session.mcu().registers("FLASH").map_or(0, |registers| registers.get(Register::Cr));
        let stall_ns = if to_sectors && cr::PG.is_set(control) {
            // Programming only clears bits.
            let before = host.read(access.address, access.width).unwrap_or(0);
            program(host, access.address, access.width, before & access.value);
            self.words += 1;
            self.word_ns
        } else if !to_sectors && cr::STRT.is_set(control) && cr::SER.is_set(control) {
            let erased = match cr::SNB.get(control) {
                6 => OTHER_SECTOR,
                7 => SECTOR,
                _ => return,
            };
            self.erases += 1;
            erased.step_by(8).for_each(|address| program(host, address, Width::W64, u64::MAX));
            ERASE_NS
        } else {
            return;
        };
        let until_ns = access.virtual_time.0 + stall_ns;
        self.stands_until_ns = Some(until_ns);
        host.hold(true);
        session.pause_at(Some(VirtualNanos(until_ns)));
    }

    /// Returns true if a stall of the core ends at this time, so that the core runs on.
    pub fn stall_done(&mut self, now_ns: u64) -> bool {
        let done = self.stands_until_ns.is_some_and(|until_ns| until_ns <= now_ns);
        self.stands_until_ns = self.stands_until_ns.filter(|_| !done);
        done
    }
}
