//! The pass over a frame, which works on rows, against the same taxel by taxel: any codes, gains, masks and tares. Then
//! gains and masks of single taxels.

use crate::common::*;
use fingertip::pressure::{CODE_BITS, CalibrationError};

/// Codes above the column's level, or any codes.
#[derive(Clone, Debug)]
struct Codes {
    levels: [u16; COLUMNS],
    above: [[u16; COLUMNS]; ROWS],
    wild: Vec<(usize, usize, u16)>,
}

impl Codes {
    fn frame(&self) -> Frame {
        let mut frame = Frame::EMPTY;
        recode(&mut frame, |row, column, _| self.levels[column] + self.above[row][column]);
        (0..COLUMNS).for_each(|column| frame.set_code(ROWS, column, self.levels[column]));
        for (slot, column, code) in &self.wild {
            frame.set_code(*slot, *column, *code);
        }
        frame
    }
}

/// Sound taxels, of which up to the given number have any code up to `code_max`, or one near saturation.
fn codes(wild: usize, code_max: u16) -> impl Strategy<Value = Codes> {
    let places = (0..=ROWS, 0..COLUMNS, prop_oneof![3 => 0..=code_max, 1 => 3_835..3_845_u16]);
    let above = prop_oneof![15 => 12_u16..3_200, 1 => 12_u16..20];
    let above = proptest::array::uniform10(proptest::array::uniform10(above));
    (proptest::array::uniform10(300_u16..600), above, proptest::collection::vec(places, 0..=wild))
        .prop_map(|(levels, above, wild)| Codes { levels, above, wild })
}

fn calibration() -> impl Strategy<Value = Calibration> {
    let gains = proptest::array::uniform10(proptest::array::uniform10(1..=GAIN_MAX));
    let mask = proptest::array::uniform10(prop_oneof![4 => Just(0), 1 => 0_u32..1 << COLUMNS]);
    (gains, mask).prop_map(|(gains, mask)| Calibration::new(&gains, &mask).unwrap())
}

fn scanned(row_sag_ppb_per_code: i32, dead_codes: i32) -> Config {
    allowed(Params { row_sag_ppb_per_code, dead_codes, ..Params::DEFAULT })
}

/// The bad columns of a row by their definition.
fn bad(frame: &Frame, row: usize, config: &Config) -> u32 {
    let wrong = |column: usize| {
        let (code, level) = (frame.code(row, column), frame.code(ROWS, column) & 0xfff);
        code >= config.saturated_codes || i32::from(code) - i32::from(level) < i32::from(config.dead_codes)
    };
    (0..COLUMNS).map(|column| u32::from(wrong(column)) << column).sum()
}

