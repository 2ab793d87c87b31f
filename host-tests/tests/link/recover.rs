//! Recovery in one write, goals that end with torque, values before a tare, faults, watchdog and requests.

use super::bench::{Bench, *};
use crate::common::*;
use fingertip::link::packet::instruction;

const RECOVER: u16 = address::RECOVER;

fn goal(bench: &mut Bench, mn: i32) -> Result<(), u8> {
    bench.write(address::GOAL_FORCE_MN, &mn.to_le_bytes())
}

/// Torque and a goal of 1 N.
fn ordered() -> Bench {
    let mut bench = Bench::on();
    goal(&mut bench, 1_000).expect("a goal");
    bench
}

fn running() -> Bench {
    let mut bench = ordered();
    bench.write(address::BUS_WATCHDOG, &[5]).expect("a watchdog");
    bench
}

/// `recover` equals the single writes that it replaces, for every fault: a watchdog that did not trip stays. It is
/// nothing where nothing is wrong, and a 0 is nothing.
#[test]
fn recover_leaves_what_the_single_writes_leave() {
    let wrong = [Fault::BusSilent, Fault::OverForce, Fault::Bridge, Fault::Crash, Fault::LostFrames, Fault::Reversed];
    for fault in wrong.map(Some).into_iter().chain([None]) {
        let recovered = |writes: &[(u16, u8)]| {
            let mut bench = running();
            bench.set_fault(fault);
            for &(address, value) in writes {
                bench.write(address, &[value]).expect("it is taken");
            }
            bench.take_up();
            bench.number(address::FAULT, 1);
            *bench.server.settings()
        };
        let all = [(address::BUS_WATCHDOG, 0), (address::TORQUE_ENABLE, 0), (address::CLEAR_FAULT, 1)];
        let single = match fault {
            None => &[],
            Some(Fault::BusSilent) => &all[..],
            Some(_) => &all[1..],
        };
        assert_eq!(recovered(&[(RECOVER, 1)]), recovered(single), "{fault:?}");
        assert_eq!(recovered(&[(address::MIRROR_RECOVER, 1)]), recovered(single), "{fault:?}");
        assert_eq!(recovered(&[(RECOVER, 0)]), recovered(&[]), "{fault:?}: 0 asks for nothing");
    }
}

/// Sequence of `dynamixel_hardware_interface` with `Recover` as a command interface: it writes goal and recover in each
/// cycle by indirect addresses, without an answer. It takes answered writes for refused, as the answers have the alert.
#[test]
fn a_driver_that_sends_goal_and_recover_in_each_cycle_recovers() {
    [Fault::Bridge, Fault::BusSilent].into_iter().for_each(recovers_by_cycles);
}

fn recovers_by_cycles(fault: Fault) {
    let mut bench = Bench::new();
    let led: Vec<u8> = [address::SHORT_GOAL_MN, address::SHORT_GOAL_MN + 1, RECOVER].map(u16::to_le_bytes).concat();
    bench.write(address::INDIRECT_ADDRESS_1, &led).expect("torque is off");
    let cycle = |bench: &mut Bench, mn: i16, recover: u8| {
        let [low, high] = mn.to_le_bytes();
        let [at, at_high] = address::INDIRECT_DATA_1.to_le_bytes();
        let params = [at, at_high, 3, 0, ID, low, high, recover];
        assert_eq!(bench.ask_as(BROADCAST, instruction::SYNC_WRITE, &params), None);
    };
    bench.write(address::TORQUE_ENABLE, &[1]).expect("torque");
    cycle(&mut bench, 1_000, 0);
    assert_eq!(bench.number(address::GOAL_FORCE_MN, 4), 1_000);
    bench.set_fault(Some(fault));
    cycle(&mut bench, 1_000, 0);
    let [at, at_high] = address::TORQUE_ENABLE.to_le_bytes();
    assert_eq!(bench.ask(instruction::WRITE, &[at, at_high, 0]).error, 0x80, "carried out, with the alert");
    cycle(&mut bench, 0, 1);
    bench.take_up();
    cycle(&mut bench, 0, 0);
    assert_eq!((bench.number(address::FAULT, 1), bench.number(address::TORQUE_ENABLE, 1)), (0, 0));
    assert_eq!(bench.ask(instruction::WRITE, &[at, at_high, 1]).error, 0);
    cycle(&mut bench, 500, 0);
    assert_eq!(bench.number(address::GOAL_FORCE_MN, 4), 500);
}

