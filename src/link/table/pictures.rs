//! The tactile images of the array: registers whose number of values, and so their address, depends on its shape.
//!
//! The first image begins at [`FIRST`], or at [`FIRST_OF_MANY`], and each further image at the next multiple of 256.

use super::registers::Source;
use super::{Access, Kind, Register, TableView, address};
use crate::frame::Shape;
use crate::pressure::{GAIN_MAX, GAIN_ONE, TARE_BITS};

/// Address of the first image.
pub(super) const FIRST: u16 = 768;
/// Address of the first image of an array whose images would reach into other registers: beyond all of these.
const FIRST_OF_MANY: u16 = 8_192;
/// Number of images.
pub const COUNT: usize = 4;

const PRESSURES_DOC: &str = " Pressure on each taxel, row by row; 0 before the first tare.";
const RAW_DOC: &str =
    " Converter codes of the last frame, row by row; the last row is that of the columns with no row driven.";
const TARE_DOC: &str = " Zero of each taxel in converter codes, row by row.";
const GAINS_DOC: &str =
    " What each taxel's reading is multiplied by, row by row: a half to just below 2. New gains need a new tare.";

/// Addresses of the images in an array's table: pressures, raw codes, tare codes, gains.
pub const fn at<const ROWS: usize, const COLUMNS: usize>() -> [u16; COUNT] {
    const { Shape::<ROWS, COLUMNS>::CHECKED };
    let few = at_from::<ROWS, COLUMNS>(FIRST);
    let [.., gains] = few;
    let end = gains + 2 * Shape::<ROWS, COLUMNS>::TAXELS as u16;
    if end <= address::MEASURE { few } else { at_from::<ROWS, COLUMNS>(FIRST_OF_MANY) }
}

const fn at_from<const ROWS: usize, const COLUMNS: usize>(pressures: u16) -> [u16; COUNT] {
    let taxels = 2 * Shape::<ROWS, COLUMNS>::TAXELS as u16;
    let slots = 2 * (Shape::<ROWS, COLUMNS>::SLOTS * COLUMNS) as u16;
    let raw = (pressures + taxels).next_multiple_of(256);
    let tare = (raw + slots).next_multiple_of(256);
    [pressures, raw, tare, (tare + taxels).next_multiple_of(256)]
}

/// The registers of the images, as documented.
pub(super) const fn registers<const ROWS: usize, const COLUMNS: usize>() -> [Register; COUNT] {
    let (taxels, codes) = (Shape::<ROWS, COLUMNS>::TAXELS, Shape::<ROWS, COLUMNS>::SLOTS * COLUMNS);
    let [pressures, raw, tare, gains] = at::<ROWS, COLUMNS>();
    let pressures = image("PRESSURES", Source::Pressures, pressures, Access::ReadOnly, PRESSURES_DOC);
    let raw = image("RAW_CODES", Source::RawCodes, raw, Access::ReadOnly, RAW_DOC);
    let tare = image("TARE_CODES", Source::TareCodes, tare, Access::ReadOnly, TARE_DOC);
    let gains = image("GAINS", Source::Gains, gains, Access::Stored, GAINS_DOC);
    [
        pressures.count(taxels).unit("Pa").scale(10),
        raw.count(codes).range(0, 4095),
        tare.count(taxels).range(0, 4095),
        gains.count(taxels).unit("1/16384").range(GAIN_ONE as i64 / 2, GAIN_MAX as i64).default(GAIN_ONE as i64),
    ]
}

const fn image(name: &'static str, source: Source, address: u16, access: Access, doc: &'static str) -> Register {
    Register::new((name, source), address, Kind::U16, access, doc)
}

impl<const ROWS: usize, const COLUMNS: usize> TableView<'_, ROWS, COLUMNS> {
    /// Returns the value of an element of an image.
    pub(super) fn picture(&self, source: Source, element: usize) -> u32 {
        let snapshot = self.snapshot;
        let of = |taxels: &[[i32; COLUMNS]; ROWS]| taxels.as_flattened().get(element).copied().unwrap_or(0);
        let value = match source {
            Source::Pressures if self.tared() => pressure_10pa(of(snapshot.taxels), snapshot.pascals_per_sum_q32),
            Source::RawCodes => snapshot.frame.code(element / COLUMNS, element % COLUMNS),
            Source::TareCodes => tare_code(of(snapshot.tare)),
            Source::Gains => self.settings().record.gains.get(element),
            _ => 0,
        };
        value.into()
    }
}

/// Converts the reading of a taxel to units of 10 Pa.
fn pressure_10pa(taxel: i32, pascals_per_sum_q32: i64) -> u16 {
    let pascals = i64::from(taxel).saturating_mul(pascals_per_sum_q32) >> 32;
    saturate(((pascals + 5) / 10) as i32)
}

/// Converts the zero of a taxel to converter codes.
fn tare_code(tare: i32) -> u16 {
    saturate(tare.saturating_add(1 << (TARE_BITS - 1)) >> TARE_BITS)
}

fn saturate(value: i32) -> u16 {
    value.max(0).min(i32::from(u16::MAX)) as u16
}

#[cfg(test)]
mod tests {
    use super::super::cells;
    use super::*;

    fn addresses<const ROWS: usize, const COLUMNS: usize>() -> [u16; COUNT] {
        // Each byte belongs to one register: a picture beside another's place would hide it.
        for pair in cells::<ROWS, COLUMNS>().windows(2) {
            assert!(pair[0].end() <= pair[1].address, "{ROWS} x {COLUMNS}: {pair:?}");
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

    #[test]
    fn taxels_are_rounded_and_stay_within_their_registers() {
        // 8 Pa for a sixteenth of a code.
        assert_eq!([0, -3, 1, i32::MAX].map(|taxel| pressure_10pa(taxel, 8 << 32)), [0, 0, 1, u16::MAX]);
        let zeros = [0, -1 << TARE_BITS, (7 << TARE_BITS) + (1 << 15), i32::MAX];
        assert_eq!(zeros.map(tare_code), [0, 0, 8, 32_767]);
    }
}
