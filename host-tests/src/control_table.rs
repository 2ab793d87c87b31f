//! Renders the control table's definition as `docs/control-table.md`.

use fingertip::link::packet::StatusError;
use fingertip::link::table::{Access, Kind, READ_MAX, Register, indirect};
use fingertip::params::Params;
use fingertip::shipped::{COLUMNS, REGISTERS, TAXELS, address};
use output::units;

const COMMAND: &str = "cargo xtask docs";

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
        gaps read 0. A write covers whole registers, and is done or refused as a whole: write a stop alone.\n\n\
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
        (
            StatusError::Range,
            "a value outside its register's range, or a goal above 0 after the bus watchdog has tripped",
        ),
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
        let (address, name, range) = (register.address, register.name.to_lowercase(), range.trim());
        let (kind, access) = (kind(register), access(register.access));
        *page += &format!("| {address} | {name} | {kind} | {access} | {range} | {meaning} |\n");
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
    let bits = 8 * kind.width();
    let whole = if is_signed(kind) { [-1 << (bits - 1), (1 << (bits - 1)) - 1] } else { [0, (1 << bits) - 1] };
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
    let name = format!("{:?}", register.kind).to_lowercase();
    if register.count == 1 { name } else { format!("{name} x {}", register.count) }
}

fn is_signed(kind: Kind) -> bool {
    matches!(kind, Kind::I8 | Kind::I16 | Kind::I32)
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

// Renders the control table as a model file, by which ROBOTIS' `dynamixel_easy_sdk` and
// `dynamixel_hardware_interface` (ROS 2) know a device.
//
// Tab-separated: `[unit info]` with name, factor to the unit, unit, sign and offset; `[control table]` with address,
// bytes and name. Those programs know items of 1, 2 and 4 bytes; so each pressure is an item, and raw codes and zeros,
// which none of them needs, are none.

/// Names that X-series servos have for these addresses: drivers use these names.
const SERVO_NAMES: [(u16, &str); 6] = [
    (address::SHORT_GOAL_MN, "Goal Current"),
    (address::MIRROR_DUTY_PERMILLE, "Present PWM"),
    (address::SHORT_FORCE_MN, "Present Current"),
    (address::MIRROR_SPEED_UM_PER_S, "Present Velocity"),
    (address::MIRROR_TRAVEL_UM, "Present Position"),
    (address::SHORT_SUPPLY_100MV, "Present Input Voltage"),
];
/// The blocks of indirect addresses and data, by the names that drivers ask for.
const INDIRECT: [(u16, u16, &str); 6] = [
    (address::INDIRECT_ADDRESS_1, 2, "Indirect Address 1"),
    (address::INDIRECT_DATA_1, 1, "Indirect Data 1"),
    (address::INDIRECT_ADDRESS_1, 2, "Indirect Address Write"),
    (address::INDIRECT_DATA_1, 1, "Indirect Data Write"),
    (address::INDIRECT_ADDRESS_29, 2, "Indirect Address Read"),
    (address::INDIRECT_DATA_29, 1, "Indirect Data Read"),
];
/// Units of the table, and how they come to those of the file.
const UNITS: [(&str, f64, &str); 9] = [
    ("mN", 1e-3, "N"),
    ("um", 1e-6, "m"),
    ("um/s", 1e-6, "m/s"),
    ("Pa", 1.0, "Pa"),
    ("permille", 1e-3, "ratio"),
    ("mV", 1e-3, "V"),
    ("ms", 1e-3, "s"),
    ("us", 1e-6, "s"),
    ("ns", 1e-9, "s"),
];

/// An item of the file.
#[derive(Clone, Debug, PartialEq)]
pub struct Item {
    /// Address of its first byte.
    pub address: u16,
    /// Number of bytes: 1, 2 or 4.
    pub bytes: u16,
    /// Name by which a driver requests it.
    pub name: String,
    /// Value and unit of one step; `None` for a plain number.
    pub unit: Option<(f64, &'static str)>,
    /// True if it may be below 0.
    pub signed: bool,
}

/// The file. `direct` leaves the indirect reads out: a driver then reads from its least address to its largest, so that
/// it can have all pressures at once.
pub fn text(direct: bool) -> String {
    let items = items();
    let mut text = String::from("[unit info]\nData Name\tvalue\tunit\tSign Type\tOffset\n");
    for item in &items {
        if let Some((factor, unit)) = item.unit {
            let sign = if item.signed { "signed" } else { "unsigned" };
            text += &format!("{}\t{factor}\t{unit}\t{sign}\t0.0\n", item.name);
        }
    }
    text += "\n[control table]\nAddress\tSize\tData Name\n";
    for item in &items {
        text += &format!("{}\t{}\t{}\n", item.address, item.bytes, item.name);
    }
    for (address, bytes, name) in INDIRECT {
        if !(direct && name.ends_with("Read")) {
            text += &format!("{address}\t{bytes}\t{name}\n");
        }
    }
    text
}

/// Every item but the indirect ones, in the order of the addresses.
pub fn items() -> Vec<Item> {
    let mut items = Vec::new();
    for register in REGISTERS.iter().filter(|register| !indirect::begins(register.address)) {
        match register.address {
            address::RAW_CODES | address::TARE_CODES | address::GAINS => {}
            address::PRESSURES => {
                for place in 0..register.count {
                    let (row, column) = (usize::from(place) / COLUMNS + 1, usize::from(place) % COLUMNS + 1);
                    let name = format!("Pressure {row} {column}");
                    items.push(Item { address: register.address + 2 * place, name, ..item(register) });
                }
            }
            _ => items.push(item(register)),
        }
    }
    items
}

fn item(register: &Register) -> Item {
    let servo = SERVO_NAMES.iter().find(|(address, _)| *address == register.address);
    let name = servo.map_or_else(|| titled(register), |(_, name)| (*name).to_owned());
    let unit = UNITS.iter().find(|(unit, ..)| *unit == register.unit);
    Item {
        address: register.address,
        bytes: register.kind.width(),
        name,
        // To 12 digits: 100 steps of a thousandth are a tenth.
        unit: unit.map(|(_, factor, unit)| ((factor * f64::from(register.scale) * 1e12).round() / 1e12, *unit)),
        signed: is_signed(register.kind),
    }
}

/// `PRESENT_FORCE_MN` as `Present Force`: the unit is in the unit info. A parameter keeps it, for it is not there.
fn titled(register: &Register) -> String {
    let name = register.name.to_lowercase();
    let unit = UNITS.iter().find(|(unit, ..)| *unit == register.unit).map(|(unit, ..)| *unit);
    let ending = unit.map(|unit| format!("_{}", unit.to_lowercase().replace('/', "_per_"))).unwrap_or_default();
    let words = name.strip_suffix(&ending).unwrap_or(&name).split('_');
    words.map(capitalised).collect::<Vec<_>>().join(" ")
}

fn capitalised(word: &str) -> String {
    if word == "id" {
        return "ID".into();
    }
    let (first, rest) = word.split_at(word.len().min(1));
    first.to_uppercase() + rest
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::collections::HashSet;

    /// Names that the examined programs of ROBOTIS request.
    #[test]
    fn what_drivers_ask_for_by_name_is_there() {
        let text = text(false);
        for line in [
            "0\t2\tModel Number",
            "6\t1\tFirmware Version",
            "7\t1\tID",
            "11\t1\tOperating Mode",
            "64\t1\tTorque Enable",
            "70\t1\tHardware Error Status",
            "98\t1\tBus Watchdog",
            "102\t2\tGoal Current",
            "126\t2\tPresent Current",
            "128\t4\tPresent Velocity",
            "132\t4\tPresent Position",
            "256\t4\tGoal Force",
            "268\t4\tPresent Force",
            "168\t2\tIndirect Address Write",
            "224\t1\tIndirect Data Write",
            "400\t2\tIndirect Address Read",
            "456\t1\tIndirect Data Read",
            "768\t2\tPressure 1 1",
            "966\t2\tPressure 10 10",
            "Present Force\t0.001\tN\tsigned\t0.0",
            "Present Input Voltage\t0.1\tV\tunsigned\t0.0",
            "Pressure 10 10\t10\tPa\tunsigned\t0.0",
            "Frame Period\t0.000000001\ts\tunsigned\t0.0",
        ] {
            assert!(text.lines().any(|written| written == line), "{line}");
        }
    }

    #[test]
    fn every_item_is_one_register_and_its_name_is_its_own() {
        let items = items();
        let names: HashSet<&str> = items.iter().map(|item| item.name.as_str()).collect();
        assert_eq!(names.len(), items.len(), "a name twice");
        for item in &items {
            assert!([1, 2, 4].contains(&item.bytes), "{item:?}");
            let holds = |register: &&Register| {
                let end = register.address + register.bytes();
                (register.address..end).contains(&item.address) && register.kind.width() == item.bytes
            };
            assert_eq!(REGISTERS.iter().filter(holds).count(), 1, "{item:?}");
            assert!(item.name == item.name.trim() && !item.name.contains('\t'), "{item:?}");
        }
    }

    /// The parsers that were read: sections by their exact line, a heading, then lines of tab-separated fields, the last
    /// one ended, none empty or with a blank at its end.
    #[test]
    fn the_form_is_what_the_parsers_take() {
        for direct in [false, true] {
            let text = text(direct);
            let (units, table) = text.split_once("\n\n").expect("two sections");
            let [mut units, mut table] = [units, table].map(str::lines);
            assert_eq!(units.next(), Some("[unit info]"));
            assert!(units.all(|line| line.split('\t').count() == 5));
            assert_eq!([table.next(), table.next()], [Some("[control table]"), Some("Address\tSize\tData Name")]);
            for line in table {
                let [address, bytes, name] = line.split('\t').collect::<Vec<_>>()[..] else { panic!("{line}") };
                assert!(address.parse::<u16>().is_ok() && bytes.parse::<u8>().is_ok() && !name.is_empty(), "{line}");
            }
            assert!(
                text.ends_with('\n') && !text.ends_with("\n\n") && text.lines().all(|line| line == line.trim_end())
            );
            assert_eq!(text.contains("Indirect Data Read"), !direct);
        }
    }
}
