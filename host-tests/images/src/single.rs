//! Contact from a single tactile image; the firmware spreads this over frames.
//!
//! [`contact::Fit`](fingertip::contact::Fit) spreads a refinement over frames. Here all of it is done with one image,
//! from a start in closed form: slower, and more exact. It is a reference for the fit; the study has its cost.

mod rim;
mod start;

use fingertip::config::Shaped;
use fingertip::contact::parts::{
    CENTRE_BITS, Comparison, Equations, Guess, Misfit, PEAK_BITS, PeakScale, Prediction, SLOPE_BITS, SQUARE_BITS,
    ScaledImage, TAXELS_MIN, confidence, covers,
};
use fingertip::contact::{Contact, from_sums};
use fingertip::pressure::TactileImage;
use rim::Rim;

/// Number of refinements of the reading.
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
    let view = ScaledImage { picture, scale };
    let guess = Guess::from_lengths(sums.indentation, sums.centre_x, sums.centre_y, geometry);
    if covers(&sums, picture, config) {
        let confidence = confidence::<ROWS, COLUMNS>(&misfit(&guess, &view, config), &scale);
        return Contact { confidence, ..sums };
    }
    let guess = refine(start::plane(&view, config).unwrap_or(guess), refined, &view, config);
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
    let prediction = &Prediction::new(guess, &view.scale, config);
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
    let prediction = &Prediction::new(&guess, &view.scale, config);
    let comparison = Comparison { prediction, view, geometry };
    let mut equations = Equations::<ROWS, COLUMNS>::NONE;
    if closely {
        let rim = Rim::new(&guess, &view.scale, geometry);
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
    let next = equations.solve(&guess, &view.scale, geometry);
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
