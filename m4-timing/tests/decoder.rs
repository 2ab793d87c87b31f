//! The decoder against LLVM's disassembler: a fixed corpus of encodings, classified by their text and by the decoder.

use m4_timing::decode::{Unknown, decode};
use m4_timing::instruction::{CoreSet, Instruction, Kind, PC, bit};

const CORPUS: &str = include_str!("corpus.txt");

/// An encoding, its mnemonic without condition and width, and its operands.
struct Line {
    bytes: Vec<u8>,
    mnemonic: String,
    operands: String,
}

fn corpus() -> Vec<Line> {
    CORPUS.lines().filter(|line| !line.starts_with('#')).map(parse).collect()
}

fn parse(line: &str) -> Line {
    let (bytes, text) = line.split_at(12);
    let (mnemonic, operands) = text.trim().split_once(' ').unwrap_or((text.trim(), ""));
    Line {
        bytes: bytes.split_whitespace().map(|byte| u8::from_str_radix(byte, 16).expect("hexadecimal")).collect(),
        mnemonic: mnemonic.trim_end_matches(".w").into(),
        operands: operands.into(),
    }
}

fn core_register(text: &str) -> Option<CoreSet> {
    let number = match text.trim_matches(|letter: char| !letter.is_alphanumeric()) {
        "sp" => 13,
        "lr" => 14,
        "pc" => 15,
        name => name.strip_prefix('r')?.parse().ok()?,
    };
    Some(bit(number))
}

/// Number of words that a list in braces names.
fn words(operands: &str) -> u8 {
    let list = operands.split_once('{').expect("a list").1;
    let words = list.split(',').map(|name| if name.trim().starts_with('d') { 2 } else { 1 });
    words.sum()
}

/// The class by the text alone. The manual's names of the instructions, not their encodings.
fn class(line: &Line) -> Kind {
    let Line { mnemonic, operands, .. } = line;
    let name = mnemonic.as_str();
    let first = operands.split(',').next().unwrap_or_default();
    let to_pc = first == "pc" || operands.contains("pc}");
    let starts = |names: &[&str]| names.iter().any(|start| name.starts_with(start));
    let indexed = operands.split_once('[').is_some_and(|(_, inner)| {
        inner
            .split_once(']')
            .unwrap_or((inner, ""))
            .0
            .split(',')
            .nth(1)
            .is_some_and(|part| core_register(part).is_some())
    });
    match name {
        _ if starts(&["vldm", "vpop"]) => Kind::FloatLoadMany(words(operands)),
        _ if starts(&["vstm", "vpush"]) => Kind::FloatStoreMany(words(operands)),
        _ if starts(&["vldr"]) && first.starts_with('d') => Kind::FloatLoadMany(2),
        _ if starts(&["vstr"]) && first.starts_with('d') => Kind::FloatStoreMany(2),
        _ if starts(&["vldr"]) => Kind::FloatLoad,
        _ if starts(&["vstr"]) => Kind::FloatStore,
        _ if starts(&["vdiv", "vsqrt"]) => Kind::FloatDivide,
        _ if starts(&["vmla", "vmls", "vnmla", "vnmls", "vfma", "vfms", "vfnma", "vfnms"]) => Kind::FloatAccumulate,
        _ if starts(&["vmov"]) => {
            // Once for each core register that it names.
            match operands.split(", ").filter(|part| core_register(part).is_some()).count() {
                0 => Kind::Float,
                count => Kind::FloatMove(count as u8),
            }
        }
        _ if starts(&["v"]) => Kind::Float,
        _ if starts(&["it"]) => Kind::IfThen { state: line.bytes[0] },
        _ if starts(&["cbz", "cbnz"]) => Kind::Branch { conditional: true },
        "b" | "bl" => Kind::Branch { conditional: false },
        "bx" | "blx" => Kind::Jump,
        "add" | "mov" if to_pc => Kind::Jump,
        _ if starts(&["bkpt"]) => Kind::Untimed,
        _ if name.starts_with('b') && operands.contains("place") => Kind::Branch { conditional: true },
        "tbb" | "tbh" => Kind::Table,
        _ if starts(&["ldrd"]) => Kind::LoadMany(2),
        _ if starts(&["strd"]) => Kind::StoreMany(2),
        _ if starts(&["ldm", "pop"]) && operands.contains('{') => Kind::LoadMany(words(operands)),
        _ if starts(&["stm", "push"]) => Kind::StoreMany(words(operands)),
        _ if starts(&["ldr"]) && to_pc => Kind::LoadPc,
        _ if starts(&["ldr"]) => Kind::Load,
        _ if starts(&["strex"]) || starts(&["str"]) && indexed => Kind::StoreIndexed,
        _ if starts(&["str"]) => Kind::Store,
        "sdiv" | "udiv" | "udivlt" => {
            let number = |place| core_register(operands.split(", ").nth(place).expect("operands")).expect("a register");
            Kind::Divide {
                signed: name == "sdiv",
                numerator: number(1).trailing_zeros() as u8,
                denominator: number(2).trailing_zeros() as u8,
            }
        }
        _ if starts(&["mul", "mla", "mls", "smul", "smla", "smls", "smml", "smmul", "smu", "umull", "umlal"]) => {
            Kind::Multiply
        }
        _ if starts(&["umaal", "usad"]) => Kind::Multiply,
        _ if starts(&["mrs", "msr", "cps"]) => Kind::Special,
        "dmb" | "dsb" | "isb" => Kind::Barrier,
        _ if starts(&["hint"]) => match operands.as_str() {
            "#64" => Kind::Begin,
            "#65" => Kind::End,
            _ => Kind::Alu,
        },
        _ if starts(&["svc", "udf", "wf", "trap"]) || name == "sev" || name == "sevlo" => Kind::Untimed,
        _ => Kind::Alu,
    }
}

