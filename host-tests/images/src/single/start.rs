//! A first guess in closed form, good wherever the contact's centre is, on the array or off it.
//!
//! Inside the contact `1 - r^2 = s^2 z` with `z = 1 / (1 - p/Y)^2`: z falls with the squared distance, and its slope
//! points to the centre. A plane through z over the taxels, weighted with their pressure, gives a mean m and a slope g
//! at the taxels' own middle c. With D = c - r0, V the mean of `|c_i - c|^2 + h^2/6` and k the slope of that square (0
//! for a symmetric set of taxels), the paper's model says `s^2 g = -k - 2 D` and `s^2 m = 1 - V - D^2`: a quadratic
//! equation for s^2, and then D.

use fingertip::config::Shaped;
use fingertip::contact::parts::{
    CENTRE_BITS, Divisor, Guess, ONE, PEAK_BITS, SQUARE_BITS, ScaledImage, clamp_to, high, root,
};

/// Taxels below an eighth of the peak are left out: the rim crosses most of them.
const SHARE_MIN: i32 = 1 << (PEAK_BITS - 3);
/// Drops from a share to a weight: 64 at the peak.
const WEIGHT_DROP: u32 = PEAK_BITS - 6;
/// The largest strain that is believed, Q16: 5/8.
const STRAIN_MAX: i32 = 5 << 13;
/// Fractional bits of a taxel's z.
const Z_BITS: u32 = 14;
/// Bits dropped from weighted z, so that their moments fit 32 bits: 2 of 10 x 10 and 16 x 16, 4 of 16 x 32.
///
/// A weighted z is at most 64 x 100,124 by [`STRAIN_MAX`]; what of a moment has one sign has the weights 1, 3, 5 .. of
/// half of the places, which are a quarter of their number's square. Sums without z fit as they are: 64 x^3 over half
/// of 16 x 32 taxels is 1.6e8. About the middle 64 bits are used.
const fn z_drop(rows: usize, columns: usize) -> u32 {
    let side = if rows > columns { rows } else { columns };
    let mut drop = 2;
    while ((64 * 100_124_u64) >> drop) * (rows * columns * side / 4) as u64 >= 1 << 31 {
        drop += 1;
    }
    drop
}

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
    /// Sums of x and of y, each times the squared length of the position.
    x_cube: i32,
    y_cube: i32,
    z: i32,
    zx: i32,
    zy: i32,
}

impl Sums {
    fn of<const ROWS: usize, const COLUMNS: usize>(view: &ScaledImage<ROWS, COLUMNS>) -> Self {
        let z_drop = const { z_drop(ROWS, COLUMNS) };
        let mut all = Self::default();
        // 2^38 over Y as a share of the peak.
        let inverse_modulus = (view.scale.inverse_modulus >> (24 - view.scale.modulus_shift)) as i32;
        for (row, taxels) in view.picture.taxels.iter().enumerate() {
            let y = 2 * row as i32 + 1 - ROWS as i32;
            let (mut n, mut sx, mut sxx, mut sxxx, mut z, mut zx) = (0, 0, 0, 0, 0, 0);
            for (column, taxel) in taxels.iter().enumerate() {
                let x = 2 * column as i32 + 1 - COLUMNS as i32;
                let share = view.share(*taxel).min(1 << PEAK_BITS);
                if share < SHARE_MIN {
                    continue;
                }
                let strain = high(share << 10, inverse_modulus).min(STRAIN_MAX).unsigned_abs();
                let left = (1 << 16) - strain;
                let taxel_z = (strain * ((2 << 16) - strain) / ((left * left) >> (32 - 4 - Z_BITS)).max(1)) as i32;
                let weight = share >> WEIGHT_DROP;
                let (wx, wz) = (weight * x, weight * taxel_z);
                n += weight;
                sx += wx;
                sxx += wx * x;
                sxxx += wx * x * x;
                z += wz >> z_drop;
                zx += (wz >> z_drop) * x;
            }
            all.n += n;
            all.x += sx;
            all.y += n * y;
            all.xx += sxx;
            all.xy += sx * y;
            all.yy += n * y * y;
            all.x_cube += sxxx + sx * y * y;
            all.y_cube += (sxx + n * y * y) * y;
            all.z += z;
            all.zx += zx;
            all.zy += z * y;
        }
        all
    }
}

