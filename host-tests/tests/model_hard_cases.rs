//! The model's hard cases, one test each.

use fingertip::model::{MODULUS_MAX, MODULUS_MIN, RADIUS_MAX, RADIUS_MIN, Tip, TipError};
use fingertip::units::{Kilopascals, Millimetres};
use host_tests::prove::domain::{boundary_distances, boundary_tips, mm, newtons, reference_tip, tip};
use host_tests::prove::exact;

/// Every function of the depth, against integers.
fn judge_depth(tip: &Tip, d: i32) {
    let context = || format!("a {}, Y {}, d {d}", tip.radius().0, tip.modulus().0);
    let judged = [
        exact::force(tip, d, tip.force(mm(d)).to_bits(), 1),
        exact::contact_radius(tip, d, tip.contact_radius(mm(d)).to_bits(), 1),
        exact::stiffness(tip, d, tip.stiffness(mm(d)).to_bits(), 1),
        exact::peak_pressure(tip, d, tip.peak_pressure(mm(d)).to_bits(), 1),
        exact::mean_pressure(tip, d, tip.mean_pressure(mm(d)).to_bits(), 1),
    ];
    for (place, judged) in judged.into_iter().enumerate() {
        assert_eq!(judged.nearest, Some(true), "function {place}, {}: {judged:?}", context());
    }
    for r in boundary_distances(tip, d) {
        let p = tip.pressure(mm(r), mm(d)).to_bits();
        let judged = exact::pressure(tip, r.min(tip.radius().to_bits()), d, p, 2);
        assert_eq!(judged.nearest, Some(true), "p({r}), {}: {judged:?}", context());
    }
}

#[test]
fn a_depth_of_one_unit() {
    for tip in boundary_tips() {
        judge_depth(&tip, 1);
        assert_eq!(tip.indentation_from_radius(tip.contact_radius(mm(1))), mm(1));
    }
    let tip = reference_tip();
    assert_eq!(tip.force(mm(1)).to_bits(), 0);
    assert_eq!(tip.contact_radius(mm(1)).to_bits(), 18_318); // sqrt(2a) in units: 1.09 um
    assert_eq!(tip.touching_angle_max(mm(1)).to_bits(), 1_832); // sqrt(2d/a): 0.1 mrad
}

#[test]
fn no_depth_at_all() {
    for tip in boundary_tips() {
        for d in [0, -1, i32::MIN] {
            assert_eq!(tip.force(mm(d)).to_bits(), 0);
            assert_eq!(tip.contact_radius(mm(d)).to_bits(), 0);
            assert_eq!(tip.stiffness(mm(d)).to_bits(), 0);
            assert_eq!(tip.touching_angle_max(mm(d)).to_bits(), 0);
            assert_eq!(tip.pressure(mm(0), mm(d)).to_bits(), 0);
        }
    }
}

#[test]
fn a_depth_near_the_radius() {
    for tip in boundary_tips() {
        let deepest = tip.depth_max().to_bits();
        for d in [deepest - 1, deepest] {
            judge_depth(&tip, d);
        }
        for beyond in [deepest + 1, tip.radius().to_bits(), i32::MAX] {
            assert_eq!(tip.force(mm(beyond)), tip.force_max());
            assert_eq!(tip.contact_radius(mm(beyond)), tip.contact_radius(mm(deepest)));
            assert_eq!(tip.touching_angle_max(mm(beyond)), tip.touching_angle_max(mm(deepest)));
        }
        // acos(1/20) = 1.52077546998 rad, a quarter turn less 0.05.
        assert!((tip.touching_angle_max(mm(deepest)).0.to_num::<f64>() - 1.520_775_47).abs() < 2e-7);
    }
}