#[test]
fn the_decoder_agrees_with_the_disassembler() {
    let corpus = corpus();
    assert!(corpus.len() > 600, "{}", corpus.len());
    for line in corpus {
        let Line { bytes, mnemonic, operands } = &line;
        let shown = format!("{bytes:02x?} {mnemonic} {operands}");
        let instruction = decode(bytes).unwrap_or_else(|error| panic!("{shown}: {error}"));
        assert_eq!(instruction.kind, class(&line), "{shown}");
        assert_eq!(instruction.size() as usize, bytes.len(), "{shown}");
        check_registers(&instruction, mnemonic, operands, &shown);
    }
}

/// The destination is the first operand; the address is what the brackets name.
fn check_registers(instruction: &Instruction, mnemonic: &str, operands: &str, shown: &str) {
    let first = operands.split(", ").next().and_then(core_register);
    let compares = ["cmp", "cmn", "tst", "teq", "pld", "pli", "msr"].iter().any(|start| mnemonic.starts_with(start));
    let literal = operands.contains("[pc");
    match instruction.kind {
        Kind::Alu | Kind::Multiply | Kind::Divide { .. } | Kind::Load | Kind::LoadPc if !compares => {
            let first = first.unwrap_or(0);
            assert_eq!(instruction.writes & first, first, "{shown}");
            if instruction.kind == Kind::Alu {
                assert_eq!(instruction.writes, first, "{shown}");
            }
        }
        Kind::Jump | Kind::Table | Kind::Branch { .. } => assert!(instruction.branches(), "{shown}"),
        Kind::FloatMove(_) => {
            let written: CoreSet = operands
                .split(", ")
                .take_while(|part| core_register(part).is_some())
                .filter_map(core_register)
                .fold(0, |set, register| set | register);
            assert_eq!(instruction.writes, written, "{shown}");
        }
        _ => {}
    }
    if instruction.accesses_memory() && operands.contains('[') && !literal {
        let inner = operands.split_once('[').map_or("", |(_, rest)| rest.split(']').next().unwrap_or_default());
        let address = inner.split(',').filter_map(core_register).fold(0, |set, register| set | register);
        assert_eq!(instruction.address, address, "{shown}");
        let back = operands.ends_with('!') || operands.split_once(']').is_some_and(|(_, after)| after.contains('#'));
        let base = inner.split(',').next().and_then(core_register).unwrap_or(0);
        assert!(!back || instruction.writes & base != 0, "{shown}");
    }
    if mnemonic.starts_with("pop") && operands.contains("pc") {
        assert!(instruction.writes & bit(PC) != 0, "{shown}");
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
