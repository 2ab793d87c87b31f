//! The model's hard cases, one test each.

use crate::common::*;
use fingertip::model::{MODULUS_MAX, MODULUS_MIN, RADIUS_MAX, RADIUS_MIN, Tip, TipError};
use fingertip::units::Kilopascals;
use host_tests::prove::exact;
use host_tests::prove::random::{boundary_depths, boundary_tips, mm, newtons};
use host_tests::prove::reference::{Reference, error_ulp, real};
use paper::units::{Radians, Ratio};
use paper::{Displacement, Load};

/// What `the_boundaries_of_the_domain_hold` leaves out of the functions of the depth.
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
fn no_depth_at_all() {
    for tip in boundary_tips() {
        for d in [0, -1, i32::MIN] {
            assert_eq!(tip.force(mm(d)).to_bits(), 0);
            assert_eq!(tip.contact_radius(mm(d)).to_bits(), 0);
            assert_eq!(tip.stiffness(mm(d)).to_bits(), 0);
            assert_eq!(paper::touching_angle_max(&tip, mm(d)).to_bits(), 0);
            assert_eq!(tip.pressure(mm(0), mm(d)).to_bits(), 0);
        }
    }
}

#[test]
fn a_depth_beyond_the_deepest() {
    for tip in boundary_tips() {
        let deepest = tip.depth_max().to_bits();
        for beyond in [deepest + 1, tip.radius().to_bits(), i32::MAX] {
            assert_eq!(tip.force(mm(beyond)), tip.force_max());
            assert_eq!(tip.contact_radius(mm(beyond)), tip.contact_radius(mm(deepest)));
            assert_eq!(paper::touching_angle_max(&tip, mm(beyond)), paper::touching_angle_max(&tip, mm(deepest)));
        }
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
fn a_force_beyond_the_deepest() {
    for tip in boundary_tips() {
        assert_eq!(tip.indentation(newtons(i32::MAX)), tip.indentation(tip.force_max()));
        assert!(tip.indentation(newtons(i32::MAX)) <= tip.depth_max());
        assert_eq!(tip.stiffness_at_force(newtons(i32::MAX)), tip.stiffness_at_force(tip.force_max()));
    }
}

#[test]
fn a_tip_outside_the_domain_is_refused_by_name_value_and_range() {
    let below = Millimetres::from_bits(RADIUS_MIN.to_bits() - 1);
    let above = Kilopascals::from_bits(MODULUS_MAX.to_bits() + 1);
    assert_eq!(Tip::new(below, MODULUS_MIN), Err(TipError::Radius(below)));
    assert!(Tip::new(Millimetres::from_bits(RADIUS_MAX.to_bits() + 1), MODULUS_MIN).is_err());
    assert_eq!(Tip::new(RADIUS_MIN, above), Err(TipError::Modulus(above)));
    assert!(Tip::new(RADIUS_MIN, Kilopascals::from_bits(MODULUS_MIN.to_bits() - 1)).is_err());
    for (radius, modulus) in [(i32::MIN, 1 << 22), (0, 1 << 22), (1 << 27, 0), (1 << 27, i32::MIN)] {
        assert!(Tip::new(Millimetres::from_bits(radius), Kilopascals::from_bits(modulus)).is_err());
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

#[test]
fn the_largest_tilt_and_shift_of_a_deep_contact() {
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
                let error = error_ulp(bits, fraction_bits, exact);
                assert!(error.abs() <= 0.501, "result {place}, shift {shift}, tilt {tilt}: {error}");
            }
        }
        let beyond = Displacement { normal: mm(i32::MAX), shift: mm(i32::MIN), tilt: Radians::from_bits(i32::MAX) };
        let nearest = Displacement { normal: mm(d), shift: mm(-reach), tilt: Radians::from_bits(1 << 24) };
        assert_eq!(paper::load(&tip, beyond), paper::load(&tip, nearest));
    }
}

#[test]
fn the_friction_of_a_deep_contact() {
    for tip in boundary_tips() {
        let reference = Reference::new(&tip);
        for d in [tip.depth_max().to_bits(), tip.depth_max().to_bits() / 3] {
            let exact_d = real(d, 24);
            let limit = paper::limit_surface(&tip, mm(d), Ratio::from_bits(4 << 16));
            let force = reference.force(&exact_d) * real(4, 0);
            let moment = &force * reference.contact_radius(&exact_d) * reference.friction_shape(&exact_d);
            assert!(error_ulp(limit.force.to_bits(), 16, &force).abs() <= 0.501);
            let error = error_ulp(limit.moment.to_bits(), 14, &moment);
            assert!(error.abs() <= 0.56, "d {d}: {error}");
            assert_eq!(paper::limit_surface(&tip, mm(d), Ratio::from_bits(i32::MAX)), limit);
        }
    }
}
