//! The fits on points from the model with noise in proportion to the force.

use crate::reference::{against_depth, against_travel};
use crate::{mm, newtons};
use fastrand::Rng;
use fingertip::identify::{DepthFit, Modulus, Refusal, TravelFit};
use fingertip::units::{Millimetres, Newtons};
use std::f64::consts::{PI, TAU};

/// Where the tip touches, as the fits do not know.
const CONTACT_MM: f64 = 4.321;

/// A press: indentations spread evenly, and what scatters.
#[derive(Clone, Copy)]
struct Press {
    modulus_kpa: f64,
    from_mm: f64,
    to_mm: f64,
    points: u32,
    /// Of the force.
    share: f64,
    newtons: f64,
}

/// From a compression of 0.5 to 3 mm with 1 % noise.
const REFERENCE: Press = Press { modulus_kpa: 250.0, from_mm: 0.5, to_mm: 3.0, points: 251, share: 0.01, newtons: 0.0 };

impl Press {
    /// Indentations in mm and forces in N.
    fn points(&self, seed: u64) -> Vec<(f64, f64)> {
        let mut rng = Rng::with_seed(seed);
        let step_mm = (self.to_mm - self.from_mm) / f64::from(self.points - 1);
        let point = |place| {
            let d = self.from_mm + step_mm * f64::from(place);
            let force = PI * self.modulus_kpa * 1e-3 * d * d;
            (d, (force * (1.0 + self.share * normal(&mut rng)) + self.newtons * normal(&mut rng)).max(0.0))
        };
        (0..self.points).map(point).collect()
    }
}

/// A number of the standard normal distribution.
fn normal(rng: &mut Rng) -> f64 {
    (-2.0 * (1.0 - rng.f64()).ln()).sqrt() * (TAU * rng.f64()).cos()
}

fn fixed(points: &[(f64, f64)], offset_mm: f64) -> impl Iterator<Item = (Millimetres, Newtons)> {
    points.iter().map(move |(d, force)| (mm(d + offset_mm), newtons(*force)))
}

/// A largest force of the size that the points have.
fn limit(points: &[(f64, f64)]) -> Newtons {
    newtons(points.iter().fold(0.1, |most: f64, (_, force)| most.max(1.5 * force)))
}

fn by_depth(points: &[(f64, f64)]) -> Result<Modulus, Refusal> {
    let mut fit = DepthFit::new(mm(4.0), limit(points));
    fit.extend(fixed(points, 0.0));
    fit.modulus()
}

fn by_travel(points: &[(f64, f64)]) -> Result<Modulus, Refusal> {
    let mut fit = TravelFit::new(mm(CONTACT_MM), mm(4.0), limit(points));
    fit.extend(fixed(points, CONTACT_MM));
    fit.modulus()
}

type Method = fn(&[(f64, f64)]) -> Result<Modulus, Refusal>;
const METHODS: [(&str, Method); 2] = [("depth", by_depth), ("travel", by_travel)];

/// Error and standard uncertainty, as shares of the truth.
fn shares(press: &Press, method: Method, seed: u64) -> (f64, f64) {
    let found = method(&press.points(seed)).expect("the points are good");
    let kpa = |value: fingertip::units::Kilopascals| value.0.to_num::<f64>();
    (kpa(found.modulus) / press.modulus_kpa - 1.0, kpa(found.sigma) / press.modulus_kpa)
}

#[test]
fn one_percent_noise_leaves_one_percent_and_three_sigma_in_99_of_100_seeds() {
    for (name, method) in METHODS {
        for modulus_kpa in [25.0, 250.0, 700.0, 1_900.0] {
            let press = Press { modulus_kpa, ..REFERENCE };
            let results: Vec<_> = (0..100).map(|seed| shares(&press, method, seed)).collect();
            let close = results.iter().filter(|(error, _)| error.abs() <= 0.01).count();
            let within = results.iter().filter(|(error, sigma)| error.abs() <= 3.0 * sigma).count();
            assert!(close >= 99 && within >= 99, "{name} {modulus_kpa} kPa: {close} within 1 %, {within} in 3 sigma");
        }
    }
}

/// Neither too narrow nor too wide, whatever the noise: 68.3 % within one sigma, 99.73 % within three.
#[test]
fn the_uncertainty_is_honest() {
    let additive = Press { share: 0.0, newtons: 0.01, ..REFERENCE };
    let both = Press { share: 0.003, newtons: 0.005, ..REFERENCE };
    let few = Press { points: 80, share: 0.003, ..REFERENCE };
    for (name, method) in METHODS {
        for (which, press) in [REFERENCE, additive, both, few].iter().enumerate() {
            let results: Vec<_> = (0..4_000).map(|seed| shares(press, method, seed)).collect();
            let inside = |sigmas: f64| {
                results.iter().filter(|(error, sigma)| error.abs() <= sigmas * sigma).count() as f64 / 4_000.0
            };
            let (one, three) = (inside(1.0), inside(3.0));
            println!("{name} {which}: {one} in one sigma, {three} in three");
            assert!((0.66..=0.71).contains(&one), "{name} {which}: {one} in one sigma");
            assert!((0.9945..=0.9990).contains(&three), "{name} {which}: {three} in three sigma");
            let mean = results.iter().map(|(error, _)| error).sum::<f64>() / 4_000.0;
            assert!(mean.abs() < 2e-4, "{name} {which}: biased by {mean}");
        }
    }
}

