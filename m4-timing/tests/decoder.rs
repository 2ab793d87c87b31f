//! The decoder against a fixed corpus of encodings, whose text is that of LLVM's disassembler.

use m4_timing::decode::{Unknown, decode};
use m4_timing::instruction::CoreSet;

const CORPUS: &str = include_str!("corpus.txt");

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
    let lines: Vec<_> = CORPUS.lines().filter(|line| !line.starts_with('#')).collect();
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
