//! One write that does what a fault asks for, goals that end with torque, and what is not told before a tare.

use fingertip::link::packet::{BROADCAST, StatusError, instruction};
use fingertip::shipped::{TAXELS, address};
use fingertip::state::{Fault, Limits};
use fingertip::units::Newtons;

use crate::bench::Bench;

const RECOVER: u16 = address::RECOVER;

fn goal(bench: &mut Bench, mn: i32) -> Result<(), u8> {
    bench.write(address::GOAL_FORCE_MN, &mn.to_le_bytes())
}

fn running() -> Bench {
    let mut bench = Bench::new();
    bench.write(address::TORQUE_ENABLE, &[1]).expect("torque");
    goal(&mut bench, 1_000).expect("a goal");
    bench.write(address::BUS_WATCHDOG, &[5]).expect("a watchdog");
    bench
}

#[test]
fn recover_does_in_one_write_what_a_tripped_watchdog_asks_for() {
    let mut bench = running();
    bench.set_fault(Some(Fault::BusSilent));
    assert_eq!(bench.number(address::BUS_WATCHDOG, 1), 0xFF);
    assert_eq!(bench.write(RECOVER, &[1]), Ok(()));
    assert_eq!(bench.number(RECOVER, 1), 0);
    bench.take_up();
    assert_eq!((bench.number(address::FAULT, 1), bench.number(address::BUS_WATCHDOG, 1)), (0, 0));
    let command = bench.server.command();
    assert_eq!((command.torque, command.goal, command.bus_watchdog_ms), (false, Newtons::ZERO, 0));
    assert_eq!(bench.write(address::TORQUE_ENABLE, &[1]), Ok(()));
    assert_eq!(goal(&mut bench, 500), Ok(()));
}

/// The same as the writes that it stands for, for every fault: a watchdog that did not trip stays.
#[test]
fn recover_leaves_what_the_single_writes_leave() {
    for fault in [Fault::BusSilent, Fault::OverForce, Fault::Bridge, Fault::Crash, Fault::LostFrames, Fault::Reversed] {
        let recovered = |writes: &[(u16, u8)]| {
            let mut bench = running();
            bench.set_fault(Some(fault));
            for &(address, value) in writes {
                bench.write(address, &[value]).expect("it is taken");
            }
            bench.take_up();
            bench.number(address::FAULT, 1);
            *bench.server.settings()
        };
        let all = [(address::BUS_WATCHDOG, 0), (address::TORQUE_ENABLE, 0), (address::CLEAR_FAULT, 1)];
        let single = &all[usize::from(fault != Fault::BusSilent)..];
        let one = [(RECOVER, 1)];
        assert_eq!(recovered(&one), recovered(single), "{fault:?}");
        assert_eq!(recovered(&[(address::MIRROR_RECOVER, 1)]), recovered(single), "{fault:?}");
    }
}

/// As `dynamixel_hardware_interface` does with `Recover` as a command interface: goal and recover go out in each cycle by
/// indirect addresses, unanswered. What it writes with an answer it takes for refused, as that has the alert.
#[test]
fn a_driver_that_sends_goal_and_recover_in_each_cycle_recovers() {
    let mut bench = Bench::new();
    let led: Vec<u8> = [address::SHORT_GOAL_MN, address::SHORT_GOAL_MN + 1, RECOVER].map(u16::to_le_bytes).concat();
    bench.write(address::INDIRECT_ADDRESS_1, &led).expect("torque is off");
    let cycle = |bench: &mut Bench, mn: i16, recover: u8| {
        let [low, high] = mn.to_le_bytes();
        let [at, at_high] = address::INDIRECT_DATA_1.to_le_bytes();
        let params = [at, at_high, 3, 0, crate::bench::ID, low, high, recover];
        assert_eq!(bench.ask_as(BROADCAST, instruction::SYNC_WRITE, &params), None);
    };
    bench.write(address::TORQUE_ENABLE, &[1]).expect("torque");
    cycle(&mut bench, 1_000, 0);
    assert_eq!(bench.number(address::GOAL_FORCE_MN, 4), 1_000);
    bench.set_fault(Some(Fault::Bridge));
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
fn where_nothing_is_wrong_recover_does_nothing() {
    let mut bench = running();
    let before = *bench.server.settings();
    for value in [0, 1] {
        assert_eq!(bench.write(RECOVER, &[value]), Ok(()));
        assert_eq!(*bench.server.settings(), before);
    }
    bench.set_fault(Some(Fault::OverForce));
    bench.number(address::FAULT, 1);
    let before = *bench.server.settings();
    assert_eq!(bench.write(RECOVER, &[0]), Ok(()), "0 asks for nothing");
    assert_eq!(*bench.server.settings(), before);
}

#[test]
fn what_stands_in_the_way_is_told_and_refused() {
    let param = |name: &str| {
        let found = fingertip::shipped::REGISTERS.iter().find(|register| register.name == name);
        found.expect("a parameter").address
    };
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
    assert_eq!(bench.ask(0x10, &clear(2, b"ERCL")).error, 0x80, "taken; the fault still stands");
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
    // A goal that comes while torque is off is a new one.
    bench.write(address::TORQUE_ENABLE, &[0]).expect("off");
    goal(&mut bench, 300).expect("a goal");
    bench.write(address::TORQUE_ENABLE, &[1]).expect("on");
    assert_eq!(bench.number(address::GOAL_FORCE_MN, 4), 300);
}

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