#[test]
fn what_stands_in_the_way_is_told_and_refused() {
    let refused = |bench: &mut Bench, hindrance: u32| {
        bench.set_fault(Some(Fault::SupplyLow));
        assert_eq!(bench.number(address::RECOVER_HINDRANCE, 1), hindrance);
        let before = *bench.server.settings();
        assert_eq!(bench.write(RECOVER, &[1]), Err(StatusError::Result as u8), "{hindrance}");
        assert_eq!(bench.ask(0x10, &[2, b'E', b'R', b'C', b'L']).number(), StatusError::Result as u8);
        assert_eq!(*bench.server.settings(), before);
    };
    // The bench's supply is at 6012 mV.
    let mut bench = Bench::new();
    bench.write(param("supply_min_mv"), &6_013i32.to_le_bytes()).expect("a higher limit");
    refused(&mut bench, 1);
    bench.write(param("supply_min_mv"), &6_012i32.to_le_bytes()).expect("it suffices");
    assert_eq!(bench.number(address::RECOVER_HINDRANCE, 1), 0);
    assert_eq!(bench.write(RECOVER, &[1]), Ok(()));

    let mut bench = Bench::new();
    bench.write(param("supply_min_mv"), &[5_000i32, 6_011].map(i32::to_le_bytes).concat()).expect("a lower limit");
    refused(&mut bench, 2);

    let mut bench = Bench::new();
    bench.status.contact.bad_taxels = 6;
    refused(&mut bench, 3);
    bench.status.contact.bad_taxels = 5;
    assert_eq!(bench.number(address::RECOVER_HINDRANCE, 1), 0);

    let mut bench = Bench::new();
    bench.write(address::SAVE_PARAMETERS, &[1]).expect("a save");
    refused(&mut bench, 4);
    bench.server.take_actions();
    assert_eq!(bench.write(RECOVER, &[1]), Ok(()));
}

#[test]
fn clear_and_backup_are_recover_and_save_or_refused_by_number() {
    let mut bench = running();
    bench.set_fault(Some(Fault::BusSilent));
    let clear = |option, key: &[u8; 4]| [&[option], &key[..]].concat();
    assert_eq!(bench.ask(0x10, &clear(1, b"DXL\"")).number(), 4, "there are no turns to clear");
    assert_eq!(bench.ask(0x10, &clear(1, b"ERCL")).number(), 4);
    assert_eq!(bench.ask(0x10, &clear(2, b"ERCM")).number(), 4);
    assert_eq!(bench.ask(0x10, &[2]).number(), 5);
    assert_eq!(bench.server.command().clear_request, 0);
    assert_eq!(bench.ask(0x10, &clear(2, b"ERCL")).error, 0x80, "accepted; the fault is still present");
    bench.take_up();
    assert_eq!(bench.ask(0x01, &[]).error, 0);
    assert_eq!(bench.number(address::BUS_WATCHDOG, 1), 0);

    assert_eq!(bench.ask(0x20, &clear(2, b"CTRL")).number(), 4, "there is no older backup");
    assert_eq!(bench.ask(0x20, &clear(1, b"CTRK")).number(), 4);
    assert_eq!(bench.ask(0x20, &[1]).number(), 5);
    assert!(!bench.server.take_actions().save);
    assert_eq!(bench.ask(0x20, &clear(1, b"CTRL")).number(), 0);
    assert!(bench.server.take_actions().save);
    bench.write(address::TORQUE_ENABLE, &[1]).expect("torque");
    assert_eq!(bench.ask(0x20, &clear(1, b"CTRL")).number(), 7, "like save_parameters, not while torque is on");
}

