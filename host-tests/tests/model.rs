//! The model: properties of any tip and any input (order, inverses, energy, quadrature, totality), and its hard cases.

use crate::common::*;
use core::hint::black_box;
use core::num::NonZeroU16;
use fingertip::arith::floor_sqrt;
use fingertip::model::{MODULUS_MAX, MODULUS_MIN, RADIUS_MAX, RADIUS_MIN, Tip, TipError};
use fingertip::units::Kilopascals;
use host_tests::prove::random::{self, boundary_depths, boundary_tips, mm, newtons, reference_tip};
use host_tests::prove::reference::{Reference, error_ulp, real};
use host_tests::prove::tally::Tally;
use host_tests::prove::{exact, reference};
use paper::units::{NewtonMillimetres, Radians, Ratio, SquareMillimetres};
use paper::{Displacement, Load, Relaxation, RelaxationState, RelaxationTerm, force_on, pressure_of, strain_of};

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
        let d = mm(d);
        let theta = Radians::from_bits((number(paper::touching_angle_max(&tip, d).to_bits(), 0) * share) as i32);
        let r = paper::distance_at(&tip, theta, d);
        // x^2 + z^2 = a^2 (eq. 1), and QC = Q_z - (a - d) (eq. 4).
        let (x, z) = (number(r.to_bits(), 24), number(paper::height_at(&tip, theta, d).to_bits(), 24));
        let a = number(tip.radius().to_bits(), 24);
        prop_assert!((x * x + z * z - a * a).abs() <= 2.0 * a * number(1, 24));
        let compression = number(paper::compression_at(&tip, theta, d).to_bits(), 24);
        prop_assert!((compression - (z - (a - number(d.to_bits(), 24))).max(0.0)).abs() < 1e-12);
    }

    #[test]
    fn a_column_obeys_equations_9_to_13((tip, d) in tip_and_depth(), share in 0.0..1.0_f64, area in 1..100 << 16) {
        let r = mm((number(tip.contact_radius(mm(d)).to_bits(), 0) * share) as i32);
        let (length, compression) = (tip.particle_length(r), tip.compression(r, mm(d)));
        let area = SquareMillimetres::from_bits(area);
        // e = dL/L (10): dL holds half a unit of Q24.
        let (strain, direct) = (strain_of(compression, length), tip.strain(r, mm(d)));
        let bound = number(1, 24) / number(length.to_bits(), 24) + number(2, 30);
        prop_assert!((number(strain.to_bits(), 30) - number(direct.to_bits(), 30)).abs() <= bound);
        // F = Y e S (11) is F = P S (13).
        let (by_strain, by_pressure) = (paper::particle_force(&tip, compression, length, area), force_on(tip.pressure(r, mm(d)), area));
        let y_s = number(tip.modulus().to_bits(), 16) / 1000.0 * number(area.to_bits(), 16);
        let bound = y_s * bound + number(area.to_bits(), 16) / 1000.0 * number(1, 17) + number(1, 16);
        prop_assert!((number(by_strain.to_bits(), 16) - number(by_pressure.to_bits(), 16)).abs() <= bound);
        // P = F/S (9, 12) undoes it.
        let pressure = number(pressure_of(by_pressure, area).to_bits(), 16);
        let bound = 1000.0 * number(1, 17) / number(area.to_bits(), 16) + number(1, 16);
        prop_assert!((pressure - number(tip.pressure(r, mm(d)).to_bits(), 16)).abs() <= bound);
    }

    #[test]
    fn a_tip_that_is_only_pressed_has_the_models_force((tip, d) in tip_and_depth()) {
        let load = paper::load(&tip, Displacement { normal: mm(d), ..Displacement::default() });
        prop_assert_eq!((load.normal, load.tangential.to_bits(), load.moment.to_bits()), (tip.force(mm(d)), 0, 0));
    }

    #[test]
    fn a_free_tip_slides_to_where_nothing_pulls((tip, d) in tip_and_depth(), t in -1.0..=1.0_f64) {
        let tilt = Radians::from_bits((t * number(1 << 24, 0)) as i32);
        let shift = paper::free_shift(&tip, mm(d), tilt);
        // Further than that the shift itself is outside the domain.
        prop_assume!(shift.to_bits().abs() < tip.radius().to_bits() / 2 - (1 << 20));
        let displacement = Displacement { normal: mm(d), shift, tilt };
        // Half a unit of shift at the lateral stiffness 2 pi Y d.
        let bound = number(tip.stiffness(mm(d)).to_bits() + 1, 16) * number(1, 25) + number(1, 16);
        prop_assert!(number(paper::load(&tip, displacement).tangential.to_bits().abs(), 16) <= bound);
        let there = paper::energy(&tip, displacement).to_bits();
        for off in [-1 << 20, 1 << 20] {
            let beside = Displacement { shift: mm(shift.to_bits() + off), ..displacement };
            prop_assert!(paper::energy(&tip, beside).to_bits() >= there);
        }
    }

    #[test]
    fn the_slip_margin_is_0_on_the_limit_1_at_rest_and_falls_along_a_ray(
        tip in any_tip(), depth in 0.05..1.0_f64, mu in 0.1..4.0_f64, angle in 0.0..1.57_f64,
    ) {
        let d = (number(tip.depth_max().to_bits(), 0) * depth) as i32;
        let limit = paper::limit_surface(&tip, mm(d), Ratio::from_bits((mu * 65_536.0) as i32));
        // So that a share of the limit is resolved to a part in a thousand.
        prop_assume!(limit.force.to_bits() > 1 << 10 && limit.moment.to_bits() > 1 << 10);
        for share in [0.0, 0.3, 0.9, 1.0, 2.0, 5.0] {
            let force = number(limit.force.to_bits(), 0) * angle.cos() * share;
            let moment = number(limit.moment.to_bits(), 0) * angle.sin() * share;
            if force.max(moment) > f64::from(i32::MAX) {
                continue;
            }
            let margin = limit.margin(Newtons::from_bits(force as i32), NewtonMillimetres::from_bits(-moment as i32));
            let margin = number(margin.to_bits(), 16);
            prop_assert!((margin - (1.0 - share)).abs() < 1e-3 * (1.0 + share), "{share}: {margin}");
        }
    }

    #[test]
    fn results_stay_in_their_domain_for_every_input_and_nothing_panics(tip in any_tip(), [x, y, z, w] in sized()) {
        let depths = [tip.indentation(newtons(x)), tip.indentation_from_peak(Kilopascals::from_bits(x)), tip.indentation_from_radius(mm(x))];
        for depth in depths {
            prop_assert!(depth >= mm(0) && depth <= tip.depth_max());
        }
        let displacement = Displacement { normal: mm(x), shift: mm(y), tilt: Radians::from_bits(z) };
        prop_assert!(paper::energy(&tip, displacement).to_bits() >= 0);
        let limit = paper::limit_surface(&tip, mm(x), Ratio::from_bits(y));
        prop_assert!(limit.margin(newtons(z), NewtonMillimetres::from_bits(x)).to_bits() <= 1 << 16);
        let (d, r, theta, area) = (mm(x), mm(y), Radians::from_bits(y), SquareMillimetres::from_bits(z));
        let (force, peak, wide) = (newtons(x), Kilopascals::from_bits(y), (x as u64) << 32 | z as u64);
        let rings = NonZeroU16::MIN.saturating_add(w as u16 & 7);
        let _ = black_box((Tip::new(d, peak), floor_sqrt(wide), tip.pi_y_times(wide, w as u32)));
        let _ = black_box((tip.force(d), tip.force_by_rings(d, rings), tip.stiffness(d), tip.stiffness_at_force(force)));
        let _ = black_box((tip.contact_radius(d), tip.particle_length(r), tip.compression(r, d), tip.strain(r, d)));
        let _ = black_box((tip.pressure(r, d), tip.peak_pressure(d), tip.mean_pressure(d)));
        let _ = black_box((paper::touching_angle_max(&tip, d), paper::touching_angle(&tip, r, d)));
        let _ = black_box((paper::distance_at(&tip, theta, d), paper::distance_slope(&tip, theta, d)));
        let _ = black_box((paper::area_density(&tip, theta, d), paper::height_at(&tip, theta, d)));
        let _ = black_box((paper::compression_at(&tip, theta, d), paper::particle_force(&tip, d, r, area)));
        let _ = black_box((pressure_of(force, area), strain_of(d, r), force_on(peak, area)));
        let _ = black_box((paper::load(&tip, displacement), paper::free_shift(&tip, d, theta), paper::friction_shape(&tip, d)));
        let terms = [(x, y), (z, w)].map(|(share, time)| RelaxationTerm {
            share: Ratio::from_bits(share),
            time_constant_us: time.unsigned_abs(),
        });
        if let Ok(filter) = Relaxation::new(w.unsigned_abs(), &terms) {
            filter.step(&mut RelaxationState::settled(newtons(y)), force);
        }
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

#[test]
fn a_tip_that_settled_has_relaxed_by_all_its_terms() {
    // Half of the force relaxes: 30 % with 10 ms, 20 % with 1 s.
    let terms = [(19_661, 10_000), (13_107, 1_000_000)]
        .map(|(share, time_constant_us)| RelaxationTerm { share: Ratio::from_bits(share), time_constant_us });
    let (filter, full) = (Relaxation::new(100, &terms).unwrap(), newtons(4 << 16));
    assert_eq!(filter.step(&mut RelaxationState::settled(full), full), newtons(2 << 16));
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
    hold(&random::touching_angles(&reference_tip(), 5_000, &quiet));
    hold(&reference::geometry(0..2_000, &quiet));
    hold(&reference::tilt(0..2_000, &quiet));
    hold(&reference::friction(0..2_000, &quiet));
    hold(&reference::relaxation(0..6, &quiet));
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
            let angle = paper::touching_angle_max(&tip, mm(d)).to_bits();
            let [radius, force] = [tip.contact_radius(mm(d)).to_bits(), tip.force(mm(d)).to_bits()];
            let [stiffness, pressure] = [tip.stiffness(mm(d)).to_bits(), tip.pressure(mm(0), mm(d)).to_bits()];
            assert_eq!([radius, angle, force, stiffness, pressure], [0; 5], "{tip:?}, d {d}");
        }
        let deepest = tip.depth_max();
        for beyond in [deepest.to_bits() + 1, tip.radius().to_bits(), i32::MAX].map(mm) {
            let at = |d| (tip.force(d), tip.contact_radius(d), paper::touching_angle_max(&tip, d));
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

#[test]
fn a_force_within_one_unit_of_zero() {
    for tip in boundary_tips() {
        assert!([0, -1, i32::MIN].iter().all(|force| tip.indentation(newtons(*force)) == mm(0)));
        let first = tip.indentation(newtons(1)).to_bits();
        // The slope is infinite at 0: a unit of noise there is worth the most.
        for force in 1..2_000 {
            let moved = tip.indentation(newtons(force + 1)).to_bits() - tip.indentation(newtons(force)).to_bits();
            assert!((0..=first).contains(&moved), "F {force}: {moved} of {first}");
        }
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

/// The cosine is near 1/20 there: what is divided by it, by its square and by its cube.
#[test]
fn the_rim_of_a_deep_contact_by_its_angle() {
    for tip in boundary_tips() {
        let (deepest, reference) = (tip.depth_max().to_bits(), Reference::new(&tip));
        for d in [deepest, deepest - 1, deepest - deepest / 100] {
            let rim = paper::touching_angle_max(&tip, mm(d)).to_bits();
            for theta in [1, rim / 2, rim - rim / 100, rim - 1, rim] {
                let (angle, exact_angle, exact_d) = (Radians::from_bits(theta), real(theta, 24), real(d, 24));
                let [distance, slope, area] = reference.at_angle(&exact_angle, &exact_d);
                let results = [
                    (paper::distance_at(&tip, angle, mm(d)).to_bits(), 24, distance),
                    (paper::distance_slope(&tip, angle, mm(d)).to_bits(), 16, slope),
                    (paper::area_density(&tip, angle, mm(d)).to_bits(), 16, area),
                ];
                for (place, (bits, fraction_bits, exact)) in results.into_iter().enumerate() {
                    let error = error_ulp(bits, fraction_bits, &exact);
                    // The angle may be rounded past the rim; r stops there.
                    let beyond = place == 0 && bits == tip.contact_radius(mm(d)).to_bits() && error < 0.0;
                    assert!(error.abs() <= 0.501 || beyond, "function {place}, d {d}, theta {theta}: {error}");
                }
            }
        }
    }
}

fn assert_near(bits: i32, fraction_bits: isize, exact: &reference::Real, bound_ulp: f64, name: &str) {
    let error = error_ulp(bits, fraction_bits, exact);
    assert!(error.abs() <= bound_ulp, "{name}: {error} ulp");
}

#[test]
fn the_largest_tilt_shift_and_friction_of_a_deep_contact() {
    for tip in boundary_tips() {
        let (d, reach, reference) = (tip.depth_max().to_bits(), tip.radius().to_bits() / 2, Reference::new(&tip));
        for (shift, tilt) in [(reach, 1 << 24), (-reach, 1 << 24), (reach, -1 << 24), (1, 1), (-1, (1 << 24) - 1)] {
            let displacement = Displacement { normal: mm(d), shift: mm(shift), tilt: Radians::from_bits(tilt) };
            let exact = reference.load(&real(d, 24), &real(shift, 24), &real(tilt, 24));
            let Load { normal, tangential, moment } = paper::load(&tip, displacement);
            let energy = paper::energy(&tip, displacement);
            let results =
                [(normal.to_bits(), 16), (tangential.to_bits(), 16), (moment.to_bits(), 14), (energy.to_bits(), 14)];
            for (place, ((bits, fraction_bits), exact)) in results.into_iter().zip(&exact).enumerate() {
                assert_near(bits, fraction_bits, exact, 0.501, &format!("result {place}, {displacement:?}"));
            }
        }
        let beyond = Displacement { normal: mm(i32::MAX), shift: mm(i32::MIN), tilt: Radians::from_bits(i32::MAX) };
        let nearest = Displacement { normal: mm(d), shift: mm(-reach), tilt: Radians::from_bits(1 << 24) };
        assert_eq!(paper::load(&tip, beyond), paper::load(&tip, nearest));
        for d in [d, d / 3] {
            let limit = paper::limit_surface(&tip, mm(d), Ratio::from_bits(4 << 16));
            let force = reference.force(&real(d, 24)) * real(4, 0);
            let moment = &force * reference.contact_radius(&real(d, 24)) * reference.friction_shape(&real(d, 24));
            assert_near(limit.force.to_bits(), 16, &force, 0.501, "the largest force");
            assert_near(limit.moment.to_bits(), 14, &moment, 0.56, &format!("the largest moment, d {d}"));
            assert_eq!(paper::limit_surface(&tip, mm(d), Ratio::from_bits(i32::MAX)), limit);
        }
    }
}
