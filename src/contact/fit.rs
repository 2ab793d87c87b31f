//! A contact followed from frame to frame, with little work in each.
//!
//! A refinement is spread over frames: it begins in a separate frame, takes each row of the array once, as many
//! rows in a frame as the fit level allows, and is solved with the last of them. Its result is the ratio of the
//! contact's force to the sum of the taxels over those frames: 1 if the array sees all of the contact. The ratio
//! changes slowly, while the sum follows every frame. So the force is the sum times the last ratio, as quick as the
//! sum itself.

use super::equations::{Comparison, Equations, Guess, PeakScale, Prediction, ScaledImage};
use super::{
    CONFIDENCE_LEAST, Contact, FitLevel, TAXELS_MIN, confidence, contact_of_force, covers, from_sums, hidden, overhang,
};
use crate::arith::{Divisor, clamp_to};
use crate::config::array::ONE;
use crate::config::{Config, Shaped};
use crate::frame::Shape;
use crate::pressure::TactileImage;
use crate::units::{Millimetres, Newtons};
use fixed::types::I16F16;

/// Fractional bits of the ratio of the force to the sum.
const RATIO_BITS: u32 = 16;
/// Number of refinements in a row without any confidence after which the guess is given up. Any contact is found with
/// fewer.
const ASTRAY_MAX: u8 = 12;
/// Number of refinements after which a new start is near a solution. Until then the earlier solution is kept.
const AFRESH: u8 = 4;
/// Least number of live taxels in the model's contact: with fewer, other contacts look the same.
const TAXELS_LEAST: i32 = 8;
/// Number of live taxels below which a new contact must match the model well to count: a wrong one can be several
/// times as large.
const TAXELS_SURE: i32 = 12;
/// Largest ratio: at least a 64th of the force must be seen.
const RATIO_MAX: i32 = 64 << RATIO_BITS;

/// The ratio follows a good match at once, and a poor one by a quarter of the difference: the error of one refinement
/// must not push the finger.
const RATIO_FOLLOWS_BITS: u32 = 2;
/// Difference from 1 below which a ratio counts as 1: 1/64.
const RATIO_SAME: i32 = 1 << (RATIO_BITS - 6);
/// Fractional bits of the slope of the indentation over the force.
const FOLLOWS_BITS: u32 = 12;
/// Largest change of the indentation with the force within a refinement: 1/16 of the radius.
const FOLLOWS_MAX: i32 = ONE / 16;

/// Fit of a contact, between frames.
///
/// ```
/// use fingertip::contact::Fit;
/// use fingertip::params::Params;
/// use fingertip::shipped::{Array, Config, Frame};
///
/// let config = Config::shipped(&Params::DEFAULT)?;
/// let (mut array, mut fit) = (Array::new(), Fit::default());
/// let contact = fit.read(array.read(&Frame::EMPTY, &config), &config);
/// assert_eq!(contact.force.0, 0.0);
/// # Ok::<(), fingertip::config::ConfigError>(())
/// ```
#[derive(Clone, Debug)]
pub struct Fit<const ROWS: usize, const COLUMNS: usize> {
    fit_level: FitLevel,
    at_work: bool,
    /// True once a refinement has begun.
    begun: bool,
    /// Number of frames in the refinement.
    frames: u8,
    /// True if the array saw the whole contact when the refinement began.
    covered: bool,
    /// Guess of the contact.
    guess: Guess,
    /// Prediction of the taxels by the guess.
    prediction: Prediction<ROWS, COLUMNS>,
    /// Scale by the peak when the refinement began.
    scale: PeakScale,
    /// Force by the sum when the refinement began.
    force: Newtons,
    /// Sum of the forces of the refinement's frames, in units of the last place.
    forces: i64,
    /// Slope of the indentation over the force by the sum: d over twice that force.
    follows: i32,
    equations: Equations<ROWS, COLUMNS>,
    /// Pitch of the array in tip radii: another pitch drops the fit.
    pitch: i32,
    confidence: u8,
    /// See [`Contact::doubt`], Q8.
    doubt: u32,
    /// Number of refinements without any confidence since the last one with some.
    astray: u8,
    /// Number of refinements of a new start that do not count yet.
    afresh: u8,
    /// Guess for the next refinement.
    next: Option<Guess>,
    /// Result of the last refinement with some confidence.
    fitted: Option<Fitted>,
}