#[test]
fn torque_off_takes_the_goal_back() {
    let mut bench = running();
    assert_eq!(bench.write(address::TORQUE_ENABLE, &[0]), Ok(()));
    assert_eq!(bench.number(address::GOAL_FORCE_MN, 4), 0);
    assert_eq!(bench.write(address::TORQUE_ENABLE, &[1]), Ok(()));
    let command = bench.server.command();
    assert_eq!((command.torque, command.goal), (true, Newtons::ZERO), "nothing moves before a new goal");
    assert_eq!(goal(&mut bench, 700), Ok(()));
    // A torque on that changes nothing leaves the goal; a refused write leaves all.
    assert_eq!(bench.write(address::TORQUE_ENABLE, &[1]), Ok(()));
    assert_eq!(bench.write(address::TORQUE_ENABLE, &[0, 0]), Err(7));
    assert_eq!(bench.number(address::GOAL_FORCE_MN, 4), 700);
    // A goal without torque would press as soon as another client enables torque.
    bench.write(address::TORQUE_ENABLE, &[0]).expect("off");
    assert_eq!((goal(&mut bench, 300), goal(&mut bench, 0)), (RESULT, Ok(())));
    // Both in one packet, in the order of a Bulk Write's entries.
    let entries = |torque: u8| [&[ID, 64, 0, 1, 0, torque, ID, 0, 1, 4, 0][..], &300i32.to_le_bytes()].concat();
    for (torque, expected) in [(1, 300), (0, 0)] {
        assert_eq!(bench.ask_as(BROADCAST, instruction::BULK_WRITE, &entries(torque)), None);
        assert_eq!(bench.number(address::GOAL_FORCE_MN, 4), expected);
    }
    // Both in one write, in the other order, as from a driver that repeats its goal: torque off is not refused.
    let places = [address::TORQUE_ENABLE, address::SHORT_GOAL_MN, address::SHORT_GOAL_MN + 1];
    bench.write(address::INDIRECT_ADDRESS_1, &places.map(u16::to_le_bytes).concat()).expect("addresses");
    for (torque, result, expected) in [(1, Ok(()), 300), (0, Ok(()), 0), (0, RESULT, 0)] {
        assert_eq!(bench.write(address::INDIRECT_DATA_1, &[torque, 44, 1]), result);
        let command = bench.server.command();
        assert_eq!((command.torque, bench.number(address::GOAL_FORCE_MN, 4)), (torque != 0, expected));
    }
}

proptest! {
    #![proptest_config(seeded(3000, 22))]

    /// No goal waits for torque, so turning torque on never moves a finger by itself.
    #[test]
    fn there_is_a_goal_only_with_torque(
        steps in prop::collection::vec((0..WRITES.len(), prop::sample::select(&[0x03, 0x03, 0x04, 0x05][..]), 0..8u8), 1..40),
    ) {
        let mut bench = Bench::new();
        let places = [address::SHORT_GOAL_MN, address::SHORT_GOAL_MN + 1, address::TORQUE_ENABLE, RECOVER];
        bench.write(address::INDIRECT_ADDRESS_1, &places.map(u16::to_le_bytes).concat()).expect("torque is off");
        for (place, instruction, event) in steps {
            let (register, data) = WRITES[place];
            let params = [&register.to_le_bytes()[..], data].concat();
            bench.ask(instruction, if instruction == 0x05 { &[] } else { &params });
            match event {
                0 => bench.set_fault(Some(Fault::BusSilent)),
                1 => bench.set_fault(None),
                2 => bench.take_up(),
                _ => {}
            }
            bench.ask(0x01, &[]);
            let Command { torque, goal, .. } = bench.server.command();
            prop_assert!(torque || goal == Newtons::ZERO, "{register} {data:?}");
        }
    }
}

