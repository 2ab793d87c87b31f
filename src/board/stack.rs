//! Protection of the memory below the stack: an overflow faults wherever it lands.
//!
//! RAM begins where the stack ends. Below it lie the option bytes and addresses that the manual calls reserved; what a
//! store there does it does not say. A region of the memory protection unit refuses it: the access is a hard fault, as
//! no other handler is enabled.

use cortex_m::asm::{dsb, isb};
use cortex_m::peripheral::MPU;

/// 16 KiB up to the start of RAM. The factory's calibration words lie below them.
const FOOT: u32 = 0x1FFF_C000;
/// Region attributes: size as a power of two, less one; no access, not executable.
const ATTRIBUTES: u32 = 13 << 1 | 1 | 1 << 28;
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

/// Closes it.
pub fn guard_foot() {
    // SAFETY: nothing else uses these registers, and nothing of the image lies in the region.
    unsafe {
        let mpu = &*MPU::PTR;
        mpu.rnr.write(0);
        mpu.rbar.write(FOOT);
        mpu.rasr.write(ATTRIBUTES);
        mpu.ctrl.write(CONTROL);
    }
    dsb();
    isb();
}
