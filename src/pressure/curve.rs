//! The array's characteristic where it is not a line: force per conductance that grows with conductance.
//!
//! A taxel that shows u codes behind its gain carries f(u) = u (1 + p u / 4096) / (1 + p), in the codes of the full
//! range: f(4096) = 4096. Above its tare B it reads T, so it carries f(T + B) - f(B) = T (q + q p (T + 2 B) / 4096) with
//! q = 1 / (1 + p). In the factor T + B and B count as 0 where they are below: a taxel cannot show that, and the
//! parabola would turn. So a reading keeps its sign, and a larger one is never a smaller force.

use super::{CODE_BITS, Picture, TARE_BITS, row::weight};
use crate::config::Curve;
use lanes::Row;

/// A code of the full range.
const RANGE_BITS: u32 = 12;
/// No taxel carries more: three times the full range, which is what a line may read there.
const LARGEST: i32 = 3 << (RANGE_BITS + CODE_BITS);

/// What a reading above a tare carries, in sixteenths of a code of the full range. Within one unit of the formula.
///
/// A reading and its tare of codes of 12 bits, gains below 2 and a boost below 1.5 stay below 2^18.6.
#[inline(always)]
fn carried(curve: Curve, taxel: i32, tare: i32) -> i32 {
    // T + B and B in sixteenths, Q12.
    let place = const { TARE_BITS - CODE_BITS };
    let both = (taxel << place).wrapping_add(tare).max(0).wrapping_add(tare.max(0));
    let factor = curve.least.wrapping_add(upper(both, curve.growth));
    let carried = upper(taxel << (32 - Curve::FACTOR_BITS), factor);
    carried.min(LARGEST).max(-LARGEST)
}

/// Turns a picture's readings into what they carry, and sums it up anew.
#[inline(never)]
pub(super) fn bend<const ROWS: usize, const COLUMNS: usize>(
    curve: Curve,
    picture: &mut Picture<ROWS, COLUMNS>,
    rows: &[Row<COLUMNS>; ROWS],
) {
    let (mut sum, mut moment_x, mut moment_y, mut peak) = (0, 0, 0, 0);
    for (number, (taxels, row)) in picture.taxels.iter_mut().zip(rows).enumerate() {
        let mut line: i32 = 0;
        for (column, (taxel, tare)) in taxels.iter_mut().zip(&row.tare).enumerate() {
            let carried = carried(curve, *taxel, *tare);
            *taxel = carried;
            line = line.wrapping_add(carried);
            moment_x = carried.wrapping_mul(weight(column, COLUMNS)).wrapping_add(moment_x);
            peak = carried.max(peak);
        }
        sum = line.wrapping_add(sum);
        moment_y = line.wrapping_mul(weight(number, ROWS)).wrapping_add(moment_y);
    }
    (picture.sum, picture.moment_x, picture.moment_y, picture.peak) = (sum, moment_x, moment_y, peak);
}

/// The upper half of a product, rounded.
#[inline(always)]
const fn upper(a: i32, b: i32) -> i32 {
    ((a as i64 * b as i64 + (1 << 31)) >> 32) as i32
}

#[cfg(test)]
mod tests {
    use super::*;

    /// In codes.
    fn exact(permille: i32, taxel: f64, tare: f64) -> f64 {
        let p = f64::from(permille) / 1_000.0;
        let least = 1.0 / (1.0 + p);
        taxel * (least + least * p * ((taxel + tare).max(0.0) + tare) / 4_096.0)
    }

    #[test]
    fn what_a_reading_carries_is_within_a_unit_of_the_formula() {
        let mut worst = 0.0_f64;
        for permille in [1, 300, 3_300, 8_000] {
            let curve = Curve::new(permille).unwrap();
            for tare in (0..=4_096 << TARE_BITS).step_by(19_531_249) {
                for taxel in (-4_096 << CODE_BITS..=8_192 << CODE_BITS).step_by(37) {
                    let carried = f64::from(carried(curve, taxel, tare));
                    let formula = 16.0 * exact(permille, f64::from(taxel) / 16.0, f64::from(tare) / 65_536.0);
                    if formula < f64::from(LARGEST) {
                        worst = worst.max((carried - formula).abs());
                    } else {
                        assert!((carried - f64::from(LARGEST)).abs() < 1.0);
                    }
                }
            }
        }
        assert!((0.5..0.52).contains(&worst), "{worst}");
    }

    #[test]
    fn a_larger_reading_never_carries_less() {
        for permille in [1, 1_000, 8_000] {
            let curve = Curve::new(permille).unwrap();
            // The most that codes of 12 bits, gains below 2 and a boost below 1.5 can show.
            let most = 196_560;
            for tare in [-most, 0, 3_000, 65_536, most] {
                let all = (-most - tare..=most - tare).step_by(5).map(|taxel| carried(curve, taxel, tare << 12));
                assert!(all.clone().is_sorted(), "{permille} {tare}");
                assert!(all.clone().all(|carried| (-LARGEST..=LARGEST).contains(&carried)));
                assert_eq!(carried(curve, 0, tare << 12), 0);
            }
        }
    }

    #[test]
    fn the_full_range_stays_and_a_line_is_none() {
        assert_eq!(Curve::new(0), None);
        for permille in [1, 500, 8_000] {
            assert_eq!(carried(Curve::new(permille).unwrap(), 4_096 << 4, 0), 4_096 << 4, "{permille}");
        }
    }
}
