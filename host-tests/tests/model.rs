//! The model: properties of any tip and any input (order, inverses, energy, quadrature, totality), and its hard cases.

use crate::common::*;
use core::f64::consts::{PI, TAU};
use core::hint::black_box;
use core::num::NonZeroU16;
use fingertip::arith::floor_sqrt;
use fingertip::model::{MODULUS_MAX, MODULUS_MIN, RADIUS_MAX, RADIUS_MIN, Tip, TipError};
use fingertip::units::Kilopascals;
use host_tests::paper;
use host_tests::prove::random::{self, boundary_depths, boundary_tips, mm, newtons, reference_tip};
use host_tests::prove::tally::Tally;
use host_tests::prove::{exact, reference};

fn any_tip() -> impl Strategy<Value = Tip> {
    (RADIUS_MIN.to_bits()..=RADIUS_MAX.to_bits(), MODULUS_MIN.to_bits()..=MODULUS_MAX.to_bits())
        .prop_map(|(a, y)| Tip::new(Millimetres::from_bits(a), Kilopascals::from_bits(y)).unwrap())
}

/// A tip, and a share of its depth from one unit on, even in the logarithm.
fn tip_and_depth() -> impl Strategy<Value = (Tip, i32)> {
    (any_tip(), 0.0..1.0_f64).prop_map(|(tip, share)| {
        let top = f64::from(tip.depth_max().to_bits());
        (tip, top.powf(share) as i32)
    })
}

/// Numbers of every size.
fn sized() -> impl Strategy<Value = [i32; 4]> {
    any::<[(i32, u8); 4]>().prop_map(|numbers| numbers.map(|(number, drop)| number >> (drop % 31)))
}

fn number(bits: i32, fraction_bits: i32) -> f64 {
    f64::from(bits) / 2_f64.powi(fraction_bits)
}

proptest! {
    #![proptest_config(seeded(2_000, 2003))]

    #[test]
    fn the_way_back_from_the_radius_and_the_peak_is_as_good_as_they_are((tip, d) in tip_and_depth()) {
        let (a, depth) = (number(tip.radius().to_bits(), 24), number(d, 24));
        let by_radius = number(tip.indentation_from_radius(tip.contact_radius(mm(d))).to_bits(), 24);
        let radius_slope = number(tip.contact_radius(mm(d)).to_bits() + 1, 24) / (a - depth);
        prop_assert!((by_radius - depth).abs() <= radius_slope * number(1, 24) + number(1, 25));
        let by_peak = number(tip.indentation_from_peak(tip.peak_pressure(mm(d))).to_bits(), 24);
        let peak_slope = a / number(tip.modulus().to_bits(), 16);
        prop_assert!((by_peak - depth).abs() <= peak_slope * number(1, 17) + number(1, 25));
    }

    #[test]
    fn geometry_closes((tip, d) in tip_and_depth(), share in 0.0..=1.0_f64) {
        let (a, depth, theta_max) = (number(tip.radius().to_bits(), 24), number(d, 24), paper::touching_angle_max);
        let theta = theta_max(a, depth) * share;
        let (x, z) = (paper::distance_at(a, depth, theta), paper::height_at(a, depth, theta));
        // x^2 + z^2 = a^2 (eq. 1), and QC = Q_z - (a - d) (eq. 4), as in the core.
        prop_assert!((x * x + z * z - a * a).abs() <= 1e-12 * a * a);
        prop_assert!((paper::touching_angle(a, depth, x) - theta).abs() <= 1e-12);
        let r = mm((x * f64::from(1 << 24)).round() as i32);
        let compression = number(tip.compression(r, mm(d)).to_bits(), 24);
        // The core has half a unit of r and half of one of its own.
        let bound = number(1, 25) * (1.0 + x / z);
        prop_assert!((compression - paper::compression_at(a, depth, theta).max(0.0)).abs() <= 1.01 * bound);
        // The rim (eq. 5) is the core's, and dr/dtheta (7) is a difference quotient.
        let rim = paper::distance_at(a, depth, theta_max(a, depth));
        prop_assert!((rim - number(tip.contact_radius(mm(d)).to_bits(), 24)).abs() <= 1.01 * number(1, 25));
        let h = 1e-5;
        let [below, above] = [theta - h, theta + h].map(|theta| paper::distance_at(a, depth, theta));
        let slope = paper::distance_slope(a, depth, theta);
        prop_assert!(((above - below) / (2.0 * h) / slope - 1.0).abs() < 1e-6);
    }

    #[test]
    fn a_column_obeys_equations_9_to_13((tip, d) in tip_and_depth(), share in 0.0..1.0_f64, area in 1.0..100.0_f64) {
        let r = mm((number(tip.contact_radius(mm(d)).to_bits(), 0) * share) as i32);
        let [length, compression] = [tip.particle_length(r), tip.compression(r, mm(d))].map(|it| number(it.to_bits(), 24));
        // e = dL/L (10): dL holds half a unit of Q24.
        let strain = paper::strain_of(compression, length);
        let bound = number(1, 24) / length + number(1, 30);
        prop_assert!((strain - number(tip.strain(r, mm(d)).to_bits(), 30)).abs() <= bound);
        // F = Y e S (11) is F = P S (13).
        let (pressure, y) = (number(tip.pressure(r, mm(d)).to_bits(), 16), number(tip.modulus().to_bits(), 16));
        let by_strain = paper::particle_force(y, compression, length, area);
        let by_pressure = paper::force_on(pressure, area);
        let bound = 1e-3 * area * (y * bound + number(1, 17));
        prop_assert!((by_strain - by_pressure).abs() <= bound);
        // P = F/S (9, 12) undoes it.
        prop_assert!((paper::pressure_of(by_pressure, area) - pressure).abs() <= 1e-12 * pressure);
    }

    /// The columns' forces (eq. 8 and 13) over all touching angles add up to the total force (eq. 14).
    #[test]
    fn the_columns_add_up_to_the_total_force((tip, d) in tip_and_depth()) {
        let [a, d, y] = [number(tip.radius().to_bits(), 24), number(d, 24), number(tip.modulus().to_bits(), 16)];
        let rim = paper::touching_angle_max(a, d);
        let step = rim / 4_000.0;
        let force = |n: i32| {
            let theta = step * (f64::from(n) + 0.5);
            let (compression, length) = (paper::compression_at(a, d, theta), paper::height_at(a, d, theta));
            paper::particle_force(y, compression, length, paper::area_density(a, d, theta)) * step * TAU
        };
        let sum: f64 = (0..4_000).map(force).sum();
        // The midpoint rule is 1e-3 off at the deepest.
        prop_assert!((sum / (1e-3 * PI * y * d * d) - 1.0).abs() < 2e-3, "{sum}");
    }

    #[test]
    fn results_stay_in_their_domain_for_every_input_and_nothing_panics(tip in any_tip(), [x, y, z, w] in sized()) {
        let depths = [tip.indentation(newtons(x)), tip.indentation_from_peak(Kilopascals::from_bits(x)), tip.indentation_from_radius(mm(x))];
        for depth in depths {
            prop_assert!(depth >= mm(0) && depth <= tip.depth_max());
        }
        let (d, r) = (mm(x), mm(y));
        let (force, peak, wide) = (newtons(x), Kilopascals::from_bits(y), (x as u64) << 32 | z as u64);
        let rings = NonZeroU16::MIN.saturating_add(w as u16 & 7);
        let _ = black_box((Tip::new(d, peak), floor_sqrt(wide), tip.pi_y_times(wide, w as u32)));
        let _ = black_box((tip.force(d), tip.force_by_rings(d, rings), tip.stiffness(d), tip.stiffness_at_force(force)));
        let _ = black_box((tip.contact_radius(d), tip.particle_length(r), tip.compression(r, d), tip.strain(r, d)));
        let _ = black_box((tip.pressure(r, d), tip.peak_pressure(d), tip.mean_pressure(d)));
    }
}

