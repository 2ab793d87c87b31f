//! Parameters in the flash of the emulated board: sectors that take turns, and words that take as long as they may.

use crate::common::*;
use fingertip::state::Fault;
use fingertip::store::SLOT_BYTES;
use sim::encode;
use virtual_board::flash::{ERASE_NS, OTHER_SECTOR, SECTOR};

const SECTOR_BYTES: usize = 128 << 10;
const ERASED: u8 = 0xff;
const SLOTS: usize = SECTOR_BYTES / SLOT_BYTES;
/// Start time of a board with full sectors to read, ms.
const START_MS: u64 = 100;
/// Longest time to program a word, ns (DS10693).
const WORD_MAX_NS: u64 = 100_000;
const ERASE_MS: u64 = ERASE_NS / 1_000_000;

fn record(pitch_um: i32) -> Record {
    let mut record = Record { return_delay_2us: 0, ..Record::DEFAULT };
    record.params.pitch_um = pitch_um;
    record
}

/// Bytes of a sector with `count` records.
fn filled(count: usize, first_sequence: u32) -> Vec<u8> {
    (0..count).flat_map(|place| encode(&record(1_000 + place as i32), first_sequence + place as u32)).collect()
}

/// A board that needs the longest time for each word.
fn start() -> Rig {
    let mut rig = running(&Setup::default(), &Options::default());
    with(&mut rig, |stand| stand.bench.flash.word_ns = WORD_MAX_NS);
    rig
}

/// Puts bytes at the begin of both sectors, and lets the board start with them.
fn start_with(rig: &mut Rig, first: Vec<u8>, other: Vec<u8>) {
    with(rig, |stand| {
        for (sector, mut bytes) in [(SECTOR, first), (OTHER_SECTOR, other)] {
            bytes.resize(SECTOR_BYTES, ERASED);
            for (address, word) in sector.step_by(8).zip(bytes.as_chunks().0) {
                let word = u64::from_le_bytes(*word);
                if stand.host.read(address, Width::W64).ok() != Some(word) {
                    stand.host.program(address, Width::W64, word).expect("the flash can be programmed");
                }
            }
        }
    });
    reboot(rig, 0);
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
    with(rig, |stand| (stand.bench.flash.words, stand.bench.flash.erases))
}

sim::sizes!(stored_parameters_outlive_long_times_full_sectors_and_damage, outlive(false), outlive(true));

fn outlive(full_sectors: bool) {
    let mut rig = start();
    a_parameter_and_torque_in_one_packet_both_act(&mut rig);
    a_save_with_the_longest_times_is_no_fault_and_no_reset(&mut rig);
    let sound = messages_of_a_start(&mut rig, encode(&record(1_700), 1).to_vec());
    after_a_save_cut_short_the_old_values_count_and_fault_8_says_so(&mut rig, sound);
    damaged_parameters_are_a_fault_that_the_bus_tells(&mut rig, sound);
    if full_sectors {
        nearly_full_sectors_take_turns(&mut rig);
    }
}

/// The parameter comes first: it would stop what torque began.
fn a_parameter_and_torque_in_one_packet_both_act(rig: &mut Rig) {
    write_param(rig, "direction_confirmed", 1);
    write_and_run_ms(rig, address::TARE, 1, 20);
    let pitch = register("pitch_um");
    for (place, led_to) in (pitch..pitch + 4).chain([address::TORQUE_ENABLE]).enumerate() {
        write_u16(rig, address::INDIRECT_ADDRESS_1 + 2 * place as u16, led_to);
    }
    write(rig, address::INDIRECT_DATA_1, &[0xa4, 0x06, 0, 0, 1]);
    rig.run_ms(10).expect("it runs");
    assert_eq!((pitch_um(rig), read_u8(rig, address::PRESENT_MODE)), (1_700, Mode::Release as u8));
    write_u8(rig, address::TORQUE_ENABLE, 0);
    write_param(rig, "direction_confirmed", 0);
}

