//! A first guess in closed form, good wherever the contact's centre is, on the array or off it.
//!
//! Inside the contact `1 - r^2 = s^2 z` with `z = 1 / (1 - p/Y)^2`: z falls with the squared distance, and its slope points
//! to the centre. A plane through z over the taxels, weighted with their pressure, gives a mean m and a slope g at the
//! taxels' own middle c. With D = c - r0, V the mean of `|c_i - c|^2 + h^2/6` and k the slope of that square (0 for a
//! symmetric set of taxels), the paper's model says `s^2 g = -k - 2 D` and `s^2 m = 1 - V - D^2`: a quadratic equation for
//! s^2, and then D.

use super::arith::{high, quotient, within};
use super::geometry::{Geometry, SQUARE_BITS};
use super::guess::{CENTRE_BITS, Guess};
use super::view::{PEAK_BITS, View};
use crate::root::floor_sqrt;

/// Taxels below an eighth of the peak are left out: the rim crosses most of them.
const SHARE_MIN: i32 = 1 << (PEAK_BITS - 3);
/// Drops from a share to a weight: 64 at the peak.
const WEIGHT_DROP: u32 = PEAK_BITS - 6;
/// The largest strain that is believed, Q16: 3/4.
const STRAIN_MAX: i32 = 3 << 14;
/// Fractional bits of z.
const Z_BITS: u32 = 14;
/// Fractional bits of means, slopes and the quadratic equation.
const BITS: u32 = 20;
/// Fractional bits of sums about the middle.
const ABOUT_BITS: u32 = 4;
/// The steepest slope of z that a contact within reach can have, in 1/a.
const SLOPE_MAX: i32 = 128 << BITS;
/// The largest slope of the squared distance, in a.
const SKEW_MAX: i32 = 16 << BITS;
/// The determinant of two columns of which one has hardly any weight.
const DETERMINANT_MIN: i64 = 1 << 20;

/// Weighted sums over the taxels; places count half pitches, z is less by 1.
#[derive(Clone, Copy, Debug, Default)]
struct Sums {
    n: i32,
    x: i32,
    y: i32,
    xx: i32,
    xy: i32,
    yy: i32,
    /// Of x and of y, times their squared length.
    x_cube: i32,
    y_cube: i32,
    z: i64,
    zx: i64,
    zy: i64,
}

impl Sums {
    fn of(view: &View) -> Self {
        let mut all = Self::default();
        let inverse_modulus_q38 = (view.inverse_modulus >> (24 - view.modulus_shift)) as i32;
        let mut y = -9;
        for row in &view.picture.taxels {
            let (mut n, mut sx, mut sxx, mut sxxx, mut z, mut zx) = (0, 0, 0, 0, 0, 0);
            for (taxel, x) in row.iter().zip((-9..).step_by(2)) {
                let share = view.share(*taxel);
                if share < SHARE_MIN {
                    continue;
                }
                let strain = high(share << 10, inverse_modulus_q38).min(STRAIN_MAX).unsigned_abs();
                let left = (1 << 16) - strain;
                let taxel_z = (strain * ((2 << 16) - strain) / ((left * left) >> (32 - 4 - Z_BITS))) as i32;
                let weight = share >> WEIGHT_DROP;
                let (wx, wz) = (weight * x, weight * taxel_z);
                n += weight;
                sx += wx;
                sxx += wx * x;
                sxxx += wx * x * x;
                z += wz;
                zx += wz * x;
            }
            all.n += n;
            all.x += sx;
            all.y += n * y;
            all.xx += sxx;
            all.xy += sx * y;
            all.yy += n * y * y;
            all.x_cube += sxxx + sx * y * y;
            all.y_cube += (sxx + n * y * y) * y;
            all.z += i64::from(z);
            all.zx += i64::from(zx);
            all.zy += i64::from(z) * i64::from(y);
            y += 2;
        }
        all
    }
}

