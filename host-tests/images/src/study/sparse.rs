//! Variants that the dense pass replaced: a pass that only sums the rows up, and single taxels by rows, where somebody
//! looks at them.
//!
//! The pass takes codes above floors, which a dead taxel falls short of: it then shows as a huge number. What the
//! floors hold back of a row's sums these begin with.

use super::frame::{Bench, Sums, pairs};
use fingertip::shipped::{BANK_COLUMNS, COLUMNS, Config, ROWS};
use lanes::{BOOST_BITS, CODE_BITS, GAIN_BITS};

type Pairs = [u32; BANK_COLUMNS];

/// Fractional bits of the weighted gains.
const MOMENT_BITS: u32 = 11;
/// Bits by which a total is coarser than a row's sum or moment.
const COARSER: u32 = 32 - BOOST_BITS;

/// Weights, what the two sums begin with, and the boost that the pass finds.
#[repr(C)]
#[derive(Clone, Copy)]
struct Row {
    weights: [Pairs; 2],
    start: [i32; 2],
    boost: i32,
}

/// Floors of the columns, what the sag begins with, the sag for a code.
#[repr(C)]
struct Common {
    floors: Pairs,
    start: i32,
    sag: u32,
}

/// The rows, and their taxels as they were last worked out.
pub struct Sparse {
    rows: [Row; ROWS],
    taxels: [[i32; COLUMNS]; ROWS],
}

impl Sparse {
    /// Constants from the gains, plain and weighted.
    pub fn new(gain: &[Pairs; ROWS], weighted: &[Pairs; ROWS], config: &Config) -> Self {
        let dead = lanes::pair(config.dead_codes as i16, config.dead_codes as i16);
        let rows = core::array::from_fn(|row| {
            let weights = [gain[row], weighted[row]];
            let start = weights.map(|weights| weights.into_iter().fold(0, |sum, pair| lanes::dot(pair, dead, sum)));
            Row { weights, start, boost: 0 }
        });
        Self { rows, taxels: [[0; COLUMNS]; ROWS] }
    }
}

/// The sums alone.
pub extern "C" fn sums(bench: &mut Bench) {
    read(bench, 0);
}

/// And the taxels of two rows, as in most frames.
pub extern "C" fn two_rows(bench: &mut Bench) {
    read(bench, 1 | 1 << 5);
}

/// And those of all rows.
pub extern "C" fn all_rows(bench: &mut Bench) {
    read(bench, (1 << ROWS) - 1);
}

/// Sums and flags, and the taxels of some rows, a bit each.
#[inline(always)]
fn read(bench: &mut Bench, mut wanted: u16) {
    let [codes @ .., undriven] = pairs(&bench.frame);
    let (dead_codes, sag_q32) = (bench.config.dead_codes, bench.config.sag_q32);
    let dead = lanes::pair(dead_codes as i16, dead_codes as i16);
    let common = Common {
        floors: undriven.map(|level| level.wrapping_add(dead)),
        start: COLUMNS as i32 * i32::from(dead_codes) * i32::from(sag_q32),
        sag: lanes::pair(sag_q32 as i16, sag_q32 as i16),
    };
    let [first, second, running, largest] = pass(codes, &mut bench.sparse.rows, &common);
    let larger_lane = |pair: u32| (pair & 0xffff).max(pair >> 16);
    let highest = larger_lane(undriven.iter().fold(0, |highest, level| lanes::larger(highest, *level)));
    let (largest, dead) = (larger_lane(largest as u32), u32::from(dead_codes));
    bench.suspect = largest + highest + dead >= u32::from(bench.config.saturated_codes);

    let rounded = |value: i32, bits: u32| (value + (1 << (bits - CODE_BITS - 1))) >> (bits - CODE_BITS);
    let moment_y = 11 * (first >> 2) - 2 * running;
    let Sums { sum, moment_x, moment_y: tare_y, .. } = bench.tare_sums;
    bench.out = Sums {
        sum: rounded(first, GAIN_BITS - COARSER) - rounded(sum, 12),
        moment_x: rounded(second, MOMENT_BITS - COARSER) - rounded(moment_x, 12),
        moment_y: rounded(moment_y, GAIN_BITS - COARSER - 2) - rounded(tare_y, 12),
        peak: (largest + dead) as i32,
    };
    while wanted != 0 {
        let row = wanted.trailing_zeros() as usize % ROWS;
        wanted &= wanted - 1;
        let Row { weights: [gains, _], boost, .. } = &bench.sparse.rows[row];
        taxels_of([&codes[row], undriven], gains, *boost, &bench.tare[row], &mut bench.sparse.taxels[row]);
    }
}

/// A row's taxels in sixteenths.
#[inline(always)]
fn taxels_of(
    [codes, undriven]: [&Pairs; 2],
    gains: &Pairs,
    boost: i32,
    tare: &[i32; COLUMNS],
    out: &mut [i32; COLUMNS],
) {
    let boost = i64::from(boost >> (GAIN_BITS + BOOST_BITS - CODE_BITS - 32));
    let taxel = |net: i16, gain: i16| ((i64::from(i32::from(net) * i32::from(gain)) * boost + (1 << 31)) >> 32) as i32;
    for place in 0..BANK_COLUMNS {
        let net = lanes::sub(codes[place], undriven[place]);
        let gain = gains[place];
        out[place] = taxel(lanes::low(net), lanes::low(gain)) - tare[place];
        out[place + BANK_COLUMNS] = taxel(lanes::high(net), lanes::high(gain)) - tare[place + BANK_COLUMNS];
    }
}

/// Sums up the rows and finds their boosts: sum, moment, running sum and largest code above its floor in each lane.
#[inline(always)]
fn pass(codes: &[Pairs; ROWS], rows: &mut [Row; ROWS], common: &Common) -> [i32; 4] {
    const { assert!(ROWS.is_multiple_of(2)) };
    let (first, second, running, largest);
    // SAFETY: reads the codes, the rows and what is common, writes each row's boost; the types hold their lengths and
    // places, and the codes' end ends the loop, which takes two rows a turn. The stack is as it was at the end, and so
    // are r6 and r7, which an operand cannot be. The flag that it can set (Q) is sticky and read nowhere.
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
    [first, second, running, largest]
}
