//! The sums behind both fits, and the line through the points.
//!
//! Points are shares of a full scale, Q31. The sums hold powers of x up to the fourth with y and y^2: enough for a
//! least-squares line and for the sum of `x^k e^2` over its residuals e, without keeping a single point:
//!
//! ```text
//! s = cov(x, y) / var(x)          t = mean(y) - s mean(x)          e = y - t - s x
//! var(s) = mean((x - mean(x))^2 e^2) / (n var(x)^2)
//! ```
//!
//! A residual is smaller than the error it comes from, by the point's leverage; at most 4/n of it for points spread
//! evenly over a line, 5/n for points evenly spread in d on a line in d^2 through the origin. Twice that is added to
//! the variance, as leaving out each point in turn would show to first order.

use crate::root::floor_sqrt;

/// Fractional bits of a point.
pub const POINT_BITS: u32 = 31;
/// Fractional bits of a sum and of a mean.
const MEAN_BITS: u32 = 47;
/// Fractional bits of a slope.
pub const SLOPE_BITS: u32 = 40;
/// Steeper than this, in shares of the full scales, is no line to judge; it bounds the arithmetic behind it.
const SLOPE_MAX: i64 = 64 << SLOPE_BITS;
/// Largest leverage times n, of a line and of a line through the origin.
const LEVERAGE_LINE: u32 = 4;
const LEVERAGE_ORIGIN: u32 = 5;

/// What is kept of the points.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Sums {
    count: u32,
    /// Of x to the power of 1 to 4, Q47.
    x: [i64; 4],
    /// Of y times x to the power of 0 to 3.
    y: [i64; 4],
    /// Of y^2 times x to the power of 0 to 2.
    yy: [i64; 3],
}

/// A line through the points, in shares of the full scales.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Line {
    /// Its slope, Q40.
    pub slope: i64,
    /// The slope's standard uncertainty, Q40.
    pub sigma: i64,
    /// Where it crosses zero, Q31.
    pub zero: i64,
    /// Mean of e^2, Q47.
    pub residual: i64,
    /// Mean of y^2, Q47.
    pub square: i64,
}

/// Means in Q47.
struct Means {
    count: u32,
    /// Of x to the power of 0 to 4.
    x: [i64; 5],
    y: [i64; 4],
    yy: [i64; 3],
}

impl Sums {
    /// Of no points.
    pub const EMPTY: Self = Self { count: 0, x: [0; 4], y: [0; 4], yy: [0; 3] };

    /// How many points were taken.
    pub fn count(&self) -> u32 {
        self.count
    }

    /// Takes a point: shares of the full scales in Q31, 0 to 1.
    pub fn add(&mut self, x: u32, y: u32) {
        let [x, y] = [x, y].map(|share| i64::from(share) << (MEAN_BITS - POINT_BITS));
        self.count += 1;
        let mut power = 1 << MEAN_BITS;
        let mut powers = [power; 5];
        for place in powers.iter_mut().skip(1) {
            power = product(power, x);
            *place = power;
        }
        let square = product(y, y);
        self.x.iter_mut().zip(powers.iter().skip(1)).for_each(|(sum, power)| *sum += power);
        self.y.iter_mut().zip(&powers).for_each(|(sum, power)| *sum += product(*power, y));
        self.yy.iter_mut().zip(&powers).for_each(|(sum, power)| *sum += product(*power, square));
    }

    /// The line of least squares; none where all points have the same x, or all the same y.
    pub fn line(&self) -> Option<Line> {
        let means = self.means();
        let [_, x1, x2, ..] = means.x;
        let [y0, y1, ..] = means.y;
        let variance = x2 - mul(x1, x1, MEAN_BITS);
        let slope = quotient(y1 - mul(x1, y0, MEAN_BITS), variance, SLOPE_BITS).filter(gentle)?;
        let offset = y0 - mul(slope, x1, SLOPE_BITS);
        let [e0, e1, e2] = means.residuals(slope, offset);
        let about_middle = e2 - 2 * mul(x1, e1, MEAN_BITS) + mul(mul(x1, x1, MEAN_BITS), e0, MEAN_BITS);
        let zero = (x1 >> (MEAN_BITS - POINT_BITS)) - quotient(y0, slope, POINT_BITS + SLOPE_BITS - MEAN_BITS)?;
        let sigma = means.sigma(about_middle, variance, LEVERAGE_LINE)?;
        Some(Line { slope, sigma, zero, residual: e0, square: means.yy[0] })
    }