/// Start guess for a plane; `None` if the taxels lie on one line, or fit no contact.
pub fn plane<const ROWS: usize, const COLUMNS: usize>(
    view: &ScaledImage<ROWS, COLUMNS>,
    config: &Shaped<ROWS, COLUMNS>,
) -> Option<Guess> {
    let geometry = &config.geometry;
    // Fractional bits of sums of z.
    let z_sum_bits = const { Z_BITS - z_drop(ROWS, COLUMNS) };
    let sums = Sums::of(view);
    let by_n = Divisor::new(sums.n.unsigned_abs().into());
    let (x, y) = (by_n.divide(sums.x.into(), BITS), by_n.divide(sums.y.into(), BITS));

    // Sums about the middle, Q4.
    let about = |sum: i32, mean: i32, other: i32| {
        (i64::from(sum) << ABOUT_BITS) - ((i64::from(mean) * i64::from(other)) >> (BITS - ABOUT_BITS))
    };
    let xx = about(sums.xx, x, sums.x);
    let xy = about(sums.xy, x, sums.y);
    let yy = about(sums.yy, y, sums.y);
    let product = |a: i32, b: i32| i64::from(a) * i64::from(b);
    let determinant = xx * yy - xy * xy;
    if determinant < DETERMINANT_MIN {
        return None;
    }
    let by_determinant = Divisor::new(determinant.unsigned_abs());
    let slope = |with_x: i64, with_y: i64, bits: u32| {
        [by_determinant.divide(with_x * yy - with_y * xy, bits), by_determinant.divide(with_y * xx - with_x * xy, bits)]
    };
    let z_about = |sum: i32, mean: i32| i64::from(sum) - (product(mean, sums.z) >> BITS);
    let z_slope = slope(z_about(sums.zx, x), z_about(sums.zy, y), BITS + ABOUT_BITS - z_sum_bits);
    // About the middle, the squared length's slope against x and y.
    let cube_about = |cube: i32, mean: i32, along: i64, across: i64, other: i32| {
        let twice = i64::from(mean) * along + i64::from(other) * across;
        about(cube, mean, sums.xx + sums.yy) - (twice >> (BITS - 1))
    };
    let k = slope(cube_about(sums.x_cube, x, xx, xy, y), cube_about(sums.y_cube, y, yy, xy, x), BITS);

    // From half pitches to tip radii; 2/h, Q20.
    let (radius_um, pitch_um) = (i64::from(config.params.tip_radius_um), i64::from(config.params.pitch_um));
    let inverse_half_pitch = ((radius_um << 21) / pitch_um.max(1)) as i32;
    let to_radii = |half_pitches: i32| high(half_pitches, geometry.pitch) << (31 - SQUARE_BITS);
    let g = z_slope.map(|slope| clamp_to(product(slope, inverse_half_pitch) >> 20, SLOPE_MAX));
    let k = k.map(|slope| clamp_to(to_radii(slope).into(), SKEW_MAX));
    let own = to_radii(2 << BITS) / 3;
    let spread = to_radii(to_radii(by_n.divide(xx + yy, BITS - ABOUT_BITS)) + own);

    // S^2 g^2/4 + S (m + g k/2) + k^2/4 + V - 1 = 0 for S = s^2.
    let dot = |a: [i32; 2], b: [i32; 2]| {
        let ([ax, ay], [bx, by]) = (a, b);
        (product(ax, bx) + product(ay, by)) >> BITS
    };
    let quadratic = dot(g, g) >> 2;
    let linear = i64::from(by_n.divide(sums.z.into(), BITS - z_sum_bits)) + (1 << BITS) + (dot(g, k) >> 1);
    let constant = (1 << BITS) - i64::from(spread) - (dot(k, k) >> 2);
    if constant <= 0 {
        return None;
    }
    let wide_root = |square: i64| {
        // The top 32 bits, by an even shift.
        let drop = (33 - square.unsigned_abs().leading_zeros().min(32)) & !1;
        i64::from(root((square >> drop) as u32)) << (drop / 2)
    };
    let twice = linear + wide_root((linear * linear + 4 * quadratic * constant).max(0));
    let height_square = Divisor::new(twice.max(1).unsigned_abs()).divide(2 * constant, SQUARE_BITS).min(ONE);
    let centre = |mean: i32, g: i32, k: i32| {
        let toward = (product(height_square, g) >> SQUARE_BITS) + i64::from(k);
        let wide = (i64::from(to_radii(mean)) << (CENTRE_BITS - BITS)) + (toward << (CENTRE_BITS - BITS - 1));
        clamp_to(wide, i32::MAX)
    };
    // The root of Q30 is Q15.
    let height = (root((height_square << 2).unsigned_abs()) as i32) << (SQUARE_BITS - 15);
    Some(Guess::new(height, centre(x, g[0], k[0]), centre(y, g[1], k[1]), geometry))
}
