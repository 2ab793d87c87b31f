//! Boundaries and random points of the whole domain, judged in arbitrary precision and by integers.

use std::ops::Range;

use fastrand::Rng;
use fingertip::model::Tip;

use super::domain::{Point, at, boundary_depths, boundary_distances, boundary_forces, boundary_tips, mm, newtons};
use super::exact;
use super::exhaustive::Progress;
use super::reference::{Reference, error_ulp, real};
use super::tally::{Judged, Tally, parallel};

/// Every random point follows from this and its place.
pub const SEED: u64 = 0x2003_0914;

const CHUNK: u64 = 1_000;

/// The reference's arc tangent takes ten times as long as all the rest together: one point in so many has it.
const ANGLE_EVERY: u64 = 10;

/// Force, indentation, contact radius, stiffness, pressure and touching angle.
pub struct Tallies(pub [Tally; 6]);

impl Tallies {
    /// Nothing judged yet.
    pub const fn new() -> Self {
        Self([
            Tally::new("F(d)", 0.5),
            Tally::new("d(F)", 0.5),
            Tally::new("r_c(d)", 0.5),
            Tally::new("k(d)", 0.5),
            Tally::new("p(r, d)", 0.5),
            Tally::new("theta_max(d)", 1.0),
        ])
    }
}

impl Default for Tallies {
    fn default() -> Self {
        Self::new()
    }
}

/// Random tips, depths, forces and distances.
pub fn points(range: Range<u64>, progress: Progress<'_>) -> [Tally; 6] {
    parallel(range, CHUNK, Tallies::new().0, progress, |range, tallies| {
        let mut rng = Rng::with_seed(SEED ^ range.start);
        for place in range {
            let Point { tip, d, force, r } = Point::random(&mut rng);
            let reference = Reference::new(&tip);
            let [by_depth @ .., by_angle] = tallies;
            depth(&tip, &reference, d, by_depth);
            indentation(&tip, &reference, force, &mut by_depth[1]);
            pressure(&tip, &reference, r, d, &mut by_depth[4]);
            if place % ANGLE_EVERY == 0 {
                touching_angle_max(&tip, &reference, d, by_angle);
            }
        }
    })
}

/// Every combination of boundary tips with boundary depths, forces and distances.
pub fn boundaries(progress: Progress<'_>) -> [Tally; 6] {
    let tips = boundary_tips();
    parallel(0..tips.len() as u64, 1, Tallies::new().0, progress, |range, tallies| {
        for tip in &tips[range.start as usize..range.end as usize] {
            let reference = Reference::new(tip);
            let [by_depth @ .., by_angle] = tallies;
            for force in boundary_forces(tip) {
                indentation(tip, &reference, force, &mut by_depth[1]);
            }
            for d in boundary_depths(tip) {
                depth(tip, &reference, d, by_depth);
                touching_angle_max(tip, &reference, d, by_angle);
                for r in boundary_distances(tip, d) {
                    pressure(tip, &reference, r, d, &mut by_depth[4]);
                }
            }
        }
    })
}

/// The touching angle at `count` depths of a tip, evenly spread.
pub fn touching_angles(tip: &Tip, count: u64, progress: Progress<'_>) -> [Tally; 1] {
    let reference = Reference::new(tip);
    let top = tip.depth_max().to_bits() as u64;
    parallel(1..count + 1, CHUNK, [Tally::new("theta_max(d)", 1.0)], progress, |range, [tally]| {
        for place in range {
            touching_angle_max(tip, &reference, (place * top / count).max(1) as i32, tally);
        }
    })
}

fn depth(tip: &Tip, reference: &Reference, d: i32, tallies: &mut [Tally; 5]) {
    let exact_d = real(d, 24);
    let at = at(tip, d, 0);
    let force = tip.force(mm(d)).to_bits();
    let by_reference = error_ulp(force, 16, &reference.force(&exact_d));
    tallies[0].add(agreed(exact::force(tip, d, force, 1), by_reference), at);
    let radius = tip.contact_radius(mm(d)).to_bits();
    let by_reference = error_ulp(radius, 24, &reference.contact_radius(&exact_d));
    tallies[2].add(agreed(exact::contact_radius(tip, d, radius, 1), by_reference), at);
    let stiffness = tip.stiffness(mm(d)).to_bits();
    let by_reference = error_ulp(stiffness, 16, &reference.stiffness(&exact_d));
    tallies[3].add(agreed(exact::stiffness(tip, d, stiffness, 1), by_reference), at);
}

fn indentation(tip: &Tip, reference: &Reference, force: i32, tally: &mut Tally) {
    let d = tip.indentation(newtons(force)).to_bits();
    let by_reference = error_ulp(d, 24, &reference.indentation(&real(force, 16)));
    tally.add(agreed(exact::indentation(tip, force, d, 1), by_reference), at(tip, force, 0));
}

fn pressure(tip: &Tip, reference: &Reference, r: i32, d: i32, tally: &mut Tally) {
    let p = tip.pressure(mm(r), mm(d)).to_bits();
    let by_reference = error_ulp(p, 16, &reference.pressure(&real(r, 24), &real(d, 24)));
    let by_integers = exact::pressure(tip, r.min(tip.radius().to_bits()), d, p, 2);
    tally.add(agreed(by_integers, by_reference), at(tip, d, r));
}

fn touching_angle_max(tip: &Tip, reference: &Reference, d: i32, tally: &mut Tally) {
    let angle = paper::touching_angle_max(tip, mm(d)).to_bits();
    let by_reference = error_ulp(angle, 24, &reference.touching_angle_max(&real(d, 24)));
    tally.add(Judged::by_error(by_reference, tally.bound_ulp), at(tip, d, 0));
}

/// The integers' verdict, refused where the two judges do not see the same error.
fn agreed(by_integers: Judged, by_reference: f64) -> Judged {
    let same = (by_integers.error_ulp - by_reference).abs() < 1e-6;
    Judged { error_ulp: by_reference, within: by_integers.within && same, ..by_integers }
}
