//! Sync, Bulk, Fast Sync and Fast Bulk instructions: several devices on one bus hear each other.

use super::bench::{Bench, Record, *};
use crate::common::*;
use fingertip::shipped::Settings;

fn device(id: u8) -> Bench {
    let mut bench = Bench::new();
    bench.write(address::ID, &[id]).expect("an ID");
    bench.write(address::TORQUE_ENABLE, &[1]).expect("torque");
    bench.status.sequence = 100 + u32::from(id);
    bench
}

/// Lets every device hear the packet, then each the answers of the other devices, until all are silent.
fn talk(devices: &mut [Bench], bytes: &[u8]) -> Vec<Vec<u8>> {
    let mut said: Vec<(Option<usize>, Vec<u8>)> = vec![(None, bytes.to_vec())];
    let mut next = 0;
    while let Some((speaker, bytes)) = said.get(next).cloned() {
        for (place, device) in devices.iter_mut().enumerate() {
            if speaker != Some(place) {
                said.extend(device.hear(&bytes).into_iter().map(|reply| (Some(place), reply)));
            }
        }
        next += 1;
    }
    said.into_iter().skip(1).map(|(_, bytes)| bytes).collect()
}

/// ID, error and data of each answer to an instruction for all.
fn answers(devices: &mut [Bench], instruction: u8, params: &[u8]) -> Vec<(u8, u8, Vec<u8>)> {
    let replies = talk(devices, &packet(BROADCAST, instruction, params));
    replies.iter().map(|reply| answer(reply)).map(|answer| (answer.id, answer.error, answer.data)).collect()
}

#[test]
fn sync_read_is_answered_in_the_order_of_the_list() {
    let mut devices = [device(1), device(2), device(3)];
    let [low, high] = address::FRAME_COUNTER.to_le_bytes();
    let expected = [3, 1, 2].map(|id| (id, 0, vec![100 + id, 0, 0, 0]));
    assert_eq!(answers(&mut devices, 0x82, &[low, high, 4, 0, 3, 1, 2]), expected);
    let refused = [(2, 7, vec![]), (1, 7, vec![])];
    assert_eq!(answers(&mut devices, 0x82, &[0xFF, 0x7F, 1, 0, 2, 1]), refused, "in turn too");
}

#[test]
fn who_is_not_asked_is_silent_and_so_is_who_waits_in_vain() {
    let mut devices = [device(1), device(2)];
    assert!(talk(&mut devices, &packet(BROADCAST, 0x82, &[7, 0, 1, 0, 5, 1])).is_empty(), "5 is not there");
    assert!(talk(&mut devices, &packet(BROADCAST, 0x82, &[7, 0, 1, 0, 7])).is_empty());
    // The old turn is forgotten with the next instruction, whoever it is for.
    assert!(talk(&mut devices, &packet(BROADCAST, 0x82, &[7, 0, 1, 0, 5, 1])).is_empty());
    assert!(talk(&mut devices, &packet(9, 0x01, &[])).is_empty());
    assert!(talk(&mut devices, &packet(5, 0x55, &[0, 5])).is_empty());
    for params in [&[][..], &[7], &[7, 0, 1]] {
        assert!(talk(&mut devices, &packet(BROADCAST, 0x82, params)).is_empty(), "{params:?}");
    }
    assert_eq!(devices[0].number(address::LENGTH_ERRORS, 2), 3);
    assert_eq!(devices[0].ask(0x82, &[7, 0, 1, 0, 1]).number(), 2, "only for all");
}

#[test]
fn only_the_device_before_gives_the_turn() {
    let mut waiting = device(2);
    assert!(waiting.hear(&packet(BROADCAST, 0x82, &[7, 0, 1, 0, 3, 1, 2])).is_empty());
    assert!(waiting.hear(&packet(3, 0x55, &[0, 3])).is_empty());
    assert_eq!(waiting.hear(&packet(1, 0x55, &[0, 1])).len(), 1);
    assert!(waiting.hear(&packet(1, 0x55, &[0, 1])).is_empty(), "once");
}

