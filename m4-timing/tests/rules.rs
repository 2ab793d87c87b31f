//! The timing rules: sequences whose cost the tables of Arm's Technical Reference Manual state, and what the meter
//! makes of them. These are checks of consistency; `cargo xtask timing --check` compares with measurements.

use Step::{Do, Goto, Touch};
use m4_timing::core::{Flash, Touched};
use m4_timing::decode::{Unknown, decode, is_wide};
use m4_timing::instruction::CoreSet;
use m4_timing::meter::{Meter, MeterError, Registers, Site, summaries};

const BEGIN: [u16; 2] = [0xf3af, 0x8040];
const END: [u16; 2] = [0xf3af, 0x8041];
/// RAM, where the flash adds nothing.
const RAM: u32 = 0x2000_0000;

/// Register values, and the program status.
#[derive(Clone, Copy, Default)]
struct Guest {
    core: [u32; 15],
    xpsr: u32,
}

impl Registers for Guest {
    fn core(&mut self, number: u8) -> u32 {
        self.core[usize::from(number)]
    }

    fn xpsr(&mut self) -> u32 {
        self.xpsr
    }
}

fn site(address: u32, halfwords: &[u16]) -> Site {
    let bytes: Vec<u8> = halfwords.iter().flat_map(|halfword| halfword.to_le_bytes()).collect();
    Site { address, code: decode(&bytes) }
}

/// Step of a test: an instruction behind the last one, or elsewhere; or a memory access of the last one.
#[derive(Clone, Copy)]
enum Step<'a> {
    Do(&'a [u16]),
    Goto(u32),
    Touch(u32, u32),
}

/// Executes steps in a region of their own: low, estimate and high cycles.
fn run(mut guest: Guest, steps: &[Step]) -> Result<[u64; 3], MeterError> {
    let mut meter = Meter::default();
    let mut address = RAM;
    meter.execute(&site(address, &BEGIN), &mut guest)?;
    address += 4;
    for step in steps {
        match *step {
            Do(code) => {
                meter.execute(&site(address, code), &mut guest)?;
                address += if is_wide(code[0]) { 4 } else { 2 };
            }
            Goto(place) => address = place,
            Touch(place, bytes) => meter.access(Touched { address: place, bytes }, false),
        }
    }
    meter.execute(&site(address, &END), &mut guest)?;
    let [_, low, estimate, high, flash] = summaries(&meter.finish()?[&guest.core[0]]).map(|summary| summary.total);
    assert_eq!(flash, estimate, "RAM has no wait states");
    Ok([low, estimate, high])
}

fn estimate(steps: &[Step]) -> u64 {
    run(Guest::default(), steps).expect("measured")[1]
}

const NOP: Step = Do(&[0xbf00]);
const NOP_W: Step = Do(&[0xf3af, 0x8000]);
/// ldr r1, [r0]; ldr r2, [r1]; ldr r2, [r0]; str r1, [r0]; str r1, [r0, r3].
const LDR_R1_R0: Step = Do(&[0x6801]);
const LDR_R2_R1: Step = Do(&[0x680a]);
const LDR_R2_R0: Step = Do(&[0x6802]);
const STR_R1_R0: Step = Do(&[0x6001]);
const STR_R1_R0_R3: Step = Do(&[0x50c1]);
/// vadd.f32 s0, s1, s2; vadd.f32 s3, s0, s1; vmla.f32 s0, s1, s2; vdiv.f32 s0, s1, s2.
const VADD: Step = Do(&[0xee30, 0x0a81]);
const VADD_AFTER: Step = Do(&[0xee70, 0x1a20]);
const VMLA: Step = Do(&[0xee00, 0x0a81]);
const VDIV: Step = Do(&[0xee80, 0x0a81]);

