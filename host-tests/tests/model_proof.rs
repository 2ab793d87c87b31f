//! A quick part of the proof: thousands of inputs where `cargo xtask prove` takes them all.

use host_tests::prove::domain::reference_tip;
use host_tests::prove::tally::Tally;
use host_tests::prove::{beyond, exhaustive, oracle, random};

fn quiet(_: u64, _: u64) {}

fn hold(tallies: &[Tally]) {
    for tally in tallies {
        assert!(tally.holds(), "{tally}");
    }
}

#[test]
fn the_reference_tip_is_correctly_rounded_at_both_ends_and_in_the_middle() {
    let tip = reference_tip();
    let parts = |top: i32| {
        let top = top as u64 + 1;
        [0..20_000, top / 2..top / 2 + 20_000, top - 20_000..top]
    };
    for part in parts(tip.depth_max().to_bits()) {
        hold(&exhaustive::depths(&tip, part.start.max(1)..part.end, &quiet));
    }
    for part in parts(tip.force_max().to_bits()) {
        hold(&exhaustive::forces(&tip, part, &quiet));
    }
    for part in parts(tip.contact_radius(tip.depth_max()).to_bits()) {
        hold(&exhaustive::radii(&tip, part, &quiet));
    }
    for part in parts(tip.peak_pressure(tip.depth_max()).to_bits()) {
        hold(&exhaustive::peaks(&tip, part, &quiet));
    }
}

#[test]
fn the_pressure_is_correctly_rounded_and_falls_with_the_distance_on_a_grid() {
    hold(&exhaustive::pressures(&reference_tip(), 100, 1_000, &quiet));
}

#[test]
fn the_boundaries_of_the_domain_hold() {
    hold(&random::boundaries(&quiet));
}

#[test]
fn random_points_of_the_domain_hold() {
    hold(&random::points(0..5_000, &quiet));
}

#[test]
fn the_touching_angle_holds_over_the_reference_tip() {
    hold(&random::touching_angles(&reference_tip(), 5_000, &quiet));
}

#[test]
fn the_rest_of_the_model_holds() {
    hold(&beyond::geometry(0..2_000, &quiet));
    hold(&beyond::tilt(0..2_000, &quiet));
    hold(&beyond::friction(0..2_000, &quiet));
    hold(&beyond::relaxation(0..6, &quiet));
}

#[test]
fn the_oracle_holds() {
    let tallies = oracle::check().unwrap();
    hold(&tallies);
    for tally in tallies {
        assert_eq!(tally.inputs, 400);
        // An error of nothing at all would mean that the comparison is not one.
        assert!(tally.worst_ulp.abs() > 0.4, "{tally}");
    }
}

#[test]
fn a_pattern_fed_for_ever_ends_in_a_cycle_no_wider_than_the_pattern_makes_it() {
    let settled = beyond::long_run(&[i32::MAX, i32::MAX], 1 << 10);
    assert_eq!((settled.low, settled.high), (0.5, 0.5));
    let swinging = beyond::long_run(&[i32::MAX, 0], 1 << 10);
    // The mean of the pattern relaxes to 1/65536 of it; the swing about it is symmetric.
    assert!((swinging.low + swinging.high - 0.5).abs() <= 2.0 / 65_536.0, "{swinging:?}");
    assert!(swinging.high < 16_384.0 && swinging.high > 15_000.0, "{swinging:?}");
}
