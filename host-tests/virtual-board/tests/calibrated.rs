//! The array calibrated over the bus, on the flash image: a press, what it proposes, accepted, saved, and there after a
//! reset; and what is left where it is interrupted.
//!
//! `FINGERTIP_IMAGE` names the image; `cargo xtask test` builds it and sets it.

use crate::common::{
    away, let_go, read_u8, read_u16, read_u32, reboot, refused, register, running, write_goal, write_u8, write_u16,
    write_u32,
};
use fingertip::shipped::address;
use virtual_board::{Options, Rig};

/// The longest that a press takes, with what is worked out after it.
const PRESS_MS: u64 = 3_000;
const GAIN_ONE: u16 = 16_384;

/// A plate 0.5 mm away, where two taxels conduct a quarter more and a quarter less than their gains say.
fn start() -> Rig {
    let mut rig = running(&away(0.5), &Options::confirmed());
    write_u16(&mut rig, address::GAINS + 2 * 44, GAIN_ONE / 4 * 5);
    write_u16(&mut rig, address::GAINS + 2 * 35, GAIN_ONE / 4 * 3);
    rig.run_ms(2).expect("it runs");
    tare(&mut rig);
    rig
}

fn tare(rig: &mut Rig) {
    write_u8(rig, address::TARE, 1);
    rig.run_ms(20).expect("it runs");
    assert_eq!(read_u8(rig, address::TARE_STATE), 2);
    write_u8(rig, address::TORQUE_ENABLE, 1);
    rig.run_ms(1).expect("it runs");
}

fn gains(rig: &mut Rig, from: u16) -> Vec<u16> {
    (0..100).map(|taxel| read_u16(rig, from + 2 * taxel)).collect()
}

#[test]
fn a_press_is_evaluated_accepted_saved_and_there_after_a_reset() {
    let mut rig = start();
    // New gains restart the scan.
    let missed = read_u32(&mut rig, address::MISSED_FRAMES);
    write_u8(&mut rig, address::CALIBRATE, 1);
    for _ in 0..PRESS_MS / 50 {
        rig.run_ms(50).expect("it runs");
        if read_u8(&mut rig, address::CALIBRATE_STATE) != 1 {
            break;
        }
    }
    assert_eq!((read_u8(&mut rig, address::CALIBRATE_STATE), read_u8(&mut rig, address::CALIBRATE_REFUSAL)), (2, 0));
    assert_eq!(
        (read_u8(&mut rig, address::CALIBRATE_PROGRESS), read_u8(&mut rig, address::CALIBRATE_PRESSES)),
        (100, 1)
    );
    assert!((60..90).contains(&read_u16(&mut rig, address::CALIBRATE_TAXELS)));
    // No deadline was missed, whatever was worked out beside the loop.
    assert_eq!((read_u8(&mut rig, address::FAULT), read_u32(&mut rig, address::MISSED_FRAMES)), (0, missed));
    let longest_us = read_u16(&mut rig, address::LOOP_TIME_MAX_US);
    println!("the longest loop time: {longest_us} us");

    let proposed = gains(&mut rig, address::PROPOSED_GAINS);
    for place in [33, 34, 35, 43, 44, 45, 54, 55, 56] {
        let off = f64::from(proposed[place]) / f64::from(GAIN_ONE) - 1.0;
        assert!(off.abs() < 0.02, "taxel {place} is off by {off}");
        let sigma = read_u8(&mut rig, address::PROPOSED_SIGMAS + place as u16);
        assert!((1..20).contains(&sigma), "taxel {place}: {sigma}");
    }
    assert_eq!(
        (proposed[0], read_u8(&mut rig, address::PROPOSED_SIGMAS)),
        (GAIN_ONE, 255),
        "no press reached the corner"
    );

    // Nothing of it counts yet, and with torque on it is not accepted.
    assert_eq!(read_u16(&mut rig, address::GAINS + 88), GAIN_ONE / 4 * 5);
    assert_ne!(refused(&mut rig, address::CALIBRATE, 3), 0);
    write_u8(&mut rig, address::TORQUE_ENABLE, 0);
    write_u8(&mut rig, address::CALIBRATE, 3);
    assert_eq!(gains(&mut rig, address::GAINS), proposed);
    rig.run_ms(2).expect("it runs");
    write_u8(&mut rig, address::SAVE_PARAMETERS, 1);
    rig.run_ms(30).expect("it runs");
    assert_eq!((read_u8(&mut rig, address::SAVED_STATE), read_u8(&mut rig, address::FAULT)), (0, 0));
    reboot(&mut rig, 100);
    assert_eq!(gains(&mut rig, address::GAINS), proposed);
    assert_eq!(read_u8(&mut rig, address::FAULT), 0);

    // A scale under the plate shows a tenth more than is read.
    tare(&mut rig);
    write_goal(&mut rig, 2_000);
    rig.run_ms(700).expect("it runs");
    let read_mn = read_u32(&mut rig, address::PRESENT_FORCE_MN);
    write_u32(&mut rig, address::SCALE_SHOWS_MN, read_mn * 11 / 10);
    rig.run_ms(2).expect("it runs");
    assert_eq!((read_u8(&mut rig, address::SCALE_POINTS), read_u8(&mut rig, address::SCALE_REFUSAL)), (1, 0));
    let factor_ppm = read_u32(&mut rig, address::SCALE_FACTOR_PPM);
    assert!((1_095_000..1_105_000).contains(&factor_ppm), "{factor_ppm}");
    write_u8(&mut rig, address::TORQUE_ENABLE, 0);
    write_u8(&mut rig, address::SCALE, 3);
    let codes = read_u32(&mut rig, register("codes_per_kpa_milli"));
    assert!((21_700..21_950).contains(&codes), "{codes}");
    rig.check_gaps().expect("no unknown gap");
}

#[test]
fn what_is_interrupted_leaves_the_old_gains() {
    let mut rig = start();
    let before = gains(&mut rig, address::GAINS);
    write_u8(&mut rig, address::CALIBRATE, 1);
    rig.run_ms(400).expect("it runs");
    assert_eq!((read_u8(&mut rig, address::PRESENT_MODE), read_u8(&mut rig, address::CALIBRATE_STATE)), (6, 1));
    write_u8(&mut rig, address::TORQUE_ENABLE, 0);
    rig.run_ms(2).expect("it runs");
    assert_eq!((read_u8(&mut rig, address::CALIBRATE_STATE), read_u8(&mut rig, address::CALIBRATE_REFUSAL)), (3, 9));
    assert_eq!((read_u8(&mut rig, address::CALIBRATE_PRESSES), gains(&mut rig, address::GAINS)), (0, before));
    assert_ne!(refused(&mut rig, address::CALIBRATE, 3), 0, "there is nothing to accept");
    // The power goes in the middle of another one.
    let_go(&mut rig);
    tare(&mut rig);
    write_u8(&mut rig, address::CALIBRATE, 1);
    rig.run_ms(600).expect("it runs");
    reboot(&mut rig, 100);
    assert_eq!(gains(&mut rig, address::GAINS), vec![GAIN_ONE; 100], "what was never saved is gone");
    assert_eq!((read_u8(&mut rig, address::CALIBRATE_STATE), read_u8(&mut rig, address::FAULT)), (0, 0));
}