/// Writes that change torque or goal, or whose refusal depends on them.
const WRITES: [(u16, &[u8]); 14] = [
    (address::TORQUE_ENABLE, &[0]),
    (address::TORQUE_ENABLE, &[1]),
    (address::GOAL_FORCE_MN, &[0, 0, 0, 0]),
    (address::GOAL_FORCE_MN, &[0, 2, 0, 0]),
    // A tare, and the end of a fault.
    (address::GOAL_FORCE_MN, &[0, 2, 0, 0, 1, 1]),
    (address::SHORT_GOAL_MN, &[0, 2]),
    (address::MIRROR_GOAL_MN, &[0, 2, 0, 0]),
    // Goal, torque and recovery through indirect addresses.
    (address::INDIRECT_DATA_1, &[0, 2, 0]),
    (address::INDIRECT_DATA_1, &[0, 2, 1]),
    (address::INDIRECT_DATA_1, &[0, 2, 1, 1]),
    (RECOVER, &[1]),
    (address::CLEAR_FAULT, &[1]),
    (address::BUS_WATCHDOG, &[0]),
    (address::MEASURE, &[3]),
];

/// An untared array shows its offsets: as pressures they would be false. The loop itself reports no contact then.
#[test]
fn before_the_first_tare_no_pressure_is_reported() {
    let mut bench = Bench::new();
    bench.status.contact.bad_taxels = 2;
    bench.status.limits.set(Limits::NOT_TARED);
    let pressures = [address::PRESSURES, address::PRESSURES + 2 * TAXELS as u16 - 2];
    for address in pressures {
        assert_eq!(bench.number(address, 2), 0, "{address}");
    }
    assert_eq!(bench.number(address::LIMITS, 2), u32::from(Limits::NOT_TARED));
    assert_eq!(bench.number(address::BAD_TAXELS, 1), 2);
    assert_eq!(bench.number(address::RAW_CODES, 2), 1_000);
    bench.status.limits = Limits::default();
    for address in pressures {
        assert_ne!(bench.number(address, 2), 0, "{address}");
    }
}

// Faults and the bus watchdog as the host sees them.

#[test]
fn a_fault_lets_go_and_raises_the_alert() {
    let mut bench = ordered();
    assert_eq!(bench.ask(0x01, &[]).error, 0);
    bench.set_fault(Some(Fault::EncoderFrozen));
    assert_eq!(bench.ask(0x01, &[]).error, 0x80);
    let command = bench.server.command();
    assert_eq!((command.torque, command.goal), (false, Newtons::ZERO));
    assert_eq!(bench.number(address::FAULT, 1), 5);
    assert_eq!(bench.number(address::HARDWARE_ERROR_STATUS, 1), 1 << 3);
    for (value, requests) in [(1, 1), (0, 1)] {
        assert_eq!(bench.write(address::CLEAR_FAULT, &[value]), Ok(()), "0 asks for nothing");
        assert_eq!((bench.server.command().clear_request, bench.server.command().torque), (requests, false));
    }
    bench.set_fault(None);
    assert_eq!(bench.ask(0x01, &[]).error, 0);
    assert!(!bench.server.command().torque, "the host has to ask again");
}

#[test]
fn every_fault_has_a_bit() {
    let mut bench = Bench::new();
    let bits: [(u32, &[Fault]); 5] = [
        (0, &[Fault::SupplyLow, Fault::SupplyHigh]),
        (3, &[Fault::EncoderFrozen, Fault::Reversed]),
        (4, &[Fault::Bridge]),
        (5, &[Fault::OverForce]),
        (6, &[Fault::ArrayBroken, Fault::RowStuck, Fault::ArrayFrozen, Fault::Unseen]),
    ];
    for fault in Fault::ALL {
        let bit = bits.iter().find(|(_, faults)| faults.contains(&fault)).map_or(7, |(bit, _)| *bit);
        bench.set_fault(Some(fault));
        assert_eq!(bench.number(address::FAULT, 1), fault as u32);
        assert_eq!(bench.number(address::HARDWARE_ERROR_STATUS, 1), 1 << bit, "{fault:?}");
    }
}

