//! The picture to a contact: total force, centre, indentation and radius, and how far the picture is a contact at all.
//!
//! Where the array sees the whole contact, the sum of the taxels is its force and their moments are its centre. Where
//! it does not, because the contact reaches over the array's edge or over a bad taxel, the paper's model is fitted to
//! the taxels that do see it: by [`Fit`] from frame to frame, by [`read`] from one picture. `docs/contact.md` gives the
//! method and the measured errors.

mod arith;
mod doubt;
mod fit_level;
mod fitted;
mod follow;
mod guess;
mod reading;
mod rim;
mod start;
mod step;
mod sums;
mod view;

pub use fit_level::FitLevel;
pub use follow::Fit;
pub use reading::Contact;
pub use sums::from_sums;

use crate::config::geometry::SQUARE_BITS;
use crate::config::{Config, Shaped};
use crate::pressure::Picture;
use guess::{CENTRE_BITS, Guess, Prediction};
use rim::Rim;
use step::{Bits, Comparison, Equations, Misfit, Taxels};
use view::{Scale, View};

/// How often the reading of a single picture is refined. What the loop does from frame to frame is its [`FitLevel`].
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Refined {
    /// Once.
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

    /// Refinements with the quick rim and then with the close one.
    const fn steps(self) -> (u32, u32) {
        match self {
            Self::One => (1, 0),
            Self::Two => (1, 1),
            Self::Full => (1, Self::STEPS_MAX - 1),
        }
    }
}

/// A contact with less confidence than this is not a hemisphere on a plane.
pub const CONFIDENCE_LEAST: u8 = 128;
/// Root mean square residual, as a share of the peak in Q14, at which confidence reaches 0: 2.8 %.
const RESIDUAL_MAX: u32 = 459;
/// A first step that moves farther than this, Q24 of the radius, is followed by another: 1/128.
const FAR: u32 = 1 << (CENTRE_BITS - 7);
/// Steps shorter than this end the refinement: 1/16384 of the radius.
const RESTS: u32 = 1 << (CENTRE_BITS - 14);
/// Where the sum is more than this many peaks, a single refinement looks at every other taxel.
const LARGE: i32 = 16;
/// Fewer live taxels than this within the contact cannot hold the model's three unknowns against noise.
const TAXELS_MIN: i32 = 5;

