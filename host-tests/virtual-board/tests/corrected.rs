//! A calibrated finger's time: every correction of a real sensor is on, and a capture runs.

use crate::common::{away, read_u16, read_u32, running, write_goal, write_u8};
use fingertip::contact::FitLevel;
use fingertip::params::Params;
use fingertip::shipped::{Record, address};
use fingertip::state::{Limits, Mode};
use virtual_board::flash::SECTOR;
use virtual_board::{Options, Rig};

/// Curve, creep and gain over temperature, as of a sensor that was measured. The winding's estimate is on by default.
const CORRECTED: Params = Params {
    curve_permille: 3_300,
    creep_permille: 66,
    array_gain_ppm_per_k: 3_600,
    direction_confirmed: 1,
    ..Params::DEFAULT
};
const RECORDING: u8 = 2;
const DONE: u8 = 3;
/// Virtual time that an answer may take while frames are kept.
const WAIT_NS: u64 = 20_000_000;

#[test]
fn corrections_and_a_capture_leave_the_fit_level_its_time() {
    let record = sim::encode(&Record { params: CORRECTED, ..Record::DEFAULT }, 0);
    // Near, so that the capture's memory lasts, and half off the array, so that the contact is refined.
    let mut setup = away(0.05);
    (setup.wall.centre_x_mm, setup.wall.centre_y_mm) = (7.5, 1.0);
    let mut rig = running(&setup, &Options { presets: vec![(SECTOR.start, record)], ..Options::default() });
    write_u8(&mut rig, address::CAPTURE, 1);
    write_u8(&mut rig, address::TARE, 1);
    write_u8(&mut rig, address::TORQUE_ENABLE, 1);
    write_goal(&mut rig, 1_000);
    rig.run_ms(40).expect("it runs");
    let read_u8 = |rig: &mut Rig, register| {
        let answer = rig.client(WAIT_NS, move |bus| bus.read_u8(1, register).map(|reply| reply.data));
        answer.expect("the client runs").expect("the image answers")
    };
    assert_eq!(read_u8(&mut rig, address::PRESENT_MODE), Mode::Force as u8);
    assert_eq!(read_u8(&mut rig, address::FIT_LEVEL_IN_USE), FitLevel::default() as u8);
    assert_eq!(read_u8(&mut rig, address::CAPTURE_STATE), RECORDING);
    rig.run_ms(400).expect("it runs");
    assert_eq!(read_u8(&mut rig, address::CAPTURE_STATE), DONE);
    assert!(!Limits(read_u16(&mut rig, address::LIMITS)).has(Limits::FIT_LEVEL));
    assert_eq!(read_u32(&mut rig, address::MISSED_FRAMES), 0);
    let longest_us = read_u16(&mut rig, address::LOOP_TIME_MAX_US);
    println!("longest loop time {longest_us} us");
    // Measured 61 us; the deadline is at 75, and 66 would lower the fit level.
    assert!((50..=65).contains(&longest_us), "{longest_us} us");
}