#[test]
fn the_rim_from_both_sides_by_one_unit() {
    // 2 mm into a radius of 10 mm has its rim at exactly 6 mm.
    let tip = reference_tip();
    let (d, rim) = (mm(2 << 24), 6 << 24);
    assert_eq!(tip.contact_radius(d), mm(rim));
    assert_eq!(tip.pressure(mm(rim), d).to_bits(), 0);
    assert_eq!(tip.pressure(mm(rim + 1), d).to_bits(), 0);
    assert_eq!(tip.strain(mm(rim - 1), d).to_bits(), 6); // r_c/(L^2) times one unit: 5.6e-9
    // Where the pressure is steepest one unit of distance is hundreds of units of pressure.
    let steep = Tip::new(RADIUS_MIN, MODULUS_MAX).unwrap();
    let d = steep.depth_max();
    let rim = steep.contact_radius(d).to_bits();
    let inside = steep.pressure(mm(rim - 1), d).to_bits();
    assert!((400..1_600).contains(&inside), "{inside}");
    assert_eq!(steep.pressure(mm(rim + 1), d).to_bits(), 0);
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
        assert!(length > 10_000);
        // A distance has no sign.
        assert_eq!(tip.pressure(mm(-radius / 2), tip.depth_max()), tip.pressure(mm(radius / 2), tip.depth_max()));
    }
}

#[test]
fn the_softest_and_the_stiffest_tip() {
    for modulus in [MODULUS_MIN, MODULUS_MAX] {
        for radius in [RADIUS_MIN, RADIUS_MAX] {
            let tip = Tip::new(radius, modulus).unwrap();
            for share in 1..=100 {
                judge_depth(&tip, (i64::from(tip.depth_max().to_bits()) * share / 100) as i32);
            }
        }
    }
}

#[test]
fn a_force_within_one_unit_of_zero() {
    for tip in boundary_tips() {
        assert_eq!(tip.indentation(newtons(0)).to_bits(), 0);
        assert_eq!(tip.indentation(newtons(-1)).to_bits(), 0);
        assert_eq!(tip.indentation(newtons(i32::MIN)).to_bits(), 0);
        let first = tip.indentation(newtons(1)).to_bits();
        assert_eq!(exact::indentation(&tip, 1, first, 1).nearest, Some(true));
        // The slope is infinite at 0: a unit of noise there is worth the most.
        for force in 1..2_000 {
            let moved = tip.indentation(newtons(force + 1)).to_bits() - tip.indentation(newtons(force)).to_bits();
            assert!((0..=first).contains(&moved), "F {force}: {moved} of {first}");
        }
    }
    // As documented: 4.4 um for Y = 250 kPa.
    let first = reference_tip().indentation(newtons(1)).0.to_num::<f64>();
    assert!((4.40e-3..4.41e-3).contains(&first), "{first}");
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

#[test]
#[expect(clippy::approx_constant, reason = "figures computed elsewhere, kept as they are")]
fn the_papers_figures() {
    let tip = tip(10 << 24, 250 << 16);
    // d um, r_c, p(0), F, k: 40-digit arithmetic for the reference tip.
    let figures = [
        (1_000_i64, 4.358_898_944, 25.0, 0.785_398_163_397_448, 1.570_796),
        (2_000, 6.0, 50.0, 3.141_592_653_589_79, 3.141_593),
        (3_000, 7.141_428_429, 75.0, 7.068_583_470_577_03, 4.712_389),
        (5_000, 8.660_254_038, 125.0, 19.634_954_084_936_2, 7.853_982),
    ];
    for (d_um, radius, peak, force, stiffness) in figures {
        let d = Millimetres::from_bits(((d_um << 24) / 1_000) as i32);
        let close = |value: f64, expected: f64, unit: f64| {
            assert!((value - expected).abs() <= unit, "d {d_um} um: {value}, not {expected}");
        };
        close(tip.contact_radius(d).0.to_num(), radius, 6e-8);
        close(tip.peak_pressure(d).0.to_num(), peak, 1.6e-5);
        close(tip.pressure(mm(0), d).0.to_num(), peak, 1.6e-5);
        close(tip.force(d).0.to_num(), force, 1.6e-5);
        close(tip.stiffness(d).0.to_num(), stiffness, 1.6e-5);
    }
}
