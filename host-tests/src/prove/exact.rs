//! The exact judge: integers against integers.
//!
//! A result `f`, in units of its last place, is compared with the exact value `v` through what both sides become when
//! the fractions, the roots and pi are cleared: `v = n/m` or `v^2 = n/m` with integers `n` and `m`, and pi between two
//! integers over 2^100. Pass and fail are decided without any rounding; only the size of the error that is printed is a
//! float.

use super::random::{at, boundary_distances, mm, newtons};
use super::tally::{Judged, Tally, parallel};
use ethnum::I256;
use fingertip::model::Tip;
use fingertip::units::Kilopascals;
use std::ops::{Add, Mul, Range, Sub};

/// pi 2^100, rounded down: from its digits in hexadecimal.
const PI_Q100: i128 = 0x32_43f6_a888_5a30_8d31_3198_a2e0;

/// An integer with room for a judge's products: 128 bits without pi, 256 with it.
trait Integer: Copy + PartialOrd + From<i64> + Add<Output = Self> + Sub<Output = Self> + Mul<Output = Self> {
    fn to_f64(self) -> f64;
}

impl Integer for i128 {
    fn to_f64(self) -> f64 {
        self as f64
    }
}

impl Integer for I256 {
    fn to_f64(self) -> f64 {
        self.as_f64()
    }
}

/// An exact value known between two rational numbers with one denominator.
struct Bounds<T> {
    low: T,
    high: T,
    denominator: T,
}

impl<T: Integer> Bounds<T> {
    fn exactly(numerator: T, denominator: T) -> Self {
        Self { low: numerator, high: numerator, denominator }
    }

    /// The bounds are those of the value.
    fn linear(&self, result: i32, bound: u32) -> Judged {
        let rounded = T::from(result.into()) * self.denominator;
        let (low, high) = (self.low - rounded, self.high - rounded);
        let holds = |halves: i64| {
            let most = T::from(halves) * self.denominator;
            low + low + most >= T::from(0) && high + high <= most
        };
        let nearest = holds(1);
        let error_ulp = -low.to_f64() / self.denominator.to_f64();
        Judged { error_ulp, nearest: Some(nearest), within: nearest || holds(2 * i64::from(bound)) }
    }

    /// The bounds are those of the value's square; the value is not negative.
    fn square(&self, result: i32, bound: u32) -> Judged {
        let result = i64::from(result);
        let rounded = T::from(result * result) * self.denominator;
        let (low, high) = (self.low - rounded, self.high - rounded);
        let quadruple = |number: T| number + number + number + number;
        let holds = |halves: i64| {
            // Four times the square of the result with so many halves more or less, less the result's own.
            let beyond = |sign: i64| T::from(halves * halves + sign * 4 * result * halves) * self.denominator;
            let above = 2 * result < halves || quadruple(low) >= beyond(-1);
            above && 2 * result + halves >= 0 && quadruple(high) <= beyond(1)
        };
        let denominator = self.denominator.to_f64();
        let sum = result as f64 + (self.low.to_f64() / denominator).sqrt();
        let error_ulp = if sum > 0.0 { -low.to_f64() / denominator / sum } else { 0.0 };
        let nearest = holds(1);
        Judged { error_ulp, nearest: Some(nearest), within: nearest || holds(2 * i64::from(bound)) }
    }
}

fn wide(number: i32) -> i128 {
    number.into()
}

/// Returns the two numbers that pi times a number lies between.
fn pi_times(number: i128) -> [I256; 2] {
    let low = I256::from(number) * I256::from(PI_Q100);
    [low, low + I256::from(number)]
}

fn radius(tip: &Tip) -> i128 {
    wide(tip.radius().to_bits())
}

fn modulus(tip: &Tip) -> i128 {
    wide(tip.modulus().to_bits())
}

/// `F = pi Y d^2`.
pub fn force(tip: &Tip, d: i32, result: i32, bound: u32) -> Judged {
    let [low, high] = pi_times(modulus(tip) * wide(d) * wide(d));
    Bounds { low, high, denominator: I256::from(1000) << 148 }.linear(result, bound)
}