impl<const ROWS: usize, const COLUMNS: usize> Default for Fit<ROWS, COLUMNS> {
    fn default() -> Self {
        Self::new(FitLevel::default())
    }
}

impl<const ROWS: usize, const COLUMNS: usize> Fit<ROWS, COLUMNS> {
    /// Creates a fit before the first frame.
    pub const fn new(fit_level: FitLevel) -> Self {
        const { Shape::<ROWS, COLUMNS>::CHECKED };
        Self {
            fit_level,
            at_work: false,
            begun: false,
            frames: 0,
            covered: true,
            guess: Guess { height: 0, x: 0, y: 0 },
            prediction: Prediction::NONE,
            scale: PeakScale::NONE,
            force: Newtons::ZERO,
            forces: 0,
            follows: 0,
            equations: Equations::NONE,
            pitch: 0,
            confidence: 255,
            doubt: 0,
            astray: 0,
            afresh: 0,
            next: None,
            fitted: None,
        }
    }

    /// Sets the fit level from the next frame on. A refinement under way starts again; the result of the last one is
    /// kept.
    pub fn set_fit_level(&mut self, fit_level: FitLevel) {
        if fit_level != self.fit_level {
            self.fit_level = fit_level;
            self.begun = false;
        }
    }

    /// Returns true if the last frame used the model.
    pub fn at_work(&self) -> bool {
        self.at_work
    }

    /// Computes the contact of the next frame. Any image is accepted.
    ///
    /// Without a contact, and until a refinement has some confidence, the result is that of [`from_sums`]. Confidence
    /// is that of the last refinement, 255 before the first.
    pub fn read(&mut self, picture: &TactileImage<ROWS, COLUMNS>, config: &Shaped<ROWS, COLUMNS>) -> Contact {
        let force = picture.force(config);
        self.at_work = false;
        // The bound of the sums holds for one table of nodes, which depends on the pitch.
        if self.pitch != config.geometry.pitch {
            self.lose();
            self.pitch = config.geometry.pitch;
        }
        if self.fit_level.rows(ROWS) == 0 || force < config.contact_off {
            self.lose();
            let sums = from_sums(picture, config);
            let doubt = if force < config.contact_off { 0 } else { doubt_of_sums(&sums, picture, config) };
            let centre = [sums.centre_x, sums.centre_y];
            let [centre_x, centre_y] = if self.fit_level == FitLevel::Sum { [Millimetres::ZERO; 2] } else { centre };
            return Contact { doubt, centre_x, centre_y, ..sums };
        }
        // The sums are needed at the beginning of a refinement, and while there is no result.
        let begins = !self.begun;
        let by_sums = begins || self.fitted.is_none();
        let mut contact = if by_sums { from_sums(picture, config) } else { Contact::default() };
        if begins && !self.start(&contact, picture, config) {
            self.lose();
            return contact;
        }
        self.at_work = true;
        // A refinement that is spread over frames starts in a separate frame.
        if !begins || self.fit_level.rows(ROWS) == ROWS {
            self.take(force, picture, config);
            if usize::from(self.frames) * self.fit_level.rows(ROWS) >= ROWS {
                self.refine(force, config);
            }
        }
        if let Some(fitted) = self.fitted {
            contact = fitted.contact(force, picture, config);
        } else if !by_sums {
            // The fit was given up in this frame.
            contact = from_sums(picture, config);
        }
        self.doubt = follow_doubt(self.doubt, self.target_doubt(&contact, picture, config));
        (contact.confidence, contact.doubt) = (self.confidence, (self.doubt >> 8) as u8);
        contact
    }

