//! What each instruction does, and when it is answered.

use fingertip::contact::FitLevel;
use fingertip::link::Actions;
use fingertip::params::Params;
use fingertip::shipped::{Record, Settings, address};

use crate::bench::{Answer, Bench, ID, hex, packet};

const BROADCAST: u8 = 254;
const GOAL: [u8; 6] = [0, 1, 0xE8, 3, 0, 0]; // 1000 mN to address 256

fn goal_mn(bench: &mut Bench) -> u32 {
    bench.number(address::GOAL_FORCE_MN, 4)
}

#[test]
fn ping_names_model_and_firmware() {
    let mut bench = Bench::new();
    let expected = Some(Answer { id: ID, error: 0, data: vec![b'F', b'T', 1] });
    assert_eq!(bench.ask_as(ID, 0x01, &[]), expected);
    assert_eq!(bench.server.reply_delay_us(), 500);
    assert_eq!(bench.ask_as(BROADCAST, 0x01, &[]), expected);
    assert_eq!(bench.server.reply_delay_us(), 500 + 140, "one slot of 14 bytes at 1 Mbaud");
    assert_eq!(bench.ask_as(2, 0x01, &[]), None);
    assert_eq!(bench.ask(0x01, &[0]).number(), 5);
}

#[test]
fn broadcast_ping_waits_for_lower_ids() {
    let mut bench = Bench::with(Record { id: 252, baud_code: 0, return_delay_2us: 0, ..Record::DEFAULT });
    bench.ask_as(BROADCAST, 0x01, &[]).expect("an answer");
    let slot_us = 14.0 * 10.0 / 9600.0 * 1e6;
    let delay = f64::from(bench.server.reply_delay_us());
    assert!((delay - 252.0 * slot_us).abs() <= 252.0, "{delay} us");
}

#[test]
fn a_write_to_all_is_silent() {
    let mut bench = Bench::new();
    assert_eq!(bench.ask_as(BROADCAST, 0x03, &GOAL), None);
    assert_eq!(goal_mn(&mut bench), 1000);
    assert_eq!(bench.ask_as(BROADCAST, 0x02, &[7, 0, 1, 0]), None, "a read from all is not answered");
    assert_eq!(bench.ask_as(BROADCAST, 0x77, &[]), None);
}

#[test]
fn reg_write_waits_for_action() {
    let mut bench = Bench::new();
    assert_eq!(bench.ask(0x05, &[]).number(), 1, "nothing registered");
    assert_eq!(bench.ask(0x04, &GOAL).number(), 0);
    assert_eq!((goal_mn(&mut bench), bench.number(address::REGISTERED_INSTRUCTION, 1)), (0, 1));
    assert_eq!(bench.ask(0x05, &[]).number(), 0);
    assert_eq!((goal_mn(&mut bench), bench.number(address::REGISTERED_INSTRUCTION, 1)), (1000, 0));

    assert_eq!(bench.ask(0x04, &[0, 1, 0xE8, 3, 0, 1]).number(), 4, "checked at once");
    assert_eq!(bench.ask(0x04, &[0, 1]).number(), 5);
    assert_eq!(bench.ask(0x04, &[]).number(), 5);
    assert_eq!(bench.ask(0x05, &[0]).number(), 5);
    assert_eq!(bench.number(address::REGISTERED_INSTRUCTION, 1), 0);

    assert_eq!(bench.ask(0x04, &[9, 0, 10]).number(), 0);
    assert_eq!(bench.write(address::TORQUE_ENABLE, &[1]), Ok(()));
    assert_eq!(bench.ask(0x05, &[]).number(), 7, "checked again");
    assert_eq!(bench.number(address::RETURN_DELAY_TIME, 1), 250);

    bench.ask(0x04, &[0, 1, 0, 0, 0, 0]);
    assert_eq!(bench.ask_as(BROADCAST, 0x05, &[]), None);
    assert_eq!(goal_mn(&mut bench), 0);
}

#[test]
fn reboot_is_answered_first() {
    let mut bench = Bench::new();
    assert_eq!(bench.ask(0x08, &[1]).number(), 5);
    assert_eq!(bench.server.take_actions(), Actions::default());
    assert_eq!(bench.ask(0x08, &[]).number(), 0);
    assert_eq!(bench.server.take_actions(), Actions { reboot: true, ..Actions::default() });
}

#[test]
fn factory_reset_keeps_what_it_is_told_to() {
    let mut params = Params::DEFAULT;
    params.pitch_um = 2_000;
    params.direction_confirmed = 1;
    let record =
        Record { id: 9, baud_code: 4, return_delay_2us: 3, fit_level: FitLevel::AllRows, params, ..Record::DEFAULT };
    for (kind, id, baud_code) in [(0x01, 9, 3), (0x02, 9, 4), (0xFF, 1, 3)] {
        let mut bench = Bench::with(record);
        assert_eq!(bench.ask(0x06, &[kind]), Answer { id: 9, error: 0, data: vec![] });
        assert_eq!(bench.server.settings().record, Record { id, baud_code, ..Record::DEFAULT });
        let actions = bench.server.take_actions();
        assert_eq!(
            actions,
            Actions {
                reboot: false,
                save: true,
                configure: true,
                calibrate: false,
                capture: None,
                baud: baud_code != 4
            }
        );
    }
    let mut bench = Bench::with(record);
    assert_eq!(bench.ask_as(BROADCAST, 0x06, &[0xFF]), None);
    assert_eq!(bench.server.settings().record, record, "reset of everything is not for all at once");
    assert_eq!(bench.ask(0x06, &[0x03]).number(), 4);
    assert_eq!(bench.ask(0x06, &[]).number(), 5);
    bench.write(address::TORQUE_ENABLE, &[1]).expect("torque");
    assert_eq!(bench.ask(0x06, &[0x01]).number(), 7);
    assert_eq!(bench.server.settings().record, record);
    assert_eq!(bench.server.take_actions(), Actions::default());
}

