//! What lies below the stack is closed, so that an overflow faults wherever it lands.
//!
//! RAM begins where the stack ends. Below it lie the option bytes and addresses that the manual calls reserved; what a
//! store there does it does not say. A region of the memory protection unit refuses it: the access is a hard fault, as
//! no other handler is enabled.

use cortex_m::asm::{dsb, isb};
use cortex_m::peripheral::MPU;

/// 16 KiB up to the start of RAM. The factory's calibration words lie below them.
const FOOT: u32 = 0x1FFF_C000;
/// Its size as a power of two, less one; no access, nothing to execute.
const ATTRIBUTES: u32 = 13 << 1 | 1 | 1 << 28;
/// On, with the usual map for all else. Off in the hard fault's handler.
const CONTROL: u32 = 1 | 1 << 2;

/// What the start-up code paints the stack with.
const PAINT: u32 = 0xCCCC_CCCC;

unsafe extern "C" {
    /// The stack's lower end; from memory.x.
    static _stack_end: u32;
    /// Where the stack starts, its upper end.
    static _stack_start: u32;
}

/// Bytes that the stack has taken at most since the reset, by the paint that is left. Reads all that is left.
pub fn deepest() -> u16 {
    let (mut place, top) = (&raw const _stack_end, &raw const _stack_start);
    // SAFETY: aligned and inside the stack, which is always readable.
    while place < top && unsafe { place.read_volatile() } == PAINT {
        place = place.wrapping_add(1);
    }
    u16::try_from(top.addr() - place.addr()).unwrap_or(u16::MAX)
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
