//! Protection of the memory: a store to the image, code in RAM, or an overflow of the stack is a hard fault, as no other
//! handler is enabled.
//!
//! RAM begins where the stack ends. Below it lie the option bytes and addresses that the manual calls reserved; what a
//! store there does it does not say. So the overflow is refused wherever it lands.

use cortex_m::asm::{dsb, isb};
use cortex_m::peripheral::MPU;

/// Regions of the memory protection unit: base and attributes. Those are the size (as a power of two, less one), the access
/// rights, and the memory type of the default memory map.
const REGIONS: [(u32, u32); 3] = [
    // The image, 256 KiB of flash: read only. The stored parameters lie above it.
    (0x0800_0000, 17 << 1 | 1 | 0b110 << 24 | 0b000_010 << 16),
    // RAM, 128 KiB: not executable.
    (0x2000_0000, 16 << 1 | 1 | 0b011 << 24 | 0b001_011 << 16 | NEVER_EXECUTED),
    // 16 KiB up to the start of RAM: no access. The factory's calibration words lie below them.
    (0x1FFF_C000, 13 << 1 | 1 | NEVER_EXECUTED),
];
const NEVER_EXECUTED: u32 = 1 << 28;
/// On, with the usual map for all else. Off in the hard fault's handler.
const CONTROL: u32 = 1 | 1 << 2;

/// Pattern with which the start-up code paints the stack.
const PAINT: u32 = 0xCCCC_CCCC;

unsafe extern "C" {
    /// The stack's lower end; from memory.x.
    pub(super) static _stack_end: u32;
    /// Upper end of the stack, where it starts.
    pub(super) static _stack_start: u32;
}

/// Words of paint in a look: some 20 us.
const PIECE: usize = 512;

/// Check of the remaining stack paint in pieces: a check of all of it at once would delay the bus.
#[derive(Default)]
pub struct Paint {
    /// Number of words found unchanged so far, from the lower end.
    words: usize,
}

impl Paint {
    /// Looks at the next piece. Where it comes to the end of the paint: the bytes that the stack has taken at most
    /// since the reset.
    pub fn look(&mut self) -> Option<u16> {
        let (end, top) = (&raw const _stack_end, &raw const _stack_start);
        for _ in 0..PIECE {
            let place = end.wrapping_add(self.words);
            // SAFETY: aligned and inside the stack, which is always readable.
            if place >= top || unsafe { place.read_volatile() } != PAINT {
                self.words = 0;
                return Some(u16::try_from(top.addr() - place.addr()).unwrap_or(u16::MAX));
            }
            self.words += 1;
        }
        None
    }
}

/// Turns the memory protection on.
pub fn protect() {
    // SAFETY: nothing else uses these registers. The image writes to flash above its region only, runs no code from RAM
    // and has nothing below RAM.
    unsafe {
        let mpu = &*MPU::PTR;
        for (number, (base, attributes)) in REGIONS.into_iter().enumerate() {
            mpu.rnr.write(number as u32);
            mpu.rbar.write(base);
            mpu.rasr.write(attributes);
        }
        mpu.ctrl.write(CONTROL);
    }
    dsb();
    isb();
}