/// `d = sqrt(F / (pi Y))`.
pub fn indentation(tip: &Tip, force: i32, result: i32, bound: u32) -> Judged {
    let numerator = I256::from(wide(force) * 1000) << 148;
    let [low, high] = pi_times(modulus(tip));
    let by_least = Bounds::exactly(numerator, high).square(result, bound);
    let by_most = Bounds::exactly(numerator, low).square(result, bound);
    Judged {
        error_ulp: by_least.error_ulp,
        nearest: Some(by_least.nearest == Some(true) && by_most.nearest == Some(true)),
        within: by_least.within && by_most.within,
    }
}

/// True if a force is at most that of the deepest indentation, judged exactly: its rounded value may be half a unit
/// more.
pub fn in_reach(tip: &Tip, force: i32) -> bool {
    let depth = wide(tip.depth_max().to_bits());
    force < tip.force_max().to_bits()
        || I256::from(wide(force) * 1000) << 148 <= pi_times(modulus(tip) * depth * depth)[0]
}

/// `r_c = sqrt(d (2a - d))`.
pub fn contact_radius(tip: &Tip, d: i32, result: i32, bound: u32) -> Judged {
    Bounds::exactly(wide(d) * (radius(tip) * 2 - wide(d)), 1).square(result, bound)
}

/// `k = 2 pi Y d`.
pub fn stiffness(tip: &Tip, d: i32, result: i32, bound: u32) -> Judged {
    let [low, high] = pi_times(modulus(tip) * wide(d));
    Bounds { low, high, denominator: I256::from(500) << 124 }.linear(result, bound)
}

/// `k = 2 sqrt(pi Y F)`.
pub fn stiffness_at_force(tip: &Tip, force: i32, result: i32, bound: u32) -> Judged {
    let [low, high] = pi_times(modulus(tip) * wide(force) * 4);
    Bounds { low, high, denominator: I256::from(1000) << 100 }.square(result, bound)
}

/// `p(0) = Y d / a`.
pub fn peak_pressure(tip: &Tip, d: i32, result: i32, bound: u32) -> Judged {
    Bounds::exactly(modulus(tip) * wide(d), radius(tip)).linear(result, bound)
}

/// `Y d / (2a - d)`.
pub fn mean_pressure(tip: &Tip, d: i32, result: i32, bound: u32) -> Judged {
    Bounds::exactly(modulus(tip) * wide(d), radius(tip) * 2 - wide(d)).linear(result, bound)
}

/// `d = a p(0) / Y`.
pub fn indentation_from_peak(tip: &Tip, peak: i32, result: i32, bound: u32) -> Judged {
    Bounds::exactly(radius(tip) * wide(peak), modulus(tip)).linear(result, bound)
}

/// `d = a - sqrt(a^2 - r_c^2)`.
pub fn indentation_from_radius(tip: &Tip, contact_radius: i32, result: i32, bound: u32) -> Judged {
    particle_length(tip, contact_radius, tip.radius().to_bits() - result, bound).mirrored()
}

/// `L = sqrt(a^2 - r^2)`.
pub fn particle_length(tip: &Tip, r: i32, result: i32, bound: u32) -> Judged {
    Bounds::exactly(radius(tip) * radius(tip) - wide(r) * wide(r), 1).square(result, bound)
}

/// `p = Y (1 - (a - d)/L)` inside the contact, 0 outside.
pub fn pressure(tip: &Tip, r: i32, d: i32, result: i32, bound: u32) -> Judged {
    let contact_square = wide(d) * (radius(tip) * 2 - wide(d));
    if wide(r) * wide(r) >= contact_square {
        return Bounds::exactly(0, 1).linear(result, bound);
    }
    // Y - p = Y (a - d) / L, whose square is rational.
    let rest = modulus(tip) * (radius(tip) - wide(d));
    let length_square = radius(tip) * radius(tip) - wide(r) * wide(r);
    Bounds::exactly(rest * rest, length_square).square(tip.modulus().to_bits() - result, bound).mirrored()
}

impl Judged {
    /// Judged through a constant less the value.
    fn mirrored(self) -> Self {
        Self { error_ulp: -self.error_ulp, ..self }
    }
}

/// Told how much of how much is done.
pub type Progress<'a> = &'a (dyn Fn(u64, u64) + Sync);

const CHUNK: u64 = 1 << 16;