#[test]
fn a_tripped_watchdog_reads_minus_one_until_it_is_reset() {
    let mut bench = ordered();
    assert_eq!(bench.write(address::BUS_WATCHDOG, &[5]), Ok(()));
    assert_eq!(bench.server.command().bus_watchdog_ms, 100);
    assert_eq!(bench.number(address::BUS_WATCHDOG, 1), 5);

    bench.set_fault(Some(Fault::BusSilent));
    assert_eq!(bench.number(address::BUS_WATCHDOG, 1), 0xFF);
    bench.write(address::CLEAR_FAULT, &[1]).expect("clear");
    bench.set_fault(None);
    assert_eq!(bench.number(address::BUS_WATCHDOG, 1), 0xFF);
    for (goal, answer) in [(500i32, Err(4)), (0, Ok(()))] {
        assert_eq!(bench.write(address::GOAL_FORCE_MN, &goal.to_le_bytes()), answer, "as ROBOTIS' servos, but a stop");
        assert_eq!(bench.write(address::SHORT_GOAL_MN, &(goal as i16).to_le_bytes()), answer);
    }
    assert_eq!(bench.write(address::TORQUE_ENABLE, &[1]), Err(1));
    assert_eq!(bench.write(address::MEASURE, &[1]), Err(1), "no watchdog would end it");
    assert_eq!(bench.write(address::TORQUE_ENABLE, &[0]), Ok(()));
    assert_eq!(bench.write(address::BUS_WATCHDOG, &[5]), Err(4));
    assert_eq!(bench.write(address::BUS_WATCHDOG, &[0xFF]), Err(4));

    assert_eq!(bench.write(address::BUS_WATCHDOG, &[0]), Ok(()));
    assert_eq!(bench.number(address::BUS_WATCHDOG, 1), 0);
    assert_eq!(bench.write(address::BUS_WATCHDOG, &[1]), Ok(()));
    assert_eq!(bench.write(address::TORQUE_ENABLE, &[1]), Ok(()));
    assert_eq!(bench.write(address::GOAL_FORCE_MN, &500i32.to_le_bytes()), Ok(()));
    bench.set_fault(Some(Fault::BusSilent));
    assert_eq!(bench.number(address::BUS_WATCHDOG, 1), 0xFF, "it trips again");
}

#[test]
fn the_watchdog_hears_only_good_instructions_for_this_device() {
    let mut bench = Bench::new();
    let mut bad = packet(1, 0x01, &[]);
    bad[9] ^= 0x10;
    for (bytes, heard) in [
        (packet(1, 0x01, &[]), 1),
        (packet(254, 0x03, &[68, 0, 2]), 1),
        (packet(1, 0x77, &[]), 1),
        (packet(2, 0x01, &[]), 0),
        (packet(1, 0x55, &[0]), 0),
        (bad, 0),
    ] {
        let before = bench.server.good_packets();
        bench.hear(&bytes);
        assert_eq!(bench.server.good_packets() - before, heard, "{bytes:02X?}");
    }
}

// A request that cannot be executed is answered with error 1; an accepted one is passed on, and its result can be read.

const RESULT: Result<(), u8> = Err(1);

fn faulted() -> Bench {
    let mut bench = Bench::new();
    bench.set_fault(Some(Fault::Bridge));
    bench
}

/// Tare, clear, save in one write.
fn requests(bench: &mut Bench, tare: u8, clear: u8, save: u8) -> Result<(), u8> {
    bench.write(address::TARE, &[tare, clear, save])
}

