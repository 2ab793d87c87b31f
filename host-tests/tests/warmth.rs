//! The array's drift with the microcontroller's temperature: what is made of it, its bounds, and that it is off at 0.

use fingertip::config::newtons;
use fingertip::control::warmth::Warmth;
use fingertip::params::Params;
use fingertip::shipped::Config;
use fingertip::units::{Celsius, Newtons};
use proptest::prelude::*;
use proptest::test_runner::RngSeed;

fn config(array_gain_ppm_per_k: i32, array_zero_pa_per_k: i32) -> Config {
    Config::shipped(&Params { array_gain_ppm_per_k, array_zero_pa_per_k, ..Params::DEFAULT }).unwrap()
}

fn celsius(degrees: i32) -> Option<Celsius> {
    Some(Celsius::from_bits(degrees << 16))
}

/// From a tare at one temperature to another, long after.
fn warmed(from: i32, to: i32, config: &Config) -> Warmth {
    let mut warmth = Warmth::default();
    // What it was before the tare is forgotten.
    (0..30_000).for_each(|frame| warmth.observe(celsius(if frame == 0 { from + 7 } else { from }), config));
    warmth.zero();
    (0..30_000).for_each(|_| warmth.observe(celsius(to), config));
    warmth
}

#[test]
fn gain_goes_by_the_calibration_and_zero_by_the_tare() {
    // 0.36 % and 10 Pa a K; 225 mm^2 of array.
    for (from, to, gain_k, zero_k) in [(25, 45, 20.0, 20.0), (35, 45, 20.0, 10.0), (25, 5, -20.0, -20.0)] {
        let config = config(3_600, 10);
        let found: f64 = warmed(from, to, &config).force(newtons(3_000), &config).0.to_num();
        let expected = 3.0 * 0.0036 * gain_k + 10.0 * 225e-6 * zero_k;
        assert!((found - expected).abs() < 3e-4, "{from} to {to}: {found} of {expected}");
    }
}

#[test]
fn at_coefficients_of_zero_and_without_a_reading_there_is_none() {
    let off = config(0, 0);
    assert_eq!(warmed(0, 100, &off), Warmth::default());
    let on = config(3_600, 10);
    let mut warmth = warmed(25, 45, &on);
    assert!(warmth.force(newtons(3_000), &on) > newtons(200));
    warmth.observe(None, &on);
    assert_eq!(warmth.force(newtons(3_000), &on), Newtons::ZERO);
}

#[test]
fn it_follows_slowly() {
    let config = config(3_600, 0);
    let mut warmth = Warmth::default();
    warmth.observe(celsius(25), &config);
    // A reading that is wrong for a frame moves it by a thousandth of that.
    warmth.observe(celsius(125), &config);
    let found: f64 = warmth.force(newtons(5_000), &config).0.to_num();
    assert!(found > 0.0 && found < 5.0 * 0.0036 * 0.11, "{found}");
}

proptest! {
    #![proptest_config(ProptestConfig { rng_seed: RngSeed::Fixed(7), failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn it_stays_within_half_of_what_is_held(
        chips in proptest::collection::vec((any::<Option<i32>>(), 1_u32..3_000, any::<bool>()), 1..12),
        held in any::<i32>(), gain in -10_000..=10_000, gain_at in -40..=125, zero in -1_000..=1_000, pitch in 500..=4_000,
    ) {
        let params = Params {
            array_gain_ppm_per_k: gain, array_gain_at_c: gain_at, array_zero_pa_per_k: zero, pitch_um: pitch,
            ..Params::DEFAULT
        };
        let config = Config::shipped(&params).unwrap();
        let mut warmth = Warmth::default();
        for (chip, frames, zeroes) in chips {
            for _ in 0..frames {
                warmth.observe(chip.map(Celsius::from_bits), &config);
            }
            if zeroes {
                warmth.zero();
            }
            let found = warmth.force(Newtons::from_bits(held), &config).to_bits();
            prop_assert!(i64::from(found).abs() <= i64::from(held.max(0)) / 2);
        }
    }
}