#[test]
fn arithmetic_takes_a_cycle_an_instruction_a_store_too_and_two_with_a_register_for_offset() {
    // adds r0, r0, r1; muls r0, r1; mla r0, r1, r2, r3; smlad r0, r1, r2, r3; ssat r0, #16, r1.
    let steps = [Do(&[0x1840]), Do(&[0x4348]), Do(&[0xfb01, 0x3002]), Do(&[0xfb21, 0x3002]), Do(&[0xf301, 0x000f])];
    assert_eq!(run(Guest::default(), &steps), Ok([5, 5, 5]));
    assert_eq!([estimate(&[STR_R1_R0]), estimate(&[STR_R1_R0_R3])], [1, 2]);
}

#[test]
fn loads_overlap_unless_one_makes_the_address_of_the_next() {
    assert_eq!(estimate(&[LDR_R1_R0]), 2);
    assert_eq!(estimate(&[LDR_R1_R0, LDR_R2_R0, LDR_R2_R0]), 4);
    assert_eq!(estimate(&[LDR_R1_R0, LDR_R2_R1]), 4);
    assert_eq!(estimate(&[LDR_R1_R0, NOP, LDR_R2_R1]), 5);
}

#[test]
fn many_words_take_one_more_than_their_number() {
    // push {r4-r7}; pop {r4-r7}; ldrd r0, r1, [r2]; vldmia r0, {s0-s3}.
    let of = [&[0xb4f0][..], &[0xbcf0], &[0xe9d2, 0x0100], &[0xec90, 0x0a04]];
    assert_eq!(of.map(|code| estimate(&[Do(code)])), [5, 5, 3, 5]);
}

#[test]
fn an_address_just_computed_and_an_unaligned_one_come_late() {
    // adds r0, #4, then a load from r0.
    assert_eq!(estimate(&[Do(&[0x3004]), LDR_R1_R0]), 4);
    assert_eq!(estimate(&[Do(&[0x3004]), NOP, LDR_R1_R0]), 4);
    let unaligned = |offset, bytes| estimate(&[LDR_R1_R0, Touch(RAM + offset, bytes)]);
    assert_eq!([unaligned(0, 4), unaligned(2, 4), unaligned(1, 4), unaligned(1, 2), unaligned(3, 1)], [2, 3, 4, 3, 2]);
}

#[test]
fn branches_refill_the_pipeline() {
    let far = RAM + 0x100;
    // b; beq; beq.w; bx r1; pop {pc}; to an instruction of 16 bits.
    let taken = |code| run(Guest::default(), &[Do(code), Goto(far), NOP]).expect("measured").map(|cycles| cycles - 1);
    assert_eq!(taken(&[0xe07e]), [2, 2, 4]);
    assert_eq!(taken(&[0xd07e]), [2, 2, 4]);
    assert_eq!(taken(&[0xf000, 0x807e]), [2, 3, 4]);
    assert_eq!(taken(&[0x4708]), [2, 3, 4]);
    assert_eq!(taken(&[0xbd00]), [3, 5, 5]);
    // Not taken.
    assert_eq!(run(Guest::default(), &[Do(&[0xd07e]), NOP]), Ok([2, 2, 3]));
    // To an instruction of 32 bits, on a word and across two.
    assert_eq!(estimate(&[Do(&[0xe07e]), Goto(far), NOP_W]), 3);
    assert_eq!(estimate(&[Do(&[0xe07e]), Goto(far + 2), NOP_W]), 4);
}

#[test]
fn divisions_end_early() {
    // udiv r0, r1, r2; sdiv r0, r1, r2.
    let cycles = |code: &[u16], r1: i32, r2: i32| {
        let mut guest = Guest::default();
        (guest.core[1], guest.core[2]) = (r1 as u32, r2 as u32);
        run(guest, &[Do(code)]).expect("measured")
    };
    let unsigned = |r1, r2| cycles(&[0xfbb1, 0xf0f2], r1, r2);
    let signed = |r1, r2| cycles(&[0xfb91, 0xf0f2], r1, r2);
    assert_eq!(unsigned(5, 7), [2, 2, 12]);
    assert_eq!(unsigned(-1, 1), [2, 12, 12]);
    assert_eq!(unsigned(5, 0), [2, 2, 12]);
    assert_eq!(signed(-1000, 10)[1], 5);
    assert_eq!(signed(i32::MIN, -1)[1], 12);
}

