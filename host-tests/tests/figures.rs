//! The paper's figures: well-formed, the same bytes every time, and of the model.

use fingertip::units::Millimetres;
use host_tests::figures::{Modulus, PITCH_MM, all, fit, readings, seen, tip};

#[test]
fn the_pictures_are_well_formed_and_the_same_every_time() {
    let pictures = all().unwrap();
    assert_eq!(pictures, all().unwrap());
    for (name, svg) in &pictures {
        assert!(svg.starts_with("<svg") && svg.trim_end().ends_with("</svg>"), "{name}");
        assert!(!svg.contains("NaN") && !svg.contains("inf"), "{name}");
        assert!(svg.contains("prefers-color-scheme:dark"), "{name}");
    }
    let [(_, profile), (_, maps), (_, force)] = pictures;
    assert_eq!(profile.matches("pressure p, kPa").count(), 3);
    assert_eq!(profile.matches("distance from the centre, mm").count(), 3);
    assert_eq!(maps.matches("columns, mm").count(), 3);
    assert!(maps.contains("kPa"));
    // The dots of the contact's circle: 60 a map, as far as they are on the array.
    assert_eq!(maps.matches("<circle").count(), 180);
    assert!(force.contains("indentation d, mm") && force.contains("force F, N"));
    assert_eq!(force.matches("<circle").count(), 24);
}

#[test]
fn what_the_array_sees_sums_to_the_force() {
    let tip = tip();
    for d_mm in [1, 2, 3] {
        let d = Millimetres::from_bits(d_mm << 24);
        let seen = seen(&tip, d);
        let sum: f64 = seen.iter().flatten().sum::<f64>() * PITCH_MM * PITCH_MM * 1e-3;
        let force: f64 = tip.force(d).0.to_num();
        assert!((sum / force - 1.0).abs() < 2e-3, "{d_mm} mm: {sum} N of {force} N");
        // The middle taxels see less than the peak, by the fall over half a taxel.
        let peak: f64 = tip.peak_pressure(d).0.to_num();
        assert!((0.93..0.99).contains(&(seen[5][5] / peak)), "{d_mm} mm: {} kPa", seen[5][5]);
    }
}

#[test]
fn the_readings_scatter_and_give_the_modulus_back() {
    let tip = tip();
    let readings = readings(&tip);
    let off = |(d, force): &(Millimetres, fingertip::units::Newtons)| {
        force.0.to_num::<f64>() / tip.force(*d).0.to_num::<f64>() - 1.0
    };
    let worst = readings.iter().map(|reading| off(reading).abs()).fold(0.0, f64::max);
    assert!((0.01..0.2).contains(&worst), "{worst}");
    let Modulus { kpa, sigma_kpa } = fit(&tip, &readings);
    assert!((kpa - 250.0).abs() < 3.0 * sigma_kpa && (0.2..5.0).contains(&sigma_kpa), "{kpa} +- {sigma_kpa}");
}
