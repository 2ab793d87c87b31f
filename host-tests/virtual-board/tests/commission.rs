//! The drive of the emulated board, commissioned over the bus as its owner would.

use crate::common::{away, read_u8, read_u16, read_u32, reboot, refused, register, running, write_u8};
use fingertip::shipped::address;
use fingertip::state::Mode;
use sim::plant::Setup;
use virtual_board::{Options, Rig};

/// The parameters that commissioning may change.
const CHANGED: [&str; 4] = ["torque_constant_unm_per_a", "inertia_ug_m2", "friction_unm", "direction_confirmed"];
/// The result error.
const RESULT: u8 = 1;

fn params(rig: &mut Rig) -> [u32; 4] {
    CHANGED.map(|name| read_u32(rig, register(name)))
}

/// A board with a blank flash, tared, its tip 5 mm from a wall.
fn new_board(setup: &Setup) -> Rig {
    let mut rig = running(setup, &Options::default());
    write_u8(&mut rig, address::TARE, 1);
    rig.run_ms(20).expect("it runs");
    rig
}

/// Runs what was asked for to its end: its state and its refusal. Watches travel and duty.
fn outcome(rig: &mut Rig, task: u8) -> (u8, u8) {
    let begun_mm = rig.world(|world| world.travel_mm()).expect("it runs");
    write_u8(rig, address::COMMISSION, task);
    for _ in 0..1_000 {
        rig.run_ms(10).expect("it runs");
        let travel_mm = rig.world(|world| world.travel_mm()).expect("it runs") - begun_mm;
        assert!(travel_mm.abs() < 2.0, "{travel_mm} mm");
        // It may end between the two answers.
        let mode = read_u8(rig, address::PRESENT_MODE);
        let state = read_u8(rig, address::COMMISSION_STATE);
        if state != 1 {
            return (state, read_u8(rig, address::COMMISSION_REFUSAL));
        }
        assert_eq!(mode, Mode::Strokes as u8);
    }
    panic!("it does not end: {} %", read_u8(rig, address::COMMISSION_PROGRESS));
}

#[test]
fn a_new_board_is_commissioned_and_keeps_it() {
    let setup = away(5.0);
    let mut rig = new_board(&setup);
    let old = params(&mut rig);
    assert_eq!(old[3], 0, "nobody knows yet which way the motor goes");
    assert_eq!(refused(&mut rig, address::TORQUE_ENABLE, 1), RESULT);
    assert_eq!(outcome(&mut rig, 2), (4, 3), "the direction comes first");
    let before_us = read_u16(&mut rig, address::LOOP_TIME_MAX_US);
    assert_eq!(outcome(&mut rig, 1), (2, 0));
    println!(
        "loop time at most {before_us} us before, {} us with the jog",
        read_u16(&mut rig, address::LOOP_TIME_MAX_US)
    );
    write_u8(&mut rig, address::COMMISSION_ACCEPT, 1);
    rig.run_ms(5).expect("it runs");
    assert_eq!(outcome(&mut rig, 2), (3, 0));

    let motor = &setup.motor;
    let ohm = motor.resistance_ohm + setup.supply.bridge_ohm;
    let k = motor.torque_nm_per_a;
    let truths = [
        (address::MEASURED_TORQUE_CONSTANT, 1e6 * k, 0.03),
        (address::MEASURED_TIME_CONSTANT, 1e6 * ohm * motor.inertia_kg_m2 / (k * k), 0.1),
        (address::MEASURED_INERTIA, 1e9 * motor.inertia_kg_m2, 0.1),
    ];
    for (register, truth, share) in truths {
        let found = f64::from(read_u32(&mut rig, register));
        println!("register {register}: {found}, true {truth:.1}");
        assert!((found / truth - 1.0).abs() < share, "{found}, {truth}");
    }
    for register in [address::MEASURED_FRICTION_FORWARD, address::MEASURED_FRICTION_BACK] {
        let found = f64::from(read_u16(&mut rig, register));
        println!("register {register}: {found}, true {:.1}", 1e6 * motor.friction_nm);
        assert!((found / (1e6 * motor.friction_nm) - 1.0).abs() < 0.15, "{found}");
    }
    println!("loop time at most {} us", read_u16(&mut rig, address::LOOP_TIME_MAX_US));
    write_u8(&mut rig, address::COMMISSION_ACCEPT, 2);
    write_u8(&mut rig, address::SAVE_PARAMETERS, 1);
    rig.run_ms(50).expect("it runs");
    let new = params(&mut rig);
    assert!(new[3] == 1 && new[0] != old[0], "{new:?}");
    reboot(&mut rig, 50);
    assert_eq!(params(&mut rig), new, "it outlives a reset");
    write_u8(&mut rig, address::TORQUE_ENABLE, 1);
}

#[test]
fn swapped_leads_and_channels_are_told() {
    let mut rig = new_board(&away(5.0));
    rig.world(|world| world.faults.leads_swapped = true).expect("it runs");
    assert_eq!(outcome(&mut rig, 1), (4, 5));
    rig.world(|world| (world.faults.leads_swapped, world.faults.encoder_reversed) = (false, true)).expect("it runs");
    assert_eq!(outcome(&mut rig, 1), (4, 5));
    rig.world(|world| (world.faults.encoder_reversed, world.faults.encoder_frozen) = (false, true)).expect("it runs");
    assert_eq!(outcome(&mut rig, 1), (4, 4));
    assert_eq!(refused(&mut rig, address::COMMISSION_ACCEPT, 1), RESULT);
    assert_eq!(refused(&mut rig, address::TORQUE_ENABLE, 1), RESULT);
}

/// By a stop, by a reset, and by a fault: the old parameters stay, and the motor rests.
#[test]
fn an_interruption_leaves_the_old_parameters() {
    let mut rig = new_board(&away(5.0));
    assert_eq!(outcome(&mut rig, 1), (2, 0));
    write_u8(&mut rig, address::COMMISSION_ACCEPT, 1);
    write_u8(&mut rig, address::SAVE_PARAMETERS, 1);
    rig.run_ms(50).expect("it runs");
    let old = params(&mut rig);
    for after_ms in [30, 1_111] {
        for reset in [false, true] {
            write_u8(&mut rig, address::TARE, 1);
            rig.run_ms(20).expect("it runs");
            write_u8(&mut rig, address::COMMISSION, 2);
            rig.run_ms(after_ms).expect("it runs");
            assert_eq!(read_u8(&mut rig, address::COMMISSION_STATE), 1);
            if reset {
                reboot(&mut rig, 0);
            } else {
                write_u8(&mut rig, address::TORQUE_ENABLE, 0);
            }
            rig.run_ms(100).expect("it runs");
            let state = if reset { (0, 0) } else { (4, 1) };
            let told = (read_u8(&mut rig, address::COMMISSION_STATE), read_u8(&mut rig, address::COMMISSION_REFUSAL));
            assert_eq!(told, state, "after {after_ms} ms");
            assert_eq!(params(&mut rig), old);
            let speed = rig.world(|world| world.speed_mm_per_s()).expect("it runs");
            assert!(speed.abs() < 0.1, "{speed} mm/s");
        }
    }
}