/// A fit that supposed equal noise would give the wrong uncertainty for noise in proportion to the force.
#[test]
fn equal_noise_may_not_be_supposed() {
    let points = REFERENCE.points(1);
    let slope = against_depth(&points).modulus_kpa * PI * 1e-3;
    let n = points.len() as f64;
    let squares: f64 = points.iter().map(|(d, _)| d.powi(4)).sum();
    let residual: f64 = points.iter().map(|(d, force)| (force - slope * d * d).powi(2)).sum();
    let naive_kpa = (residual / (n - 1.0) / squares).sqrt() / PI * 1e3;
    let sigma_kpa = by_depth(&points).unwrap().sigma.0.to_num::<f64>();
    assert!((1.3..2.0).contains(&(sigma_kpa / naive_kpa)), "{sigma_kpa} kPa against {naive_kpa} kPa");
}

#[test]
fn the_sums_give_what_two_passes_in_f64_give() {
    for (share, tolerance) in [(0.01, 1e-3), (1e-3, 1e-3), (2e-4, 0.02)] {
        for modulus_kpa in [25.0, 250.0, 1_900.0] {
            for points in [25, 251, 4_000] {
                let points = Press { share, modulus_kpa, points, ..REFERENCE }.points(u64::from(points));
                let rounded: Vec<_> = fixed(&points, 0.0).map(|(d, f)| (d.0.to_num(), f.0.to_num())).collect();
                let depth = (by_depth(&points).unwrap(), against_depth(&rounded));
                let travel = (by_travel(&points).unwrap(), against_travel(&rounded));
                for (found, expected) in [depth, travel] {
                    // Beyond the tolerance, the unit of the last place is allowed.
                    let close = |value: f64, expected: f64, tolerance: f64| {
                        let error = (value - expected).abs();
                        assert!(error < tolerance * expected + 2e-5, "{value}, not {expected}: noise {share}");
                    };
                    close(found.modulus.0.to_num(), expected.modulus_kpa, 1e-8);
                    close(found.sigma.0.to_num(), expected.sigma_kpa, tolerance);
                    let touches = found.contact.0.to_num::<f64>();
                    let touches = if expected.contact_mm == 0.0 { touches } else { touches - CONTACT_MM };
                    assert!((touches - expected.contact_mm).abs() < 2e-6);
                }
            }
        }
    }
}

#[test]
fn the_contact_point_is_found() {
    for seed in 0..100 {
        let found = by_travel(&REFERENCE.points(seed)).unwrap();
        assert!((found.contact.0.to_num::<f64>() - CONTACT_MM).abs() < 0.01);
    }
}

#[test]
fn order_and_portions_change_no_bit() {
    let mut points: Vec<_> = fixed(&REFERENCE.points(7), 0.0).collect();
    let mut batch = TravelFit::new(mm(0.0), mm(4.0), newtons(20.0));
    batch.extend(points.iter().copied());
    Rng::with_seed(3).shuffle(&mut points);
    let mut recursive = TravelFit::new(mm(0.0), mm(4.0), newtons(20.0));
    for (travel, force) in points {
        recursive.add(travel, force);
        let _ = recursive.modulus();
    }
    assert_eq!(batch, recursive);
}

#[test]
fn too_little_travel_is_refused() {
    for (name, method) in METHODS {
        for (to_mm, expected) in [(0.7, Err(Refusal::Span)), (0.799, Err(Refusal::Span)), (0.801, Ok(()))] {
            let press = Press { to_mm, share: 0.001, ..REFERENCE };
            assert_eq!(method(&press.points(1)).map(|_| ()), expected, "{name} to {to_mm} mm");
        }
        assert_eq!(method(&[]).map(|_| ()), Err(Refusal::Span));
    }
}

#[test]
fn data_that_cannot_support_it_are_refused() {
    for (name, method) in METHODS {
        let refusal = |press: Press| method(&press.points(1)).err();
        assert_eq!(refusal(Press { points: 19, ..REFERENCE }), Some(Refusal::Points), "{name}");
        assert_eq!(refusal(Press { share: 0.08, ..REFERENCE }), Some(Refusal::Residual), "{name}");
        assert_eq!(refusal(Press { modulus_kpa: 15.0, ..REFERENCE }), Some(Refusal::Range), "{name}");
        assert_eq!(refusal(Press { modulus_kpa: 2_100.0, ..REFERENCE }), Some(Refusal::Range), "{name}");

        let nothing: Vec<_> = REFERENCE.points(1).iter().map(|(d, _)| (*d, 0.0)).collect();
        assert!(matches!(method(&nothing).err(), Some(Refusal::Residual | Refusal::Range)), "{name}");
        // A Hertz contact, and a force that falls.
        let hertz: Vec<_> = REFERENCE.points(1).iter().map(|(d, _)| (*d, d.powf(1.5))).collect();
        assert_eq!(method(&hertz).err(), Some(Refusal::Residual), "{name}");
        let falls: Vec<_> = REFERENCE.points(1).iter().map(|(d, _)| (*d, 4.0 - d)).collect();
        assert_eq!(method(&falls).err(), Some(Refusal::Residual), "{name}");
    }
    // Little travel with much noise: the contact point cannot be told from the slope.
    let short = Press { from_mm: 1.5, to_mm: 1.82, points: 20, share: 0.02, ..REFERENCE };
    let scattered = (0..20).filter(|seed| by_travel(&short.points(*seed)).err() == Some(Refusal::Scatter)).count();
    assert!(scattered >= 19, "{scattered}");
}

#[test]
fn points_outside_the_limits_are_left_out() {
    let mut fit = TravelFit::new(mm(1.0), mm(3.0), newtons(5.0));
    for (travel, force) in [(0.9, 1.0), (4.1, 1.0), (2.0, -0.1), (2.0, 5.1)] {
        fit.add(mm(travel), newtons(force));
    }
    assert_eq!(fit.points(), 0);
    fit.add(mm(1.0), newtons(0.0));
    fit.add(mm(4.0), newtons(5.0));
    assert_eq!((fit.points(), fit.span()), (2, mm(3.0)));
}