/// Reads the contact of a single picture. Any picture is taken.
///
/// The sum decides whether there is a contact. A contact whose rim lies on the array, with no bad taxel in it, keeps
/// the sum's force and centre; the model then only gives the confidence. So does a contact that the model explains with
/// no confidence at all.
pub fn read<const ROWS: usize, const COLUMNS: usize>(
    picture: &Picture<ROWS, COLUMNS>,
    refined: Refined,
    config: &Shaped<ROWS, COLUMNS>,
) -> Contact {
    let sums = from_sums(picture, config);
    let geometry = &config.geometry;
    if sums.force < config.contact_off {
        return sums;
    }
    let Some(scale) = Scale::new(picture.peak, geometry) else {
        return sums;
    };
    let view = View { picture, scale };
    // The sum over the peak is about half of the number of taxels that see the contact.
    let which = if refined == Refined::One && picture.sum / LARGE > picture.peak { Taxels::HALF } else { Taxels::ALL };
    let guess = Guess::from_lengths(sums.indentation, sums.centre_x, sums.centre_y, geometry);
    if covers(&sums, picture, config) {
        return Contact {
            confidence: confidence::<ROWS, COLUMNS>(&misfit(&guess, which, &view, config), &scale),
            ..sums
        };
    }
    let start = start::plane(&view, which, geometry).unwrap_or(guess);
    let guess = refine(start, refined, which, &view, config);
    let misfit = misfit(&guess, which, &view, config);
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

/// How far a guess and the picture are apart.
fn misfit<const ROWS: usize, const COLUMNS: usize>(
    guess: &Guess,
    which: Taxels,
    view: &View<ROWS, COLUMNS>,
    config: &Shaped<ROWS, COLUMNS>,
) -> Misfit {
    let mut misfit = Misfit::NONE;
    misfit.compare(
        Comparison { prediction: &Prediction::new(guess, &view.scale, config), view, geometry: &config.geometry },
        which,
    );
    misfit
}

/// How far a contact reaches over the array's edge; below 0 where it does not. In 2^-20 mm: 24 bits hold 128 mm, half a
/// unit of these is 8 nm, and nothing overflows.
fn overhang<const ROWS: usize, const COLUMNS: usize>(contact: &Contact, config: &Config) -> i32 {
    let [x, y, radius, half_pitch] =
        [contact.centre_x, contact.centre_y, contact.radius, config.half_pitch].map(|length| length.to_bits() >> 4);
    let [x, y] = [x.abs(), y.abs()];
    // The sides of a square are equally far: only for it the farther coordinate decides.
    if ROWS == COLUMNS {
        return x.max(y) + radius - COLUMNS as i32 * half_pitch;
    }
    (x - COLUMNS as i32 * half_pitch).max(y - ROWS as i32 * half_pitch) + radius
}

/// Whether the whole contact lies on good taxels of the array.
fn covers<const ROWS: usize, const COLUMNS: usize>(
    contact: &Contact,
    picture: &Picture<ROWS, COLUMNS>,
    config: &Config,
) -> bool {
    overhang::<ROWS, COLUMNS>(contact, config) <= 0 && !hides(contact, picture, config)
}

/// Whether a bad taxel hides a part of a contact.
fn hides<const ROWS: usize, const COLUMNS: usize>(
    contact: &Contact,
    picture: &Picture<ROWS, COLUMNS>,
    config: &Config,
) -> bool {
    if picture.bad.iter().all(|bad| *bad == 0) {
        return false;
    }
    let [x, y, radius, half_pitch] =
        [contact.centre_x, contact.centre_y, contact.radius, config.half_pitch].map(|length| length.to_bits() >> 4);
    // A bad taxel whose middle is nearer than the rim and half of its own diagonal may hide pressure.
    let reach = radius + half_pitch + (half_pitch >> 1);
    for (row, bad) in picture.bad.iter().enumerate() {
        let mut left = *bad;
        let dy = (2 * row as i32 + 1 - ROWS as i32) * half_pitch - y;
        while left != 0 {
            let dx = (2 * left.trailing_zeros() as i32 + 1 - COLUMNS as i32) * half_pitch - x;
            if i64::from(dx) * i64::from(dx) + i64::from(dy) * i64::from(dy) < i64::from(reach) * i64::from(reach) {
                return true;
            }
            left &= left - 1;
        }
    }
    false
}

/// Refines a guess as often as asked for.
fn refine<const ROWS: usize, const COLUMNS: usize>(
    start: Guess,
    refined: Refined,
    which: Taxels,
    view: &View<ROWS, COLUMNS>,
    config: &Shaped<ROWS, COLUMNS>,
) -> Guess {
    let geometry = &config.geometry;
    let (mut quick, mut close) = refined.steps();
    let mut guess = start;
    let mut again = true;
    while quick + close > 0 {
        let comparison = Comparison { prediction: &Prediction::new(&guess, &view.scale, config), view, geometry };
        let mut equations = Equations::<ROWS, COLUMNS>::NONE;
        if quick > 0 {
            equations.take(comparison, which);
        } else {
            equations.take_closely(comparison, &Rim::new(&guess, &view.scale, geometry));
        }
        let next = equations.solve(&guess, &view.scale, geometry);
        let moved = distance(&guess, &next);
        guess = next;
        if quick > 0 {
            // A start from few taxels can be far off; few taxels are also quick.
            if moved > FAR && again {
                again = false;
            } else {
                quick -= 1;
            }
        } else {
            close -= 1;
            if moved < RESTS {
                break;
            }
        }
    }
    guess
}

/// The largest change of a coordinate, Q24.
fn distance(from: &Guess, to: &Guess) -> u32 {
    let height = (from.height >> (SQUARE_BITS - CENTRE_BITS)).abs_diff(to.height >> (SQUARE_BITS - CENTRE_BITS));
    height.max(from.x.abs_diff(to.x)).max(from.y.abs_diff(to.y))
}

/// 255 at no residual, falling to 0 at [`RESIDUAL_MAX`]; what the converter's steps leave does not count.
fn confidence<const ROWS: usize, const COLUMNS: usize>(misfit: &Misfit, scale: &Scale) -> u8 {
    let mean = |squares: i32, taxels: i32| squares.max(0).unsigned_abs() / taxels.max(1).unsigned_abs();
    // Squares count fewer bits than a share's square.
    let drop = Bits::<ROWS, COLUMNS>::ALL;
    let larger = mean(misfit.inside, misfit.taxels).max(mean(misfit.outside, misfit.others));
    let mean = larger.min(u32::MAX >> drop) << drop;
    let residual = arith::root(mean.saturating_sub(scale.converter_square()));
    (255 - (residual * 255 / RESIDUAL_MAX).min(255)) as u8
}
