//! Any picture that the array's reading can make, under any finger's parameters: the fit ends, within its range.

use fingertip::contact::Contact;
use fingertip::contact::FitLevel;
use fingertip::params::Params;
use fingertip::shipped::{COLUMNS, Config, Fit, Picture, ROWS};
use host_tests::fit_cases::picture;
use images::single::{Refined, read};
use proptest::prelude::*;
use proptest::test_runner::RngSeed;

/// A code of 4095 with the largest sag and the largest gain, in sixteenths; a tare can be as large.
const LARGEST: i32 = 4095 * 2 * 2 * 16;

fn any_config() -> impl Strategy<Value = Config> {
    let ends_or = |low: i32, high: i32| prop_oneof![Just(low), Just(high), low..=high];
    let fingers = (ends_or(500, 4_000), ends_or(4_000, 16_000), ends_or(20_000, 2_000_000), ends_or(1_000, 200_000));
    (fingers, ends_or(1, 14)).prop_map(
        |((pitch_um, tip_radius_um, modulus_pa, codes_per_kpa_milli), contact_off_mn)| {
            let params =
                Params { pitch_um, tip_radius_um, modulus_pa, codes_per_kpa_milli, contact_off_mn, ..Params::DEFAULT };
            Config::shipped(&params).expect("parameters within their ranges that do not contradict each other")
        },
    )
}

/// All of one kind: an even level, extremes, small values, anything, or a few spikes.
fn any_picture() -> impl Strategy<Value = Picture> {
    let extremes = prop_oneof![Just(-LARGEST), Just(0), Just(LARGEST), Just(16), Just(1)];
    let taxel = prop_oneof![
        3 => Just(None),
        1 => extremes.clone().prop_map(Some),
        1 => (-40..400).prop_map(Some),
        1 => (-LARGEST..=LARGEST).prop_map(Some),
    ];
    let level = prop_oneof![extremes, 0..LARGEST, -40..4_000];
    let spikes = proptest::collection::vec(taxel, ROWS * COLUMNS);
    let bad = prop_oneof![3 => Just([0; ROWS]), 1 => proptest::array::uniform10(0..1_u32 << COLUMNS)];
    (level, prop::bool::ANY, spikes, bad).prop_map(|(level, even, spikes, bad)| {
        let taxels = core::array::from_fn(|row| {
            core::array::from_fn(|column| if even { level } else { spikes[row * COLUMNS + column].unwrap_or(level) })
        });
        picture(&taxels, bad)
    })
}

fn in_range(contact: &Contact, config: &Config) {
    let radius = config.tip.radius();
    // A fit's centre stays within a tip radius of the array.
    let farthest = config.half_pitch.0.to_num::<f64>() * COLUMNS as f64 + radius.0.to_num::<f64>() + 1e-3;
    assert!(contact.force.to_bits() >= 0, "{contact:?}");
    assert!(contact.indentation.to_bits() >= 0 && contact.indentation < radius, "{contact:?}");
    assert!(contact.radius.to_bits() >= 0 && contact.radius <= radius, "{contact:?}");
    for centre in [contact.centre_x, contact.centre_y] {
        assert!(centre.0.to_num::<f64>().abs() <= farthest, "{contact:?}");
    }
}

proptest! {
    #![proptest_config(ProptestConfig {
        cases: 1_500,
        rng_seed: RngSeed::Fixed(2003),
        failure_persistence: None,
        ..ProptestConfig::default()
    })]

    #[test]
    fn any_pictures_are_read(config in any_config(), pictures in proptest::collection::vec(any_picture(), 1..4)) {
        let mut fits = FitLevel::ALL.map(Fit::new);
        for picture in &pictures {
            for refined in Refined::ALL {
                in_range(&read(picture, refined, &config), &config);
            }
            // Not a whole number of refinements, so that a picture meets a guess made from another.
            for _ in 0..19 {
                for fit in &mut fits {
                    in_range(&fit.read(picture, &config), &config);
                }
            }
        }
    }
}