    /// Begins a refinement. Returns false if the peak is too low for the model.
    fn start(&mut self, sums: &Contact, picture: &TactileImage<ROWS, COLUMNS>, config: &Shaped<ROWS, COLUMNS>) -> bool {
        let Some(scale) = PeakScale::new(picture.peak, &config.geometry) else {
            return false;
        };
        // For a contact that is cut off, the sums' centre lies too far in and their radius is too small: the fit is
        // better.
        self.covered = match self.fitted {
            Some(fitted) => covers(&fitted.contact(sums.force, picture, config), picture, config),
            None => covers(sums, picture, config),
        };
        self.guess = self
            .next
            .unwrap_or_else(|| Guess::from_lengths(sums.indentation, sums.centre_x, sums.centre_y, &config.geometry));
        self.prediction = Prediction::new(&self.guess, &scale, config);
        self.scale = scale;
        (self.begun, self.frames) = (true, 0);
        (self.force, self.forces) = (sums.force, 0);
        self.follows = Divisor::new(2 * u64::from(sums.force.to_bits().unsigned_abs()))
            .divide((ONE - self.guess.height).into(), FOLLOWS_BITS);
        self.equations = Equations::NONE;
        true
    }

    /// Adds the frame's share of the rows.
    fn take(&mut self, force: Newtons, picture: &TactileImage<ROWS, COLUMNS>, config: &Shaped<ROWS, COLUMNS>) {
        let view = ScaledImage { picture, scale: &self.scale };
        self.prediction.height = self.followed(&self.guess, force);
        let comparison = Comparison { prediction: &self.prediction, view: &view, geometry: &config.geometry };
        let (rows, frame) = (self.fit_level.rows(ROWS), usize::from(self.frames));
        let mut row = if rows == 1 { frame * const { row_step(ROWS) } % ROWS } else { frame };
        while row < ROWS {
            if self.covered {
                self.equations.misfit.compare_row(comparison, row);
            } else {
                self.equations.take_row(comparison, row);
            }
            // Each frame takes every n-th row, for n frames.
            row += ROWS.div_ceil(rows.max(1));
        }
        self.forces += i64::from(force.to_bits());
        self.frames += 1;
    }

    /// Distance between the plane and the hemisphere's centre after a change of the sum's force: d is proportional to
    /// the root of the force.
    fn followed(&self, guess: &Guess, force: Newtons) -> i32 {
        // No force is negative, so the difference fits.
        let more = i64::from(force.to_bits().wrapping_sub(self.force.to_bits()));
        guess.height.saturating_sub(clamp_to((more * i64::from(self.follows)) >> FOLLOWS_BITS, FOLLOWS_MAX))
    }

