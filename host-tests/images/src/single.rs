//! Contact from a single tactile image; the firmware spreads this over frames.
//!
//! [`contact::Fit`](fingertip::contact::Fit) spreads a refinement over frames. Here all of it is done with one image,
//! from a start in closed form: slower, and more exact. It is a reference for the fit; the study has its cost.

use fingertip::config::{Geometry, Shaped};
use fingertip::contact::parts::{
    CENTRE_BITS, Comparison, Divisor, Equations, Guess, Misfit, ONE, PEAK_BITS, PLACE_BITS, PeakScale, Prediction,
    SLOPE_BITS, SQUARE_BITS, ScaledImage, TAXELS_MIN, between, clamp_to, confidence, covers, high, interval, root,
};
use fingertip::contact::{Contact, from_sums};
use fingertip::pressure::TactileImage;

/// Number of refinements of the reading.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Refined {
    One,
    /// Twice, the second time with the rim worked out closely.
    Two,
    /// Until it rests, at most [`Refined::STEPS_MAX`] times, with the rim worked out closely.
    Full,
}

impl Refined {
    /// All of them, least first.
    pub const ALL: [Self; 3] = [Self::One, Self::Two, Self::Full];
    /// Refinements of [`Refined::Full`] at most.
    pub const STEPS_MAX: u32 = 6;

    /// Refinements with the close rim, after the quick one.
    const fn close_steps(self) -> u32 {
        match self {
            Self::One => 0,
            Self::Two => 1,
            Self::Full => Self::STEPS_MAX - 1,
        }
    }
}

/// A first step that moves farther than this, Q24 of the radius, is followed by another: 1/128.
const FAR: u32 = 1 << (CENTRE_BITS - 7);
/// Steps shorter than this end the refinement: 1/16384 of the radius.
const RESTS: u32 = 1 << (CENTRE_BITS - 14);

/// Reads the contact of a single tactile image. Any image is accepted.
///
/// The sum decides whether there is a contact. A contact whose rim lies on the array, with no bad taxel in it, keeps
/// the sum's force and centre; the model then only gives the confidence. So does a contact that the model explains with
/// no confidence at all.
pub fn read<const ROWS: usize, const COLUMNS: usize>(
    picture: &TactileImage<ROWS, COLUMNS>,
    refined: Refined,
    config: &Shaped<ROWS, COLUMNS>,
) -> Contact {
    let sums = from_sums(picture, config);
    let geometry = &config.geometry;
    if sums.force < config.contact_off {
        return sums;
    }
    let Some(scale) = PeakScale::new(picture.peak, geometry) else {
        return sums;
    };
    let view = ScaledImage { picture, scale: &scale };
    let guess = Guess::from_lengths(sums.indentation, sums.centre_x, sums.centre_y, geometry);
    if covers(&sums, picture, config) {
        let confidence = confidence::<ROWS, COLUMNS>(&misfit(&guess, &view, config), &scale);
        return Contact { confidence, ..sums };
    }
    let guess = refine(plane(&view, config).unwrap_or(guess), refined, &view, config);
    let misfit = misfit(&guess, &view, config);
    let confidence = confidence::<ROWS, COLUMNS>(&misfit, &scale);
    if misfit.taxels < TAXELS_MIN || confidence == 0 {
        return Contact { confidence, ..sums };
    }
    let indentation = guess.indentation(&config.tip);
    let [centre_x, centre_y] = guess.centre(&config.tip);
    Contact {
        force: config.tip.force(indentation),
        indentation,
        centre_x,
        centre_y,
        radius: config.tip.contact_radius(indentation),
        confidence,
        ..sums
    }
}

/// Difference between a guess and the tactile image.
fn misfit<const ROWS: usize, const COLUMNS: usize>(
    guess: &Guess,
    view: &ScaledImage<ROWS, COLUMNS>,
    config: &Shaped<ROWS, COLUMNS>,
) -> Misfit {
    let mut misfit = Misfit::NONE;
    let prediction = &Prediction::new(guess, view.scale, config);
    let comparison = Comparison { prediction, view, geometry: &config.geometry };
    (0..ROWS).for_each(|row| misfit.compare_row(comparison, row));
    misfit
}

/// Refines a guess the requested number of times.
fn refine<const ROWS: usize, const COLUMNS: usize>(
    start: Guess,
    refined: Refined,
    view: &ScaledImage<ROWS, COLUMNS>,
    config: &Shaped<ROWS, COLUMNS>,
) -> Guess {
    let (mut guess, far) = step(start, false, view, config);
    // With few taxels the start can be far off, and a second step takes little time.
    if far > FAR {
        (guess, _) = step(guess, false, view, config);
    }
    for _ in 0..refined.close_steps() {
        let (next, moved) = step(guess, true, view, config);
        guess = next;
        if moved < RESTS {
            break;
        }
    }
    guess
}

/// A refinement of all rows, and the largest change of a coordinate, Q24.
fn step<const ROWS: usize, const COLUMNS: usize>(
    guess: Guess,
    closely: bool,
    view: &ScaledImage<ROWS, COLUMNS>,
    config: &Shaped<ROWS, COLUMNS>,
) -> (Guess, u32) {
    let geometry = &config.geometry;
    let prediction = &Prediction::new(&guess, view.scale, config);
    let comparison = Comparison { prediction, view, geometry };
    let mut equations = Equations::<ROWS, COLUMNS>::NONE;
    if closely {
        let rim = Rim::new(&guess, view.scale, geometry);
        for row in 0..ROWS {
            equations.take_row_by(comparison, row, |model, (square, place)| {
                if square >= prediction.inside {
                    model.pressure = rim.pressure(place);
                }
                noise_weight(model.pressure)
            });
        }
    } else {
        (0..ROWS).for_each(|row| equations.take_row(comparison, row));
    }
    let next = equations.solve(&guess, view.scale, geometry);
    let height = (guess.height >> (SQUARE_BITS - CENTRE_BITS)).abs_diff(next.height >> (SQUARE_BITS - CENTRE_BITS));
    (next, height.max(guess.x.abs_diff(next.x)).max(guess.y.abs_diff(next.y)))
}

