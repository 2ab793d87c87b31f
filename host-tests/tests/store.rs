//! The parameters in flash: bytes, two sectors in turns, and losses of power at every word.

mod tear;

use self::tear::{Nor, bits, record, with_gains};
use crate::common::*;
use fingertip::params::ParamError;
use fingertip::shipped::{Gains, Loaded, Record};
use fingertip::store::{Flash as _, Journal, Remark, SLOT_BYTES, Sector, number, settle};
use sim::encode;

// Bytes of a record, and bytes that are never taken for a record.

const SIZE: usize = 8 * SLOT_BYTES;

/// Result of a start with these bytes in a sector, and the other one blank.
fn start_in(sector: Sector, bytes: &[u8]) -> (Loaded, Vec<Remark>) {
    let mut nor = Nor::blank(SIZE);
    nor.sector(sector)[..bytes.len()].copy_from_slice(bytes);
    let mut remarks = Vec::new();
    (Journal::new(&nor).load(&nor, |remark| remarks.push(remark)), remarks)
}

fn load(nor: &Nor) -> Loaded {
    Journal::new(nor).load(nor, |_| ())
}

#[test]
fn garbage_is_a_fault_with_the_defaults_and_the_next_save_ends_it() {
    let garbage: Vec<u8> = (0..SIZE as u64).map(|place| bits(place) as u8).collect();
    for both in [false, true] {
        let other = if both { garbage.clone() } else { vec![0xFF; SIZE] };
        let mut nor = Nor::new([garbage.clone(), other]);
        let mut journal = Journal::new(&nor);
        let loaded = journal.load(&nor, |remark| assert_eq!(remark, Remark::NoneWhole));
        assert_eq!(loaded, Loaded { record: Record::DEFAULT, sound: false });
        assert_eq!(journal.make_room(&mut nor, SLOT_BYTES), Ok(both));
        // The caller feeds a watchdog before each word.
        let mut fed = 0;
        assert_eq!(journal.save(&mut nor, &record(1), || fed += 1), Ok(()));
        assert_eq!(fed, SLOT_BYTES / 4);
        assert_eq!(load(&nor), Loaded { record: record(1), sound: true });
    }
}

#[test]
fn every_flipped_bit_of_the_newest_is_seen_and_the_one_before_counts() {
    for sector in [Sector::A, Sector::B] {
        let mut both = [encode(&record(1), 1), encode(&record(2), 2)].concat();
        assert_eq!(start_in(sector, &both).0, Loaded { record: record(2), sound: true });
        // Without the padding.
        for place in SLOT_BYTES..SLOT_BYTES + 12 + 8 * names().len() + 4 {
            for bit in 0..8 {
                both[place] ^= 1 << bit;
                let (loaded, remarks) = start_in(sector, &both);
                assert_eq!(loaded, Loaded { record: record(1), sound: false }, "bit {bit} of byte {place}");
                assert_eq!(remarks, [Remark::Torn]);
                both[place] ^= 1 << bit;
            }
        }
    }
}

#[test]
fn the_sequence_tells_which_sector_is_newer_also_where_it_wraps() {
    for first in [0, 1, 0x7FFF_FFFF, 0x8000_0000, u32::MAX - 1, u32::MAX] {
        let mut nor = Nor::blank(SIZE);
        nor.sector(Sector::A)[..SLOT_BYTES].copy_from_slice(&encode(&record(1), first));
        nor.sector(Sector::B)[..SLOT_BYTES].copy_from_slice(&encode(&record(2), first.wrapping_add(1)));
        assert_eq!(load(&nor), Loaded { record: record(2), sound: true }, "{first}");
        nor.sector(Sector::A)[..SLOT_BYTES].copy_from_slice(&encode(&record(3), first.wrapping_add(2)));
        assert_eq!(load(&nor), Loaded { record: record(3), sound: true }, "{first}");
        let mut journal = Journal::new(&nor);
        assert_eq!(journal.save(&mut nor, &record(4), || ()), Ok(()));
        assert_eq!(nor.bytes(Sector::A)[SLOT_BYTES + 4..][..4], first.wrapping_add(3).to_le_bytes());
    }
}

// Values that a firmware loads from another firmware's record, and remarks on the rest.

