//! Jog, strokes and a press over the bus, on the flash image: each completes, and its record is read and parsed by the
//! host's solver.

use crate::capture::fetch;
use crate::common::{away, let_go, read_u8, read_u16, read_u32, running, write_and_run_ms, write_goal, write_param};
use fingertip::measure::{MeasureState, Task};
use fingertip::params::Params;
use fingertip::shipped::address;
use fingertip::state::Mode;
use solve::record;
use virtual_board::{Options, Rig};

/// The longest motion, ms.
const LONGEST_MS: u64 = 20_000;

/// Makes a motion, which must complete without a fault.
fn measure(rig: &mut Rig, task: Task) {
    write_and_run_ms(rig, address::MEASURE, task as u8, 2);
    for _ in 0..LONGEST_MS / 20 {
        let mode = read_u8(rig, address::PRESENT_MODE);
        let state = read_u8(rig, address::MEASURE_STATE);
        if state != MeasureState::Running as u8 {
            let value = read_u32(rig, address::MEASURE_VALUE).cast_signed();
            let told = [address::MEASURE_ENDED, address::FAULT].map(|register| read_u8(rig, register));
            let loop_us = read_u16(rig, address::LOOP_TIME_MAX_US);
            let missed = read_u32(rig, address::MISSED_FRAMES);
            println!("{task:?}: {loop_us} us at most, {missed} frames missed");
            assert_eq!((state, told, value), (MeasureState::Done as u8, [0; 2], 0), "state, end and fault, value");
            return;
        }
        assert_eq!(mode, if task == Task::Press { Mode::Press } else { Mode::Strokes } as u8);
        rig.run_ms(20).expect("it runs");
    }
    panic!("it does not end: {} %", read_u8(rig, address::MEASURE_PROGRESS));
}

fn tare(rig: &mut Rig) {
    write_and_run_ms(rig, address::TARE, 1, 20);
    assert_eq!(read_u8(rig, address::TARE_STATE), 2);
}

#[test]
fn jog_and_strokes_complete_and_the_drive_is_solved() {
    let setup = away(2.0);
    let mut rig = running(&setup, &Options::default());
    tare(&mut rig);
    measure(&mut rig, Task::Jog);
    write_param(&mut rig, "direction_confirmed", 1);
    tare(&mut rig);
    measure(&mut rig, Task::Strokes);
    let strokes = record::strokes(&fetch(&mut rig), &Params::DEFAULT).expect("strokes");
    assert_eq!((strokes.strokes.len(), strokes.ended), (32, None));
    let found = solve::strokes::solve(&strokes).expect("a drive");
    let k = found.torque_constant.value;
    println!("torque constant {k}, true {}", setup.motor.torque_nm_per_a);
    assert!((k / setup.motor.torque_nm_per_a - 1.0).abs() < 0.03, "{k}");
    rig.check_gaps().expect("no unknown gap");
}

pub fn a_press_completes_and_the_modulus_is_solved(rig: &mut Rig) {
    tare(rig);
    write_and_run_ms(rig, address::TORQUE_ENABLE, 1, 2);
    measure(rig, Task::Press);
    let press = record::press(&fetch(rig), &Params::DEFAULT).expect("a press");
    let kpa = solve::modulus(&[press]).expect("a modulus").kpa;
    let true_kpa = rig.world(|world| world.setup().tip.modulus_kpa).expect("it runs");
    println!("modulus {kpa} kPa, true {true_kpa}");
    assert!((kpa / true_kpa - 1.0).abs() < 0.03, "{kpa}");
    // The finger holds forces afterwards.
    write_goal(rig, 500);
    rig.run_ms(300).expect("it runs");
    assert_eq!(read_u8(rig, address::PRESENT_MODE), Mode::Force as u8);
    let_go(rig);
    rig.check_gaps().expect("no unknown gap");
}
