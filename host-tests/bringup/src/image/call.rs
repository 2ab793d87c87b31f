//! Calling a variant between two looks at the cycle counter.

use core::arch::asm;
use core::hint::black_box;

/// The core's cycle counter.
const CYCCNT: u32 = 0xE000_1004;

/// Arguments of a call by the hard-float calling convention; after the call its results.
#[derive(Clone, Copy, Default)]
#[repr(C)]
pub struct Registers {
    /// r0 to r3.
    pub core: [u32; 4],
    /// s0 to s3.
    pub single: [u32; 4],
}

/// Calls a kernel of any signature whose arguments fit the registers, as a pass of the present kernel.
pub fn pass(_region: u32, kernel: *const (), registers: &mut Registers) {
    // The compiler must neither know the kernel nor move it.
    let kernel = black_box(kernel);
    let [r0, r1, r2, r3] = registers.core;
    let (first, second);
    let (begun, ended): (u32, u32);
    // SAFETY: a call by the calling convention, with every register that it may change named. The singles are loaded
    // before it and stored behind it, from and to a structure that outlives the call. The counter is only read.
    unsafe {
        asm!(
            "vldr s0, [{singles}]",
            "vldr s1, [{singles}, #4]",
            "vldr s2, [{singles}, #8]",
            "vldr s3, [{singles}, #12]",
            "ldr {begun}, [{counter}]",
            "blx {kernel}",
            "ldr {counter}, [{counter}]",
            "vstr s0, [{singles}]",
            "vstr s1, [{singles}, #4]",
            singles = in(reg) registers.single.as_mut_ptr(),
            kernel = in(reg) kernel,
            begun = out(reg) begun,
            counter = inout(reg) CYCCNT => ended,
            inout("r0") r0 => first,
            inout("r1") r1 => second,
            inout("r2") r2 => _,
            inout("r3") r3 => _,
            out("r12") _, out("lr") _,
            out("s0") _, out("s1") _, out("s2") _, out("s3") _, out("s4") _, out("s5") _, out("s6") _, out("s7") _,
            out("s8") _, out("s9") _, out("s10") _, out("s11") _, out("s12") _, out("s13") _, out("s14") _, out("s15") _,
        );
    }
    registers.core = [first, second, 0, 0];
    super::note(ended.wrapping_sub(begun));
}

/// Calls a kernel that works on memory.
pub fn pass_on<T>(region: u32, kernel: extern "C" fn(&mut T), bench: &mut T) {
    let mut registers = Registers { core: [&raw mut *bench as u32, 0, 0, 0], ..Registers::default() };
    pass(region, kernel as *const (), &mut registers);
}