    /// Ends a refinement.
    fn refine(&mut self, force: Newtons, config: &Shaped<ROWS, COLUMNS>) {
        self.begun = false;
        self.confidence = confidence::<ROWS, COLUMNS>(&self.equations.misfit, &self.scale);
        if self.covered {
            self.settle(1 << RATIO_BITS, None);
            return;
        }
        let few = self.equations.misfit.taxels < TAXELS_MIN;
        self.astray = if self.confidence > 0 && !few { 0 } else { self.astray + 1 };
        if few || self.astray > ASTRAY_MAX {
            // Another start may find the contact. The last result is kept meanwhile: the force must not jump.
            (self.next, self.afresh) = (None, AFRESH);
            if self.astray > ASTRAY_MAX {
                self.astray = 0;
                self.fitted = self.fitted.filter(|_| !few);
            }
            return;
        }
        self.afresh = if self.confidence > 0 { 0 } else { self.afresh.saturating_sub(1) };
        let guess = self.equations.solve(&self.guess, &self.scale, &config.geometry);
        self.next = Some(Guess::new(self.followed(&guess, force), guess.x, guess.y, &config.geometry));
        let taxels = self.equations.misfit.taxels;
        let likely = self.confidence >= CONFIDENCE_LEAST || taxels >= TAXELS_SURE;
        if self.afresh == 0 && taxels >= TAXELS_LEAST && (likely || self.fitted.is_some() && self.confidence > 0) {
            // At the mean of the frames, where noise has the least effect.
            let mean = Divisor::new(self.frames.into()).divide(self.forces, 0);
            let height = self.followed(&guess, Newtons::from_bits(mean));
            let mean_guess = Guess::new(height, guess.x, guess.y, &config.geometry);
            let fitted = i64::from(config.tip.force(mean_guess.indentation(&config.tip)).to_bits());
            let ratio = Divisor::new(mean.unsigned_abs().into()).divide(fitted, RATIO_BITS);
            self.settle(ratio.max(1).min(RATIO_MAX), Some(guess.centre(&config.tip)));
        }
    }

    /// Takes a refinement's ratio, and its centre if it has one.
    fn settle(&mut self, ratio: i32, centre: Option<[Millimetres; 2]>) {
        // A force below the sum of the taxels needs a good match.
        let ratio = if self.confidence >= CONFIDENCE_LEAST { ratio } else { ratio.max(1 << RATIO_BITS) };
        match (&mut self.fitted, centre) {
            (Some(fitted), centre) => {
                let way = ratio - fitted.ratio;
                fitted.ratio += if self.confidence >= CONFIDENCE_LEAST { way } else { way >> RATIO_FOLLOWS_BITS };
                fitted.centre = centre.unwrap_or(fitted.centre);
                if self.covered && way.abs() < RATIO_SAME {
                    self.forget();
                }
            }
            (None, Some(centre)) => self.fitted = Some(Fitted { ratio, centre }),
            (None, None) => {}
        }
    }

    /// Uncertainty of the force in this frame.
    fn target_doubt(
        &self,
        contact: &Contact,
        picture: &TactileImage<ROWS, COLUMNS>,
        config: &Shaped<ROWS, COLUMNS>,
    ) -> u8 {
        match self.fitted {
            _ if self.covered => 0,
            Some(fitted) => doubt_of_fit(fitted.ratio, self.confidence),
            None => doubt_of_sums(contact, picture, config),
        }
    }

    /// Drops the fit: there is no contact, none that the model can describe, or another model.
    pub(crate) fn lose(&mut self) {
        self.forget();
        (self.begun, self.confidence, self.doubt) = (false, 255, 0);
    }

    /// Drops the result, so that the sums count.
    fn forget(&mut self) {
        (self.next, self.fitted, self.astray, self.afresh) = (None, None, 0, 0);
    }
}

/// Step from row to row if a frame takes one row, so that a change during the refinement is not taken for a slope:
/// three, or the next number without a common divisor with the number of rows, so that the steps visit each row once.
const fn row_step(rows: usize) -> usize {
    let mut step = 3;
    while divisor(step, rows) != 1 {
        step += 1;
    }
    step
}

/// Returns the largest common divisor.
const fn divisor(a: usize, b: usize) -> usize {
    if b == 0 { a } else { divisor(b, a % b) }
}

/// Result of a refinement for a contact of which the array sees a part.
#[derive(Clone, Copy, Debug)]
struct Fitted {
    /// Ratio of the force to the sum.
    ratio: i32,
    /// Centre of pressure, from the array's middle.
    centre: [Millimetres; 2],
}

impl Fitted {
    /// Returns the contact for a force by the sum.
    fn contact<const ROWS: usize, const COLUMNS: usize>(
        self,
        force: Newtons,
        picture: &TactileImage<ROWS, COLUMNS>,
        config: &Config,
    ) -> Contact {
        let wide = (i64::from(force.to_bits()) * i64::from(self.ratio)) >> RATIO_BITS;
        let force = Newtons(I16F16::from_bits(wide.min(i64::from(i32::MAX)) as i32));
        contact_of_force(force, self.centre, picture, config)
    }
}