/// Every depth from one unit to the deepest: force, radius, stiffness, peak and mean pressure; that the force never
/// falls and never jumps; and the inverse from the force.
pub fn depths(tip: &Tip, range: Range<u64>, progress: Progress<'_>) -> [Tally; 7] {
    let round_trip_max = (tip.indentation(newtons(1)).to_bits() + 1).into();
    let tallies = [
        Tally::new("F(d)", 0.5),
        Tally::new("r_c(d)", 0.5),
        Tally::new("k(d)", 0.5),
        Tally::new("p(0)", 0.5),
        Tally::new("mean p", 0.5),
        Tally::new("F(d + 1 ulp) - F(d)", 1.0),
        Tally::new("d(F(d)) - d", round_trip_max),
    ];
    // F(d) is rounded by up to half a unit of force, 2^-16 N. As a change of d^2 that is half of 2^-16 N / (pi Y). Here it
    // is four times that, in Q48 mm^2, from the indentation at one unit of force, rounded up.
    let first = i128::from(tip.indentation(newtons(1)).to_bits()) + 1;
    let four_lost = 2 * first * first;
    parallel(range, CHUNK, tallies, progress, |range, [force, radius, stiffness, peak, mean, step, back]| {
        let results = |d: i32| (tip.force(mm(d)), tip.stiffness(mm(d)));
        let mut next = results(range.start as i32);
        let mut inverse = (next.0, tip.indentation(next.0));
        for d in range.map(|d| d as i32) {
            let at = at(tip, d, 0);
            let (f, k) = next;
            next = results(d + 1);
            force.add(self::force(tip, d, f.to_bits(), 1), at);
            radius.add(contact_radius(tip, d, tip.contact_radius(mm(d)).to_bits(), 1), at);
            stiffness.add(self::stiffness(tip, d, k.to_bits(), 1), at);
            peak.add(peak_pressure(tip, d, tip.peak_pressure(mm(d)).to_bits(), 1), at);
            mean.add(mean_pressure(tip, d, tip.mean_pressure(mm(d)).to_bits(), 1), at);
            let rise = next.0.to_bits() - f.to_bits();
            // The slope at the larger depth, in units of force for a unit of depth.
            let slope_ulp = f64::from(next.1.to_bits() + 1) / f64::from(1 << 24);
            let within = rise >= 0 && f64::from(rise) <= 1.0 + slope_ulp;
            step.add(Judged { error_ulp: rise.into(), nearest: None, within }, at);
            // Some thirty depths have the same force.
            if f != inverse.0 {
                inverse = (f, tip.indentation(f));
            }
            back.add(round_trip(d.into(), inverse.1.to_bits().into(), four_lost), at);
        }
    })
}

/// Every force up to that of the deepest indentation: indentation and stiffness; and that a unit of force never moves
/// the indentation back, nor by more than the first unit does.
pub fn forces(tip: &Tip, range: Range<u64>, progress: Progress<'_>) -> [Tally; 3] {
    let first = tip.indentation(newtons(1)).to_bits();
    let tallies = [Tally::new("d(F)", 0.5), Tally::new("k(F)", 0.5), Tally::new("d(F + 1 ulp) - d(F)", first.into())];
    parallel(range, CHUNK, tallies, progress, |range, [indentation, stiffness, step]| {
        let mut next = tip.indentation(newtons(range.start as i32)).to_bits();
        for f in range.map(|f| f as i32) {
            let (at, d) = (at(tip, f, 0), next);
            next = tip.indentation(newtons(f + 1)).to_bits();
            if !in_reach(tip, f) {
                continue;
            }
            indentation.add(self::indentation(tip, f, d, 1), at);
            let k = tip.stiffness_at_force(newtons(f)).to_bits();
            stiffness.add(stiffness_at_force(tip, f, k, 1), at);
            let rise = next - d;
            step.add(Judged { error_ulp: rise.into(), nearest: None, within: (0..=first).contains(&rise) }, at);
        }
    })
}

/// Every contact radius up to that of the deepest indentation.
pub fn radii(tip: &Tip, range: Range<u64>, progress: Progress<'_>) -> [Tally; 1] {
    let depth = wide(tip.depth_max().to_bits());
    let square = depth * (radius(tip) * 2 - depth);
    parallel(range, CHUNK, [Tally::new("d(r_c)", 0.5)], progress, |range, [indentation]| {
        let in_reach = |radius: &i32| wide(*radius) * wide(*radius) <= square;
        for radius in range.map(|radius| radius as i32).filter(in_reach) {
            let d = tip.indentation_from_radius(mm(radius)).to_bits();
            indentation.add(indentation_from_radius(tip, radius, d, 1), at(tip, radius, 0));
        }
    })
}