#[test]
fn the_quadrature_converges_with_the_square_of_the_rings_down_to_the_formats_floor() {
    let tip = Tip::new(Millimetres::from_bits(16 << 24), MODULUS_MAX).unwrap();
    for d_mm in [4, 8, 12] {
        let d = mm(d_mm << 24);
        let rings = |n: u16| number(tip.force_by_rings(d, NonZeroU16::new(n).unwrap()).to_bits(), 16);
        let exact = std::f64::consts::PI * 2.0 * f64::from(d_mm * d_mm);
        // Midpoint rule: the error is h^2/24 times the difference of the slopes at the ends, h the width in r^2.
        let (a, rest) = (16.0, 16.0 - f64::from(d_mm));
        let slopes = std::f64::consts::PI * (1.0 / (rest * rest) - rest / (a * a * a));
        let contact_square: f64 = a * a - rest * rest;
        for n in [16, 32, 64, 128, 256] {
            let predicted = (contact_square / f64::from(n)).powi(2) / 24.0 * slopes;
            let share = (rings(n) - exact) / predicted;
            // The next term of the series is smaller by 1/n^2; two units of the format at the other end.
            let bound = 40.0 / f64::from(n).powi(2) + number(2, 16) / predicted;
            assert!((share - 1.0).abs() < bound, "d {d_mm}, n {n}: {share}, {bound}");
        }
        assert!((rings(u16::MAX) - exact).abs() <= number(2, 16), "d {d_mm}: {}", rings(u16::MAX) - exact);
    }
}

// A quick part of the proof: thousands of inputs where `cargo xtask prove` takes them all.

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
        hold(&exact::depths(&tip, part.start.max(1)..part.end, &quiet));
    }
    for part in parts(tip.force_max().to_bits()) {
        hold(&exact::forces(&tip, part, &quiet));
    }
    for part in parts(tip.contact_radius(tip.depth_max()).to_bits()) {
        hold(&exact::radii(&tip, part, &quiet));
    }
    for part in parts(tip.peak_pressure(tip.depth_max()).to_bits()) {
        hold(&exact::peaks(&tip, part, &quiet));
    }
}