#[test]
fn a_tare_in_a_fault_is_refused_and_with_or_after_its_clearing_taken() {
    let mut bench = faulted();
    let before = bench.server.command();
    assert_eq!(bench.write(address::TARE, &[1]), RESULT);
    assert_eq!(bench.server.command(), before);
    assert_eq!(bench.number(address::RESULT_ERRORS, 2), 1);
    assert_eq!(bench.write(address::TARE, &[0]), Ok(()), "0 asks for nothing");
    assert_eq!(requests(&mut bench, 1, 1, 0), Ok(()));
    let Command { tare_request, clear_request, torque, .. } = bench.server.command();
    assert_eq!((tare_request, clear_request, torque), (1, 1, false));

    // One request after the other, before the loop has seen them.
    let mut bench = faulted();
    assert_eq!(bench.write(address::CLEAR_FAULT, &[1]), Ok(()));
    assert_eq!(bench.write(address::TARE, &[1]), Ok(()));
    bench.take_up();
    assert_eq!((bench.number(address::FAULT, 1), bench.number(address::TARE_STATE, 1)), (0, 2));

    // The loop took the clear up, and the fault is back.
    bench.set_fault(Some(Fault::Bridge));
    assert_eq!(bench.write(address::TARE, &[1]), RESULT);
}

/// All forces would read too low by the force during the tare. The host may force torque nevertheless.
#[test]
fn torque_is_refused_after_a_tare_while_something_touched() {
    let mut bench = Bench::new();
    let tare = |bench: &mut Bench, value| {
        let before = bench.server.command().tare_request;
        assert_eq!(bench.write(address::TARE, &[value]), Ok(()));
        assert_eq!(bench.server.command().tare_request, before + 1, "{value}");
        bench.take_up();
    };
    bench.status.limits.set(Limits::TARED_TOUCHING);
    tare(&mut bench, 1);
    assert!(!bench.server.command().tare_forced);
    assert_eq!(bench.write(address::TORQUE_ENABLE, &[1]), RESULT);
    assert_eq!(bench.write(address::TORQUE_ENABLE, &[0]), Ok(()));
    // Another tare, which the loop has not begun yet, may be clean: the loop decides.
    assert_eq!(bench.write(address::TARE, &[1]), Ok(()));
    assert_eq!(bench.write(address::TORQUE_ENABLE, &[1]), Ok(()));
    bench.write(address::TORQUE_ENABLE, &[0]).expect("off");
    tare(&mut bench, 2);
    assert_eq!(bench.write(address::TARE, &[0]), Ok(()), "0 asks for nothing");
    assert!(bench.server.command().tare_forced);
    assert_eq!(bench.write(address::TORQUE_ENABLE, &[1]), Ok(()));
    assert_eq!(bench.write(address::TARE, &[2]), Err(7), "not while torque is on");
    bench.write(address::TORQUE_ENABLE, &[0]).expect("off");
    tare(&mut bench, 1);
    assert_eq!(bench.write(address::TORQUE_ENABLE, &[1]), RESULT, "the next tare is not forced");
    assert_eq!(bench.write(address::TARE, &[3]), Err(4));
}

#[test]
fn torque_and_goals_wait_until_the_fault_is_seen_to_be_cleared() {
    let mut bench = faulted();
    let goal = 1_000i32.to_le_bytes();
    assert_eq!(bench.write(address::GOAL_FORCE_MN, &goal), RESULT, "the fault would take it back");
    assert_eq!(bench.write(address::GOAL_FORCE_MN, &[&goal[..], &[0, 1]].concat()), RESULT);
    assert_eq!(bench.server.command().clear_request, 0, "all or nothing");
    assert_eq!(bench.write(address::GOAL_FORCE_MN, &0i32.to_le_bytes()), Ok(()));
    assert_eq!(bench.write(address::CLEAR_FAULT, &[1]), Ok(()));
    assert_eq!(bench.write(address::TORQUE_ENABLE, &[1]), RESULT);
    assert_eq!(bench.write(address::GOAL_FORCE_MN, &goal), RESULT);
    bench.take_up();
    assert_eq!(bench.write(address::TORQUE_ENABLE, &[1]), Ok(()));
    assert_eq!(bench.write(address::GOAL_FORCE_MN, &goal), Ok(()));
    assert_eq!(bench.number(address::GOAL_FORCE_MN, 4), 1_000);
}