#[test]
fn sync_write_reaches_each_with_its_own() {
    let mut devices = [device(1), device(2), device(3)];
    let entries = hex("00 01 04 00  02 E8 03 00 00  01 D0 07 00 00");
    assert!(talk(&mut devices, &packet(BROADCAST, 0x83, &entries)).is_empty());
    let goals = devices.each_mut().map(|device| device.number(address::GOAL_FORCE_MN, 4));
    assert_eq!(goals, [2000, 1000, 0]);
    // An entry that is cut short spoils the packet; one that is refused concerns its own device only.
    for entries in ["00 01 04 00  01 00 00 00 00  02 00 00", "00 01 04 00  01 00 00 00 40  02 01 00 00 00"] {
        assert!(talk(&mut devices, &packet(BROADCAST, 0x83, &hex(entries))).is_empty());
    }
    assert_eq!(devices.each_mut().map(|device| device.number(address::GOAL_FORCE_MN, 4)), [2000, 1, 0]);
    assert_eq!(devices[0].number(address::RANGE_ERRORS, 2), 1);
    assert_eq!(devices[0].number(address::LENGTH_ERRORS, 2), 1);
    // One device twice: the later entry is written after the earlier one, also where that was refused.
    for entries in ["00 01 04 00  01 D0 07 00 00  01 02 00 00 00", "00 01 04 00  01 00 00 00 40  01 03 00 00 00"] {
        assert!(talk(&mut devices, &packet(BROADCAST, 0x83, &hex(entries))).is_empty());
    }
    assert_eq!(devices[0].number(address::GOAL_FORCE_MN, 4), 3);
}

#[test]
fn bulk_read_and_write_have_addresses_of_their_own() {
    let mut devices = [device(1), device(2), device(3)];
    let entries = hex("02 00 01 04 00 E8 03 00 00  01 44 00 01 00 01");
    assert!(talk(&mut devices, &packet(BROADCAST, 0x93, &entries)).is_empty());
    assert_eq!(devices[1].number(address::GOAL_FORCE_MN, 4), 1000);
    assert_eq!(devices[0].number(address::STATUS_RETURN_LEVEL, 1), 1);
    assert!(talk(&mut devices, &packet(BROADCAST, 0x93, &hex("01 44 00 02 00 02"))).is_empty(), "cut short");
    assert_eq!(devices[0].number(address::STATUS_RETURN_LEVEL, 1), 1);

    let read = answers(&mut devices, 0x92, &hex("02 00 01 04 00  01 07 00 01 00"));
    assert_eq!(read, [(2, 0, vec![0xE8, 3, 0, 0]), (1, 0, vec![1])]);
    assert!(talk(&mut devices, &packet(BROADCAST, 0x92, &hex("02 00 01 04"))).is_empty());
}

/// The devices answer a request for these spans in one packet, whose parts each have a checksum over all before it.
fn answer_in_one_packet(devices: &mut [Bench], request: &[u8], list: &[(u8, u16, u16)]) {
    let wire = talk(devices, request).concat();
    let length = 1 + list.iter().map(|&(_, _, length)| usize::from(length) + 4).sum::<usize>();
    assert_eq!(wire.len(), 7 + length, "{wire:02X?}");
    assert_eq!(wire[..8], [0xFF, 0xFF, 0xFD, 0, 0xFE, length as u8, (length >> 8) as u8, 0x55]);
    let mut begin = 8;
    for &(id, address, length) in list {
        let data = devices[usize::from(id) - 1].read(address, length).expect("within the table");
        let end = begin + 2 + usize::from(length);
        assert_eq!(wire[begin..begin + 2], [0, id]);
        assert_eq!(wire[begin + 2..end], data, "of {id}");
        assert_eq!(wire[end..end + 2], update_crc(CRC_START, &wire[..end]).to_le_bytes(), "over all before it");
        begin = end + 2;
    }
}