#[test]
fn grids_boundaries_and_random_points_of_the_model_hold() {
    hold(&exact::pressures(&reference_tip(), 100, 1_000, &quiet));
    hold(&random::boundaries(&quiet));
    hold(&random::points(0..5_000, &quiet));
    hold(&reference::columns(0..2_000, &quiet));
}

#[test]
fn the_oracle_holds() {
    let tallies = reference::check().unwrap();
    hold(&tallies);
    for tally in tallies {
        assert_eq!(tally.inputs, 400);
        // An error of nothing at all would mean that the comparison is not one.
        assert!(tally.worst_ulp.abs() > 0.4, "{tally}");
    }
}

/// Checks the functions of depth that `random::boundaries` does not check.
#[test]
fn peak_and_mean_pressure_at_the_boundaries() {
    for tip in boundary_tips() {
        assert_eq!(tip.indentation_from_radius(tip.contact_radius(mm(1))), mm(1));
        for d in boundary_depths(&tip) {
            let [peak, mean] = [tip.peak_pressure(mm(d)), tip.mean_pressure(mm(d))].map(Kilopascals::to_bits);
            let judged = [exact::peak_pressure(&tip, d, peak, 1), exact::mean_pressure(&tip, d, mean, 1)];
            assert!(judged.iter().all(|judged| judged.nearest == Some(true)), "{tip:?}, d {d}: {judged:?}");
        }
    }
}

#[test]
fn a_depth_or_force_outside_the_domain_counts_as_the_nearest() {
    for tip in boundary_tips() {
        for d in [0, -1, i32::MIN] {
            let [radius, force] = [tip.contact_radius(mm(d)).to_bits(), tip.force(mm(d)).to_bits()];
            let [stiffness, pressure] = [tip.stiffness(mm(d)).to_bits(), tip.pressure(mm(0), mm(d)).to_bits()];
            assert_eq!([radius, force, stiffness, pressure], [0; 4], "{tip:?}, d {d}");
        }
        let deepest = tip.depth_max();
        for beyond in [deepest.to_bits() + 1, tip.radius().to_bits(), i32::MAX].map(mm) {
            let at = |d| (tip.force(d), tip.contact_radius(d));
            assert_eq!(at(beyond), at(deepest), "{tip:?}");
            assert_eq!(tip.force(beyond), tip.force_max(), "{tip:?}");
        }
        let at = |force| (tip.indentation(force), tip.stiffness_at_force(force));
        assert_eq!(at(newtons(i32::MAX)), at(tip.force_max()), "{tip:?}");
        assert!(tip.indentation(newtons(i32::MAX)) <= deepest, "{tip:?}");
    }
}

#[test]
fn distances_near_and_beyond_the_radius() {
    for tip in boundary_tips() {
        let radius = tip.radius().to_bits();
        for r in [radius, radius + 1, i32::MAX, -radius, i32::MIN] {
            assert_eq!(tip.particle_length(mm(r)).to_bits(), 0);
            assert_eq!(tip.pressure(mm(r), tip.depth_max()).to_bits(), 0);
            assert_eq!(tip.compression(mm(r), tip.depth_max()).to_bits(), 0);
        }
        // One unit inside: sqrt(2a - 1) units.
        let length = tip.particle_length(mm(radius - 1)).to_bits();
        assert_eq!(exact::particle_length(&tip, radius - 1, length, 1).nearest, Some(true));
        // A distance has no sign.
        assert_eq!(tip.pressure(mm(-radius / 2), tip.depth_max()), tip.pressure(mm(radius / 2), tip.depth_max()));
    }
}

/// The slope is infinite at 0: a unit of noise there is worth the most.
#[test]
fn a_force_within_one_unit_of_zero() {
    for tip in boundary_tips() {
        assert!([0, -1, i32::MIN].iter().all(|force| tip.indentation(newtons(*force)) == mm(0)));
        hold(&exact::forces(&tip, 0..2_000, &quiet));
    }
}

#[test]
fn a_tip_outside_the_domain_is_refused_by_name_value_and_range() {
    for radius in [RADIUS_MIN.to_bits() - 1, RADIUS_MAX.to_bits() + 1, 0, i32::MIN].map(mm) {
        assert_eq!(Tip::new(radius, MODULUS_MIN), Err(TipError::Radius(radius)));
    }
    for modulus in [MODULUS_MIN.to_bits() - 1, MODULUS_MAX.to_bits() + 1, 0, i32::MIN].map(Kilopascals::from_bits) {
        assert_eq!(Tip::new(RADIUS_MIN, modulus), Err(TipError::Modulus(modulus)));
    }
    let refused = Tip::new(Millimetres::from_bits(3 << 24), MODULUS_MIN).unwrap_err();
    assert_eq!(refused.to_string(), "tip radius of 3 mm: 4 to 16 mm are covered");
    let refused = Tip::new(RADIUS_MIN, Kilopascals::from_bits(3_000 << 16)).unwrap_err();
    assert_eq!(refused.to_string(), "Young's modulus of 3000 kPa: 20 to 2000 kPa are covered");
}
