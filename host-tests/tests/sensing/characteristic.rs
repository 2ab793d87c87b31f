//! An array whose characteristic is no line: codes to force, drift, bad taxels, and what is refused.

use super::{Bench, drift_weight};
use fingertip::params::Params;
use fingertip::pressure::{GAIN_ONE, TARE_BITS};
use fingertip::shipped::{Array, COLUMNS, Calibration, Config, Frame, ROWS, TARE_FRAMES};
use proptest::prelude::*;
use proptest::test_runner::RngSeed;
use sim::setup::Setup;

/// At the full range a code means so much more than at none.
const GROWTH: f64 = 3.3;

/// An array of this growth, and a configuration of this one.
fn curved(growth: f64, curve_permille: i32) -> Bench {
    let mut setup = Setup::default();
    setup.array.growth = growth;
    // Such an array is steeper at small pressures.
    setup.array.siemens_per_kpa *= 3.0;
    Bench::with(&setup, &Params { curve_permille, codes_per_kpa_milli: 72_000, ..Params::DEFAULT })
}

/// Force as sensed and as it is, N.
fn press(bench: &mut Bench, indentation_mm: f64) -> [f64; 2] {
    [bench.press(indentation_mm).force.0.to_num(), bench.world.force_n()]
}

#[test]
fn the_force_of_a_saturating_array_is_read_by_its_curve() {
    let mut bench = curved(GROWTH, 3_300);
    let mut line = curved(GROWTH, 0);
    let mut worst = 0.0_f64;
    for step in 2..=28 {
        let [sensed, truth] = press(&mut bench, f64::from(step) * 0.1);
        assert!((sensed - truth).abs() <= 0.003 * truth + 0.006, "{truth} N read as {sensed} N");
        let [sensed, truth] = press(&mut line, f64::from(step) * 0.1);
        worst = worst.max(1.0 - sensed / truth);
    }
    assert!(worst > 0.3, "by a line it would be {worst} too small");
}

#[test]
fn with_the_same_codes_a_curve_never_reads_less_than_the_line() {
    // What the guard goes by stays on the safe side.
    let (mut curve, mut line) = (curved(0.0, 1_000), curved(0.0, 0));
    for step in 0..=28 {
        let [[bent, _], [straight, _]] = [&mut curve, &mut line].map(|bench| press(bench, f64::from(step) * 0.1));
        assert!(bent >= straight - 0.002, "{bent} {straight}");
    }
}

#[test]
fn the_baseline_follows_drift_as_by_a_line() {
    let (mut curve, mut line) = (curved(GROWTH, 3_300), curved(GROWTH, 0));
    for bench in [&mut curve, &mut line] {
        for (row, column) in (0..ROWS).flat_map(|row| (0..COLUMNS).map(move |column| (row, column))) {
            let code = bench.frame.code(row, column);
            bench.frame.set_code(row, column, code + 10);
        }
        for _ in 0..30_000 {
            bench.array.read(&bench.frame, &bench.config);
            bench.array.follow_drift(drift_weight());
        }
    }
    let tares = |bench: &Bench| -> Vec<i32> { bench.array.tare().flatten().copied().collect() };
    assert_eq!(tares(&curve), tares(&line));
    let moved = tares(&curve)[0] >> TARE_BITS;
    assert!((45..=60).contains(&moved), "{moved}");
}

#[test]
fn bad_taxels_are_left_out_of_picture_sums_and_baseline() {
    let mut bench = curved(GROWTH, 3_300);
    bench.press(2.0);
    bench.frame.set_code(4, 4, 0);
    bench.frame.set_code(5, 5, 4_095);
    let picture = *bench.array.read(&bench.frame, &bench.config);
    assert_eq!((picture.bad_count, picture.taxels[4][4], picture.taxels[5][5]), (2, 0, 0));
    assert_eq!(picture.sum, picture.taxels.as_flattened().iter().sum::<i32>());
    assert_eq!(picture.peak, *picture.taxels.as_flattened().iter().max().unwrap());
    let before: Vec<i32> = bench.array.tare().map(|row| row[4]).collect();
    for _ in 0..ROWS {
        bench.array.read(&bench.frame, &bench.config);
        bench.array.follow_drift(1 << 14);
    }
    let after: Vec<i32> = bench.array.tare().map(|row| row[4]).collect();
    assert_eq!(before[4], after[4], "a dead taxel moves no baseline");
    assert_ne!(before[5], after[5]);
}

