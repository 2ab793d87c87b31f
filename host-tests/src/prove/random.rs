//! Boundaries and random points of the whole domain, judged in arbitrary precision and by integers.

use super::exact::{self, Progress, in_reach};
use super::reference::{Reference, error_ulp, real};
use super::tally::{Judged, Tally, parallel};
use fastrand::Rng;
use fingertip::model::{MODULUS_MAX, MODULUS_MIN, RADIUS_MAX, RADIUS_MIN, Tip};
use fingertip::units::{Kilopascals, Millimetres, Newtons};
use std::ops::Range;

/// Seed of the random points; each point is computed from the seed and its index.
pub const SEED: u64 = 0x2003_0914;

const CHUNK: u64 = 1_000;

/// Tallies without results: force, indentation, contact radius, stiffness and pressure.
fn tallies() -> [Tally; 5] {
    ["F(d)", "d(F)", "r_c(d)", "k(d)", "p(r, d)"].map(|name| Tally::new(name, 0.5))
}

/// Random tips, depths, forces and distances.
pub fn points(range: Range<u64>, progress: Progress<'_>) -> [Tally; 5] {
    parallel(range, CHUNK, tallies(), progress, |range, tallies| {
        let mut rng = Rng::with_seed(SEED ^ range.start);
        for _ in range {
            let Point { tip, d, force, r } = Point::random(&mut rng);
            let reference = Reference::new(&tip);
            depth(&tip, &reference, d, tallies);
            indentation(&tip, &reference, force, &mut tallies[1]);
            pressure(&tip, &reference, r, d, &mut tallies[4]);
        }
    })
}

/// Every combination of boundary tips with boundary depths, forces and distances.
pub fn boundaries(progress: Progress<'_>) -> [Tally; 5] {
    let tips = boundary_tips();
    parallel(0..tips.len() as u64, 1, tallies(), progress, |range, tallies| {
        for tip in &tips[range.start as usize..range.end as usize] {
            let reference = Reference::new(tip);
            for force in boundary_forces(tip) {
                indentation(tip, &reference, force, &mut tallies[1]);
            }
            for d in boundary_depths(tip) {
                depth(tip, &reference, d, tallies);
                for r in boundary_distances(tip, d) {
                    pressure(tip, &reference, r, d, &mut tallies[4]);
                }
            }
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

/// The integers' verdict, refused where the two judges do not see the same error.
fn agreed(by_integers: Judged, by_reference: f64) -> Judged {
    let same = (by_integers.error_ulp - by_reference).abs() < 1e-6;
    Judged { error_ulp: by_reference, within: by_integers.within && same, ..by_integers }
}

// The inputs: boundaries, random points and the reference tip.

/// A tip from raw integers inside the domain.
pub fn tip(radius_bits: i32, modulus_bits: i32) -> Tip {
    Tip::new(Millimetres::from_bits(radius_bits), Kilopascals::from_bits(modulus_bits)).expect("inside the domain")
}

/// The paper's tip: a = 10 mm, Y = 250 kPa.
pub fn reference_tip() -> Tip {
    tip(10 << 24, 250 << 16)
}

/// Every combination of the ends of the radius and modulus ranges, their neighbours and the reference tip's values.
pub fn boundary_tips() -> Vec<Tip> {
    let radii = around(RADIUS_MIN.to_bits(), RADIUS_MAX.to_bits(), &[10 << 24, 123_456_789]);
    let moduli = around(MODULUS_MIN.to_bits(), MODULUS_MAX.to_bits(), &[250 << 16, 12_345_678]);
    radii.iter().flat_map(|&a| moduli.iter().map(move |&y| tip(a, y))).collect()
}

/// The ends of the range of depths, their neighbours, and both sides of every power of two.
pub fn boundary_depths(tip: &Tip) -> Vec<i32> {
    around(1, tip.depth_max().to_bits(), &powers(tip.depth_max().to_bits()))
}

/// The ends of the range of forces, their neighbours, and both sides of every power of two.
pub fn boundary_forces(tip: &Tip) -> Vec<i32> {
    let top = tip.force_max().to_bits();
    let mut forces = around(0, top, &powers(top));
    forces.retain(|&force| in_reach(tip, force));
    forces
}

/// Distances at the centre, on both sides of the rim and of the radius a, and beyond.
pub fn boundary_distances(tip: &Tip, d: i32) -> Vec<i32> {
    let rim = tip.contact_radius(Millimetres::from_bits(d)).to_bits();
    let radius = tip.radius().to_bits();
    around(0, i32::MAX, &[rim - 2, rim - 1, rim, rim + 1, rim / 2, radius - 1, radius, radius + 1])
}

/// Random point of the domain.
pub struct Point {
    /// Radius and modulus, uniform.
    pub tip: Tip,
    /// Depth: half of the points uniform, half uniform in its logarithm.
    pub d: i32,
    /// Force: half of the points uniform, half uniform in its logarithm.
    pub force: i32,
    /// Distance: inside the contact, near its rim (down to one unit) or outside.
    pub r: i32,
}

impl Point {
    pub fn random(rng: &mut Rng) -> Self {
        let tip = tip(
            rng.i32(RADIUS_MIN.to_bits()..=RADIUS_MAX.to_bits()),
            rng.i32(MODULUS_MIN.to_bits()..=MODULUS_MAX.to_bits()),
        );
        let d = spread(rng, tip.depth_max().to_bits());
        let mut force = spread(rng, tip.force_max().to_bits());
        if !in_reach(&tip, force) {
            force -= 1;
        }
        let rim = tip.contact_radius(Millimetres::from_bits(d)).to_bits();
        let r = match rng.u8(0..4) {
            0 | 1 => rng.i32(0..=rim),
            2 => (rim + spread(rng, rim) * if rng.bool() { 1 } else { -1 }).max(0),
            _ => rng.i32(rim..=tip.radius().to_bits()),
        };
        Self { tip, d, force, r }
    }
}

/// The raw inputs of a result.
pub fn at(tip: &Tip, third: i32, fourth: i32) -> [i64; 4] {
    [tip.radius().to_bits().into(), tip.modulus().to_bits().into(), third.into(), fourth.into()]
}

/// Shorthand for a length from its raw integer.
pub const fn mm(bits: i32) -> Millimetres {
    Millimetres::from_bits(bits)
}

/// Shorthand for a force from its raw integer.
pub const fn newtons(bits: i32) -> Newtons {
    Newtons::from_bits(bits)
}

/// 1 to `top`: half of the draws uniform, half uniform in the logarithm.
fn spread(rng: &mut Rng, top: i32) -> i32 {
    if top < 2 {
        return 1;
    }
    if rng.bool() {
        return rng.i32(1..=top);
    }
    let bits = 31 - top.leading_zeros();
    let magnitude = rng.u32(0..=bits);
    (1 << magnitude | rng.i32(0..1 << magnitude)).min(top)
}

fn powers(top: i32) -> Vec<i32> {
    (0..31).map(|power| 1 << power).take_while(|&power| power <= top).collect()
}

/// The ends of a range and the given values, each with its neighbours, inside the range.
fn around(min: i32, max: i32, values: &[i32]) -> Vec<i32> {
    let centres = values.iter().copied().chain([min, max]);
    let mut all: Vec<i32> = centres
        .flat_map(|value| [value.saturating_sub(1), value, value.saturating_add(1)])
        .filter(|value| (min..=max).contains(value))
        .collect();
    all.sort_unstable();
    all.dedup();
    all
}