/// Every peak pressure up to that of the deepest indentation.
pub fn peaks(tip: &Tip, range: Range<u64>, progress: Progress<'_>) -> [Tally; 1] {
    parallel(range, CHUNK, [Tally::new("d(p(0))", 0.5)], progress, |range, [indentation]| {
        for peak in range.map(|peak| peak as i32) {
            let d = tip.indentation_from_peak(Kilopascals::from_bits(peak)).to_bits();
            indentation.add(indentation_from_peak(tip, peak, d, 1), at(tip, peak, 0));
        }
    })
}

/// A grid of `depths` by `distances` from the centre to past the rim, denser at small depths and towards the rim: the
/// pressure, and that it never rises with the distance.
pub fn pressures(tip: &Tip, depths: u64, distances: u64, progress: Progress<'_>) -> [Tally; 2] {
    let tallies = [Tally::new("p(r, d)", 0.5), Tally::new("p(r) rise with r", 0.0)];
    parallel(1..depths + 1, 16, tallies, progress, |range, [pressure, rise]| {
        for step in range {
            let share = step as f64 / depths as f64;
            let d = ((share * share * f64::from(tip.depth_max().to_bits())) as i32).max(1);
            let rim = f64::from(tip.contact_radius(mm(d)).to_bits());
            let mut before = i32::MAX;
            let grid = (0..distances).map(|place| {
                let from_rim = 1.0 - place as f64 / (distances - 1) as f64;
                ((1.01 - from_rim * from_rim * 1.01) * rim) as i32
            });
            let mut places: Vec<i32> = grid.chain(boundary_distances(tip, d)).collect();
            places.sort_unstable();
            for r in places {
                let p = tip.pressure(mm(r), mm(d)).to_bits();
                let at = at(tip, d, r);
                // Past the radius a every distance is the same.
                pressure.add(self::pressure(tip, r.min(tip.radius().to_bits()), d, p, 2), at);
                let error_ulp = f64::from((p - before).max(0));
                rise.add(Judged { error_ulp, nearest: None, within: p <= before }, at);
                before = p;
            }
        }
    })
}

/// `|d' - d|` is at most what half a unit of force is worth at `d`, and half a unit of depth.
fn round_trip(d: i64, again: i64, four_lost: i128) -> Judged {
    let (d, again) = (i128::from(d), i128::from(again));
    let above = again == 0 || (2 * again - 1).pow(2) <= 4 * d * d + four_lost;
    let below = (2 * again + 1).pow(2) >= 4 * d * d - four_lost;
    Judged { error_ulp: (again - d) as f64, nearest: None, within: above && below }
}

#[cfg(test)]
mod tests {
    use super::*;
    use fingertip::units::{Kilopascals, Millimetres};

    /// 2 mm, 10 mm, 250 kPa: F is pi N, d(pi N) 2 mm, k pi N/mm, p(0) 50 kPa.
    #[test]
    fn a_unit_off_is_seen_by_every_judge() {
        let tip = Tip::new(Millimetres::from_bits(10 << 24), Kilopascals::from_bits(250 << 16)).unwrap();
        type Judge = fn(&Tip, i32, i32, u32) -> Judged;
        let cases: [(Judge, i32, i32); 9] = [
            (force, 2 << 24, 205_887),
            (indentation, 205_887, 33_554_398),
            (contact_radius, 2 << 24, 6 << 24),
            (stiffness, 2 << 24, 205_887),
            (stiffness_at_force, 205_887, 205_887),
            (peak_pressure, 2 << 24, 50 << 16),
            (mean_pressure, 2 << 24, 1_820_444),
            (indentation_from_peak, 50 << 16, 2 << 24),
            (indentation_from_radius, 6 << 24, 2 << 24),
        ];
        for (place, (judge, input, result)) in cases.into_iter().enumerate() {
            let right = judge(&tip, input, result, 1);
            assert!(right.nearest == Some(true) && right.within, "case {place}: {right:?}");
            for off in [-1, 1] {
                let wrong = judge(&tip, input, result + off, 1);
                assert!(wrong.nearest == Some(false), "case {place}: {wrong:?}");
                assert!((wrong.error_ulp - right.error_ulp - f64::from(off)).abs() < 1e-6, "case {place}: {wrong:?}");
                assert!(!judge(&tip, input, result + 2 * off, 1).within, "case {place}");
            }
        }
    }
}
