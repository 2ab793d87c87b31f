//! Renders the control table's definition as `docs/control-table.md`.

use fingertip::link::packet::StatusError;
use fingertip::link::table::{Access, Kind, READ_MAX, Register};
use fingertip::params::Params;
use fingertip::shipped::{REGISTERS, TAXELS, address};
use output::units;

/// Command that renews this page.
pub const COMMAND: &str = "cargo xtask docs";

/// The page.
pub fn markdown() -> String {
    let mut page = String::new();
    let state = address::PRESENT_MODE;
    let state_bytes = address::FRAME_PERIOD_NS + 4 - state;
    let (picture, end) = (address::PICTURE_TIME_US, address::RAW_CODES.min(address::PRESSURES + 2 * TAXELS as u16) - 1);
    let together = end + 1 - picture;
    page += &format!(
        "# Control table\n\n\
        Generated from `src/link/table/registers.rs` and `src/params.rs` by `{COMMAND}`: do not edit.\n\n\
        DYNAMIXEL Protocol 2.0; numbers are little-endian, signed ones two's complement. One read of {state_bytes} \
        bytes from {state} gets the whole state of the loop, all from one frame. A read takes 1 to {READ_MAX} bytes; \
        gaps read 0. A write covers whole registers, and is done or refused as a whole.\n\n\
        **Access**: R read only; RW; RW-off writable with torque off; S writable with torque off, and kept in flash \
        after `save_parameters`; S-any the same, but writable at any time. A number is in the unit at the end of its \
        name, unless its row names a step.\n\n"
    );
    errors(&mut page);
    section(&mut page, "Registers", |register| param(register).is_none() && second_name_of(register).is_none());
    page.push_str("\n## Second names\n\nThey serve drivers that cannot reach the first address. Brackets have the first name.\n\n");
    let reads = format!(
        "{picture} to {end}, for reads of at most 255 bytes (state, time and all pressures in {together} bytes)"
    );
    for (title, addresses) in [
        ("124 to 132, as in an X-series servo", 0..148),
        ("148 to 166, for addresses up to 255", 148..256),
        (reads.as_str(), 256..u16::MAX),
    ] {
        let inside = REGISTERS.iter().filter(|register| addresses.contains(&register.address));
        let names = inside.filter_map(|register| {
            let first = second_name_of(register)?;
            Some(format!("{} `{}` (`{first}`)", register.address, register.name.to_lowercase()))
        });
        page += &format!("- {title}: {}\n", names.collect::<Vec<_>>().join(", "));
    }
    parameters(&mut page);
    page
}

/// Name of the register of which this is a second name.
fn second_name_of(register: &Register) -> Option<&'static str> {
    register.doc.trim().strip_prefix("The same as ").map(|name| name.trim_end_matches('.'))
}

fn errors(page: &mut String) {
    page.push_str("## Errors in a status packet\n\n| number | meaning |\n| --- | --- |\n");
    let meanings = [
        (StatusError::Result, "understood, but not possible now"),
        (StatusError::Instruction, "no such instruction, or not under this ID"),
        (StatusError::Crc, "the packet arrived damaged"),
        (StatusError::Range, "a value outside its register's range, or a goal after the bus watchdog has tripped"),
        (StatusError::Length, "wrong number of parameters, a part of a register written, a read too long"),
        (
            StatusError::Limit,
            "a value that other registers do not allow: a goal above force_max_mn, or contradicting parameters; write \
            both in one packet, or first the one that makes room",
        ),
        (StatusError::Access, "no such register, or not writable, or not while torque is on"),
    ];
    for (error, meaning) in meanings {
        *page += &format!("| {} | {meaning} |\n", error as u8);
    }
    page.push_str("\nBit 7 of the error is the alert: the hardware error status is not zero.\n");
}

fn section(page: &mut String, title: &str, wanted: impl Fn(&Register) -> bool) {
    *page += &format!(
        "\n## {title}\n\n| address | name | type | access | range (default) | meaning |\n\
        | --- | --- | --- | --- | --- | --- |\n"
    );
    for register in REGISTERS.iter().filter(|register| wanted(register)) {
        // The registers of a block share their documentation.
        let first =
            REGISTERS.iter().find(|other| other.doc == register.doc).filter(|other| other.name != register.name);
        let meaning = match first {
            Some(first) => format!("As {}.", first.name.to_lowercase()),
            None => format!("{}{}", register.doc.trim(), unusual_step(register)),
        };
        let default = register.default.map(|value| format!("({value})"));
        let range = [Some(range(register)), default].into_iter().flatten().collect::<Vec<_>>().join(" ");
        *page += &format!(
            "| {} | {} | {} | {} | {} | {meaning} |\n",
            register.address,
            register.name.to_lowercase(),
            kind(register),
            access(register.access),
            range.trim(),
        );
    }
}

fn parameters(page: &mut String) {
    page.push_str(
        "\n## Parameters\n\nEach is an i32 with access S.\n\n\
        | address | name | range (default) | meaning |\n| --- | --- | --- | --- |\n",
    );
    for register in REGISTERS.iter().filter(|register| param(register).is_some()) {
        let Register { address, name, min, max, default, doc, .. } = register;
        let (default, doc) = (default.unwrap_or_default(), doc.trim());
        *page += &format!("| {address} | {name} | {min} to {max} ({default}) | {doc} |\n");
    }
}

/// Range, unless it is that of the type, or of a count that is only read.
fn range(register: &Register) -> String {
    let Register { min, max, kind, .. } = *register;
    let whole = match kind {
        Kind::U8 => [0, u8::MAX.into()],
        Kind::I8 => [i8::MIN.into(), i8::MAX.into()],
        Kind::U16 => [0, u16::MAX.into()],
        Kind::I16 => [i16::MIN.into(), i16::MAX.into()],
        Kind::U32 => [0, u32::MAX.into()],
        Kind::I32 => [i32::MIN.into(), i32::MAX.into()],
    };
    let counts = register.access == Access::ReadOnly && min == 0;
    if counts || [min, max] == whole { String::new() } else { format!("{min} to {max}") }
}

/// Step of the number, if the register's name does not end with it.
fn unusual_step(register: &Register) -> String {
    let (step, name) = (step(register), register.name.to_lowercase());
    let named = units::of(&name).map_or("1".into(), |unit| units::step(&unit));
    if step == named || step == "1" { String::new() } else { format!(" Step: {step}.") }
}

fn param(register: &Register) -> Option<usize> {
    let place = usize::from(register.address.checked_sub(address::PARAMS)?) / 4;
    (place < Params::COUNT).then_some(place)
}

fn kind(register: &Register) -> String {
    let name = match register.kind {
        Kind::U8 => "u8",
        Kind::I8 => "i8",
        Kind::U16 => "u16",
        Kind::I16 => "i16",
        Kind::U32 => "u32",
        Kind::I32 => "i32",
    };
    if register.count == 1 { name.into() } else { format!("{name} x {}", register.count) }
}

fn access(access: Access) -> &'static str {
    match access {
        Access::ReadOnly => "R",
        Access::ReadWrite => "RW",
        Access::TorqueOff => "RW-off",
        Access::Stored => "S",
        Access::StoredLive => "S-any",
    }
}

/// Unit of a step of the number: from the definition, for a parameter from its name.
pub fn step(register: &Register) -> String {
    if param(register).is_some() {
        return units::of(register.name).map_or("1".into(), |unit| units::step(&unit));
    }
    match (register.unit, register.scale) {
        ("", _) => "1".into(),
        (unit, 1) if unit.starts_with("1/") => unit.into(),
        (unit, scale) => format!("{scale} {unit}"),
    }
}
