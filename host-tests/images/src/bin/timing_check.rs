//! Published kernels for the timing model's check: code in assembly, so the compiler has no part in the figures.
//!
//! Not for a board. Each kernel is a region, numbered by its place in [`KERNELS`] from 1 on;
//! `xtask/src/timing.rs` has the cycles that their authors measured, in the same order. With the command line
//! `unknown`, a region holds an instruction that the core does not have.
#![no_std]
#![no_main]

#[expect(dead_code, reason = "a kernel here takes its arguments in registers")]
#[path = "../study/call.rs"]
mod call;
#[expect(dead_code, reason = "nothing is read here, and no line is written")]
mod host;

use call::{Registers, pass};
use core::arch::{asm, global_asm};
use cortex_m_semihosting::debug;
use host::{command_line, fail};

global_asm!(
    include_str!("../../../../m4-timing/tests/kernels/aes-armcortexm/aes128.s"),
    include_str!("../../../../m4-timing/tests/kernels/aes-armcortexm/aes128ctr.s"),
    include_str!("../../../../m4-timing/tests/kernels/aes-armcortexm/aes192ctr.s"),
    include_str!("../../../../m4-timing/tests/kernels/aes-armcortexm/aes256ctr.s"),
    include_str!("../../../../m4-timing/tests/kernels/cortexm-aes/common.s"),
    include_str!("../../../../m4-timing/tests/kernels/cortexm-aes/CM3_1T_AES128_keyschedule_enc.s"),
    include_str!("../../../../m4-timing/tests/kernels/cortexm-aes/CM3_1T_AES256_keyschedule_enc.s"),
    include_str!("../../../../m4-timing/tests/kernels/cortexm-aes/CM3_1T_AES_keyschedule_dec.s"),
    include_str!("../../../../m4-timing/tests/kernels/cortexm-aes/CM3_1T_AES_encrypt.s"),
    include_str!("../../../../m4-timing/tests/kernels/cortexm-aes/CM3_1T_AES_decrypt.s"),
    include_str!("../../../../m4-timing/tests/kernels/cortexm-aes/CM3_1T_AES128_encrypt_unrolled.s"),
    include_str!("../../../../m4-timing/tests/kernels/cortexm-aes/CM3_1T_AES256_encrypt_unrolled.s"),
    include_str!("../../../../m4-timing/tests/kernels/cortexm-aes/CM3_1T_AES128_decrypt_unrolled.s"),
    include_str!("../../../../m4-timing/tests/kernels/cortexm-aes/CM3_1T_AES256_decrypt_unrolled.s"),
    include_str!("../../../../m4-timing/tests/kernels/cortexm-aes/CM4_DSPsBOX_AES_encrypt.s"),
    include_str!("../../../../m4-timing/tests/kernels/cortexm-aes/CM4_DSPsBOX_AES_decrypt.s"),
    options(raw)
);

type Words = *mut u32;
type Kernel = unsafe extern "C" fn(Words, Words, Words, usize);

/// Declares kernels, which take a state or keys, two buffers, and the bytes or rounds.
macro_rules! kernels {
    ($($name:ident)*) => { unsafe extern "C" { $(fn $name(_: Words, _: Words, _: Words, _: usize);)* } };
}
kernels! {
    AES_128_keyschedule AES_128_encrypt AES_128_encrypt_ctr AES_192_keyschedule AES_192_encrypt_ctr AES_256_keyschedule
    AES_256_encrypt_ctr CM3_1T_AES128_keyschedule_enc CM3_1T_AES256_keyschedule_enc CM3_1T_AES_keyschedule_dec
    CM3_1T_AES_encrypt CM3_1T_AES_decrypt CM3_1T_AES128_encrypt_unrolled CM3_1T_AES256_encrypt_unrolled
    CM3_1T_AES128_decrypt_unrolled CM3_1T_AES256_decrypt_unrolled CM4_DSPsBOX_AES_encrypt CM4_DSPsBOX_AES_decrypt
}

/// Bytes that the kernels for many blocks get.
const BYTES: usize = 4096;
const PASSES: u32 = 5;

enum Second {
    Input,
    Rounds(usize),
}
use Second::{Input, Rounds};

/// Kernels, each with its second argument and its last one.
const KERNELS: [(Kernel, Second, usize); 23] = [
    (AES_128_keyschedule, Input, 0),
    (AES_128_encrypt, Input, 0),
    (AES_128_encrypt_ctr, Input, BYTES),
    (AES_192_keyschedule, Input, 0),
    (AES_192_encrypt_ctr, Input, BYTES),
    (AES_256_keyschedule, Input, 0),
    (AES_256_encrypt_ctr, Input, BYTES),
    (CM3_1T_AES128_keyschedule_enc, Input, 0),
    (CM3_1T_AES256_keyschedule_enc, Input, 0),
    (CM3_1T_AES_encrypt, Input, 10),
    (CM3_1T_AES_encrypt, Input, 14),
    (CM3_1T_AES128_encrypt_unrolled, Input, 0),
    (CM3_1T_AES256_encrypt_unrolled, Input, 0),
    (CM3_1T_AES_keyschedule_dec, Rounds(10), 0),
    (CM3_1T_AES_keyschedule_dec, Rounds(14), 0),
    (CM3_1T_AES_decrypt, Input, 10),
    (CM3_1T_AES_decrypt, Input, 14),
    (CM3_1T_AES128_decrypt_unrolled, Input, 0),
    (CM3_1T_AES256_decrypt_unrolled, Input, 0),
    (CM4_DSPsBOX_AES_encrypt, Input, 10),
    (CM4_DSPsBOX_AES_encrypt, Input, 14),
    (CM4_DSPsBOX_AES_decrypt, Input, 10),
    (CM4_DSPsBOX_AES_decrypt, Input, 14),
];

static mut BUFFERS: [[u32; BYTES / 4 + 64]; 3] = [[0; BYTES / 4 + 64]; 3];

#[cortex_m_rt::entry]
fn main() -> ! {
    if command_line(&mut [0; 256]) == b"unknown\0" {
        // SAFETY: no region measures this, and it would fault; it is refused before.
        unsafe { asm!(".inst.w 0xf3af8040", ".inst.w 0xee310b02", ".inst.w 0xf3af8041") };
    }
    let buffers = &raw mut BUFFERS;
    // SAFETY: each is a third of the buffers; nothing else uses them.
    let [state, from, to] = unsafe { [0, 1, 2].map(|third| (&raw mut (*buffers)[third]).cast::<u32>()) };
    for (number, (kernel, second, last)) in (1..).zip(&KERNELS) {
        let second = match second {
            Input => from,
            Rounds(rounds) => *rounds as Words,
        };
        for _ in 0..PASSES {
            let core = [state as u32, second as u32, to as u32, *last as u32];
            pass(number, *kernel as *const (), &mut Registers { core, ..Registers::default() });
        }
    }
    loop {
        debug::exit(debug::EXIT_SUCCESS);
    }
}

#[panic_handler]
fn panic(_: &core::panic::PanicInfo) -> ! {
    fail("panic")
}