#[test]
fn what_leaves_too_few_codes_at_the_full_range_is_refused() {
    let params = Params { codes_per_kpa_milli: 4_000, curve_permille: 3_500, ..Params::DEFAULT };
    let error = Config::shipped(&params).unwrap_err();
    assert_eq!(error.to_string(), "codes_per_kpa_milli of 4000: 4500 to 200000 are allowed");
    assert!(Config::shipped(&Params { codes_per_kpa_milli: 4_500, ..params }).is_ok());
}

#[test]
fn less_force_is_seen_where_the_characteristic_saturates() {
    let seen = |curve_permille| {
        let params = Params { curve_permille, codes_per_kpa_milli: 72_000, ..Params::DEFAULT };
        Config::shipped(&params).unwrap().force_seen
    };
    assert!(seen(3_300) > seen(0), "the same codes reach farther");
    let full = Config::shipped(&Params { codes_per_kpa_milli: 72_000 * 10 / 43, ..Params::DEFAULT }).unwrap();
    assert!(seen(3_300) < full.force_seen, "but not as far as a line through the full range");
}

proptest! {
    #![proptest_config(ProptestConfig {
        rng_seed: RngSeed::Fixed(5), failure_persistence: None, cases: 200, ..ProptestConfig::default()
    })]

    /// Any codes of sound taxels and any gains: against the formula in double precision, from the line's readings.
    #[test]
    fn a_picture_carries_what_the_formula_says(
        blank in proptest::array::uniform10(proptest::array::uniform10(20_u16..300)),
        codes in proptest::array::uniform10(proptest::array::uniform10(20_u16..3_800)),
        gains in proptest::array::uniform10(proptest::array::uniform10(GAIN_ONE / 2..2 * GAIN_ONE)),
        curve_permille in 1..=8_000,
    ) {
        let frame = |codes: &[[u16; COLUMNS]; ROWS]| {
            let mut frame = Frame::EMPTY;
            for (row, column) in (0..ROWS).flat_map(|row| (0..COLUMNS).map(move |column| (row, column))) {
                frame.set_code(row, column, codes[row][column]);
            }
            frame
        };
        let calibration = Calibration::new(&gains, &[0; ROWS]).unwrap();
        let [straight, bent] = [0, curve_permille].map(|curve_permille| {
            let config = Config::shipped(&Params { curve_permille, ..Params::DEFAULT }).unwrap();
            let mut array = Array::new();
            array.calibrate(&calibration);
            for _ in 0..TARE_FRAMES {
                array.read(&frame(&blank), &config);
                array.continue_tare();
            }
            array.read(&frame(&codes), &config);
            array
        });
        let growth = f64::from(curve_permille) / 1e3;
        let mut exact_sum = 0.0;
        let tares = bent.tare().flatten().map(|tare| f64::from(*tare) / 65_536.0);
        let readings = straight.picture().taxels.as_flattened().iter().zip(bent.picture().taxels.as_flattened());
        for ((straight, bent), tare) in readings.zip(tares) {
            let reading = f64::from(*straight) / 16.0;
            let carried = |codes: f64| codes * (1.0 + growth * codes / 4_096.0) / (1.0 + growth);
            let exact = (carried(reading + tare) - carried(tare)).min(12_288.0);
            exact_sum += exact;
            prop_assert!((f64::from(*bent) / 16.0 - exact).abs() < 0.04, "{bent} {exact}");
        }
        let picture = bent.picture();
        prop_assert!((f64::from(picture.sum) / 16.0 - exact_sum).abs() < 4.0);
        prop_assert_eq!(picture.sum, picture.taxels.as_flattened().iter().sum::<i32>());
        let weighted = |of: fn(usize, usize) -> i32| -> i32 {
            let rows = picture.taxels.iter().enumerate();
            rows.flat_map(|(row, taxels)| taxels.iter().enumerate().map(move |(column, taxel)| of(row, column) * taxel)).sum()
        };
        prop_assert_eq!(picture.moment_x, weighted(|_, column| 2 * column as i32 - 9));
        prop_assert_eq!(picture.moment_y, weighted(|row, _| 2 * row as i32 - 9));
    }
}