#[test]
fn a_changed_layout_is_no_fault_and_every_known_value_is_taken() {
    let new = Remark::New(LACKED);
    let unknown = |name: &str, value| Remark::Unknown { number: number(name), value };
    let remarks = [vec![], vec![unknown("one_more", -5)], vec![new], vec![unknown("another_name", 777), new]];
    for (other, remarks) in OTHERS.into_iter().zip(remarks) {
        let (bytes, expected) = record_of(other, 3, 9);
        assert_eq!(start_in(Sector::B, &bytes), (Loaded { record: expected, sound: true }, remarks));
    }
    // Of no values at all, all are defaults.
    let new: Vec<Remark> = names().into_iter().map(Remark::New).collect();
    assert_eq!(start_in(Sector::B, &of_values(&[], 1)), (Loaded { record: Record::DEFAULT, sound: true }, new));
    // The order of the values does not count.
    let reversed: Vec<_> = named(&record(8)).into_iter().rev().collect();
    assert_eq!(start_in(Sector::B, &of_values(&reversed, 1)), (Loaded { record: record(8), sound: true }, vec![]));
}

#[test]
fn a_value_out_of_its_range_is_its_default_and_a_fault() {
    let heads =
        [("id", 252), ("baud_code", 5), ("return_delay_2us", 254), ("fit_level", 5)].map(|(name, max)| (name, 0, max));
    let params = Params::RANGES.iter().map(|(name, _, min, max)| (*name, *min, *max));
    let whole = record(3);
    for (place, (name, min, max)) in heads.into_iter().chain(params).enumerate() {
        for value in [min - 1, max + 1, i32::MIN, i32::MAX] {
            let mut values = named(&whole);
            values[place].1 = value;
            let (loaded, remarks) = start_in(Sector::B, &of_values(&values, 1));
            assert_eq!(remarks, [Remark::Refused(ParamError { name, value, min, max })]);
            assert!(!loaded.sound);
            values[place].1 = named(&Record::DEFAULT)[place].1;
            assert_eq!(named(&loaded.record), values, "all others are taken");
        }
        for value in [min, max] {
            let mut values = named(&whole);
            values[place].1 = value;
            let (loaded, _) = start_in(Sector::B, &of_values(&values, 1));
            assert!(loaded.sound);
            assert_eq!(named(&loaded.record), values);
        }
    }
}

/// The gains as their documentation has them: two in a value, the first in its low half.
fn with_gains_of(record: &Record, words: core::ops::Range<u32>, change: impl Fn(u32, u32) -> u32) -> Vec<u8> {
    let first = crc32fast::hash(b"gains_10x10");
    let word = |word: u32| (first.wrapping_add(word), change(word, record.gains.word(word as usize)).cast_signed());
    let named = named(record).into_iter().map(|(name, value)| (crc32fast::hash(name.as_bytes()), value));
    of_numbers(&named.chain(words.map(word)).collect::<Vec<_>>(), 1)
}

#[test]
fn gains_are_stored_two_in_a_value_behind_the_parameters() {
    let record = with_gains(4);
    let bytes = with_gains_of(&record, 0..50, |_, gains| gains);
    assert_eq!(bytes, encode(&record, 1));
    assert_eq!(start_in(Sector::A, &bytes), (Loaded { record, sound: true }, vec![]));
}

#[test]
fn gains_are_taken_all_or_not_at_all() {
    let whole = with_gains(4);
    let expected = Record { gains: Gains::ONE, ..whole };
    let refused = |bytes: &[u8], taken| {
        let error = ParamError { name: "gains", value: taken, min: 8_192, max: 32_767 };
        let loaded = Loaded { record: expected, sound: false };
        assert_eq!(start_in(Sector::A, bytes), (loaded, vec![Remark::Refused(error)]));
    };
    refused(&with_gains_of(&whole, 0..49, |_, gains| gains), 49);
    refused(&with_gains_of(&whole, 1..50, |_, gains| gains), 49);
    for bad in [0, 8_191, 0x8000, 0xFFFF] {
        let spoilt = |word, gains| if word == 17 { gains & 0xFFFF | bad << 16 } else { gains };
        refused(&with_gains_of(&whole, 0..50, spoilt), 49);
    }
    // No gains, or those of another array, are unknown to this firmware.
    let (loaded, remarks) = start_in(Sector::A, &with_gains_of(&whole, 50..60, |_, gains| gains));
    assert_eq!(loaded, Loaded { record: expected, sound: true });
    assert_eq!(remarks.len(), 10);
}

