//! The exact judge: integers against integers.
//!
//! A result `f`, in units of its last place, is compared with the exact value `v` through what both sides become when
//! the fractions, the roots and pi are cleared: `v = n/m` or `v^2 = n/m` with integers `n` and `m`, and pi between two
//! integers over 2^100. Pass and fail are decided without any rounding; only the size of the error that is printed is a
//! float.

use ethnum::{I256, U256};
use fingertip::model::Tip;

use super::tally::Judged;

/// pi 2^100, rounded down: from its digits in hexadecimal.
const PI_Q100: u128 = 0x32_43f6_a888_5a30_8d31_3198_a2e0;

/// An exact value known between two rational numbers with one denominator.
struct Bounds {
    low: U256,
    high: U256,
    denominator: U256,
}

impl Bounds {
    fn exactly(numerator: U256, denominator: U256) -> Self {
        Self { low: numerator, high: numerator, denominator }
    }

    /// The bounds are those of the value.
    fn linear(&self, result: i32, bound: u32) -> Judged {
        let twice = I256::from(result) * 2;
        let holds = |margin: i32| {
            let low = (twice - I256::from(margin)) * self.denominator.as_i256();
            let high = (twice + I256::from(margin)) * self.denominator.as_i256();
            (self.low * 2).as_i256() >= low && (self.high * 2).as_i256() <= high
        };
        let error = I256::from(result) * self.denominator.as_i256() - self.low.as_i256();
        Judged {
            error_ulp: error.as_f64() / self.denominator.as_f64(),
            nearest: Some(holds(1)),
            within: holds(2 * bound as i32),
        }
    }

    /// The bounds are those of the value's square; the value is not negative.
    fn square(&self, result: i32, bound: u32) -> Judged {
        let twice = 2 * i128::from(result);
        let squared = |side: i128| U256::from(side.max(0).unsigned_abs().pow(2)) * self.denominator;
        let holds = |margin: i128| {
            let above = twice < margin || self.low * 4 >= squared(twice - margin);
            above && self.high * 4 <= squared(twice + margin)
        };
        let difference = (squared(twice).as_i256() - (self.low * 4).as_i256()).as_f64() / self.denominator.as_f64();
        let value = (self.low.as_f64() / self.denominator.as_f64()).sqrt();
        let sum = 2.0 * (f64::from(result) + value);
        Judged {
            error_ulp: if sum > 0.0 { difference / sum / 2.0 } else { 0.0 },
            nearest: Some(holds(1)),
            within: holds(2 * i128::from(bound)),
        }
    }
}

fn wide(number: i32) -> U256 {
    U256::from(number.unsigned_abs())
}

fn pi_times(number: U256) -> (U256, U256) {
    (number * U256::from(PI_Q100), number * U256::from(PI_Q100 + 1))
}

fn radius(tip: &Tip) -> U256 {
    wide(tip.radius().to_bits())
}

fn modulus(tip: &Tip) -> U256 {
    wide(tip.modulus().to_bits())
}

/// `F = pi Y d^2`.
pub fn force(tip: &Tip, d: i32, result: i32, bound: u32) -> Judged {
    let (low, high) = pi_times(modulus(tip) * wide(d) * wide(d));
    Bounds { low, high, denominator: U256::from(1000_u32) << 148 }.linear(result, bound)
}

/// `d = sqrt(F / (pi Y))`.
pub fn indentation(tip: &Tip, force: i32, result: i32, bound: u32) -> Judged {
    let numerator = (wide(force) * 1000) << 148;
    let (low, high) = pi_times(modulus(tip));
    let by_least = Bounds::exactly(numerator, high).square(result, bound);
    let by_most = Bounds::exactly(numerator, low).square(result, bound);
    Judged {
        error_ulp: by_least.error_ulp,
        nearest: Some(by_least.nearest == Some(true) && by_most.nearest == Some(true)),
        within: by_least.within && by_most.within,
    }
}

/// True if the exact indentation at a force is at most the deepest.
pub fn force_in_reach(tip: &Tip, force: i32) -> bool {
    let depth = wide(tip.depth_max().to_bits());
    (wide(force) * 1000) << 148 <= pi_times(modulus(tip)).0 * depth * depth
}

/// True if the exact indentation at a contact radius is at most the deepest.
pub fn radius_in_reach(tip: &Tip, contact_radius: i32) -> bool {
    let depth = wide(tip.depth_max().to_bits());
    wide(contact_radius) * wide(contact_radius) <= depth * (radius(tip) * 2 - depth)
}

/// `r_c = sqrt(d (2a - d))`.
pub fn contact_radius(tip: &Tip, d: i32, result: i32, bound: u32) -> Judged {
    Bounds::exactly(wide(d) * (radius(tip) * 2 - wide(d)), U256::ONE).square(result, bound)
}

/// `k = 2 pi Y d`.
pub fn stiffness(tip: &Tip, d: i32, result: i32, bound: u32) -> Judged {
    let (low, high) = pi_times(modulus(tip) * wide(d));
    Bounds { low, high, denominator: U256::from(500_u32) << 124 }.linear(result, bound)
}

/// `k = 2 sqrt(pi Y F)`.
pub fn stiffness_at_force(tip: &Tip, force: i32, result: i32, bound: u32) -> Judged {
    let (low, high) = pi_times(modulus(tip) * wide(force) * 4);
    Bounds { low, high, denominator: U256::from(1000_u32) << 100 }.square(result, bound)
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
    Bounds::exactly(radius(tip) * radius(tip) - wide(r) * wide(r), U256::ONE).square(result, bound)
}

/// `p = Y (1 - (a - d)/L)` inside the contact, 0 outside.
pub fn pressure(tip: &Tip, r: i32, d: i32, result: i32, bound: u32) -> Judged {
    let contact_square = wide(d) * (radius(tip) * 2 - wide(d));
    if wide(r) * wide(r) >= contact_square {
        return Bounds::exactly(U256::ZERO, U256::ONE).linear(result, bound);
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