/// If one device is missing, those behind it wait; the host's next packet is not taken as the missing answer.
#[test]
fn who_waits_for_one_that_is_missing_does_not_speak_into_the_next_packet() {
    let mut devices = [device(1), device(2)];
    for ids in [&[1, 9, 2][..], &[9, 2], &[1, 9, 9, 2]] {
        talk(&mut devices, &packet(BROADCAST, 0x8A, &[&[7, 0, 4, 0], ids].concat()));
        devices.iter_mut().for_each(|device| device.tick_ms = device.tick_ms.wrapping_add(10));
        let replies =
            talk(&mut devices, &packet(BROADCAST, 0x83, &[&[0x44, 0, 1, 0, 1, 2][..], &[7, 2].repeat(20)].concat()));
        assert_eq!(replies, Vec::<Vec<u8>>::new(), "{ids:?}");
    }
    // A pause between bytes at the slowest speed does not end the packet.
    let request = packet(BROADCAST, 0x8A, &[7, 0, 1, 0, 1, 2]);
    let first = devices[0].hear(&request).concat();
    assert!(devices[1].hear(&request).is_empty());
    let heard = first.iter().flat_map(|byte| {
        devices[1].tick_ms += 2;
        devices[1].hear(&[*byte])
    });
    assert_eq!(heard.count(), 1);
}

/// A device does not receive its own packet: the rest of the shared packet does not count as noise.
#[test]
fn a_shared_packet_is_no_framing_error() {
    let mut devices = [device(1), device(2), device(3), device(4)];
    let sync =
        |ids: &[u8]| packet(BROADCAST, 0x8A, &[&address::FRAME_COUNTER.to_le_bytes()[..], &[4, 0], ids].concat());
    let bulk = |id: u8, length: u8| [&[id][..], &address::PRESENT_MODE.to_le_bytes(), &[length, 0]].concat();
    let bulk = packet(BROADCAST, 0x9A, &[bulk(2, 9), bulk(1, 54), bulk(3, 1)].concat());
    let requests = [sync(&[1]), sync(&[1, 2, 3]), sync(&[3, 1, 2]), bulk];
    for request in requests.iter().chain(&requests) {
        assert!(!talk(&mut devices, request).is_empty());
        // The host waits for its time-out before it continues.
        devices.iter_mut().for_each(|device| device.tick_ms += 10);
        assert_eq!(talk(&mut devices, &packet(3, 0x01, &[])).len(), 1);
    }
    for device in &devices {
        assert_eq!(device.server.counters().framing, 0);
    }
    // After an unfinished packet of another device, and after noise, the next packet is still received.
    talk(&mut devices, &sync(&[1, 9]));
    talk(&mut devices, &[1; 40]);
    assert_eq!(talk(&mut devices, &packet(3, 0x01, &[])).len(), 1);
    assert!(devices.iter().all(|device| device.server.counters().framing == 1));
}

#[test]
fn a_fast_read_gives_way_to_another_packet() {
    let bulk = [[1, 7, 0, 1, 0], [2, 7, 0, 1, 0]].concat();
    for request in [packet(BROADCAST, 0x8A, &[7, 0, 1, 0, 1, 2]), packet(BROADCAST, 0x9A, &bulk)] {
        let mut waiting = device(2);
        assert!(waiting.hear(&request).is_empty());
        assert_eq!(waiting.hear(&packet(2, 0x01, &[])).len(), 1, "a ping is answered as ever");
        assert!(waiting.hear(&[0; 40]).is_empty(), "the turn is over");
    }
}

