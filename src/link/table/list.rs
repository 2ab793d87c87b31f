//! All registers of the table, in the order of the addresses: for documentation and hosts.

use crate::params::Params;

use super::registers::{FIXED, address};
use super::{Access, Kind, Register, indirect, mirrors, pictures};

/// How many registers there are.
pub const COUNT: usize =
    FIXED.len() + mirrors::REGISTERS.len() + indirect::REGISTERS.len() + Params::COUNT + pictures::COUNT;

/// Every register of an array of this shape, in the order of the addresses.
pub const fn registers<const ROWS: usize, const COLUMNS: usize>() -> [Register; COUNT] {
    let mut all = [FIXED[0]; COUNT];
    let mut count = 0;
    count = add(&mut all, count, FIXED);
    count = add(&mut all, count, mirrors::REGISTERS);
    count = add(&mut all, count, &indirect::REGISTERS);
    count = add(&mut all, count, &params());
    add(&mut all, count, &pictures::registers::<ROWS, COLUMNS>());
    all
}

/// Puts more registers, themselves in order, among those that are there.
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

const fn params() -> [Register; Params::COUNT] {
    let mut all = [FIXED[0]; Params::COUNT];
    let mut place = 0;
    while place < all.len() {
        let (name, default, min, max) = Params::RANGES[place];
        all[place] = Register {
            name,
            address: address::PARAMS + 4 * place as u16,
            kind: Kind::I32,
            count: 1,
            access: Access::Stored,
            unit: "",
            scale: 1,
            min: min as i64,
            max: max as i64,
            default: Some(default as i64),
            doc: Params::DOCS[place],
        };
        place += 1;
    }
    all
}

// The parameters end where the state before the pressures begins, and that ends where these do.
const _: () = assert!(
    address::PARAMS as usize + 4 * Params::COUNT <= mirrors::address::PICTURE_TIME_US as usize
        && mirrors::address::PICTURE_CONFIDENCE + 1 == pictures::FIRST
);
