//! The pass by instructions: SSUB16, SMLAD, UQSUB16, SMMLA, SMULxy, SMMULR, SMMLAR, USAT, SSAT.

use core::ops::Range;

use super::{BOOST_DROP, CODE_BITS, Codes, Common, Curve, Row, TARE_BITS, Total, portable_pass, sum_drop};

/// Columns of a row that the instructions take.
const WRITTEN_OUT: usize = 10;
/// Pairs of such a row, in bytes.
const PAIRS: usize = 2 * WRITTEN_OUT;

/// [`super::portable_pass`].
///
/// Written out in assembly for rows of ten columns: for any order of these instructions the compiler runs out of
/// registers and spills to the stack. A row takes about 170 cycles, about 260 with a curve.
#[inline(always)]
pub fn pass<const ROWS: usize, const COLUMNS: usize>(
    codes: &Codes<ROWS, COLUMNS>,
    rows: &mut [Row<COLUMNS>; ROWS],
    common: &Common,
    taxels: &mut [[i32; COLUMNS]; ROWS],
    range: Range<usize>,
    total: Total,
) -> Total {
    if COLUMNS != WRITTEN_OUT || const { sum_drop(ROWS, COLUMNS) } != 0 {
        return portable_pass(codes, rows, common, taxels, range, total);
    }
    let Codes { rows: all, undriven } = codes;
    let (Some(codes), Some(rows), Some(taxels)) =
        (all.get(range.clone()), rows.get_mut(range.clone()), taxels.get_mut(range))
    else {
        return total;
    };
    if codes.is_empty() {
        return total;
    }
    let mut second = total.second;
    if common.curve.growth != 0 {
        // With a curve the loop adds up sums, from which its end computes `second`: this start value gives back
        // `total.second`. The halved number is even.
        let both = total.first.wrapping_mul(9).wrapping_add(second);
        second = total.running.wrapping_mul(5).wrapping_sub(both >> 1);
    }
    let (first, running, largest, peak);
    // SAFETY: the rows have as many columns as the offsets suppose, and the codes begin on a word's border. Reads the
    // codes, the rows and what is common, writes each row's boost, nets and largest, and the taxels; the slices are
    // equally long and not empty, and the codes' end ends the loop. The stack is as it was at the end, and so are r6 and
    // r7, which an operand cannot be. The flag that it can set (Q) is sticky and read nowhere.
    unsafe {
        core::arch::asm!(
            // The two columns of a pair, whose net codes are in `net`: sums, taxels, peak. The left one's tare goes to
            // `left`; the first pair has no register left for it beside its own, and begins the sums.
            ".macro columns place, net, left",
            "ldr r8, [r1, #4 * \\place]", // gains
            "ldr r9, [r1, #4 * \\place + {moments}]",
            "ldr r10, [r1, #4 * \\place + {tare} + {pairs}]",
            ".if \\place == 0",
            "smuad lr, \\net, r8",
            "smuad r11, \\net, r9",
            ".else",
            "ldr \\left, [r1, #4 * \\place + {tare}]",
            "smlad lr, \\net, r8, lr",
            "smlad r11, \\net, r9, r11",
            ".endif",
            "smultt r9, \\net, r8",
            "smulbb r8, \\net, r8",
            ".if \\place == 0",
            "ldr \\left, [r1, #4 * \\place + {tare}]",
            ".endif",
            "smmulr r8, r8, r0",
            "smmulr r9, r9, r0",
            "sub r8, r8, \\left, asr #{tare_drop}",
            "sub r9, r9, r10, asr #{tare_drop}",
            "cmp r8, r12",
            "it gt",
            "movgt r12, r8",
            "cmp r9, r12",
            "it gt",
            "movgt r12, r9",
            "str r8, [r2, #4 * \\place]",
            "str r9, [r2, #4 * \\place + {pairs}]",
            ".endm",
            // The load of a reading above a tare; takes the tare's register.
            ".macro load reading, tare",
            "sub \\reading, \\reading, \\tare, asr #{fine_drop}",
            "add r4, \\tare, \\reading, lsl #{fine_drop}",
            "usat r4, #31, r4; usat \\tare, #31, \\tare; add r4, r4, \\tare",
            "smmlar r4, r4, r9, r8; smmulr \\reading, \\reading, r4",
            "ssat \\reading, #{largest_bits} + 1, \\reading",
            "cmp \\reading, r12; it gt; movgt r12, \\reading",
            ".endm",
            // The same with a curve. Sums of the left and the right half in lr, of these sums in r11, of the right
            // half in r10.
            ".macro loads place",
            "ldr r3, [r1, #4 * \\place + {nets}]; ldr r4, [r1, #4 * \\place]",
            "ldr r5, [r1, #4 * \\place + {tare}]; ldr r6, [r1, #4 * \\place + {tare} + {pairs}]",
            "smultt r7, r3, r4; smulbb r3, r3, r4; smmulr r7, r7, r0; smmulr r3, r3, r0",
            "load r3, r5",
            "load r7, r6",
            "str r3, [r2, #4 * \\place]; str r7, [r2, #4 * \\place + {pairs}]",
            "add r3, r3, r7; add lr, lr, r3; add r10, r10, r7; add r11, r11, lr",
            ".endm",
            // On the stack: what is common, the place among the codes, the totals, r6 and r7, the codes' end.
            "push {{r6, r7, r9}}",
            "mov r6, r10",
            "mov r7, r11",
            "mov r8, #0",
            "push {{r0, r4-r8}}",
            "ldm r3, {{r4-r7}}",
            "push {{r4-r7}}",
            "ldm lr, {{r4-r8}}", // the undriven codes
            "push {{r4-r8}}",
            "2:",
            "ldm r0!, {{r3-r7}}", // codes, then net codes
            "str r0, [sp, #36]",
            "ldm sp, {{r0, r8-r11}}",
            "ssub16 r3, r3, r0",
            "ssub16 r4, r4, r8",
            "ssub16 r5, r5, r9",
            "ssub16 r6, r6, r10",
            "ssub16 r7, r7, r11",
            "ldr r8, [sp, #20]", // dead
            "ldr r9, [sp, #24]", // sag
            "ldr lr, [sp, #32]", // the curve's growth
            "ldr r10, [sp, #52]", // the largest of all
            "smuad r11, r3, r9",
            "smlad r11, r4, r9, r11",
            "smlad r11, r5, r9, r11",
            "smlad r11, r6, r9, r11",
            "smlad r11, r7, r9, r11",
            "ssub16 r9, r3, r8", // the row's largest
            ".irp net, r4, r5, r6, r7",
            "ssub16 r0, \\net, r8",
            "uqsub16 r0, r0, r9",
            "add r9, r9, r0",
            ".endr",
            "str r9, [r1, #{largest}]",
            "uqsub16 r9, r9, r10",
            "add r10, r10, r9",
            "str r10, [sp, #52]",
            "smmul r8, r11, r11", // the boost
            "smmul r9, r8, r8",
            "mov r0, #1 << 28",
            "add r0, r0, r11, asr #4",
            "smmla r9, r9, r9, r9",
            "smmla r0, r0, r8, r0",
            "smmla r0, r0, r9, r0",
            "str r0, [r1, #{boost}]",
            "cmp lr, #0",
            "bne 3f",
            "asr r0, r0, #{boost_drop}",
            "columns 0, r3, r3",
            "columns 1, r4, r3",
            "columns 2, r5, r4",
            "columns 3, r6, r5",
            "columns 4, r7, r6",
            "ldr r3, [sp, #40]", // the totals
            "ldr r4, [sp, #44]",
            "ldr r5, [sp, #48]",
            "ldr r6, [r1, #{boost}]",
            "ldr r0, [sp, #36]",
            "ldr r7, [sp, #68]", // the codes' end
            "smmla r3, lr, r6, r3",
            "smmla r4, r11, r6, r4",
            "add r5, r5, r3, asr #2",
            "str r3, [sp, #40]",
            "str r4, [sp, #44]",
            "str r5, [sp, #48]",
            "adds r1, #{row}",
            "adds r2, #2 * {pairs}",
            "cmp r0, r7",
            "bne 2b",
            "b 4f",
            "3:",
            "str r3, [r1, #{nets}]; str r4, [r1, #{nets} + 4]; str r5, [r1, #{nets} + 8]",
            "str r6, [r1, #{nets} + 12]; str r7, [r1, #{nets} + 16]",
            "mov r9, lr; ldr r8, [sp, #28]", // the curve
            "ldr r10, [sp, #56]; ldr r11, [sp, #44]; ldr lr, [sp, #40]",
            ".irp place, 0, 1, 2, 3, 4",
            "loads \\place",
            ".endr",
            "ldr r5, [sp, #48]; ldr r0, [sp, #36]; ldr r7, [sp, #68]; add r5, r5, lr",
            "str lr, [sp, #40]; str r11, [sp, #44]; str r5, [sp, #48]; str r10, [sp, #56]",
            "adds r1, #{row}; adds r2, #2 * {pairs}; cmp r0, r7",
            "bne 2b",
            // Pair n of five was in a row's sums 5 - n times, and the rows before in all five of them. Twice its
            // distance from the middle is 2 n - 9 at the left, and 10 more at the right.
            "mov r3, lr; sub r6, r5, r3; add r6, r6, r10; movs r7, #10",
            "mla r6, r6, r7, r3; sub r4, r6, r11, lsl #1",
            "4:",
            ".purgem columns",
            ".purgem load",
            ".purgem loads",
            "ldr r0, [sp, #52]",
            "add sp, #60",
            "pop {{r6, r7, r9}}",
            pairs = const PAIRS,
            row = const size_of::<Row<WRITTEN_OUT>>(),
            moments = const core::mem::offset_of!(Row<WRITTEN_OUT>, moments),
            tare = const core::mem::offset_of!(Row<WRITTEN_OUT>, tare),
            nets = const core::mem::offset_of!(Row<WRITTEN_OUT>, nets),
            boost = const core::mem::offset_of!(Row<WRITTEN_OUT>, boost),
            largest = const core::mem::offset_of!(Row<WRITTEN_OUT>, largest),
            tare_drop = const TARE_BITS - CODE_BITS,
            boost_drop = const BOOST_DROP,
            fine_drop = const TARE_BITS - Curve::FINE_BITS,
            largest_bits = const Curve::LARGEST_BITS,
            inout("r0") codes.as_ptr() => largest,
            inout("r1") rows.as_mut_ptr() => _,
            inout("r2") taxels.as_mut_ptr() => _,
            inout("r3") common => first,
            inout("r4") total.first => second, inout("r5") second => running,
            out("r8") _, in("r9") codes.as_ptr_range().end,
            inout("r10") total.running => _, inout("r11") total.largest => _, inout("r12") total.peak => peak,
            inout("lr") undriven.as_ptr() => _,
        );
    }
    Total { first, second, running, largest, peak }
}
