//! Gains and masks of single taxels.

use crate::common::*;
use fingertip::pressure::{CalibrationError, GAIN_MAX};
use host_tests::stimulus::tared;

const GAINS: [[u16; COLUMNS]; ROWS] = [[GAIN_ONE; COLUMNS]; ROWS];

/// A frame of a contact of 1.5 mm, and one without contact.
pub fn frames() -> [Frame; 2] {
    let mut world = Plant::new(&Setup::default());
    let mut frames = [Frame::EMPTY; 2];
    world.fill_frame(&mut frames[1]);
    world.place(world.setup().wall.distance_mm + 1.5);
    world.fill_frame(&mut frames[0]);
    frames
}

#[test]
fn a_gain_scales_its_taxel_and_no_other() {
    let [pressed, blank] = frames();
    let config = config();
    let plain = *tared(&Calibration::NONE, &blank, &config).read(&pressed, &config);
    let mut gains = GAINS;
    gains[4][6] = GAIN_ONE / 2;
    gains[5][3] = GAIN_ONE / 4 * 5;
    let calibration = Calibration::new(&gains, &[0; ROWS]).unwrap();
    let scaled = *tared(&calibration, &blank, &config).read(&pressed, &config);
    for (row, column) in places() {
        let share = f64::from(gains[row][column]) / f64::from(GAIN_ONE);
        let expected = f64::from(plain.taxels[row][column]) * share;
        let found = f64::from(scaled.taxels[row][column]);
        assert!((found - expected).abs() <= 1.5, "row {row}, column {column}: {found}, not {expected}");
    }
    assert!(plain.taxels[4][6] > 1_000, "the contact lies there");
}

#[test]
fn a_masked_taxel_reads_as_nothing_and_is_no_fault() {
    let [mut pressed, blank] = frames();
    let config = config();
    let mut mask = [0; ROWS];
    mask[4] = 1 << 5;
    mask[7] = 0x3ff;
    let array = |frame: &Frame| {
        let mut array = tared(&Calibration::new(&GAINS, &mask).unwrap(), &blank, &config);
        (*array.read(frame, &config), array.bad_taxels(frame, &config))
    };
    let (sound, _) = array(&pressed);
    assert_eq!((sound.taxels[4][5], sound.taxels[7], sound.bad, sound.bad_count), (0, [0; COLUMNS], mask, 0));
    // One of them dies, and one that counts.
    pressed.set_code(4, 5, 0);
    pressed.set_code(4, 4, 4095);
    let (dead, glanced) = array(&pressed);
    assert_eq!((dead.taxels[4][4], dead.taxels[4][5]), (0, 0));
    assert_eq!((dead.bad[4], dead.bad[7], dead.bad_count, glanced), (0b11_0000, 0x3ff, 1, 1));
}

#[test]
fn what_cannot_be_is_refused_by_name() {
    for (value, row, column) in [(0, 0, 0), (GAIN_MAX + 1, 9, 9), (u16::MAX, 3, 7)] {
        let mut gains = GAINS;
        gains[row][column] = value;
        let error = Calibration::new(&gains, &[0; ROWS]).unwrap_err();
        assert_eq!(error, CalibrationError::Gain { row, column, value });
        assert!(error.to_string().contains(&format!("row {row}, column {column}: 1 to {GAIN_MAX}")), "{error}");
    }
    let mut mask = [0; ROWS];
    mask[6] = 0x400;
    let error = Calibration::new(&GAINS, &mask).unwrap_err();
    assert_eq!(error, CalibrationError::Mask { row: 6, value: 0x400, all: 0x3ff });
    assert_eq!(error.to_string(), "mask of 0x400 for row 6: 0 to 0x3ff are allowed");
    let mut gains = GAINS;
    (gains[2][2], gains[2][3], mask[6]) = (1, GAIN_MAX, 0x3ff);
    assert!(Calibration::new(&gains, &mask).is_ok());
}