#[test]
fn what_contradicts_goes_back_to_its_defaults_and_the_rest_stays() {
    let settled = |mut params: Params| {
        let mut told = 0;
        assert_eq!(settle(&mut params, Config::shipped, |_| told += 1).expect("a configuration").params, params);
        (params, told)
    };
    let own = Params { pitch_um: 1_777, ..Params::DEFAULT };
    assert_eq!(settled(own), (own, 0));
    assert_eq!(settled(Params { contact_on_mn: 100, contact_off_mn: 200, ..own }), (own, 1));
    assert_eq!(settled(Params { sample_cycles: 16, ..own }), (own, 1));
    assert_eq!(settled(Params { pitch_um: 1, ..own }), (Params { pitch_um: 1_500, ..own }, 1));
    // What goes back contradicts the next.
    let contacts = Params { contact_on_mn: 1_000, contact_off_mn: 1_900, ..own };
    let (params, told) = settled(Params { force_max_mn: 3_000, force_fault_mn: 2_900, ..contacts });
    assert!(told >= 2);
    assert_eq!(params.pitch_um, 1_777);
    // All at an end of their ranges.
    for end in 0..2 {
        let mut values = Params::RANGES.map(|(_, _, min, max)| [min, max][end]);
        values[0] += 1 - 2 * end as i32;
        settled(Params::from_array(&values));
    }
    // If nothing helps, a remark reports it.
    let mut params = own;
    let error = Config::shipped(&Params { pitch_um: 1, ..own }).expect_err("out of range");
    assert!(settle(&mut params, |_| Err::<(), _>(error), |_| ()).is_none());
    assert_eq!(params, Params::DEFAULT);
}

/// The names before the parameters, and the parameters' names.
fn names() -> Vec<&'static str> {
    let head = ["id", "baud_code", "return_delay_2us", "fit_level"].into_iter();
    head.chain(Params::RANGES.iter().map(|(name, ..)| *name)).collect()
}

/// Names and values of a record, in the order in which they are stored.
fn named(record: &Record) -> Vec<(&'static str, i32)> {
    let head = [record.id, record.baud_code, record.return_delay_2us, record.fit_level as u8];
    let values = head.map(i32::from).into_iter().chain(record.params.to_array());
    names().into_iter().zip(values).collect()
}

/// A record as its documentation describes it.
fn of_values(values: &[(&str, i32)], sequence: u32) -> Vec<u8> {
    let numbered = values.iter().map(|(name, value)| (crc32fast::hash(name.as_bytes()), *value));
    of_numbers(&numbered.collect::<Vec<_>>(), sequence)
}

/// The same of values by their numbers.
fn of_numbers(values: &[(u32, i32)], sequence: u32) -> Vec<u8> {
    let mut bytes = b"FTPR".to_vec();
    bytes.extend(sequence.to_le_bytes());
    bytes.extend((values.len() as u32).to_le_bytes());
    for (number, value) in values {
        bytes.extend(number.to_le_bytes());
        bytes.extend(value.to_le_bytes());
    }
    bytes.extend(crc32fast::hash(&bytes).to_le_bytes());
    bytes.resize(bytes.len().next_multiple_of(16), 0xFF);
    bytes
}

/// What another firmware's records have instead of this one's values.
type Other = fn(&mut Vec<(&'static str, i32)>);

/// The same values, one more, one fewer, and one under another name.
const OTHERS: [Other; 4] = [
    |_| {},
    |values| values.insert(9, ("one_more", -5)),
    |values| values.retain(|(name, _)| *name != LACKED),
    |values| values.iter_mut().filter(|(name, _)| *name == LACKED).for_each(|value| value.0 = "another_name"),
];

/// The parameter that others lack.
const LACKED: &str = "clearance_um";

/// Bytes of another firmware's record with this number, and the record that this firmware has to load from them.
fn record_of(other: Other, number: i32, sequence: u32) -> (Vec<u8>, Record) {
    let mut expected = record(number);
    expected.params.clearance_um = 777;
    let mut values = named(&expected);
    other(&mut values);
    if values.iter().all(|(name, _)| *name != LACKED) {
        expected.params.clearance_um = Params::DEFAULT.clearance_um;
    }
    (of_values(&values, sequence), expected)
}
