//! From stored values to a record: what this firmware knows is taken, and what it cannot take is told.

use super::Record;
use super::format::Found;
use super::names::{NUMBERS, gains_number, ranges};
use crate::config::ConfigError;
use crate::params::{ParamError, Params};
use crate::pressure::Gains;

/// What is to be told of a start.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Remark {
    /// There is no whole record, but the flash is not blank: the defaults count. It is a fault.
    NoneWhole,
    /// What was written after the newest whole record is damaged, most likely cut short: the values before it count. It
    /// is a fault.
    Torn,
    /// A value is out of its range: its default counts. It is a fault.
    Refused(ParamError),
    /// Another firmware had a value whose name this one does not know.
    Unknown {
        /// The number of its name.
        number: u32,
        /// The value.
        value: i32,
    },
    /// The record has no such value: its default counts.
    New(&'static str),
}

/// The values that this firmware knows, and whether all of those were taken.
///
/// Gains are taken all or not at all.
#[inline(never)]
pub fn take<const ROWS: usize, const COLUMNS: usize>(
    found: &Found<'_>,
    mut tell: impl FnMut(Remark),
) -> (Record<ROWS, COLUMNS>, bool) {
    let mut values = Record::<ROWS, COLUMNS>::DEFAULT.values();
    let mut sound = true;
    let (mut gains, mut taken) = (Gains::ONE, 0);
    let first = const { gains_number(ROWS, COLUMNS) };
    for (number, value) in found.values() {
        let word = number.wrapping_sub(first) as usize;
        if word < Gains::<ROWS, COLUMNS>::WORDS {
            taken += usize::from(gains.set_word(word, value.cast_unsigned()));
            continue;
        }
        let mut known = values.iter_mut().zip(ranges()).zip(&NUMBERS);
        match known.find(|(_, own)| **own == number) {
            None => tell(Remark::Unknown { number, value }),
            Some(((place, (_, min, max)), _)) if (min..=max).contains(&value) => *place = value,
            Some(((_, (name, min, max)), _)) => {
                sound = false;
                tell(Remark::Refused(ParamError { name, value, min, max }));
            }
        }
    }
    for ((name, ..), own) in ranges().zip(&NUMBERS) {
        if !found.values().any(|(number, _)| number == *own) {
            tell(Remark::New(name));
        }
    }
    let mut record = Record::from_values(&values);
    if taken == Gains::<ROWS, COLUMNS>::WORDS {
        record.gains = gains;
    } else if found.values().any(|(number, _)| (number.wrapping_sub(first) as usize) < Gains::<ROWS, COLUMNS>::WORDS) {
        sound = false;
        let [min, max] = [Gains::<ROWS, COLUMNS>::MIN, Gains::<ROWS, COLUMNS>::MAX].map(i32::from);
        tell(Remark::Refused(ParamError { name: "gains", value: taken as i32, min, max }));
    }
    (record, sound)
}

/// Makes something of the parameters; those that contradict each other go back to their defaults, and `tell` hears why.
///
/// None where even the defaults make nothing.
pub fn settle<T>(
    params: &mut Params,
    mut make: impl FnMut(&Params) -> Result<T, ConfigError>,
    mut tell: impl FnMut(ConfigError),
) -> Option<T> {
    // Each round but the last puts one back at the least.
    for _ in 0..=Params::COUNT {
        match make(params) {
            Ok(made) => return Some(made),
            Err(error) => {
                tell(error);
                give_up(params, error);
            }
        }
    }
    None
}

/// Puts what the error names back to its default, and everything where that is no change.
#[inline(never)]
fn give_up(params: &mut Params, error: ConfigError) {
    let names = match error {
        ConfigError::Param(error) => [error.name; 2],
        ConfigError::Scan(_) => ["settle_ns", "sample_cycles"],
        ConfigError::Order([(low, _), (high, _)]) => [low, high],
        ConfigError::Seen { .. } => ["codes_per_kpa_milli", "contact_on_mn"],
        ConfigError::Supply(..) => ["voltage_max_mv", "supply_min_mv"],
    };
    let mut values = params.to_array();
    let mut changed = false;
    for (value, (name, default, ..)) in values.iter_mut().zip(&Params::RANGES) {
        if names.contains(name) {
            changed |= *value != *default;
            *value = *default;
        }
    }
    *params = if changed { Params::from_array(&values) } else { Params::DEFAULT };
}
