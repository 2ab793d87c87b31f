//! Registers by name, and what their numbers mean: all out of the core's own table.

use fingertip::link::table::{Access, Kind, Register};
use fingertip::shipped::REGISTERS;

/// Registers side by side, as they were read.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Block {
    pub first: u16,
    pub bytes: Vec<u8>,
}

impl Block {
    /// The number at an address; 0 where the block does not hold it.
    pub fn number(&self, address: u16) -> i64 {
        let register = register_at(address);
        let offset = usize::from(address.wrapping_sub(self.first));
        register.and_then(|register| decode(register.kind, self.bytes.get(offset..)?)).unwrap_or(0)
    }

    pub fn numbers(&self, address: u16) -> Vec<i64> {
        let Some(register) = register_at(address) else { return Vec::new() };
        let width = register.kind.width();
        let offset = usize::from(address.wrapping_sub(self.first));
        let bytes = self.bytes.get(offset..).unwrap_or_default();
        let words = bytes.chunks_exact(usize::from(width)).take(usize::from(register.count));
        words.map(|word| decode(register.kind, word).unwrap_or(0) * i64::from(register.scale)).collect()
    }
}

/// Name on the command line: lower case, the unit at its end.
pub fn name(register: &Register) -> String {
    register.name.to_lowercase()
}

pub fn register_at(address: u16) -> Option<&'static Register> {
    REGISTERS.iter().find(|register| register.address == address)
}

pub fn end(register: &Register) -> u16 {
    register.address + register.kind.width() * register.count
}

/// An address for people.
pub fn place(address: u16) -> String {
    register_at(address).map_or_else(|| format!("address {address}"), name)
}

pub fn find(wanted: &str) -> Result<&'static Register, String> {
    let found = REGISTERS.iter().find(|register| register.name.eq_ignore_ascii_case(wanted));
    found.ok_or_else(|| {
        let wanted = wanted.to_lowercase();
        let mut near: Vec<String> = REGISTERS.iter().filter(|r| is_stored(r)).map(name).collect();
        let alike = |known: &str| known.get(..4).is_some_and(|begin| wanted.starts_with(begin));
        near.retain(|known| known.contains(&wanted) || wanted.contains(known.as_str()) || alike(known));
        let near = if near.is_empty() { String::new() } else { format!("; did you mean {}?", near.join(" or ")) };
        format!("no register `{wanted}`{near} (`fingertip params get` lists those that are stored)")
    })
}

/// A register of one number by its name.
pub fn find_number(wanted: &str) -> Result<&'static Register, String> {
    let register = find(wanted)?;
    if register.count == 1 {
        return Ok(register);
    }
    let (name, count) = (name(register), register.count);
    Err(format!("{name} has {count} numbers (`fingertip record --pressures` and `params backup` write maps to a file)"))
}

/// True if it outlives a reset once it is saved.
pub fn is_stored(register: &Register) -> bool {
    register.count == 1 && matches!(register.access, Access::Stored | Access::StoredLive)
}

pub fn stored() -> impl Iterator<Item = &'static Register> {
    REGISTERS.iter().filter(|register| is_stored(register))
}

pub fn encode(register: &Register, value: i64) -> Vec<u8> {
    value.to_le_bytes()[..usize::from(register.kind.width())].to_vec()
}

fn decode(kind: Kind, bytes: &[u8]) -> Option<i64> {
    Some(match kind {
        Kind::U8 => i64::from(*bytes.first()?),
        Kind::I8 => i64::from(i8::from_le_bytes(*bytes.first_chunk()?)),
        Kind::U16 => i64::from(u16::from_le_bytes(*bytes.first_chunk()?)),
        Kind::I16 => i64::from(i16::from_le_bytes(*bytes.first_chunk()?)),
        Kind::U32 => i64::from(u32::from_le_bytes(*bytes.first_chunk()?)),
        Kind::I32 => i64::from(i32::from_le_bytes(*bytes.first_chunk()?)),
    })
}

/// Meaning of a register's number, from the register's own documentation: `2 approach` there is "approach" here.
pub fn meaning(address: u16, number: i64) -> String {
    let doc = register_at(address).map_or("", |register| register.doc);
    let numbered = doc.split([',', '.', ':', ';']).map(str::trim);
    let found = numbered.filter_map(|part| part.split_once(' ')).find(|(digits, _)| digits.parse() == Ok(number));
    found.map_or_else(|| format!("number {number}"), |(_, words)| words.trim().into())
}

/// Meanings of the set bits of a register.
pub fn bits(address: u16, number: i64) -> Vec<String> {
    (0..32).filter(|bit| number >> bit & 1 == 1).map(|bit| meaning(address, bit)).collect()
}

pub fn meaning_of_error(number: u8) -> &'static str {
    match number {
        1 => "it was understood, but cannot be carried out in the present state of the loop",
        2 => "it knows no such instruction",
        3 => "the packet arrived damaged: is the line noisy?",
        4 => "a value outside of its register's range",
        5 => "the data do not cover whole registers",
        6 => "a value beyond what other registers allow",
        7 => {
            "the register cannot be written, or not while torque is on (`fingertip press` and `torque_enable` \
             turn it on), or another client of `fingertip share` commands the finger until it ends; \
             `share` keeps the bus speed"
        }
        _ => "an error that this program does not know",
    }
}
