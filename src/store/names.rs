//! The values of a record, with their names, numbers and ranges.

use super::{BAUD_RATES, CRC, ID_MAX, Record};
use crate::contact::FitLevel;
use crate::params::Params;
use crate::pressure::Gains;

/// Values that stand before the parameters.
const HEAD_COUNT: usize = 4;
/// How many values this firmware has without the gains.
pub const COUNT: usize = HEAD_COUNT + Params::COUNT;

/// Name, least and largest value of those before the parameters. The names are stored: they stay.
const HEAD: [(&str, i32, i32); HEAD_COUNT] = [
    ("id", 0, ID_MAX as i32),
    ("baud_code", 0, BAUD_RATES.len() as i32 - 1),
    ("return_delay_2us", 0, 254),
    ("fit_level", 0, FitLevel::AllRows as i32),
];

/// The number under which a value is stored: the CRC-32 (ISO-HDLC) of its name.
pub const fn number(name: &str) -> u32 {
    CRC.checksum(name.as_bytes())
}

/// The numbers of this firmware's values, in order.
pub static NUMBERS: [u32; COUNT] = numbers();

const fn numbers() -> [u32; COUNT] {
    let mut numbers = [0; COUNT];
    let mut place = 0;
    while place < COUNT {
        let name = if place < HEAD_COUNT { HEAD[place].0 } else { Params::RANGES[place - HEAD_COUNT].0 };
        numbers[place] = number(name);
        place += 1;
    }
    numbers
}

/// The number under which an array's first two gains are stored; the next two are stored under the next one. Of another
/// array's it is another.
pub const fn gains_number(rows: usize, columns: usize) -> u32 {
    let shape =
        [b'0' + rows as u8 / 10, b'0' + rows as u8 % 10, b'x', b'0' + columns as u8 / 10, b'0' + columns as u8 % 10];
    let mut digest = CRC.digest();
    digest.update(b"gains_");
    digest.update(&shape);
    digest.finalize()
}

/// Whether no other value is stored under the numbers of an array's gains.
pub const fn gains_stand_apart(rows: usize, columns: usize) -> bool {
    let numbers = numbers();
    let mut place = 0;
    while place < COUNT {
        if (numbers[place].wrapping_sub(gains_number(rows, columns)) as usize) < rows * columns {
            return false;
        }
        place += 1;
    }
    true
}

const _: () = {
    let numbers = numbers();
    let mut one = 0;
    while one < COUNT {
        let mut other = 0;
        while other < one {
            assert!(numbers[one] != numbers[other], "two names have the same number: rename one");
            other += 1;
        }
        one += 1;
    }
};

/// Name, least and largest value, in order.
pub fn ranges() -> impl Iterator<Item = (&'static str, i32, i32)> {
    HEAD.into_iter().chain(Params::RANGES.iter().map(|(name, _, min, max)| (*name, *min, *max)))
}

impl<const ROWS: usize, const COLUMNS: usize> Record<ROWS, COLUMNS> {
    /// The values in order, without the gains.
    pub(super) fn values(&self) -> [i32; COUNT] {
        let head = [self.id, self.baud_code, self.return_delay_2us, self.fit_level as u8];
        let mut values = [0; COUNT];
        let all = head.into_iter().map(i32::from).chain(self.params.to_array());
        for (place, value) in values.iter_mut().zip(all) {
            *place = value;
        }
        values
    }

    /// The inverse, for values in their ranges; gains of 1.
    pub(super) fn from_values(values: &[i32; COUNT]) -> Self {
        let [id, baud_code, return_delay_2us, fit_level, rest @ ..] = values;
        let [id, baud_code, return_delay_2us, fit_level] =
            [id, baud_code, return_delay_2us, fit_level].map(|value| *value as u8);
        Self {
            id,
            baud_code,
            return_delay_2us,
            fit_level: FitLevel::from_number(fit_level),
            params: Params::from_array(rest),
            gains: Gains::ONE,
        }
    }
}