    /// The line of least squares through the origin; none where all points lie there.
    pub fn through_origin(&self) -> Option<Line> {
        let means = self.means();
        let slope = quotient(means.y[1], means.x[2], SLOPE_BITS).filter(gentle)?;
        let [e0, _, e2] = means.residuals(slope, 0);
        let sigma = means.sigma(e2, means.x[2], LEVERAGE_ORIGIN)?;
        Some(Line { slope, sigma, zero: 0, residual: e0, square: means.yy[0] })
    }

    fn means(&self) -> Means {
        let share = (1 << MEAN_BITS) / u64::from(self.count.max(1));
        let mean = |sum| mul(sum, share as i64, MEAN_BITS);
        let [x1, x2, x3, x4] = self.x.map(mean);
        Means {
            count: self.count.max(1),
            x: [mean(i64::from(self.count) << MEAN_BITS), x1, x2, x3, x4],
            y: self.y.map(mean),
            yy: self.yy.map(mean),
        }
    }
}

impl Means {
    /// Means of x^k e^2 for k of 0, 1 and 2.
    fn residuals(&self, slope: i64, offset: i64) -> [i64; 3] {
        let slope2 = mul(slope, slope, SLOPE_BITS);
        let offset2 = mul(offset, offset, MEAN_BITS);
        let both = mul(slope, offset, SLOPE_BITS);
        let powers = self.x.iter().zip(self.x.iter().skip(1)).zip(self.x.iter().skip(2));
        let mixed = self.y.iter().zip(self.y.iter().skip(1));
        let mut means = self.yy;
        for ((mean, ((x, x1), x2)), (y, y1)) in means.iter_mut().zip(powers).zip(mixed) {
            *mean += mul(offset2, *x, MEAN_BITS) + mul(slope2, *x2, SLOPE_BITS) + 2 * mul(both, *x1, MEAN_BITS)
                - 2 * mul(offset, *y, MEAN_BITS)
                - 2 * mul(slope, *y1, SLOPE_BITS);
        }
        means
    }

    /// sqrt(scatter (1 + 2 leverage / n) / n) / spread, Q40.
    fn sigma(&self, scatter: i64, spread: i64, leverage: u32) -> Option<i64> {
        // The roots are Q31 and Q10: their product is Q41 against the spread's Q47.
        let root = i64::from(floor_sqrt(scatter.max(0).unsigned_abs() << 15));
        let root_count = i64::from(floor_sqrt(u64::from(self.count + 2 * leverage) << 20));
        quotient(root * root_count, spread * i64::from(self.count), SLOPE_BITS + MEAN_BITS - 41)
    }
}

fn gentle(slope: &i64) -> bool {
    (-SLOPE_MAX..=SLOPE_MAX).contains(slope)
}

/// Product of two shares in Q47, rounded.
fn product(a: i64, b: i64) -> i64 {
    (mul(a, b, MEAN_BITS - 1) + 1) >> 1
}

/// a b / 2^shift, rounded down.
pub fn mul(a: i64, b: i64, shift: u32) -> i64 {
    ((i128::from(a) * i128::from(b)) >> shift) as i64
}

/// a 2^bits / b to 31 significant bits, held to what an i64 takes; none where b is not positive.
pub fn quotient(a: i64, b: i64, bits: u32) -> Option<i64> {
    let (magnitude, divisor) = (a.unsigned_abs(), u64::try_from(b).ok().filter(|b| *b > 0)?);
    let (up, up_divisor) = (magnitude.leading_zeros().min(63), divisor.leading_zeros());
    // 64 significant bits by 32.
    let quotient = (magnitude << up) / ((divisor << up_divisor) >> 32).max(1);
    let shift = i64::from(bits) + i64::from(up_divisor) - 32 - i64::from(up);
    let value = if shift >= 30 {
        i64::MAX
    } else if shift >= 0 {
        (quotient << shift) as i64
    } else {
        (quotient >> (-shift).min(63)) as i64
    };
    Some(if a < 0 { -value } else { value })
}
