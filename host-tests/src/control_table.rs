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
        DYNAMIXEL Protocol 2.0. Numbers are little-endian, signed ones two's complement. One Read of {state_bytes} \
        bytes from {state} fetches the whole state of the loop, all from one frame. A read may take any 1 to {READ_MAX} \
        bytes of the table, and gets 0 where there is no register; a write covers whole registers, and either all of it \
        happens or nothing.\n\n\
        Some registers have a second name elsewhere, for drivers that cannot reach the first: 148 to 166 for those whose \
        addresses end at 255, {picture} to {end} for those that read 255 bytes at most (state, time and all pressures in \
        {together} bytes).\n\n\
        - **access**: R read only, RW, RW-off writable with torque off, S writable with torque off and kept in flash \
        once `save_parameters` was written, S-any the same but writable at any time.\n\
        - **one is**: what a step of the number means, which is also its resolution.\n\n"
    );
    errors(&mut page);
    section(&mut page, "Registers", |register| param(register).is_none());
    section(&mut page, "Parameters", |register| param(register).is_some());
    page
}

fn errors(page: &mut String) {
    page.push_str("## Errors in a status packet\n\n| number | meaning |\n| --- | --- |\n");
    let meanings = [
        (StatusError::Result, "understood, but cannot be carried out just now"),
        (StatusError::Instruction, "no such instruction, or not under this ID"),
        (StatusError::Crc, "the packet arrived damaged"),
        (StatusError::Range, "a value outside its register's range, or a goal after the bus watchdog has tripped"),
        (StatusError::Length, "parameters missing or too many, a part of a register written, a read too long"),
        (
            StatusError::Limit,
            "a value beyond what other registers allow: a goal above force_max_mn, parameters that contradict each other: each says \
            which it must be above or below; to change both, write both in one packet, or first the one that makes room",
        ),
        (StatusError::Access, "no such register, or one that cannot be written, or not while torque is on"),
    ];
    for (error, meaning) in meanings {
        *page += &format!("| {} | {meaning} |\n", error as u8);
    }
    page.push_str("\nBit 7 of the error is the alert: the hardware error status is not zero.\n");
}

fn section(page: &mut String, title: &str, wanted: impl Fn(&Register) -> bool) {
    *page += &format!(
        "\n## {title}\n\n| address | name | type | access | one is | range | default | meaning |\n\
        | --- | --- | --- | --- | --- | --- | --- | --- |\n"
    );
    for register in REGISTERS.iter().filter(|register| wanted(register)) {
        let default = register.default.map_or(String::new(), |value| value.to_string());
        *page += &format!(
            "| {} | {} | {} | {} | {} | {} to {} | {default} | {} |\n",
            register.address,
            register.name.to_lowercase(),
            kind(register),
            access(register.access),
            step(register),
            register.min,
            register.max,
            register.doc.trim(),
        );
    }
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