/// The link refuses impossible requests at once; it passes on those that a running tare may make possible.
#[test]
fn a_motion_is_refused_where_it_cannot_begin() {
    let ask = |bench: &mut Bench, task: u8| bench.write(address::MEASURE, &[task]);
    // A jog, strokes, a press.
    let all = |bench: &mut Bench| {
        [1, 2, 3].map(|task| {
            bench.status.taken.measure = bench.server.command().measure_request;
            ask(bench, task).is_ok()
        })
    };
    let mut bench = Bench::new();
    bench.status.limits.set(Limits::NOT_TARED);
    assert_eq!(all(&mut bench), [false; 3], "not tared, torque off");
    assert_eq!(bench.write(address::TORQUE_ENABLE, &[1]), RESULT, "not tared");
    bench.status.mode = Mode::Tare;
    bench.write(address::TORQUE_ENABLE, &[1]).expect("torque waits for the tare");
    assert_eq!(all(&mut bench), [false, false, true], "a press waits for the tare");
    bench.write(address::TORQUE_ENABLE, &[0]).expect("off");
    assert_eq!(all(&mut bench), [false; 3], "during a tare, torque off");
    let mut bench = Bench::new();
    bench.write(address::TARE, &[1]).expect("a tare");
    assert_eq!(all(&mut bench), [false; 3], "a tare that the loop has not seen, torque off");
    let mut bench = Bench::new();
    assert_eq!(all(&mut bench), [true, true, false], "tared, torque off");
    let mut bench = Bench::new();
    bench.write(address::TORQUE_ENABLE, &[1]).expect("on");
    assert_eq!(all(&mut bench), [false, false, true], "torque on");
    bench.set_fault(Some(Fault::Bridge));
    assert_eq!(all(&mut bench), [false; 3], "a fault");
    let mut bench = Bench::new();
    for state in [CaptureState::Armed, CaptureState::Recording] {
        bench.capture.state = state;
        assert_eq!(all(&mut bench), [true, false, false], "the capture's memory is in use");
    }
    // The loop has not taken the jog yet, nor the stop after it: another motion or a capture would replace them.
    let mut waits = Bench::new();
    assert_eq!([1, 2, 0, 1, 2, 0].map(|task| ask(&mut waits, task).is_ok()), [true, false, true, false, false, true]);
    assert_eq!(waits.write(address::CAPTURE, &[1]), RESULT);
    assert_eq!(waits.write(address::CAPTURE, &[0]), Ok(()));
    // A stop is never refused. Without a motion to end it changes nothing: it would hide how the last one ended.
    for bench in [&mut Bench::new(), &mut faulted(), &mut bench, &mut waits] {
        let before = bench.server.command();
        assert_eq!((ask(bench, 0), bench.server.command()), (Ok(()), before));
    }
    // Torque off and a goal of 0 stop as well, also where the loop does not see them: on or another goal follows at once.
    let [on, off] = [(address::TORQUE_ENABLE, &[1][..]), (address::TORQUE_ENABLE, &[0])];
    let [goal, none] = [(address::GOAL_FORCE_MN, &[0, 2, 0, 0][..]), (address::GOAL_FORCE_MN, &[0; 4])];
    for writes in [&[off, on][..], &[goal, none, goal]] {
        let mut presses = Bench::new();
        presses.write(on.0, on.1).expect("on");
        ask(&mut presses, 3).expect("a press");
        presses.status.taken.measure = presses.server.command().measure_request;
        presses.status.measure = MeasureStatus::running(Task::Press);
        assert_eq!([1, 2, 3].map(|task| ask(&mut presses, task)), [RESULT; 3], "it would not be made");
        writes.iter().for_each(|(register, bytes)| presses.write(*register, bytes).expect("a write"));
        assert_eq!(Task::of(presses.server.command().measure_request), Task::Stop, "{writes:?}");
    }
    // A stop where nothing runs leaves no request that a motion in the same packet would replace.
    let mut both = Bench::new();
    let places = [address::SHORT_GOAL_MN, address::SHORT_GOAL_MN + 1, address::MEASURE];
    both.write(address::INDIRECT_ADDRESS_1, &places.map(u16::to_le_bytes).concat()).expect("torque is off");
    for _ in 0..2 {
        assert_eq!(both.write(address::INDIRECT_DATA_1, &[0, 0, 1]), Ok(()));
        both.take_up();
    }
    let before = bench.server.command();
    assert_eq!(ask(&mut bench, 4), Err(4));
    assert_eq!(bench.server.command(), before);
}

