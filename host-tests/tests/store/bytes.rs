//! A record's bytes, and what is never taken for a record.

use crate::nor::{Nor, bits, record};
use crate::taken::{crc32, named, names, of_values};
use fingertip::shipped::{Loaded, Record};
use fingertip::store::{Flash as _, Journal, Remark, SLOT_BYTES, SaveError, Sector};
use host_tests::page::{PAGE, table};
use sim::encode;

const SIZE: usize = 8 * SLOT_BYTES;

/// What a start makes of these bytes in a sector, with the other one blank.
fn start_in(sector: Sector, bytes: &[u8]) -> (Loaded, Vec<Remark>) {
    let mut nor = Nor::blank(SIZE);
    nor.sector(sector)[..bytes.len()].copy_from_slice(bytes);
    let mut remarks = Vec::new();
    (Journal::new(&nor).load(&nor, |remark| remarks.push(remark)), remarks)
}

fn start(bytes: &[u8]) -> Loaded {
    start_in(Sector::A, bytes).0
}

#[test]
fn an_erased_board_has_the_defaults_and_no_fault() {
    assert_eq!(start_in(Sector::A, &[]), (Loaded { record: Record::DEFAULT, sound: true }, vec![]));
    let none = Nor::blank(0);
    assert_eq!(Journal::new(&none).load(&none, |_| ()), Loaded { record: Record::DEFAULT, sound: true });
}

#[test]
fn garbage_is_a_fault_with_the_defaults_and_the_next_save_ends_it() {
    let garbage: Vec<u8> = (0..SIZE as u64).map(|place| bits(place) as u8).collect();
    for both in [false, true] {
        let other = if both { garbage.clone() } else { vec![0xFF; SIZE] };
        let mut nor = Nor::new([garbage.clone(), other]);
        let mut journal = Journal::new(&nor);
        assert_eq!(
            journal.load(&nor, |remark| assert_eq!(remark, Remark::NoneWhole)),
            Loaded { record: Record::DEFAULT, sound: false }
        );
        assert_eq!(journal.make_room(&mut nor, SLOT_BYTES), Ok(both));
        assert_eq!(journal.save(&mut nor, &record(1), || ()), Ok(()));
        let journal = Journal::new(&nor);
        assert_eq!(journal.load(&nor, |_| ()), Loaded { record: record(1), sound: true });
    }
}

/// Bytes of a record without what fills it up to the next one's place.
fn whole() -> usize {
    12 + 8 * names().len() + 4
}

#[test]
fn the_bytes_are_the_documented_ones() {
    let bytes = encode(&record(9), 0x1234_5678);
    assert_eq!(bytes[..], of_values(&named(&record(9)), 0x1234_5678));
    assert_eq!(bytes[..8], *b"FTPR\x78\x56\x34\x12");
    assert_eq!(bytes[12..16], crc32(b"id").to_le_bytes());
    assert_eq!(bytes[16..20], 9u32.to_le_bytes());
}

#[test]
fn every_flipped_bit_of_the_newest_is_seen_and_the_one_before_counts() {
    for sector in [Sector::A, Sector::B] {
        let mut both = [encode(&record(1), 1), encode(&record(2), 2)].concat();
        assert_eq!(start_in(sector, &both).0, Loaded { record: record(2), sound: true });
        for place in SLOT_BYTES..SLOT_BYTES + whole() {
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
fn a_write_cut_short_anywhere_is_no_record() {
    let bytes = encode(&record(2), 2);
    for cut in 1..whole() {
        let both = [&encode(&record(1), 1)[..], &bytes[..cut]].concat();
        assert_eq!(start(&both), Loaded { record: record(1), sound: false }, "cut after {cut} bytes");
        assert_eq!(start(&bytes[..cut]), Loaded { record: Record::DEFAULT, sound: false });
    }
}

#[test]
fn the_sequence_tells_which_sector_is_newer_also_where_it_wraps() {
    for first in [0, 1, 0x7FFF_FFFF, 0x8000_0000, u32::MAX - 1, u32::MAX] {
        let mut nor = Nor::blank(SIZE);
        nor.sector(Sector::A)[..SLOT_BYTES].copy_from_slice(&encode(&record(1), first));
        nor.sector(Sector::B)[..SLOT_BYTES].copy_from_slice(&encode(&record(2), first.wrapping_add(1)));
        let load = |nor: &Nor| Journal::new(nor).load(nor, |_| ());
        assert_eq!(load(&nor), Loaded { record: record(2), sound: true }, "{first}");
        nor.sector(Sector::A)[..SLOT_BYTES].copy_from_slice(&encode(&record(3), first.wrapping_add(2)));
        assert_eq!(load(&nor), Loaded { record: record(3), sound: true }, "{first}");
        let mut journal = Journal::new(&nor);
        assert_eq!(journal.save(&mut nor, &record(4), || ()), Ok(()));
        assert_eq!(nor.bytes(Sector::A)[SLOT_BYTES + 4..][..4], first.wrapping_add(3).to_le_bytes());
    }
}

#[test]
fn a_count_that_no_record_has_is_none() {
    for count in [257, 0x1000_0000, 0x2000_0000, u32::MAX] {
        let mut bytes = encode(&record(1), 1);
        bytes[8..12].copy_from_slice(&count.to_le_bytes());
        assert_eq!(start(&bytes), Loaded { record: Record::DEFAULT, sound: false });
    }
}

#[test]
fn a_sector_with_older_records_is_not_written_before_it_is_erased() {
    let mut nor = Nor::blank(SIZE);
    for number in 0..7 {
        let place = number as usize * SLOT_BYTES;
        nor.sector(Sector::A)[place..place + SLOT_BYTES].copy_from_slice(&encode(&record(number), 9 + number as u32));
    }
    // What an erase that was cut short may leave: behind it some bits are weak.
    nor.sector(Sector::B)[..SLOT_BYTES].copy_from_slice(&encode(&record(100), 1));
    let mut journal = Journal::new(&nor);
    assert_eq!(journal.save(&mut nor, &record(7), || ()), Ok(()));
    assert_eq!(journal.save(&mut nor, &record(8), || ()), Err(SaveError::Full));
    let mut journal = Journal::new(&nor);
    assert_eq!(journal.make_room(&mut nor, SLOT_BYTES), Ok(true));
    assert_eq!(journal.save(&mut nor, &record(8), || ()), Ok(()));
    assert_eq!(Journal::new(&nor).load(&nor, |_| ()), Loaded { record: record(8), sound: true });
}

#[test]
fn something_happens_before_each_word_of_a_save() {
    let mut nor = Nor::blank(SIZE);
    let mut fed = 0;
    assert_eq!(Journal::new(&nor).save(&mut nor, &record(1), || fed += 1), Ok(()));
    assert_eq!(fed, SLOT_BYTES / 4);
}

#[test]
fn the_table_of_saves_is_fresh() {
    PAGE.check(&table()).expect("docs/firmware.md");
}
