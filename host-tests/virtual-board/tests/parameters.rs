//! Parameters in the flash of the emulated board: sectors that take turns, and words that take as long as they may.

use crate::common::{image, read_u8, read_u32, reboot, register, write_u8, write_u32};
use fingertip::link::table::address;
use fingertip::shipped::Record;
use fingertip::store::SLOT_BYTES;
use sim::encode;
use sim::plant::{Plant, Setup};
use virtual_board::flash::{OTHER_SECTOR, SECTOR};
use virtual_board::{Options, Rig};

const SECTOR_BYTES: usize = 128 << 10;
const SLOTS: usize = SECTOR_BYTES / SLOT_BYTES;
/// Start time of a board with full sectors to read, ms.
const START_MS: u64 = 100;
/// Longest time to program a word, ns (DS10693).
const WORD_MAX_NS: u64 = 100_000;
/// Time of an erase at 8 bits on the emulated part, ms.
const ERASE_MS: u64 = 2_000;

fn record(pitch_um: i32) -> Record {
    let mut record = Record { return_delay_2us: 0, ..Record::DEFAULT };
    record.params.pitch_um = pitch_um;
    record
}

/// Bytes of a sector with `count` records.
fn filled(count: usize, first_sequence: u32) -> Vec<u8> {
    (0..count).flat_map(|place| encode(&record(1_000 + place as i32), first_sequence + place as u32)).collect()
}

fn start(presets: Vec<(u64, Vec<u8>)>) -> Rig {
    let options = Options { presets, ..Options::default() };
    let mut rig = Rig::new(&image(), Plant::new(&Setup::default()), &options).expect("the image starts");
    rig.with(|stand| stand.bench.flash.word_ns = WORD_MAX_NS).expect("it runs");
    rig.run_ms(START_MS).expect("it runs");
    rig
}

fn set_and_save(rig: &mut Rig, pitch_um: u32) {
    write_u32(rig, register("pitch_um"), pitch_um);
    rig.run_ms(10).expect("it runs");
    write_u8(rig, address::SAVE_PARAMETERS, 1);
    // 98 words of 100 us.
    rig.run_ms(12).expect("it runs");
}

fn pitch_um(rig: &mut Rig) -> u32 {
    read_u32(rig, register("pitch_um"))
}

fn words_and_erases(rig: &mut Rig) -> (u64, u64) {
    rig.with(|stand| (stand.bench.flash.words, stand.bench.flash.erases)).expect("it runs")
}

#[test]
fn a_save_with_the_longest_times_is_no_fault_and_no_reset() {
    let mut rig = start(Vec::new());
    for pitch in [1_600, 1_700] {
        set_and_save(&mut rig, pitch);
        assert_eq!(read_u8(&mut rig, address::SAVED_STATE), 0, "the same as the flash");
        assert_eq!(read_u8(&mut rig, address::FAULT), 0);
        assert_eq!(read_u8(&mut rig, address::PRESENT_MODE), 0, "off");
    }
    assert_eq!(rig.resets().expect("it runs"), vec![]);
    // A word that is blank anyway is not programmed.
    let (words, erases) = words_and_erases(&mut rig);
    assert!((196..=200).contains(&words), "{words} words");
    assert_eq!(erases, 0);
    // The scan goes on: torque can be enabled after a tare.
    let before = rig.scan_counts().expect("it runs").frames;
    rig.run_ms(2).expect("it runs");
    assert!(rig.scan_counts().expect("it runs").frames > before + 15);
    reboot(&mut rig, START_MS);
    assert_eq!((pitch_um(&mut rig), read_u8(&mut rig, address::FAULT)), (1_700, 0));
    rig.check_gaps().expect("no unknown gap");
}

#[test]
fn nearly_full_sectors_take_turns() {
    // The newest record is the last but one of the first sector, the other sector has older ones.
    let first = filled(SLOTS - 1, 10_000);
    let mut rig = start(vec![(SECTOR.start, first), (OTHER_SECTOR.start, filled(SLOTS, 10_000 - SLOTS as u32))]);
    // The start erases the sector with the older ones, at 32 bits: half of the time that it takes at 8.
    let mut frames_at = |ms: u64| {
        rig.run_until_ns(ms * 1_000_000).expect("it runs");
        rig.scan_counts().expect("it runs").frames
    };
    assert_eq!(frames_at(ERASE_MS / 2 - 100), 0, "no scan while it is erased");
    assert!(frames_at(ERASE_MS / 2 + START_MS) > 0);
    assert_eq!(words_and_erases(&mut rig).1, 1);
    let newest = 1_000 + SLOTS as u32 - 2;
    assert_eq!((pitch_um(&mut rig), read_u8(&mut rig, address::FAULT)), (newest, 0));
    // One fits, the other goes to the erased sector.
    set_and_save(&mut rig, 2_001);
    set_and_save(&mut rig, 2_002);
    assert_eq!(read_u8(&mut rig, address::SAVED_STATE), 0, "the same as the flash");
    let begins = |sector: u64| {
        move |stand: &mut virtual_board::stand::Stand<'_>| {
            [0, 1, 2, 3].map(|n| stand.host.read(sector + n, rigless::soc::Width::W8).unwrap_or(0) as u8)
        }
    };
    assert_eq!(rig.with(begins(OTHER_SECTOR.start)).expect("it runs"), *b"FTPR");
    reboot(&mut rig, START_MS);
    assert_eq!((pitch_um(&mut rig), read_u8(&mut rig, address::FAULT)), (2_002, 0));
    assert_eq!(words_and_erases(&mut rig).1, 1, "the sector with room is not erased");
    rig.check_gaps().expect("no unknown gap");
}

#[test]
fn after_a_save_cut_short_the_old_values_count_and_fault_8_says_so() {
    let mut presets = encode(&Record { id: 1, ..record(1_111) }, 1).to_vec();
    presets.extend(&encode(&record(1_222), 2)[..200]);
    let mut rig = start(vec![(SECTOR.start, presets)]);
    assert_eq!((pitch_um(&mut rig), read_u8(&mut rig, address::FAULT)), (1_111, 8));
    // A save ends it.
    set_and_save(&mut rig, 1_333);
    reboot(&mut rig, START_MS);
    assert_eq!((pitch_um(&mut rig), read_u8(&mut rig, address::FAULT)), (1_333, 0));
}