#[test]
fn a_fast_read_makes_one_packet_of_equal_and_unequal_parts() {
    let mut devices = [device(1), device(2), device(3)];
    let (counter, id, mode) = (address::FRAME_COUNTER, address::ID, address::PRESENT_MODE);
    for ids in [&[1][..], &[2, 3, 1], &[3, 1], &[1, 2, 3]] {
        let request = packet(BROADCAST, 0x8A, &[&counter.to_le_bytes()[..], &[4, 0], ids].concat());
        answer_in_one_packet(&mut devices, &request, &ids.iter().map(|id| (*id, counter, 4)).collect::<Vec<_>>());
    }
    for list in [
        &[(1, counter, 4)][..],
        &[(2, counter, 4), (3, id, 1), (1, mode, 7)],
        &[(3, id, 1), (1, counter, 4)],
        &[(1, mode, 62), (2, id, 3), (3, counter, 4)],
    ] {
        let entries: Vec<u8> = list
            .iter()
            .flat_map(|&(id, address, length): &(u8, u16, u16)| {
                [&[id][..], &address.to_le_bytes(), &length.to_le_bytes()].concat()
            })
            .collect();
        answer_in_one_packet(&mut devices, &packet(BROADCAST, 0x9A, &entries), list);
    }
}

#[test]
fn a_part_of_a_fast_read_that_is_refused_is_zeros_and_a_packet_too_long_is_none() {
    let mut first = device(1);
    let mut ask = |address: [u8; 2], length: [u8; 2]| {
        let sync = packet(BROADCAST, 0x8A, &[&address[..], &length, &[1]].concat());
        let bulk = packet(BROADCAST, 0x9A, &[&[1], &address[..], &length].concat());
        [sync, bulk].map(|request| first.hear(&request).concat())
    };
    for reply in ask([0xFF, 0x7F], [3, 0]) {
        assert_eq!(reply[8..13], [7, 1, 0, 0, 0], "the error, and zeros");
    }
    for length in [[1, 1], [0xFF, 0xFF]] {
        assert!(ask([0, 0], length).iter().all(Vec::is_empty), "beyond a packet's length");
    }
    assert_eq!(first.refused(StatusError::Access), 2);
    let overflows = [[1, 7, 0, 1, 0], [2, 0, 0, 0xFF, 0xFF]].concat();
    assert!(first.hear(&packet(BROADCAST, 0x9A, &overflows)).is_empty(), "beyond a packet's length");
    for params in [&[1][..], &[1, 7, 0, 1], &[1, 7, 0, 1, 0, 9]] {
        assert!(first.hear(&packet(BROADCAST, 0x9A, params)).is_empty(), "{params:?}");
    }
    assert!(first.hear(&packet(BROADCAST, 0x9A, &[])).is_empty(), "nobody is asked");
    assert_eq!(first.ask(0x9A, &[1, 7, 0, 1, 0]).number(), 2, "only for all");
}

// What each instruction does, and when it is answered.

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
    // A ping to all waits for all lower IDs.
    let mut bench = Bench::with(Record { id: 252, baud_code: 0, return_delay_2us: 0, ..Record::DEFAULT });
    bench.ask_as(BROADCAST, 0x01, &[]).expect("an answer");
    let slot_us = 14.0 * 10.0 / 9600.0 * 1e6;
    let delay = f64::from(bench.server.reply_delay_us());
    assert!((delay - 252.0 * slot_us).abs() <= 252.0, "{delay} us");
}

#[test]
fn a_write_to_all_is_silent() {
    let mut bench = Bench::on();
    assert_eq!(bench.ask_as(BROADCAST, 0x03, &GOAL), None);
    assert_eq!(goal_mn(&mut bench), 1000);
    assert_eq!(bench.ask_as(BROADCAST, 0x02, &[7, 0, 1, 0]), None, "a read from all is not answered");
    assert_eq!(bench.ask_as(BROADCAST, 0x77, &[]), None);
}

