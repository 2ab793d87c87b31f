//! One pass over the rows of a frame: sums of ten columns, two of them an instruction, the sag of each row taken out.

use super::{Pairs, portable};

/// Fractional bits of a boost.
pub const BOOST_BITS: u32 = 28;

/// What is known of a row before the pass, and the boost, which the pass finds.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Row {
    /// The first and the second weight of each column.
    pub weights: [Pairs; 2],
    /// What the row's two weighted sums begin with.
    pub start: [i32; 2],
    /// 1 / (1 - x) in Q28, where x is the row's sag.
    pub boost: i32,
}

/// What is common to the rows of a pass.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct Common {
    /// What each column's codes are taken above.
    pub floors: Pairs,
    /// What the sag of each row begins with, Q32.
    pub start: i32,
    /// The sag for each code above the floor, Q32; in both lanes.
    pub sag: u32,
}

/// What the rows add up to.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Total {
    /// Sum of the rows' first sums, each times its boost; upper half of the product.
    pub first: i32,
    /// The same of the second sums.
    pub second: i32,
    /// A quarter of `first` after each row, added up.
    pub running: i32,
    /// The largest code above its floor in each lane, unsigned: one below its floor is huge.
    pub largest: u32,
}

/// 1 / (1 - x) in Q28, for x in Q32 from -0.32 to 0.32.
///
/// It is (1 + x)(1 + x^2)(1 + x^4 + x^8), which leaves out x^12 of itself and less: 2^-20 at the ends, 2^-46 at 7 %.
#[inline(always)]
fn boost(x: i32) -> i32 {
    let x2 = portable::add_high(0, x, x);
    let x4 = portable::add_high(0, x2, x2);
    let boost = (1 << BOOST_BITS) + (x >> (32 - BOOST_BITS));
    let boost = portable::add_high(boost, boost, x2);
    portable::add_high(boost, boost, portable::add_high(x4, x4, x4))
}

/// [`pass`] without the instructions.
#[inline(always)]
pub fn portable_pass<const ROWS: usize>(codes: &[Pairs; ROWS], rows: &mut [Row; ROWS], common: &Common) -> Total {
    let mut total = Total::default();
    for (codes, row) in codes.iter().zip(rows) {
        let ([mut first, mut second], mut sag) = (row.start, common.start);
        let [firsts, seconds] = &row.weights;
        for (((code, floor), first_weight), second_weight) in codes.iter().zip(&common.floors).zip(firsts).zip(seconds) {
            let above = portable::sub(*code, *floor);
            sag = portable::dot(above, common.sag, sag);
            first = portable::dot(above, *first_weight, first);
            second = portable::dot(above, *second_weight, second);
            total.largest = super::larger(total.largest, above);
        }
        row.boost = boost(sag);
        total.first = portable::add_high(total.first, first, row.boost);
        total.second = portable::add_high(total.second, second, row.boost);
        total.running = total.running.wrapping_add(total.first >> 2);
    }
    total
}

#[cfg(not(all(target_arch = "arm", target_os = "none")))]
pub use portable_pass as pass;

/// Sums up the rows and finds their boosts (SSUB16, SMLAD, UQSUB16, SMMLA). ROWS is even.
///
/// Written out, because the compiler has too few registers for any order of these instructions, and keeps loading and
/// storing. It works through a row in about 73 cycles.
#[cfg(all(target_arch = "arm", target_os = "none"))]
#[inline(always)]
pub fn pass<const ROWS: usize>(codes: &[Pairs; ROWS], rows: &mut [Row; ROWS], common: &Common) -> Total {
    const { assert!(ROWS > 0 && ROWS % 2 == 0) };
    let (first, second, running, largest);
    // SAFETY: reads the codes, the rows and what is common, writes each row's boost; the types hold their lengths and places,
    // and the codes' end ends the loop, which takes two rows a turn. The stack is as it was at the end, and so are r6 and r7,
    // which an operand cannot be. The flag that it can set (Q) is sticky and read nowhere.
    unsafe {
        core::arch::asm!(
            "push {{r6, r7, r9}}",
            "ldm r2, {{r3-r8, lr}}",
            "push {{r3-r8}}",
            "movs r2, #0", // the largest
            "movs r3, #0", // first, second, running
            "movs r4, #0",
            "movs r5, #0",
            "2:",
            ".irp row, 0, 1",
            "ldr r6, [sp, #20]", // the sag, then the row's two sums
            "ldr r7, [r1, #\\row * {row} + {start}]",
            "ldr r8, [r1, #\\row * {row} + {start} + 4]",
            ".irp place, 0, 4, 8, 12, 16",
            "ldr r9, [r0, #\\row * {pairs} + \\place]",
            "ldr r10, [sp, #\\place]",
            "ldr r11, [r1, #\\row * {row} + \\place]",
            "ldr r12, [r1, #\\row * {row} + \\place + {pairs}]",
            "ssub16 r9, r9, r10",
            "smlad r6, r9, lr, r6",
            "smlad r7, r9, r11, r7",
            "smlad r8, r9, r12, r8",
            "uqsub16 r10, r9, r2",
            "add r2, r2, r10",
            ".endr",
            "smmul r9, r6, r6", // the boost
            "smmul r10, r9, r9",
            "mov r12, #1 << 28",
            "add r12, r12, r6, asr #4",
            "smmla r10, r10, r10, r10",
            "smmla r12, r12, r9, r12",
            "smmla r12, r12, r10, r12",
            "str r12, [r1, #\\row * {row} + {boost}]",
            "smmla r3, r7, r12, r3",
            "smmla r4, r8, r12, r4",
            "add r5, r5, r3, asr #2",
            ".endr",
            "ldr r12, [sp, #32]", // the codes' end
            "adds r0, #2 * {pairs}",
            "adds r1, #2 * {row}",
            "cmp r0, r12",
            "bne 2b",
            "add sp, #24",
            "pop {{r6, r7, r9}}",
            pairs = const size_of::<Pairs>(),
            row = const size_of::<Row>(),
            start = const core::mem::offset_of!(Row, start),
            boost = const core::mem::offset_of!(Row, boost),
            inout("r0") codes.as_ptr() => _,
            inout("r1") rows.as_mut_ptr() => _,
            inout("r2") common => largest,
            out("r3") first, out("r4") second, out("r5") running,
            out("r8") _, in("r9") codes.as_ptr_range().end,
            out("r10") _, out("r11") _, out("r12") _, out("lr") _,
        );
    }
    Total { first, second, running, largest }
}