#[test]
fn the_fpu_takes_its_time() {
    assert_eq!(estimate(&[VADD]), 1);
    assert_eq!(estimate(&[VADD, VADD_AFTER]), 3);
    assert_eq!(estimate(&[VADD, NOP, VADD_AFTER]), 3);
    assert_eq!(estimate(&[VMLA]), 3);
    // A division's 14 cycles, in which integer instructions go on; then the addition.
    assert_eq!(estimate(&[VDIV, VADD_AFTER]), 15);
    assert_eq!(estimate(&[VDIV, NOP, NOP, NOP, VADD_AFTER]), 15);
    // The end of a region waits for it.
    assert_eq!(run(Guest::default(), &[VDIV, NOP, NOP, NOP]), Ok([14, 14, 17]));
    assert_eq!(estimate(&[VDIV, VDIV, VADD_AFTER]), 29);
    // vmov s0, r0; vldr s0, [r0].
    assert_eq!(estimate(&[Do(&[0xee00, 0x0a10])]), 2);
    assert_eq!(estimate(&[Do(&[0xed90, 0x0a00])]), 2);
}

#[test]
fn what_a_condition_skips_takes_a_cycle() {
    // ite eq; ldr r1, [r0]; pop {r1, r2}.
    let steps = [NOP, Do(&[0xbf0c]), LDR_R1_R0, Do(&[0xbc06])];
    let with = |xpsr| run(Guest { xpsr, ..Guest::default() }, &steps).expect("measured")[1];
    // IT folds into the instruction of 16 bits before it.
    assert_eq!(with(1 << 30), 1 + 2 + 1);
    assert_eq!(with(0), 1 + 1 + 3);
    // Behind one of 32 bits it does not.
    assert_eq!(estimate(&[NOP_W, Do(&[0xbf08]), NOP]), 3);
}

#[test]
fn what_cannot_be_measured_is_refused() {
    let refused = |steps: &[Step]| run(Guest::default(), steps).expect_err("refused");
    assert!(matches!(refused(&[Do(&[0xee31, 0x0b02])]), MeterError::Unknown(..)));
    assert!(matches!(refused(&[Do(&[0xbe00])]), MeterError::Untimed(_)));
    assert!(matches!(refused(&[Do(&BEGIN)]), MeterError::Nested(_)));
    assert!(matches!(refused(&[Do(&END)]), MeterError::NotBegun(_)));
    assert!(matches!(refused(&[NOP, Goto(RAM + 64), NOP]), MeterError::Interrupted { .. }));

    let mut meter = Meter::default();
    let mut guest = Guest::default();
    guest.core[0] = 7;
    assert_eq!(meter.execute(&site(RAM, &BEGIN), &mut guest), Ok(()));
    assert_eq!(meter.finish().expect_err("not ended"), MeterError::NotEnded(7));
    assert_eq!(MeterError::Untimed(16).to_string(), "the instruction at 0x00000010 waits, traps or calls the debugger");
}

/// Instructions of 32 bits in straight code, a cycle each.
fn straight(flash: &mut Flash, from: u32, to: u32) -> u64 {
    let start = flash.now();
    for address in (from..to).step_by(4) {
        flash.fetch(address, 4);
        flash.pass(1);
    }
    flash.now() - start
}

