//! The readout: sag, settling, ghosting, defects, codes.

use super::pressed;
use fingertip::shipped::{COLUMNS, Frame, ROWS, SLOTS};
use sim::mechanics::decay::decay;
use sim::plant::{Plant, Row, Setup, Taxel};

const NONE: [bool; ROWS] = [false; ROWS];

fn only(row: usize) -> [bool; ROWS] {
    std::array::from_fn(|r| r == row)
}

#[test]
fn the_boards_reference_figures() {
    let array = Setup::default().array;
    let codes_ohm = array.feedback_ohm * array.drive_v * 4096.0 / array.reference_v;
    assert!((codes_ohm / 1.8e7 - 1.0).abs() < 1e-12);
    assert!((array.preload_siemens * codes_ohm - 40.0).abs() < 1e-9);
    assert!((array.siemens_per_kpa * codes_ohm - 24.0).abs() < 1e-9);
    assert!((array.row_ohm / codes_ohm - 1.667e-6).abs() < 1e-9);
}

#[test]
fn pressing_one_taxel_shows_in_no_other_row() {
    // Ghosting is nil: undriven rows and all columns sit at the same voltage.
    let mut light = pressed(0.0);
    let mut heavy = pressed(1.0);
    let far = 0;
    assert_eq!(heavy.pressure_kpa(far, 5), 0.0);
    assert_eq!(light.settled_volts(&only(far)), heavy.settled_volts(&only(far)));
    assert_eq!(heavy.settled_volts(&NONE), [0.3; COLUMNS]);
}

#[test]
fn columns_settle_exponentially() {
    let mut world = pressed(1.5);
    let (start, end) = (world.settled_volts(&only(4))[5], world.settled_volts(&only(2))[5]);
    assert!(start - end > 0.1);
    for tau in [0.0_f64, 0.5, 1.0, 3.0, 9.0, 12.0] {
        let expected = end + (start - end) * (-tau).exp();
        let volts = world.settling_volts(&only(2), tau * 0.2e-6, &only(4))[5];
        assert!((volts - expected).abs() < 1e-9, "{volts} V for {expected} V after {tau} tau");
    }
}

#[test]
fn the_decay_factor_is_the_exponential() {
    let mut worst = 0.0_f64;
    for n in 0..=40_000 {
        let x = f64::from(n) * 1e-3;
        worst = worst.max((decay(x) / (-x).exp() - 1.0).abs());
        if n == 12_000 {
            assert!(worst < 1e-12, "{worst:e} up to 12");
        }
    }
    assert!(worst < 1e-11, "{worst:e} up to 40");
    assert_eq!(decay(1e6), 0.0);
    assert_eq!(decay(0.0), 1.0);
}

#[test]
fn codes_are_rounded_down_and_cut() {
    let array = Setup::default().array;
    let lsb = 3.3 / 4096.0;
    assert_eq!(array.code(0.0), 0);
    assert_eq!(array.code(100.999 * lsb), 100);
    assert_eq!(array.code(101.001 * lsb), 101);
    assert_eq!((array.code(3.3), array.code(9.0), array.code(-1.0)), (4095, 4095, 0));
}

#[test]
fn a_frame_holds_every_slot() {
    let mut world = pressed(1.0);
    let mut frame = Frame::EMPTY;
    world.fill_frame(&mut frame);
    world.fill_frame(&mut frame);
    assert_eq!(frame.sequence, 2);
    for slot in 0..SLOTS {
        for column in 0..COLUMNS {
            assert_eq!(frame.code(slot, column), world.slot_codes(slot)[column]);
        }
    }
    // 0.3 V of virtual ground is 372.36 codes; the preload of the undriven slot has settled away.
    assert_eq!(frame.code(ROWS, 5), 372);
    // The middle taxels' mean r^2 is 1.5 mm^2, where p is 23.3 kPa: 559 codes, 40 of preload, 0.4 % of sag, 372 of
    // ground.
    assert!((963..975).contains(&frame.code(5, 5)), "{}", frame.code(5, 5));
}

#[test]
fn a_slot_sampled_at_its_edge_still_shows_the_slot_before() {
    let mut world = pressed(1.0);
    let settled: Vec<_> = (0..SLOTS).map(|slot| world.slot_codes(slot)).collect();
    let mut setup = Setup::default();
    setup.array.sample_after_s = 0.0;
    let mut world = Plant::new(&setup);
    world.place(setup.wall.distance_mm + 1.0);
    for slot in 0..SLOTS {
        assert_eq!(world.slot_codes(slot), settled[(slot + SLOTS - 1) % SLOTS]);
    }
}

#[test]
fn defects_show_where_they_are() {
    let mut sound = pressed(1.0);
    let code = |world: &mut Plant, row, column| f64::from(world.slot_codes(row)[column]);

    let mut dead = pressed(1.0);
    dead.faults.array.taxels[4][5] = Taxel::Dead;
    assert_eq!(dead.slot_codes(4)[5], 372);
    assert_eq!(dead.slot_codes(5)[5], sound.slot_codes(5)[5]);

    let mut shorted = pressed(1.0);
    shorted.faults.array.taxels[4][5] = Taxel::Shorted;
    assert_eq!(shorted.slot_codes(4)[5], 4095);
    // The row's switch carries 100 mS: R_on S = 3, so the others read a quarter.
    let share = (code(&mut shorted, 4, 4) - 372.4) / (code(&mut sound, 4, 4) - 372.4);
    assert!((0.24..0.26).contains(&share), "{share}");

    let mut low = pressed(1.0);
    low.faults.array.rows[4] = Row::StuckLow;
    assert_eq!(low.slot_codes(4)[5], 372);
    assert_eq!(low.slot_codes(5)[5], sound.slot_codes(5)[5]);

    let mut high = pressed(1.0);
    high.faults.array.rows[4] = Row::StuckHigh;
    assert_eq!(high.slot_codes(4)[5], sound.slot_codes(4)[5]);
    assert_eq!(high.slot_codes(ROWS)[5], sound.slot_codes(4)[5]);
    let both = code(&mut sound, 4, 5) + code(&mut sound, 5, 5) - 372.4;
    assert!((code(&mut high, 5, 5) - both).abs() < 2.0);

    let mut saturated = pressed(1.0);
    saturated.faults.array.saturated = true;
    assert!((0..SLOTS).all(|slot| saturated.slot_codes(slot) == [4095; COLUMNS]));
}
