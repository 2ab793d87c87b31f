//! The parameter record in flash.

use fingertip::contact::Effort;
use fingertip::params::Params;
use fingertip::store::{Damage, Record, SLOT_BYTES, StoreError, encode, latest, newest_whole, next_offset};
use proptest::prelude::*;
use proptest::test_runner::RngSeed;

const SECTOR: usize = 16 * 1024;

fn record(id: u8) -> Record {
    let mut params = Params::DEFAULT;
    params.pitch_um = 1_000 + i32::from(id);
    Record { id, baud_code: 4, return_delay_2us: 7, effort: Effort::TwoRows, params }
}

/// A sector to which records were saved one after the other.
fn sector(ids: impl IntoIterator<Item = u8>) -> Vec<u8> {
    let mut sector = vec![0xFF; SECTOR];
    for id in ids {
        save(&mut sector, &encode(&record(id)));
    }
    sector
}

fn save(sector: &mut [u8], bytes: &[u8]) {
    let place = next_offset(sector).expect("room");
    assert!(sector[place..place + SLOT_BYTES].iter().all(|&byte| byte == 0xFF), "flash is written once");
    sector[place..place + bytes.len()].copy_from_slice(bytes);
}

#[test]
fn a_blank_sector_holds_nothing() {
    assert_eq!(latest(&sector([])), Ok(None));
    assert_eq!(latest(&[]), Ok(None));
    assert_eq!(next_offset(&sector([])), Some(0));
    assert_eq!(next_offset(&[]), None);
    assert_eq!(newest_whole(&sector([])), None);
}

#[test]
fn the_newest_record_counts_until_the_sector_is_full() {
    let slots = SECTOR / SLOT_BYTES;
    assert!(slots >= 100, "{slots} saves to an erase");
    for count in 1..=slots {
        let sector = sector((0..count).map(|place| place as u8));
        assert_eq!(latest(&sector), Ok(Some(record(count as u8 - 1))));
        let next = (count < slots).then_some(count * SLOT_BYTES);
        assert_eq!(next_offset(&sector), next);
    }
}

/// CRC-32 (ISO-HDLC), bit by bit.
fn crc32(bytes: &[u8]) -> [u8; 4] {
    let mut crc = !0u32;
    for byte in bytes {
        crc ^= u32::from(*byte);
        for _ in 0..8 {
            crc = if crc & 1 == 1 { crc >> 1 ^ 0xEDB8_8320 } else { crc >> 1 };
        }
    }
    (!crc).to_le_bytes()
}

#[test]
fn the_layout_is_the_documented_one() {
    let bytes = encode(&record(9));
    let head = ["id", "baud_code", "return_delay_2us", "effort"].into_iter();
    let names: String =
        head.chain(Params::RANGES.iter().map(|(name, ..)| *name)).map(|name| format!("{name}\n")).collect();
    assert_eq!(bytes[..4], *b"FTIP");
    assert_eq!(bytes[4..8], crc32(names.as_bytes()));
    assert_eq!(bytes[8..12], [9, 4, 7, 3]);
    assert_eq!(bytes[12..16], record(9).params.tip_radius_um.to_le_bytes());
    let end = 12 + 4 * Params::COUNT;
    assert_eq!(bytes[end..end + 4], crc32(&bytes[..end]));
    assert!(bytes[end + 4..].iter().all(|&byte| byte == 0xFF));
}

#[test]
fn a_write_cut_short_anywhere_is_never_taken_for_a_record() {
    let bytes = encode(&record(2));
    let whole = bytes.iter().rposition(|&byte| byte != 0xFF).expect("a record") + 1;
    for cut in 1..whole {
        let mut sector = sector([1]);
        save(&mut sector, &bytes[..cut]);
        let expected = StoreError { offset: SLOT_BYTES, damage: Damage::Unreadable };
        assert_eq!(latest(&sector), Err(expected), "cut after {cut} bytes");
        assert_eq!(newest_whole(&sector), Some(record(1)));
        // The next save mends it.
        save(&mut sector, &encode(&record(3)));
        assert_eq!(latest(&sector), Ok(Some(record(3))));
    }
}

#[test]
fn every_flipped_bit_is_seen() {
    for place in 0..12 + 4 * Params::COUNT + 4 {
        for bit in 0..8 {
            let mut sector = sector([1, 2]);
            sector[SLOT_BYTES + place] ^= 1 << bit;
            assert!(latest(&sector).is_err(), "bit {bit} of byte {place}");
            assert_eq!(newest_whole(&sector), Some(record(1)));
        }
    }
}

#[test]
fn a_record_of_another_layout_or_out_of_range_is_refused() {
    let refused = |record: Record| latest(&encode(&record)).expect_err("refused").damage;
    assert_eq!(refused(Record { id: 253, ..record(1) }), Damage::Head);
    assert_eq!(refused(Record { baud_code: 6, ..record(1) }), Damage::Head);
    assert_eq!(refused(Record { return_delay_2us: 255, ..record(1) }), Damage::Head);
    let mut bad = encode(&record(1));
    bad[11] = 6;
    let end = 12 + 4 * Params::COUNT;
    let crc = crc32(&bad[..end]);
    bad[end..end + 4].copy_from_slice(&crc);
    assert_eq!(latest(&bad).expect_err("refused").damage, Damage::Head);
    let mut bad = record(1);
    bad.params.pitch_um = 0;
    assert!(matches!(refused(bad), Damage::Param(error) if error.name == "pitch_um"));
    for place in 4..8 {
        let mut other = encode(&record(1));
        other[place] ^= 1;
        // With the CRC that such a record would have.
        let end = 12 + 4 * Params::COUNT;
        let crc = crc32(&other[..end]);
        other[end..end + 4].copy_from_slice(&crc);
        assert_eq!(latest(&other).expect_err("refused").damage, Damage::Unreadable);
    }
}

proptest! {
    #![proptest_config(ProptestConfig {
        cases: 1000, rng_seed: RngSeed::Fixed(22), failure_persistence: None, ..ProptestConfig::default()
    })]

    #[test]
    fn what_is_saved_is_read(shares in prop::collection::vec(0.0..=1.0f64, Params::COUNT), id in 0..=252u8) {
        let mut values = [0; Params::COUNT];
        for ((value, (_, _, min, max)), share) in values.iter_mut().zip(Params::RANGES).zip(&shares) {
            *value = (f64::from(min) + f64::from(max - min) * share).round() as i32;
        }
        let record = Record { id, baud_code: id % 6, return_delay_2us: id, effort: Effort::from_number(id % 6), params: Params::from_array(&values) };
        let mut sector = sector([1]);
        save(&mut sector, &encode(&record));
        prop_assert_eq!(latest(&sector), Ok(Some(record)));
    }

    #[test]
    fn no_bytes_make_it_fail(bytes in prop::collection::vec(any::<u8>(), 0..600)) {
        let _ = (latest(&bytes), newest_whole(&bytes), next_offset(&bytes));
    }
}
