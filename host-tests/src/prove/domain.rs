//! The inputs: boundaries, random points and the reference tip.

use fastrand::Rng;
use fingertip::model::{MODULUS_MAX, MODULUS_MIN, RADIUS_MAX, RADIUS_MIN, Tip};
use fingertip::units::{Kilopascals, Millimetres, Newtons};

/// A tip from raw integers inside the domain.
///
/// # Panics
/// Outside the domain.
pub fn tip(radius_bits: i32, modulus_bits: i32) -> Tip {
    Tip::new(Millimetres::from_bits(radius_bits), Kilopascals::from_bits(modulus_bits)).expect("inside the domain")
}

/// a = 10 mm, Y = 250 kPa.
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

/// Whether a force is at most that of the deepest indentation, judged exactly: its rounded value may be half a unit
/// more.
pub fn in_reach(tip: &Tip, force: i32) -> bool {
    force < tip.force_max().to_bits() || super::exact::force_in_reach(tip, force)
}

/// A random point of the domain.
pub struct Point {
    /// Radius and modulus, uniform.
    pub tip: Tip,
    /// Depth: half of the points uniform, half uniform in its logarithm.
    pub d: i32,
    /// Force, likewise.
    pub force: i32,
    /// Distance: inside the contact, near its rim (down to one unit) or outside.
    pub r: i32,
}

impl Point {
    /// The next random point.
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

    /// The raw inputs with one of the others.
    pub fn at(&self, third: i32, fourth: i32) -> [i64; 4] {
        at(&self.tip, third, fourth)
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