#[test]
fn warm_loops_are_free_and_long_straight_code_is_bound_by_the_flash() {
    let flash_start = 0x0800_0000;
    let mut flash = Flash::default();
    // Cold: five wait states, then a line every six cycles.
    assert_eq!(straight(&mut flash, flash_start, flash_start + 64), 5 + 3 * 6 + 4);
    assert_eq!(straight(&mut flash, flash_start, flash_start + 64), 16);
    // 128 lines do not fit 64.
    let mut flash = Flash::default();
    straight(&mut flash, flash_start, flash_start + 2048);
    let again = straight(&mut flash, flash_start, flash_start + 2048);
    assert!((127 * 6..=129 * 6).contains(&again), "{again}");
    assert_eq!(straight(&mut flash, RAM, RAM + 2048), 512);
}

#[test]
fn eight_lines_of_data_are_cached() {
    let mut flash = Flash::default();
    let mut read = |line: u32| {
        let start = flash.now();
        flash.read(0x0800_4000 + 16 * line);
        flash.pass(6);
        flash.now() - start - 6
    };
    let costs = [0..8, 0..8].map(|lines| lines.map(&mut read).sum::<u64>());
    assert_eq!(costs, [8 * 5, 0]);
    // The ninth takes the place of the oldest.
    assert_eq!([read(8), read(7), read(0)], [5, 0, 5]);
}

/// Names of the core registers in a set.
fn registers(set: CoreSet) -> String {
    let name = |register: u32| match register {
        13 => "sp".into(),
        14 => "lr".into(),
        15 => "pc".into(),
        number => format!("r{number}"),
    };
    (0..16).filter(|register| set >> register & 1 != 0).map(name).collect::<Vec<_>>().join(" ")
}

#[test]
fn the_decoder_agrees_with_the_disassembler() {
    let lines: Vec<_> = include_str!("corpus.txt").lines().filter(|line| !line.starts_with('#')).collect();
    assert!(lines.len() > 600, "{}", lines.len());
    for line in lines {
        let bytes: Vec<_> = line[..12].split_whitespace().map(|byte| u8::from_str_radix(byte, 16).unwrap()).collect();
        let instruction = decode(&bytes).unwrap_or_else(|error| panic!("{line}: {error}"));
        assert_eq!(instruction.size() as usize, bytes.len(), "{line}");
        let mut columns = line.split('|').skip(1).map(|column| column.trim().to_owned());
        let expected = [(); 3].map(|()| columns.next().unwrap_or_default());
        let decoded =
            [format!("{:?}", instruction.kind), registers(instruction.writes), registers(instruction.address)];
        assert_eq!(decoded, expected, "{line}");
    }
}

#[test]
fn what_this_core_does_not_have_is_refused() {
    let refused: [&[u8]; 14] = [
        // Half an instruction, and nothing.
        &[0x00, 0xf0],
        &[],
        // vadd.f64, vmov.f64 with an immediate, vrintz.f32, vmaxnm.f32.
        &[0x31, 0xee, 0x02, 0x0b],
        &[0xb7, 0xee, 0x00, 0x0b],
        &[0xb6, 0xee, 0xc0, 0x0a],
        &[0x80, 0xfe, 0x00, 0x0a],
        // NEON: vadd.i32; a coprocessor: mcr; crc32b; blx to Arm code.
        &[0x20, 0xef, 0x00, 0x08],
        &[0x07, 0xee, 0x15, 0x0f],
        &[0xc0, 0xfa, 0x81, 0xf0],
        &[0x00, 0xf0, 0x00, 0xc0],
        // ldrexd, strexd; setend; a hint that nobody defined.
        &[0xd1, 0xe8, 0x7f, 0x01],
        &[0xc2, 0xe8, 0x70, 0x01],
        &[0x50, 0xb6],
        &[0xaf, 0xf3, 0x42, 0x80],
    ];
    for bytes in refused {
        assert!(decode(bytes).is_err(), "{bytes:02x?}");
    }
    assert_eq!(Unknown { first: 0xeeb6, second: Some(0x0ac0) }.to_string(), "eeb6 0ac0");
}
