//! Registers: their form, the macro that defines them, and the list of all of them for documentation and hosts.
//!
//! From a definition the macro makes addresses, documentation, reading and writing.

use super::registers::{FIXED, Source, address};
use super::{indirect, mirrors, pictures};
use crate::params::Params;

macro_rules! control_table {
    ($($(#[doc = $doc:literal])+ $address:literal $name:ident: $kind:ident $([$count:expr])? $access:ident
       $($unit:literal $(* $scale:literal)?)? $(in $min:literal..=$max:literal)? $(= $default:expr)?,
       $get:expr $(, $set:expr)?;)*) => {
        /// Address of each register.
        pub mod address {
            $($(#[doc = $doc])+ pub const $name: u16 = $address;)*
            /// The parameters, in the order of [`crate::params::Params`], 4 bytes each.
            pub const PARAMS: u16 = 512;
        }

        /// Value that a register reads and writes.
        #[expect(non_camel_case_types, clippy::upper_case_acronyms, reason = "the registers' names")]
        #[derive(Clone, Copy, Debug, PartialEq, Eq)]
        pub(in crate::link) enum Source {
            $($name,)*
            Params,
            /// Addresses of the indirect data from this place on.
            Addresses(u8),
            /// Indirect data from this place on.
            Data(u8),
            Pressures,
            RawCodes,
            TareCodes,
            Gains,
        }

        pub(super) const FIXED: &[Register] = &[$(
            Register::new(
                (stringify!($name), Source::$name),
                $address,
                Kind::$kind,
                Access::$access,
                concat!($($doc),+),
            )
            $(.count($count))? $(.unit($unit) $(.scale($scale))?)? $(.range($min, $max))? $(.default($default as i64))?
        ),*];

        /// The register that begins at an address.
        pub(super) const fn fixed(address: u16) -> Register {
            let mut place = 0;
            while FIXED[place].address != address {
                place += 1;
            }
            FIXED[place]
        }

        impl<const ROWS: usize, const COLUMNS: usize> TableView<'_, ROWS, COLUMNS> {
            /// Returns the low bytes of an element of a register.
            pub(super) fn register(&self, source: Source, element: usize) -> u32 {
                match source {
                    $(Source::$name => {
                        let get: fn(&Self, usize) -> u32 = $get;
                        get(self, element)
                    })*
                    _ => self.picture(source, element),
                }
            }
        }

        impl<const ROWS: usize, const COLUMNS: usize> Staged<'_, ROWS, COLUMNS> {
            /// Sets a register that can be written.
            pub(super) fn set_register(&mut self, source: Source, value: i64) -> Result<(), StatusError> {
                match source {
                    $($(Source::$name => {
                        let Register { min, max, .. } = const { fixed($address) };
                        if !(min..=max).contains(&value) {
                            return Err(StatusError::Range);
                        }
                        let set: fn(&mut Self, i64) -> Result<(), StatusError> = $set;
                        set(self, value)
                    })?)*
                    _ => Err(StatusError::Access),
                }
            }
        }
    };
}

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

/// Format of a register's number, little-endian.
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

    /// Least and largest number.
    const fn range(self) -> (i64, i64) {
        let numbers = 1 << (8 * self.width());
        match self {
            Self::U8 | Self::U16 | Self::U32 => (0, numbers - 1),
            Self::I8 | Self::I16 | Self::I32 => (-numbers / 2, numbers / 2 - 1),
        }
    }

    /// The number that `bytes` make, or none where there are not enough of them.
    pub(super) fn decode(self, bytes: &[u8]) -> Option<i64> {
        let bytes = bytes.get(..usize::from(self.width()))?;
        let number = bytes.iter().rev().fold(0, |number, byte| number << 8 | i64::from(*byte));
        let (min, max) = self.range();
        Some(if number > max { number - max - 1 + min } else { number })
    }
}

/// A register as its documentation has it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Register {
    /// The constant in [`address`](super::address), or the field of [`Params`].
    pub name: &'static str,
    /// Address of its first byte.
    pub address: u16,
    /// Format of its numbers.
    pub kind: Kind,
    /// Number of elements: 1, but for the tactile images of the array.
    pub count: u16,
    /// Who may write it.
    pub access: Access,
    /// Physical unit; empty where it is a plain number.
    pub unit: &'static str,
    /// Resolution: a step of the number in that unit.
    pub scale: u16,
    /// The least value.
    pub min: i64,
    /// The largest value.
    pub max: i64,
    /// After a factory reset where it is stored, after a reset where it can be written.
    pub default: Option<i64>,
    /// Meaning of the register.
    pub doc: &'static str,
    pub(in crate::link) source: Source,
}

impl Register {
    /// A register of one element, a plain number without limits or default.
    pub(super) const fn new(
        (name, source): (&'static str, Source),
        address: u16,
        kind: Kind,
        access: Access,
        doc: &'static str,
    ) -> Self {
        let (min, max) = kind.range();
        Self { name, address, kind, count: 1, access, unit: "", scale: 1, min, max, default: None, doc, source }
    }

    pub(super) const fn count(self, count: usize) -> Self {
        Self { count: count as u16, ..self }
    }

    pub(super) const fn unit(self, unit: &'static str) -> Self {
        Self { unit, ..self }
    }

    pub(super) const fn scale(self, scale: u16) -> Self {
        Self { scale, ..self }
    }

    pub(super) const fn range(self, min: i64, max: i64) -> Self {
        Self { min, max, ..self }
    }

    pub(super) const fn default(self, default: i64) -> Self {
        Self { default: Some(default), ..self }
    }

    /// Bytes on the bus.
    pub const fn bytes(&self) -> u16 {
        self.kind.width() * self.count
    }
}

/// Number of registers.
pub const COUNT: usize =
    FIXED.len() + mirrors::REGISTERS.len() + indirect::REGISTERS.len() + Params::COUNT + pictures::COUNT;

/// Every register of an array of this shape, in the order of the addresses.
pub const fn registers<const ROWS: usize, const COLUMNS: usize>() -> [Register; COUNT] {
    let mut all = [FIXED[0]; COUNT];
    let mut count = add(&mut all, 0, FIXED);
    count = add(&mut all, count, mirrors::REGISTERS);
    count = add(&mut all, count, &indirect::REGISTERS);
    count = add(&mut all, count, &pictures::registers::<ROWS, COLUMNS>());
    while count < COUNT {
        count = add(&mut all, count, &[param(count + Params::COUNT - COUNT)]);
    }
    all
}

/// Merges more registers, which are in order, into those that are there.
const fn add(all: &mut [Register], count: usize, more: &[Register]) -> usize {
    let (mut from, mut with, mut to) = (count, more.len(), count + more.len());
    while with > 0 {
        to -= 1;
        if from > 0 && all[from - 1].address > more[with - 1].address {
            from -= 1;
            all[to] = all[from];
        } else {
            with -= 1;
            all[to] = more[with];
        }
    }
    count + more.len()
}

const fn param(place: usize) -> Register {
    let (name, default, min, max) = Params::RANGES[place];
    let at = address::PARAMS + 4 * place as u16;
    Register::new((name, Source::Params), at, Kind::I32, Access::Stored, Params::DOCS[place])
        .range(min as i64, max as i64)
        .default(default as i64)
}

// The parameters end where the state before the pressures begins, and that ends where these do.
const _: () = assert!(
    address::PARAMS as usize + 4 * Params::COUNT <= mirrors::address::PICTURE_TIME_US as usize
        && mirrors::address::PICTURE_CONFIDENCE + 1 == pictures::FIRST
);
