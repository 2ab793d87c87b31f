//! The tactile images of the array: registers whose number of values, and so their address, depends on its shape.
//!
//! The first image begins at [`FIRST`], or at [`FIRST_OF_MANY`], and each further image at the next multiple of 256.

use crate::frame::Shape;

use crate::link::packet::StatusError;
use crate::pressure::{GAIN_MAX, GAIN_ONE};

use super::registers::FIXED;
use super::{Access, Cell, Kind, Register, Staged, TableView, address};

/// Address of the first image.
pub(super) const FIRST: u16 = 768;
/// Address of the first image of an array whose images would reach into other registers: beyond all of these.
const FIRST_OF_MANY: u16 = 8_192;
/// Number of images.
pub const COUNT: usize = 4;
/// Name, largest value, unit and resolution of each, and what it means.
const PICTURES: [(&str, i64, &str, u16, &str); COUNT] = [
    ("PRESSURES", 0xFFFF, "Pa", 10, " Pressure on each taxel, row by row; 0 before the first tare."),
    (
        "RAW_CODES",
        4095,
        "",
        1,
        " Converter codes of the last frame, row by row; the last row is that of the columns with no row driven.",
    ),
    ("TARE_CODES", 4095, "", 1, " Zero of each taxel in converter codes, row by row."),
    (
        "GAINS",
        GAIN_MAX as i64,
        "1/16384",
        1,
        " What each taxel's reading is multiplied by, row by row: a half to just below 2. New gains need a new tare.",
    ),
];

/// Cells of the images in an array's table.
pub(super) const fn cells<const ROWS: usize, const COLUMNS: usize>() -> [Cell; COUNT] {
    const { Shape::<ROWS, COLUMNS>::CHECKED };
    let few = cells_from::<ROWS, COLUMNS>(FIRST);
    let [.., gains] = &few;
    if gains.end() <= address::MEASURE { few } else { cells_from::<ROWS, COLUMNS>(FIRST_OF_MANY) }
}

const fn cells_from<const ROWS: usize, const COLUMNS: usize>(address: u16) -> [Cell; COUNT] {
    let taxels = Shape::<ROWS, COLUMNS>::TAXELS as u16;
    let codes = (Shape::<ROWS, COLUMNS>::SLOTS * COLUMNS) as u16;
    let first = cell(address, taxels);
    let second = cell(after(&first), codes);
    let third = cell(after(&second), taxels);
    let gains = Cell { access: Access::Stored, ..cell(after(&third), taxels) };
    [first, second, third, gains]
}

const fn cell(address: u16, count: u16) -> Cell {
    Cell { address, of: address, count, kind: Kind::U16, access: Access::ReadOnly }
}

/// Addresses of the images in an array's table.
pub const fn at<const ROWS: usize, const COLUMNS: usize>() -> [u16; COUNT] {
    let cells = cells::<ROWS, COLUMNS>();
    let mut addresses = [0; COUNT];
    let mut place = 0;
    while place < COUNT {
        addresses[place] = cells[place].address;
        place += 1;
    }
    addresses
}

/// End of the table.
pub(super) const fn end<const ROWS: usize, const COLUMNS: usize>() -> u16 {
    let [.., last] = cells::<ROWS, COLUMNS>();
    let mut end = last.end();
    let mut place = 0;
    while place < FIXED.len() {
        let Register { address, kind, count, .. } = FIXED[place];
        if address + kind.width() * count > end {
            end = address + kind.width() * count;
        }
        place += 1;
    }
    end
}

/// The next multiple of 256.
const fn after(cell: &Cell) -> u16 {
    cell.end().next_multiple_of(256)
}

/// The registers of the images, as documented.
pub(super) const fn registers<const ROWS: usize, const COLUMNS: usize>() -> [Register; COUNT] {
    let cells = cells::<ROWS, COLUMNS>();
    [register(0, &cells), register(1, &cells), register(2, &cells), register(3, &cells)]
}

const fn register(picture: usize, cells: &[Cell; COUNT]) -> Register {
    let (name, max, unit, scale, doc) = PICTURES[picture];
    let Cell { address, count, kind, access, .. } = cells[picture];
    let stored = matches!(access, Access::Stored);
    let (min, default) = if stored { (GAIN_ONE as i64 / 2, Some(GAIN_ONE as i64)) } else { (0, None) };
    Register { name, address, kind, count, access, unit, scale, min, max, default, doc }
}

/// Returns the value of an element; 0 if there is no such image.
pub(super) fn get<const ROWS: usize, const COLUMNS: usize>(
    view: TableView<'_, ROWS, COLUMNS>,
    address: u16,
    element: usize,
) -> u32 {
    let [pressures, codes, tare, gains] = const { cells::<ROWS, COLUMNS>() };
    let snapshot = view.snapshot;
    let value = if address == pressures.address {
        if view.tared() { snapshot.pressure_10pa(element) } else { 0 }
    } else if address == codes.address {
        snapshot.frame.code(element / COLUMNS, element % COLUMNS)
    } else if address == tare.address {
        snapshot.tare_codes(element)
    } else if address == gains.address {
        view.settings().record.gains.get(element)
    } else {
        0
    };
    value.into()
}

/// Sets an element of an image that can be written. Returns false if the address is not that of an image.
pub(super) fn set<const ROWS: usize, const COLUMNS: usize>(
    staged: &mut Staged<ROWS, COLUMNS>,
    address: u16,
    element: u16,
    value: i64,
) -> Result<bool, StatusError> {
    let [_, _, _, gains, ..] = const { cells::<ROWS, COLUMNS>() };
    if address != gains.address {
        return Ok(false);
    }
    let set = u16::try_from(value).is_ok_and(|gain| staged.settings.record.gains.set(element.into(), gain));
    if set { Ok(true) } else { Err(StatusError::Range) }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::params::Params;
    use std::vec::Vec;

    fn addresses<const ROWS: usize, const COLUMNS: usize>() -> [u16; COUNT] {
        // Each byte belongs to one register: a picture beside another's place would hide it.
        let mut cells: Vec<_> = Cell::all::<ROWS, COLUMNS>().map(|cell| (cell.address, cell.end())).collect();
        cells.push((address::PARAMS, address::PARAMS + 4 * Params::RANGES.len() as u16));
        cells.sort_unstable();
        for pair in cells.windows(2) {
            assert!(pair[0].1 <= pair[1].0, "{ROWS} x {COLUMNS}: {pair:?}");
        }
        at::<ROWS, COLUMNS>()
    }

    #[test]
    fn pictures_stand_apart() {
        assert_eq!(addresses::<10, 10>(), [768, 1_024, 1_280, 1_536]);
        assert_eq!(addresses::<3, 3>(), [768, 1_024, 1_280, 1_536]);
        assert_eq!(addresses::<16, 16>(), [768, 1_280, 2_048, 2_560]);
        assert_eq!(addresses::<16, 32>(), [8_192, 9_216, 10_496, 11_520]);
    }
}
