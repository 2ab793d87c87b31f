//! What a firmware takes of another firmware's values, and what it says of the rest.

use crate::fleet::{BEFORE, LACKED, OTHERS, Other, named, of_values};
use crate::nor::{Nor, record};
use fingertip::params::{ParamError, Params};
use fingertip::shipped::Config;
use fingertip::store::{Journal, Loaded, Record, Remark, SLOT_BYTES, Sector, number, settle};

fn start(bytes: &[u8]) -> (Loaded, Vec<Remark>) {
    let mut nor = Nor::blank(4 * SLOT_BYTES);
    nor.sector(Sector::B)[..bytes.len()].copy_from_slice(bytes);
    let mut remarks = Vec::new();
    (Journal::new(&nor).load(&nor, |remark| remarks.push(remark)), remarks)
}

#[test]
fn a_changed_layout_is_no_fault_and_every_known_value_is_taken() {
    for other in OTHERS {
        let (bytes, expected) = other.record(3, 9);
        let (loaded, remarks) = start(&bytes);
        assert_eq!(loaded, Loaded { record: expected, sound: true }, "{other:?}");
        let expected = match other {
            Other::None => vec![],
            Other::Before => Params::RANGES[BEFORE..].iter().map(|(name, ..)| Remark::New(name)).collect(),
            Other::More => vec![Remark::Unknown { number: number("one_more"), value: -5 }],
            Other::Fewer => vec![Remark::New(LACKED)],
            Other::Renamed => {
                vec![Remark::Unknown { number: number("another_name"), value: 777 }, Remark::New(LACKED)]
            }
        };
        assert_eq!(remarks, expected, "{other:?}");
    }
}

#[test]
fn the_order_of_the_values_does_not_count() {
    let mut values = named(&record(8));
    values.reverse();
    assert_eq!(start(&of_values(&values, 1)).0, Loaded { record: record(8), sound: true });
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
            let (loaded, remarks) = start(&of_values(&values, 1));
            assert_eq!(remarks, [Remark::Refused(ParamError { name, value, min, max })]);
            assert!(!loaded.sound);
            values[place].1 = named(&Record::DEFAULT)[place].1;
            assert_eq!(named(&loaded.record), values, "all others are taken");
        }
        for value in [min, max] {
            let mut values = named(&whole);
            values[place].1 = value;
            let (loaded, _) = start(&of_values(&values, 1));
            assert!(loaded.sound);
            assert_eq!(named(&loaded.record), values);
        }
    }
}

#[test]
fn no_values_at_all_are_all_defaults() {
    let (loaded, remarks) = start(&of_values(&[], 1));
    assert_eq!(loaded, Loaded { record: Record::DEFAULT, sound: true });
    assert_eq!(remarks.len(), named(&Record::DEFAULT).len());
}

#[test]
fn what_contradicts_goes_back_to_its_defaults_and_the_rest_stays() {
    let settled = |mut params: Params| {
        let mut told = 0;
        let made = settle(&mut params, Config::shipped, |_| told += 1);
        assert_eq!(made.expect("a configuration").params, params);
        (params, told)
    };
    let own = Params { pitch_um: 1_777, ..Params::DEFAULT };
    assert_eq!(settled(own), (own, 0));
    assert_eq!(settled(Params { contact_on_mn: 100, contact_off_mn: 200, ..own }), (own, 1));
    assert_eq!(settled(Params { sample_cycles: 16, ..own }), (own, 1));
    assert_eq!(settled(Params { pitch_um: 1, ..own }), (Params { pitch_um: 1_500, ..own }, 1));
    // What goes back contradicts the next.
    let (params, told) = settled(Params {
        force_max_mn: 3_000,
        force_fault_mn: 2_900,
        contact_on_mn: 1_000,
        contact_off_mn: 1_900,
        ..own
    });
    assert!(told >= 2);
    assert_eq!(params.pitch_um, 1_777);
    // All at an end of their ranges.
    for end in 0..2 {
        let mut values = Params::RANGES.map(|(_, _, min, max)| [min, max][end]);
        values[0] += 1 - 2 * end as i32;
        settled(Params::from_array(&values));
    }
    // Where nothing helps it says so.
    let mut params = own;
    let error = Config::shipped(&Params { pitch_um: 1, ..own }).expect_err("out of range");
    assert!(settle(&mut params, |_| Err::<(), _>(error), |_| ()).is_none());
    assert_eq!(params, Params::DEFAULT);
}