#[test]
fn an_old_outcome_is_never_taken_for_that_of_a_new_motion() {
    let mut bench = Bench::new();
    bench.status.measure = MeasureStatus::over(Task::Press, Ended::NoContact, -1_234);
    let read = |bench: &mut Bench| {
        [address::MEASURE_STATE, address::MEASURE_ENDED, address::MEASURE_TASK].map(|place| bench.number(place, 1))
    };
    assert_eq!((read(&mut bench), bench.number(address::MEASURE_VALUE, 4)), ([3, 11, 3], -1_234_i32 as u32));
    bench.write(address::MEASURE, &[1]).expect("a jog");
    assert_eq!(bench.number(address::MEASURE_STATE, 1), 1, "before the loop has looked");
    bench.status.measure = MeasureStatus::over(Task::Jog, Ended::Complete, 0);
    bench.take_up();
    assert_eq!((read(&mut bench), bench.number(address::MEASURE_PROGRESS, 1)), ([2, 0, 1], 100));
}

#[test]
fn a_save_is_refused_while_the_loop_drives_or_tares() {
    let mut bench = Bench::new();
    for mode in [Mode::Tare, Mode::Approach, Mode::Force, Mode::Release, Mode::Press] {
        bench.status.mode = mode;
        assert_eq!(bench.write(address::SAVE_PARAMETERS, &[1]), RESULT, "{mode:?}");
        assert_eq!(bench.ask(0x06, &[0x02]).number(), 1, "{mode:?}");
        assert!(!bench.server.take_actions().save);
    }
    bench.status.mode = Mode::Off;
    assert_eq!(requests(&mut bench, 1, 0, 1), RESULT, "the tare comes first");
    assert_eq!(requests(&mut bench, 1, 0, 0), Ok(()));
    assert_eq!(bench.write(address::SAVE_PARAMETERS, &[1]), RESULT, "the tare that was accepted");
    bench.take_up();
    assert_eq!(bench.write(address::SAVE_PARAMETERS, &[1]), Ok(()));
    // The save waits for the firmware: nothing may come between.
    assert_eq!(bench.write(address::TORQUE_ENABLE, &[1]), RESULT);
    assert_eq!(bench.write(address::TARE, &[1]), RESULT);
    bench.server.take_actions();
    bench.set_fault(Some(Fault::Bridge));
    assert_eq!(bench.write(address::SAVE_PARAMETERS, &[1]), Ok(()), "the motor is off in a fault");
}

/// A Sync Write has no answer, so its result is read: refusals are counted, accepted requests have a state.
#[test]
fn how_an_unanswered_request_went_can_be_read() {
    let mut bench = Bench::new();
    let sync_write = |bench: &mut Bench| {
        let params = [&address::TARE.to_le_bytes()[..], &[1, 0, ID, 1]].concat();
        assert!(bench.hear(&packet(254, 0x83, &params)).is_empty());
    };
    assert_eq!(bench.number(address::TARE_STATE, 1), 0);
    sync_write(&mut bench);
    assert_eq!(bench.number(address::TARE_STATE, 1), 1, "before the loop has looked");
    bench.take_up();
    assert_eq!(bench.number(address::TARE_STATE, 1), 2);
    // A fault occurs in between: the link has accepted the request, the loop refuses it.
    sync_write(&mut bench);
    bench.set_fault(Some(Fault::Bridge));
    bench.take_up();
    assert_eq!((bench.status.tare, bench.number(address::TARE_STATE, 1)), (Taring::Refused, 3));
    // With the fault known the link refuses it.
    sync_write(&mut bench);
    assert_eq!((bench.number(address::TARE_STATE, 1), bench.number(address::RESULT_ERRORS, 2)), (3, 1));
}
