//! The form of a register's definition, and what is made of it: addresses, documentation, reading and writing.

macro_rules! count {
    () => {
        1
    };
    ($count:expr) => {
        $count as u16
    };
}

macro_rules! optional {
    () => {
        None
    };
    ($value:expr) => {
        Some($value as i64)
    };
}

macro_rules! control_table {
    ($($(#[doc = $doc:literal])+ $address:literal $name:ident: $kind:ident $([$count:expr])? $access:ident,
       $unit:literal * $scale:literal, $min:literal to $max:literal $(= $default:expr)?,
       $get:expr $(, $set:expr)?;)*) => {
        /// Where each register begins.
        pub mod address {
            $($(#[doc = $doc])+ pub const $name: u16 = $address;)*
            /// The parameters, in the order of [`crate::params::Params`], 4 bytes each.
            pub const PARAMS: u16 = 512;
        }

        pub(super) const FIXED: &[Register] = &[$(Register {
            name: stringify!($name),
            address: $address,
            kind: Kind::$kind,
            count: count!($($count)?),
            access: Access::$access,
            unit: $unit,
            scale: $scale,
            min: $min,
            max: $max,
            default: optional!($($default)?),
            doc: concat!($($doc),+),
        }),*];

        pub(super) static CELLS: [Cell; FIXED.len()] = [
            $(Cell { address: $address, of: $address, kind: Kind::$kind, count: count!($($count)?), access: Access::$access }),*
        ];

        /// Where they end.
        pub(super) const END: u16 = {
            let last = &FIXED[FIXED.len() - 1];
            last.address + last.kind.width() * last.count
        };

        /// The register that begins at an address.
        pub(super) const fn fixed(address: u16) -> Register {
            let mut place = 0;
            while FIXED[place].address != address {
                place += 1;
            }
            FIXED[place]
        }

        /// The value of an element, as its low bytes; 0 where there is no such register.
        pub(super) fn get<const ROWS: usize, const COLUMNS: usize>(
            view: View<'_, ROWS, COLUMNS>,
            address: u16,
            element: usize,
        ) -> u32 {
            match address {
                $($address => {
                    let get: fn(View<'_, ROWS, COLUMNS>, usize) -> u32 = $get;
                    get(view, element)
                })*
                _ => super::pictures::get(view, address, element),
            }
        }

        /// Sets a register that can be written.
        pub(super) fn set<const ROWS: usize, const COLUMNS: usize>(
            staged: &mut Staged<ROWS, COLUMNS>,
            address: u16,
            value: i64,
        ) -> Result<(), StatusError> {
            match address {
                $($($address => {
                    if !($min..=$max).contains(&value) {
                        return Err(StatusError::Range);
                    }
                    let set: fn(&mut Staged<ROWS, COLUMNS>, i64) -> Result<(), StatusError> = $set;
                    set(staged, value)
                })?)*
                _ => Err(StatusError::Access),
            }
        }
    };
}