/// The plane's guess; None where the taxels lie on one line, or fit no contact.
pub(super) fn plane(view: &View, geometry: &Geometry) -> Option<Guess> {
    let sums = Sums::of(view);
    let n = u64::from(sums.n.unsigned_abs());
    let (x, y) = (quotient(sums.x.into(), n, BITS), quotient(sums.y.into(), n, BITS));

    // Sums about the middle.
    let about =
        |sum: i64, mean: i32, other: i64| (sum << ABOUT_BITS) - ((i64::from(mean) * other) >> (BITS - ABOUT_BITS));
    let xx = about(sums.xx.into(), x, sums.x.into());
    let xy = about(sums.xy.into(), x, sums.y.into());
    let yy = about(sums.yy.into(), y, sums.y.into());
    let determinant = xx * yy - xy * xy;
    if determinant < DETERMINANT_MIN {
        return None;
    }
    let slope = |with_x: i64, with_y: i64, bits: u32| {
        let over = |numerator: i64| quotient(numerator, determinant.unsigned_abs(), bits);
        [over(with_x * yy - with_y * xy), over(with_y * xx - with_x * xy)]
    };
    let z_about = |sum: i64, mean: i32| sum - ((i64::from(mean) * sums.z) >> BITS);
    let z_slope = slope(z_about(sums.zx, x), z_about(sums.zy, y), BITS + ABOUT_BITS - Z_BITS);
    let squares = i64::from(sums.xx) + i64::from(sums.yy);
    let cube_about = |cube: i32, mean: i32, along: i64, across: i64, other: i32| {
        let twice = i64::from(mean) * along + i64::from(other) * across;
        about(cube.into(), mean, squares) - (twice >> (BITS - 1))
    };
    let k = slope(cube_about(sums.x_cube, x, xx, xy, y), cube_about(sums.y_cube, y, yy, xy, x), BITS);

    // From half pitches to tip radii.
    let half_pitch = geometry.pitch >> 1;
    let to_radii = |half_pitches: i32| high(half_pitches, half_pitch) << (32 - SQUARE_BITS);
    let g =
        z_slope.map(|slope| within(quotient(slope.into(), half_pitch.unsigned_abs().into(), SQUARE_BITS), SLOPE_MAX));
    let k = k.map(|slope| within(to_radii(slope), SKEW_MAX));
    let spread = to_radii(to_radii(quotient(xx + yy, n, BITS - ABOUT_BITS)) + to_radii(2 << BITS) / 3);

    // |s^2 g + k|^2 / 4 + s^2 m - 1 + V = 0.
    let dot = |a: [i32; 2], b: [i32; 2]| {
        let ([ax, ay], [bx, by]) = (a, b);
        (i64::from(ax) * i64::from(bx) + i64::from(ay) * i64::from(by)) >> BITS
    };
    let quadratic = dot(g, g) >> 2;
    let linear = i64::from(quotient(sums.z, n, BITS - Z_BITS)) + (1 << BITS) + (dot(g, k) >> 1);
    let constant = (1 << BITS) - i64::from(spread) - (dot(k, k) >> 2);
    if constant <= 0 {
        return None;
    }
    let root = floor_sqrt((linear * linear + 4 * quadratic * constant).unsigned_abs());
    let rest_square = quotient(2 * constant, (linear + i64::from(root)).max(1).unsigned_abs(), SQUARE_BITS);
    let centre = |mean: i32, g: i32, k: i32| {
        let toward = ((i64::from(rest_square) * i64::from(g)) >> SQUARE_BITS) + i64::from(k);
        (i64::from(to_radii(mean)) << (CENTRE_BITS - BITS)) + (toward << (CENTRE_BITS - BITS - 1))
    };
    let [centre_x, centre_y] = [centre(x, g[0], k[0]), centre(y, g[1], k[1])]
        .map(|centre| centre.max(i64::from(-i32::MAX)).min(i64::from(i32::MAX)) as i32);
    let rest = floor_sqrt(u64::from(rest_square.unsigned_abs()) << SQUARE_BITS);
    Some(Guess::new(rest.min(1 << SQUARE_BITS) as i32, centre_x, centre_y, geometry))
}