#[test]
fn reg_write_waits_for_action() {
    let mut bench = Bench::on();
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

    bench.ask(0x04, &[0, 1, 0, 0, 0, 0]);
    assert_eq!(bench.ask_as(BROADCAST, 0x05, &[]), None);
    assert_eq!(goal_mn(&mut bench), 0);

    assert_eq!(bench.write(address::TORQUE_ENABLE, &[0]), Ok(()));
    assert_eq!(bench.ask(0x04, &[9, 0, 10]).number(), 0);
    assert_eq!(bench.write(address::TORQUE_ENABLE, &[1]), Ok(()));
    assert_eq!(bench.ask(0x05, &[]).number(), 7, "checked again");
    assert_eq!(bench.number(address::RETURN_DELAY_TIME, 1), 250);
}

/// An Action that another finger waits for moves no finger that was stopped.
#[test]
fn a_stop_drops_a_registered_write() {
    let stops: [(u16, &[u8]); 7] = [
        (address::TORQUE_ENABLE, &[0]),
        (address::GOAL_FORCE_MN, &[0; 4]),
        (address::SHORT_GOAL_MN, &[0; 2]),
        (address::MIRROR_GOAL_MN, &[0; 4]),
        (address::MEASURE, &[0]),
        (address::RECOVER, &[1]),
        // A read, which only looks on.
        (address::FAULT, &[]),
    ];
    for (stop, data) in stops {
        for (torque, address, written) in
            [(1, GOAL[..2].to_vec(), &GOAL[2..]), (0, address::MEASURE.to_le_bytes().to_vec(), &[2])]
        {
            let mut bench = Bench::new();
            bench.write(address::TORQUE_ENABLE, &[torque]).expect("torque");
            assert_eq!(bench.ask(0x04, &[&address[..], written].concat()).number(), 0);
            // A write beside it drops nothing.
            bench.write(address::CAPTURE_OFFSET, &[1, 0, 0, 0]).expect("a write");
            assert_eq!(bench.number(address::REGISTERED_INSTRUCTION, 1), 1);
            if [address::RECOVER, address::FAULT].contains(&stop) {
                bench.set_fault(Some(Fault::BusSilent));
            }
            if !data.is_empty() {
                bench.write(stop, data).expect("a stop");
            }
            assert_eq!(bench.number(address::REGISTERED_INSTRUCTION, 1), 0, "{stop}");
            bench.take_up();
            bench.set_fault(None);
            let before = bench.server.command();
            assert_eq!(bench.ask_as(BROADCAST, 0x05, &[]), None);
            assert_eq!(bench.server.command(), before, "{stop}");
        }
    }
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
        let actions = Actions { save: true, configure: true, baud: baud_code != 4, ..Actions::default() };
        assert_eq!(bench.server.take_actions(), actions);
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
fn unknown_instructions_and_missing_and_surplus_parameters_are_refused() {
    let mut bench = Bench::new();
    let known = [0x01, 0x02, 0x03, 0x04, 0x05, 0x06, 0x08, 0x10, 0x20, 0x55];
    for instruction in (0..=255).filter(|number| !known.contains(number)) {
        assert_eq!(bench.ask(instruction, &[]), Answer { id: ID, error: 2, data: vec![] }, "{instruction:02X}");
    }
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
    assert_eq!(bench.ask(0x03, &vec![0; 384 - 11]).number(), 7, "the longest that fits is looked at");
    // 400 parameters and their CRC, put together by hand.
    let mut bytes = hex("FF FF FD 00 01 93 01 03");
    bytes.extend([0; 400]);
    let crc = update_crc(CRC_START, &bytes);
    bytes.extend(crc.to_le_bytes());
    assert_eq!(bench.hear(&bytes).iter().map(|reply| reply[8]).collect::<Vec<_>>(), [5]);
}

#[test]
fn the_status_return_level_is_honoured() {
    for (level, ping, read, write) in [(0, true, false, false), (1, true, true, false), (2, true, true, true)] {
        let mut bench = Bench::on();
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