fn a_save_with_the_longest_times_is_no_fault_and_no_reset(rig: &mut Rig) {
    for pitch in [1_600, 1_700] {
        set_and_save(rig, pitch);
        assert_eq!(read_u8(rig, address::SAVED_STATE), 0, "the same as the flash");
        assert_eq!(read_u8(rig, address::FAULT), 0);
        assert_eq!(read_u8(rig, address::PRESENT_MODE), 0, "off");
    }
    assert_eq!(rig.resets().expect("it runs"), vec![]);
    // A word that is blank anyway is not programmed.
    let (words, erases) = words_and_erases(rig);
    assert!((196..=200).contains(&words), "{words} words");
    assert_eq!(erases, 0);
    // The scan goes on: torque can be enabled after a tare.
    let before = frames(rig);
    rig.run_ms(2).expect("it runs");
    assert!(frames(rig) > before + 15);
    rig.check_gaps().expect("no unknown gap");
}

fn nearly_full_sectors_take_turns(rig: &mut Rig) {
    let erases_before = words_and_erases(rig).1;
    // The newest record is the last but one of the first sector, the other sector has older ones.
    start_with(rig, filled(SLOTS - 1, 10_000), filled(SLOTS, 10_000 - SLOTS as u32));
    // The start erases the sector with the older ones.
    let (from_ms, from) = (rig.now_ns() / 1_000_000, frames(rig));
    let mut frames_at = |ms: u64| {
        rig.run_until_ns((from_ms + ms) * 1_000_000).expect("it runs");
        frames(rig) - from
    };
    let while_it_boots = frames_at(START_MS);
    assert_eq!(frames_at(ERASE_MS - 100), while_it_boots, "no scan while it is erased");
    assert!(frames_at(ERASE_MS + START_MS) > while_it_boots);
    assert_eq!(words_and_erases(rig).1, erases_before + 1);
    let newest = 1_000 + SLOTS as u32 - 2;
    assert_eq!((pitch_um(rig), read_u8(rig, address::FAULT)), (newest, 0));
    // One fits, the other goes to the erased sector.
    set_and_save(rig, 2_001);
    set_and_save(rig, 2_002);
    assert_eq!(read_u8(rig, address::SAVED_STATE), 0, "the same as the flash");
    let begin = with(rig, |stand| stand.host.read(OTHER_SECTOR.start, Width::W32).unwrap_or(0) as u32);
    assert_eq!(begin.to_le_bytes(), *b"FTPR");
    reboot(rig, START_MS);
    assert_eq!((pitch_um(rig), read_u8(rig, address::FAULT)), (2_002, 0));
    assert_eq!(words_and_erases(rig).1, erases_before + 1, "the sector with room is not erased");
    rig.check_gaps().expect("no unknown gap");
}

fn after_a_save_cut_short_the_old_values_count_and_fault_8_says_so(rig: &mut Rig, sound: usize) {
    let mut records = encode(&Record { id: 1, ..record(1_111) }, 1).to_vec();
    records.extend(&encode(&record(1_222), 2)[..200]);
    let told = messages_of_a_start(rig, records);
    assert_eq!((pitch_um(rig), read_u8(rig, address::FAULT)), (1_111, 8));
    // Of the record, and of the fault.
    assert_eq!(told, sound + 2, "messages of the log");
}

fn damaged_parameters_are_a_fault_that_the_bus_tells(rig: &mut Rig, sound: usize) {
    let from_ns = rig.now_ns();
    let told = messages_of_a_start(rig, vec![0x55; 64]);
    assert_eq!(read_u8(rig, address::FAULT), Fault::BrokenParameters as u8);
    // Of the record, and of the fault.
    assert_eq!(told, sound + 2, "messages of the log");
    assert_ne!(refused(rig, address::TORQUE_ENABLE, &[1]) & 0x7f, 0, "torque stays off in a fault");
    assert_eq!(read_u8(rig, address::PRESENT_MODE), 5);
    assert!(rig.bridge_edges().expect("it runs").iter().all(|edge| edge.at_ns < from_ns || !edge.on));
}

/// Lets the board start with these bytes in its first sector. Returns the number of messages in its log, whose text is not
/// checked.
fn messages_of_a_start(rig: &mut Rig, stored: Vec<u8>) -> usize {
    let messages = |stand: &mut Stand<'_>| {
        stand.bench.log.drain(stand.host);
        stand.bench.log.messages
    };
    start_with(rig, stored, Vec::new());
    let before = with(rig, messages);
    rig.run_ms(START_MS).expect("it runs");
    with(rig, messages) - before
}