/// Ratios of the force to the sum between which the uncertainty of a poor match rises: from a fifth of the force
/// hidden to two fifths.
const RATIO_DOUBTED: [i32; 2] = [(5 << RATIO_BITS) / 4, (7 << RATIO_BITS) / 4];
/// Shares of the force hidden by bad taxels, Q8, between which the uncertainty of the sums rises.
const HIDDEN: [i32; 2] = [1 << 5, 1 << 7];
/// Confidences between which a fit becomes a good match.
const CONFIDENCE: [i32; 2] = [96, 160];

/// Uncertainty of a fit. While little is hidden, any fit is good enough; while much is hidden, only a good match
/// shows how much.
fn doubt_of_fit(ratio: i32, confidence: u8) -> u8 {
    let hidden = ramp(ratio, RATIO_DOUBTED);
    let unlike = u8::MAX - ramp(confidence.into(), CONFIDENCE);
    ((u32::from(hidden) * (u32::from(unlike) + 1)) >> 8) as u8
}

/// Uncertainty of the sums: 0 while the rim is within half a pitch of the edge, full from a pitch and a half on; 0
/// while bad taxels hide an eighth of the force, full if they hide half of it.
fn doubt_of_sums<const ROWS: usize, const COLUMNS: usize>(
    sums: &Contact,
    picture: &TactileImage<ROWS, COLUMNS>,
    config: &Config,
) -> u8 {
    let hidden = ramp(hidden(sums, picture, config).unwrap_or(0).cast_signed(), HIDDEN);
    let half_pitch = config.half_pitch.to_bits() >> 4;
    hidden.max(ramp(overhang::<ROWS, COLUMNS>(sums, config), [half_pitch, 3 * half_pitch]))
}

/// Moves the uncertainty, Q8, towards its target: up within about 8 frames, down within about 64. The loop uses it,
/// so it must not jump when a rim touches the array's edge.
fn follow_doubt(doubt: u32, target: u8) -> u32 {
    let target = u32::from(target) << 8;
    if target > doubt { doubt + (target - doubt).div_ceil(8) } else { doubt - (doubt - target).div_ceil(64) }
}

/// Returns 0 up to `from`, 255 from `to` on, and a line between.
fn ramp(value: i32, [from, to]: [i32; 2]) -> u8 {
    let way = i64::from(value.max(from).min(to)) - i64::from(from);
    (way * 255 / (i64::from(to) - i64::from(from)).max(1)) as u8
}

#[cfg(test)]
mod tests {
    use super::{FitLevel, divisor, row_step};

    #[test]
    fn every_row_comes_once() {
        assert_eq!([3, 4, 8, 9, 10, 15, 16].map(row_step), [4, 3, 3, 4, 3, 4, 3]);
        for rows in 3..=16 {
            assert_eq!(divisor(row_step(rows), rows), 1);
            let mut seen: std::vec::Vec<_> = (0..rows).map(|frame| frame * row_step(rows) % rows).collect();
            seen.sort_unstable();
            assert!(seen.into_iter().eq(0..rows));
            for fit_level in [FitLevel::TwoRows, FitLevel::FiveRows, FitLevel::AllRows] {
                let most = fit_level.rows(rows);
                let frames = (1..).find(|frames| frames * most >= rows).unwrap();
                let stride = rows.div_ceil(most);
                assert_eq!(frames, stride);
                let taken = |frame: usize| (frame..rows).step_by(stride);
                assert!((0..frames).all(|frame| (1..=most).contains(&taken(frame).count())));
                assert_eq!((0..frames).flat_map(taken).count(), rows);
            }
        }
    }
}