#[test]
fn unknown_instructions_are_refused() {
    let mut bench = Bench::new();
    let known = [0x01, 0x02, 0x03, 0x04, 0x05, 0x06, 0x08, 0x10, 0x20, 0x55];
    for instruction in (0..=255).filter(|number| !known.contains(number)) {
        assert_eq!(bench.ask(instruction, &[]), Answer { id: ID, error: 2, data: vec![] }, "{instruction:02X}");
    }
}

#[test]
fn missing_and_surplus_parameters_are_refused() {
    let mut bench = Bench::new();
    for params in [&[][..], &[7], &[7, 0], &[7, 0, 1], &[7, 0, 1, 0, 0]] {
        assert_eq!(bench.ask(0x02, params).number(), 5, "{params:?}");
    }
    for params in [&[][..], &[7], &[7, 0]] {
        assert_eq!(bench.ask(0x03, params).number(), 5, "{params:?}");
    }
}

#[test]
fn a_packet_too_long_to_keep_is_refused() {
    let mut bench = Bench::new();
    let params = vec![0; 384 - 11];
    assert_eq!(bench.ask(0x03, &params).number(), 7, "the longest that fits is looked at");
    // 400 parameters and their CRC, put together by hand.
    let mut bytes = hex("FF FF FD 00 01 93 01 03");
    bytes.extend([0; 400]);
    let crc = fingertip::link::packet::update_crc(0, &bytes);
    bytes.extend(crc.to_le_bytes());
    let replies = bench.hear(&bytes);
    assert_eq!(replies.iter().map(|reply| reply[8]).collect::<Vec<_>>(), [5]);
}

#[test]
fn the_status_return_level_is_honoured() {
    for (level, ping, read, write) in [(0, true, false, false), (1, true, true, false), (2, true, true, true)] {
        let mut bench = Bench::new();
        bench.write(address::STATUS_RETURN_LEVEL, &[level]).expect("answered at the level before");
        assert_eq!(bench.ask_as(ID, 0x01, &[]).is_some(), ping);
        assert_eq!(bench.ask_as(ID, 0x02, &[7, 0, 1, 0]).is_some(), read);
        assert_eq!(bench.ask_as(ID, 0x02, &[7, 0, 0, 0]).is_some(), read, "a refused read");
        assert_eq!(bench.ask_as(ID, 0x03, &GOAL).is_some(), write);
        assert_eq!(bench.ask_as(ID, 0x77, &[]).is_some(), write);
        assert_eq!(bench.server.command().goal.to_bits(), 65_536, "it is carried out all the same");
    }
}

#[test]
fn a_damaged_packet_is_answered_only_by_whom_it_names() {
    let mut bench = Bench::new();
    for (id, answers) in [(ID, 1), (2, 0), (BROADCAST, 0)] {
        let mut bytes = packet(id, 0x03, &GOAL);
        *bytes.last_mut().expect("a CRC") ^= 1;
        let replies = bench.hear(&bytes);
        assert_eq!(replies.len(), answers);
        assert!(replies.iter().all(|reply| reply[8] == 3));
    }
    let mut status = packet(ID, 0x55, &[0]);
    *status.last_mut().expect("a CRC") ^= 1;
    assert!(bench.hear(&status).is_empty(), "not an instruction");
    assert_eq!(goal_mn(&mut bench), 0);
    assert_eq!(bench.number(address::CRC_ERRORS, 2), 4);
}

#[test]
fn a_new_id_and_speed_come_after_the_reply() {
    let mut bench = Bench::new();
    assert_eq!(bench.ask(0x03, &[7, 0, 5, 4]), Answer { id: ID, error: 0, data: vec![] });
    let settings: &Settings = bench.server.settings();
    assert_eq!((settings.record.id, settings.baud()), (5, 2_000_000));
    assert_eq!(bench.server.take_actions(), Actions { baud: true, ..Actions::default() });
    assert_eq!(bench.ask_as(ID, 0x01, &[]), None);
    assert_eq!(bench.ask_as(5, 0x01, &[]).map(|answer| answer.id), Some(5));
}

#[test]
fn a_save_is_told_about() {
    let mut bench = Bench::new();
    bench.write(address::RETURN_DELAY_TIME, &[5]).expect("a write");
    assert_eq!(bench.number(address::SAVED_STATE, 1), 1);
    bench.write(address::SAVE_PARAMETERS, &[1]).expect("a write");
    assert!(bench.server.take_actions().save);
    bench.server.note_saved(false);
    assert_eq!(bench.number(address::SAVED_STATE, 1), 2);
    bench.server.note_saved(true);
    assert_eq!(bench.number(address::SAVED_STATE, 1), 0);
}