proptest! {
    #![proptest_config(seeded(256, 21))]

    /// Taxels against the formula in double precision, with and without a curve; then the sums against the taxels.
    #[test]
    fn a_picture_is_what_the_formula_says(
        blank in codes(0, 0), codes in codes(3, 4095), calibration in calibration(), sag in 0..7_601, dead in 1..13,
        curve_permille in prop_oneof![Just(0), 1..=8_000],
    ) {
        let params = Params { row_sag_ppb_per_code: sag, dead_codes: dead, curve_permille, ..Params::DEFAULT };
        let mut config = allowed(params);
        // A wild level spoils a column: the sums of an array that is not broken.
        config.params.bad_taxels_max = 100;
        let mut array = tared(&calibration, &blank.frame(), &config);
        let frame = codes.frame();
        let picture = *array.read(&frame, &config);
        let (mut sums, mut sizes, mut peak) = ([0_i64; 3], 0, 0);
        let growth = f64::from(curve_permille) / 1e3;
        let load = |codes: f64| codes * (1.0 + growth * codes / 4_096.0) / (1.0 + growth);
        for ((row, taxels), tares) in picture.taxels.iter().enumerate().zip(array.tare()) {
            let net = |column| f64::from(frame.code(row, column)) - f64::from(frame.code(ROWS, column));
            let boost = 1.0 / (1.0 - f64::from(config.sag_q32) / 2_f64.powi(32) * (0..COLUMNS).map(net).sum::<f64>());
            for (column, (taxel, tare)) in taxels.iter().zip(tares).enumerate() {
                if picture.bad[row] >> column & 1 == 0 {
                    let reading = net(column) * f64::from(array.gain(row, column)) / f64::from(GAIN_ONE) * boost;
                    let exact = (load(reading) - load(f64::from(*tare) / 65_536.0)).min(16_384.0 - 1.0 / 16.0);
                    prop_assert!((f64::from(*taxel) / 16.0 - exact).abs() < 0.04, "{taxel} {exact}");
                }
                let weight = |place: usize| 2 * place as i64 - 9;
                for (sum, weight) in sums.iter_mut().zip([1, weight(column), weight(row)]) {
                    *sum += i64::from(*taxel) * weight;
                }
                sizes += i64::from(*taxel) + i64::from(tare >> (TARE_BITS - CODE_BITS));
                peak = peak.max(*taxel);
            }
        }
        let TactileImage { sum, moment_x, moment_y, .. } = picture;
        // On a line, taxels and their tares are rounded to sixteenths; along the columns, the weighted gains to Q10.
        let bounds = if curve_permille > 0 { [0; 3] } else { [110, 550 + sizes / 2_048, 550] };
        for ((found, exact), bound) in [sum, moment_x, moment_y].into_iter().zip(sums).zip(bounds) {
            prop_assert!((i64::from(found) - exact).abs() <= bound, "{found}, not {exact}, to {bound}");
        }
        prop_assert_eq!(picture.peak, peak);
    }

    #[test]
    fn bad_taxels_are_those_of_the_definition(
        codes in codes(12, 4095), calibration in calibration(), dead in prop_oneof![1..20, 1..1_001], new in 0..=ROWS,
    ) {
        let (frame, config) = (codes.frame(), scanned(1_667, dead));
        let mut array = Array::new();
        array.calibrate(&calibration);
        let masks = array.read(&Codes { wild: vec![], ..codes }.frame(), &scanned(1_667, 1)).bad;
        let picture = *array.read(&frame, &config);
        let mut count = 0;
        for (row, mask) in masks.iter().enumerate() {
            let expected = bad(&frame, row, &config);
            prop_assert_eq!(picture.bad[row], expected | mask, "row {}", row);
            count += (expected & !mask).count_ones();
            for column in (0..COLUMNS).filter(|column| picture.bad[row] >> column & 1 != 0) {
                prop_assert_eq!(picture.taxels[row][column], 0);
            }
        }
        prop_assert_eq!(u32::from(picture.bad_count), count);
        let mut begun = array.clone();
        // Of a frame of which no row is there yet nothing is known, neither its undriven levels.
        begun.begin(&Frame::EMPTY, 0, &config);
        let late = begun.clone();
        prop_assert_eq!(begun.begin(&frame, new, &config), (count as u16, picture.undriven_max));
        array.read(&frame, &config);
        array.follow_drift(1 << 14);
        for mut begun in [begun, late] {
            prop_assert_eq!(begun.read(&frame, &config), array.picture());
            begun.follow_drift(1 << 14);
            prop_assert!(begun.tare().eq(array.tare()));
        }
        let above = places().map(|(row, column)| frame.code(row, column).saturating_sub(frame.code(ROWS, column)));
        let sound = (0..ROWS).all(|row| bad(&frame, row, &config) == 0);
        prop_assert_eq!(picture.peak_codes, if sound { above.max().unwrap_or(0) } else { 0 });
        // What was bad in one frame is not in the next.
        prop_assert_eq!(array.read(&Codes { wild: vec![], ..codes }.frame(), &scanned(1_667, 1)).bad, masks);
    }

    #[test]
    fn a_tare_is_the_mean_of_what_it_looks_at(frames in proptest::collection::vec(codes(0, 0), 1..12), calibration in calibration()) {
        let config = scanned(0, 1);
        let mut array = Array::new();
        array.calibrate(&calibration);
        let gains = array.clone();
        let mut means = [[0.0; COLUMNS]; ROWS];
        let mut highest = 0;
        for (number, codes) in frames.iter().cycle().take(TARE_FRAMES as usize).enumerate() {
            let frame = codes.frame();
            array.read(&frame, &config);
            let picture = *gains.clone().read(&frame, &config);
            for row in [number % 5, number % 5 + 5] {
                for (mean, taxel) in means[row].iter_mut().zip(picture.taxels[row]) {
                    *mean += f64::from(taxel) / f64::from(TARE_FRAMES / 5);
                    highest = highest.max(taxel);
                }
            }
            prop_assert_eq!(array.continue_tare(), number + 1 == TARE_FRAMES as usize);
        }
        for (tare, mean) in array.tare().flatten().zip(means.as_flattened()) {
            let tare = f64::from(*tare) / f64::from(1 << (TARE_BITS - CODE_BITS));
            // The n-th of 32 looks counts 1/n in 16 bits, rounded down: that moves the mean by n/32 of 2^-16 of what
            // the looks differ.
            let bound = 1.5 + f64::from(highest) * 16.5 / 65_536.0;
            prop_assert!((tare - mean).abs() <= bound, "{tare}, not {mean}, to {bound}");
        }
    }
}

#[test]
fn a_broken_array_shows_nothing() {
    let config = scanned(1_667, 12);
    let most = config.params.bad_taxels_max as usize;
    let mut array = Array::new();
    for bad in [most + 1, most, 0] {
        // From none to saturated, in rows of their own.
        let wild = (0..bad).map(|place| (place, 9 - place, if place % 2 == 0 { 4_095 } else { 0 })).collect();
        let mut codes = Codes { levels: [300; COLUMNS], above: [[40; COLUMNS]; ROWS], wild };
        codes.above[9][9] = 400;
        let picture = *array.read(&codes.frame(), &config);
        let taxels = picture.taxels.as_flattened();
        let zeros = taxels.iter().filter(|taxel| **taxel == 0).count();
        assert_eq!(usize::from(picture.bad_count), bad);
        assert_eq!(zeros, if bad > most { ROWS * COLUMNS } else { bad });
        assert_eq!(picture.peak, taxels.iter().fold(0, |peak, taxel| peak.max(*taxel)));
        assert_eq!(picture.peak > 6_000, bad <= most, "{}", picture.peak);
    }
}

const GAINS: [[u16; COLUMNS]; ROWS] = [[GAIN_ONE; COLUMNS]; ROWS];

/// A frame of a contact of 1.5 mm, and one without contact.
pub fn frames() -> [Frame; 2] {
    let mut world = Plant::new(&Setup::default());
    let mut frames = [Frame::EMPTY; 2];
    world.fill_frame(&mut frames[1]);
    world.place(world.finger().setup.wall.distance_mm + 1.5);
    world.fill_frame(&mut frames[0]);
    frames
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
