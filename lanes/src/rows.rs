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
        for (((code, floor), first_weight), second_weight) in codes.iter().zip(&common.floors).zip(firsts).zip(seconds)
        {
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
    const { assert!(ROWS > 0 && ROWS.is_multiple_of(2)) };
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

#[cfg(test)]
mod tests {
    use super::{BOOST_BITS, Common, Row, boost, pass};

    const ONE: f64 = (1_u64 << 32) as f64;

    #[test]
    fn the_boost_takes_the_sag_out() {
        let (mut ends, mut usual) = (0.0_f64, 0.0_f64);
        for x in (-1_370_000_000..=1_370_000_000).step_by(100_003) {
            let exact = f64::from(1 << BOOST_BITS) / (1.0 - f64::from(x) / ONE);
            let error = (f64::from(boost(x)) - exact).abs() / exact;
            ends = ends.max(error);
            if x.abs() < 300_000_000 {
                usual = usual.max(error);
            }
        }
        let unit = 1.0 / f64::from(1 << BOOST_BITS);
        assert!(ends < 1.2 / 1_048_576.0 && ends > 0.8 / 1_048_576.0, "{ends:e}");
        assert!(usual < 4.0 * unit && usual > unit, "{usual:e}");
    }

    #[test]
    fn a_pass_is_what_its_parts_say() {
        let codes = [[0x0102_0304, 5, 6 << 16, 0x0fff_0fff, 9], [0x0001_0002, 0, 0, 0, 0x0100_0001]];
        let common = Common { floors: [1, 2, 1 << 16, 0x0ffe_0ffe, 3], start: 7_000, sag: 3 | 3 << 16 };
        let weights = [[2 | 1 << 16; 5], [0xffff, 3, 0, 0, 5]];
        let mut rows = [Row { weights, start: [1 << 20, 4], boost: 0 }; 2];
        let total = pass(&codes, &mut rows, &common);
        let lanes = |pair: u32| [i64::from(pair as u16 as i16), i64::from((pair >> 16) as u16 as i16)];
        let (mut first_total, mut second_total, mut running) = (0, 0, 0);
        for (codes, row) in codes.iter().zip(&rows) {
            let [mut sag, mut first, mut second] = [7_000, 1 << 20, 4];
            for place in 0..5 {
                for lane in 0..2 {
                    let above = lanes(codes[place])[lane] - lanes(common.floors[place])[lane];
                    sag += 3 * above;
                    first += above * lanes(weights[0][place])[lane];
                    second += above * lanes(weights[1][place])[lane];
                }
            }
            assert_eq!(row.boost, boost(sag as i32));
            first_total += (first * i64::from(row.boost)) >> 32;
            second_total += (second * i64::from(row.boost)) >> 32;
            running += first_total >> 2;
        }
        assert_eq!([total.first, total.second, total.running].map(i64::from), [first_total, second_total, running]);
        // The second row's codes below their floors are huge.
        assert_eq!(total.largest, 0xffff_fffe, "{:x}", total.largest);
    }
}
