//! What a register is.

/// Who may write a register, and when.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Access {
    /// Nobody.
    ReadOnly,
    /// The host, at any time.
    ReadWrite,
    /// The host, while torque is off.
    TorqueOff,
    /// The host, while torque is off; kept in flash once `save_parameters` was written.
    Stored,
    /// The same at any time.
    StoredLive,
}

/// How a register's bytes make a number, little-endian.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    /// 8 bits.
    U8,
    /// 8 bits, two's complement.
    I8,
    /// 16 bits.
    U16,
    /// 16 bits, two's complement.
    I16,
    /// 32 bits.
    U32,
    /// 32 bits, two's complement.
    I32,
}

impl Kind {
    /// Bytes on the bus.
    pub const fn width(self) -> u16 {
        match self {
            Self::U8 | Self::I8 => 1,
            Self::U16 | Self::I16 => 2,
            Self::U32 | Self::I32 => 4,
        }
    }

    /// The number that `bytes` make, or none where there are not enough of them.
    pub(super) fn decode(self, bytes: &[u8]) -> Option<i64> {
        Some(match self {
            Self::U8 => i64::from(u8::from_le_bytes(*bytes.first_chunk()?)),
            Self::I8 => i64::from(i8::from_le_bytes(*bytes.first_chunk()?)),
            Self::U16 => i64::from(u16::from_le_bytes(*bytes.first_chunk()?)),
            Self::I16 => i64::from(i16::from_le_bytes(*bytes.first_chunk()?)),
            Self::U32 => i64::from(u32::from_le_bytes(*bytes.first_chunk()?)),
            Self::I32 => i64::from(i32::from_le_bytes(*bytes.first_chunk()?)),
        })
    }
}

/// A register as its documentation has it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Register {
    /// The constant in [`address`](super::address), or the field of [`Params`](crate::params::Params).
    pub name: &'static str,
    /// Of its first byte.
    pub address: u16,
    /// How its bytes make a number.
    pub kind: Kind,
    /// How many numbers stand side by side: 1, but for the pictures of the array.
    pub count: u16,
    /// Who may write it.
    pub access: Access,
    /// Physical unit; empty where it is a plain number.
    pub unit: &'static str,
    /// What a step of the number means, in that unit: the resolution.
    pub scale: u16,
    /// The least value.
    pub min: i64,
    /// The largest value.
    pub max: i64,
    /// After a factory reset where it is stored, after a reset where it can be written.
    pub default: Option<i64>,
    /// What it means.
    pub doc: &'static str,
}

impl Register {
    /// Bytes on the bus.
    pub const fn bytes(&self) -> u16 {
        self.kind.width() * self.count
    }
}
