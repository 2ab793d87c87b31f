//! Faults and the bus watchdog as the host sees them.

use fingertip::shipped::address;
use fingertip::state::Fault;
use fingertip::units::Newtons;

use crate::bench::{Bench, packet};

fn running() -> Bench {
    let mut bench = Bench::new();
    bench.write(address::GOAL_FORCE_MN, &1000i32.to_le_bytes()).expect("a goal");
    bench.write(address::TORQUE_ENABLE, &[1]).expect("torque");
    bench
}

#[test]
fn a_fault_lets_go_and_raises_the_alert() {
    let mut bench = running();
    assert_eq!(bench.ask(0x01, &[]).error, 0);
    bench.set_fault(Some(Fault::EncoderFrozen));
    assert_eq!(bench.ask(0x01, &[]).error, 0x80);
    let command = bench.server.command();
    assert_eq!((command.torque, command.goal), (false, Newtons::ZERO));
    assert_eq!(bench.number(address::FAULT, 1), 5);
    assert_eq!(bench.number(address::HARDWARE_ERROR_STATUS, 1), 1 << 3);
    bench.set_fault(None);
    assert_eq!(bench.ask(0x01, &[]).error, 0);
    assert!(!bench.server.command().torque, "the host has to ask again");
}

#[test]
fn a_fault_is_cleared_with_torque_off_in_the_same_command() {
    let mut bench = running();
    bench.set_fault(Some(Fault::OverForce));
    let before = bench.server.command().clear_request;
    assert_eq!(bench.write(address::CLEAR_FAULT, &[1]), Ok(()));
    let command = bench.server.command();
    assert!(command.clear_request != before && !command.torque);
    assert_eq!(bench.write(address::CLEAR_FAULT, &[0]), Ok(()));
    assert_eq!(bench.server.command().clear_request, command.clear_request, "0 asks for nothing");
}

#[test]
fn every_fault_has_a_bit() {
    let mut bench = Bench::new();
    let faults = [
        (Fault::LostFrames, 7),
        (Fault::ArrayBroken, 6),
        (Fault::RowStuck, 6),
        (Fault::ArrayFrozen, 6),
        (Fault::EncoderFrozen, 3),
        (Fault::OverForce, 5),
        (Fault::BusSilent, 7),
        (Fault::BrokenParameters, 7),
        (Fault::SupplyLow, 0),
        (Fault::SupplyHigh, 0),
        (Fault::Bridge, 4),
        (Fault::MissedDeadline, 7),
        (Fault::Crash, 7),
        (Fault::Runaway, 7),
        (Fault::Reversed, 3),
        (Fault::Unseen, 6),
        (Fault::NoClock, 7),
        (Fault::BrownOutLevel, 7),
    ];
    assert_eq!(faults.map(|(fault, _)| fault), Fault::ALL);
    for (fault, bit) in faults {
        bench.set_fault(Some(fault));
        assert_eq!(bench.number(address::FAULT, 1), fault as u32);
        assert_eq!(bench.number(address::HARDWARE_ERROR_STATUS, 1), 1 << bit, "{fault:?}");
    }
}

#[test]
fn a_tripped_watchdog_reads_minus_one_until_it_is_reset() {
    let mut bench = running();
    assert_eq!(bench.write(address::BUS_WATCHDOG, &[5]), Ok(()));
    assert_eq!(bench.server.command().bus_watchdog_ms, 100);
    assert_eq!(bench.number(address::BUS_WATCHDOG, 1), 5);

    bench.set_fault(Some(Fault::BusSilent));
    assert_eq!(bench.number(address::BUS_WATCHDOG, 1), 0xFF);
    bench.write(address::CLEAR_FAULT, &[1]).expect("clear");
    bench.set_fault(None);
    assert_eq!(bench.number(address::BUS_WATCHDOG, 1), 0xFF);
    for goal in [0, 500i32] {
        assert_eq!(bench.write(address::GOAL_FORCE_MN, &goal.to_le_bytes()), Err(4), "as ROBOTIS' servos answer");
        assert_eq!(bench.write(address::SHORT_GOAL_MN, &(goal as i16).to_le_bytes()), Err(4));
    }
    assert_eq!(bench.write(address::TORQUE_ENABLE, &[1]), Err(1));
    assert_eq!(bench.write(address::TORQUE_ENABLE, &[0]), Ok(()));
    assert_eq!(bench.write(address::BUS_WATCHDOG, &[5]), Err(4));
    assert_eq!(bench.write(address::BUS_WATCHDOG, &[0xFF]), Err(4));

    assert_eq!(bench.write(address::BUS_WATCHDOG, &[0]), Ok(()));
    assert_eq!(bench.number(address::BUS_WATCHDOG, 1), 0);
    assert_eq!(bench.write(address::GOAL_FORCE_MN, &500i32.to_le_bytes()), Ok(()));
    assert_eq!(bench.write(address::BUS_WATCHDOG, &[1]), Ok(()));
    assert_eq!(bench.write(address::TORQUE_ENABLE, &[1]), Ok(()));
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