/// The weight of the close model, for errors in proportion to the reading: `(1 + 4 p)^-2` for a share p of the peak,
/// from 1 to 1/25, Q13.
fn noise_weight(pressure: i32) -> i32 {
    let quarter = 1 << (PEAK_BITS - 2);
    let ratio = (quarter << SLOPE_BITS) / (pressure.clamp(0, 1 << PEAK_BITS) + quarter);
    (ratio * ratio) >> SLOPE_BITS
}

// Taxels under the rim, computed more exactly: two lines across the taxel, each cut at the rim.
//
// The mean over the squared distance's spread, which the firmware's model uses, ignores the direction; its error is up
// to half a percent of the peak for a taxel under the rim. Here the taxel is cut by two Gauss lines along its steeper
// direction, and the part of each line inside the contact has two Gauss points.

/// 1/sqrt(3), Q15: Gauss points on -1 to 1.
const GAUSS: i32 = 18_919;
/// Shift from the square of a place to the format of squared distances, bits.
const TO_SQUARE: u32 = 2 * PLACE_BITS - SQUARE_BITS;

/// A guess worked out for the taxels under its rim.
struct Rim<'a> {
    geometry: &'a Geometry,
    height: i32,
    rim_square: i32,
    /// Half of a taxel's side, Q15.
    half: i32,
    /// Gauss points of a side from its middle, Q15.
    line: i32,
    /// Puts the largest strain's top bit at 31.
    lift: u32,
    /// Modulus in shares of the peak over the taxel's side, with `scale_shift`.
    scale: u32,
    scale_shift: u32,
}

impl<'a> Rim<'a> {
    fn new(guess: &Guess, scale: &PeakScale, geometry: &'a Geometry) -> Self {
        let half = (geometry.pitch >> (SQUARE_BITS - PLACE_BITS + 1)).max(1);
        let lift = (ONE - guess.height).leading_zeros();
        Self {
            geometry,
            height: guess.height,
            rim_square: guess.rim_square(),
            half,
            line: (half * GAUSS) >> 15,
            lift,
            scale: (scale.modulus.unsigned_abs() << scale.modulus_shift) / half.unsigned_abs(),
            scale_shift: scale.modulus_shift,
        }
    }

    /// Mean pressure on the taxel at a place from the centre, both in Q15, as a share of the peak in Q14.
    fn pressure(&self, place: [i32; 2]) -> i32 {
        let [dx, dy] = place.map(i32::abs);
        let (along, across) = if dx < dy { (dy, dx) } else { (dx, dy) };
        let sum = self.chord(along, across - self.line) + self.chord(along, across + self.line);
        // Strain in Q(12 + lift), length in Q15, two lines of two points each; the side is twice `half`.
        ((u64::from(sum) * u64::from(self.scale)) >> (11 + self.lift + self.scale_shift)) as i32
    }

    /// Strain times length, twice its mean, over the part of a line that lies inside.
    #[inline]
    fn chord(&self, along: i32, across: i32) -> u32 {
        let across_square = (across * across) >> TO_SQUARE;
        let left = self.rim_square - across_square;
        if left <= 0 {
            return 0;
        }
        // The root of Q30 is Q15.
        let reach = root(left.unsigned_abs() << TO_SQUARE) as i32;
        let near = (along - self.half).max(-reach);
        let far = (along + self.half).min(reach);
        if far <= near {
            return 0;
        }
        let (middle, part) = ((near + far) >> 1, ((far - near) * GAUSS) >> 16);
        let strains = self.strain(middle - part, across_square) + self.strain(middle + part, across_square);
        ((u64::from(strains) * u64::from((far - near).unsigned_abs())) >> 4) as u32
    }

    /// (L - s) / L, Q(12 + lift).
    #[inline]
    fn strain(&self, along: i32, across_square: i32) -> u32 {
        let square = (((along * along) >> TO_SQUARE) + across_square).unsigned_abs();
        let ([low, up], share) = interval(&self.geometry.nodes, square);
        let length = between(low.length, up.length, share);
        let compressed = (length - self.height).max(0).unsigned_abs();
        (compressed << self.lift) / (length >> 12).max(1).unsigned_abs()
    }
}

// A first guess in closed form, good wherever the contact's centre is, on the array or off it.
//
// Inside the contact `1 - r^2 = s^2 z` with `z = 1 / (1 - p/Y)^2`: z falls with the squared distance, and its slope
// points to the centre. A plane through z over the taxels, weighted with their pressure, gives a mean m and a slope g
// at the taxels' own middle c. With D = c - r0, V the mean of `|c_i - c|^2 + h^2/6` and k the slope of that square (0
// for a symmetric set of taxels), the paper's model says `s^2 g = -k - 2 D` and `s^2 m = 1 - V - D^2`: a quadratic
// equation for s^2, and then D.

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
fn plane<const ROWS: usize, const COLUMNS: usize>(
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
