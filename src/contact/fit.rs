//! A contact followed from frame to frame, with little work in each.
//!
//! A refinement is spread over frames: it begins in a frame of its own, each row of the array is then taken once, so
//! many in a frame as the fit level says, and the solution comes with the last of them. What it tells is how many times
//! larger the contact's force is than the sum of the taxels over those frames: 1 where the array sees all of it. That
//! ratio changes slowly, while the sum follows every frame. So the force is the sum times the last ratio, as quick as
//! the sum itself.

use super::equations::{Comparison, Equations};
use super::prediction::{Guess, Prediction, Scale, View};
use super::{
    CONFIDENCE_LEAST, Contact, FitLevel, TAXELS_MIN, confidence, contact_of_force, covers, from_sums, hidden, overhang,
};
use crate::arith::{Divisor, clamp_to};
use crate::config::array::ONE;
use crate::config::{Config, Shaped};
use crate::frame::Shape;
use crate::pressure::Picture;
use crate::units::{Millimetres, Newtons};
use fixed::types::I16F16;

/// Fractional bits of the ratio of the force to the sum.
const RATIO_BITS: u32 = 16;
/// Refinements in a row without any confidence after which the guess is given up: more than any contact needs to be
/// found.
const ASTRAY_MAX: u8 = 12;
/// Refinements after which a new start is near a solution: until then what was found before counts.
const AFRESH: u8 = 4;
/// With fewer live taxels than this in the model's contact there are other contacts that look the same.
const TAXELS_LEAST: i32 = 8;
/// With fewer, a contact that was not there before must be a good likeness to count: a wrong one can be several times
/// as large.
const TAXELS_SURE: i32 = 12;
/// The largest ratio: at least a 64th of the force must be seen.
const RATIO_MAX: i32 = 64 << RATIO_BITS;

/// The ratio follows a good likeness at once, another by a quarter of the way: what one of them gets wrong must not
/// push the finger.
const RATIO_FOLLOWS_BITS: u32 = 2;
/// A ratio this near to 1 is 1: 1/64.
const RATIO_SAME: i32 = 1 << (RATIO_BITS - 6);
/// Fractional bits of what the indentation follows the force by.
const FOLLOWS_BITS: u32 = 12;
/// The farthest that the indentation follows the force within a refinement: 1/16 of the radius.
const FOLLOWS_MAX: i32 = ONE / 16;

/// A contact's fit between frames.
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
    /// Whether a refinement has begun.
    begun: bool,
    /// Frames taken in since then.
    frames: u8,
    /// Whether the array sees the whole contact, as at the beginning.
    covered: bool,
    /// The contact supposed.
    guess: Guess,
    /// The same, worked out for the taxels.
    prediction: Prediction<ROWS, COLUMNS>,
    /// By the peak at the beginning.
    scale: Scale,
    /// The sum's force at the beginning.
    force: Newtons,
    /// Over all frames taken in, in its smallest units.
    forces: i64,
    /// How far the indentation follows the sum's force: d over twice that force.
    follows: i32,
    equations: Equations<ROWS, COLUMNS>,
    /// Of the array that all this was found on, in tip radii.
    pitch: i32,
    confidence: u8,
    /// See [`Contact::doubt`], Q8.
    doubt: u32,
    /// Refinements without any confidence since the last that had some.
    astray: u8,
    /// Refinements of a new start that do not count yet.
    afresh: u8,
    /// What the last refinement made of the guess.
    next: Option<Guess>,
    /// What the last refinement with some confidence says.
    fitted: Option<Fitted>,
}

impl<const ROWS: usize, const COLUMNS: usize> Default for Fit<ROWS, COLUMNS> {
    fn default() -> Self {
        Self::new(FitLevel::default())
    }
}

impl<const ROWS: usize, const COLUMNS: usize> Fit<ROWS, COLUMNS> {
    /// Nothing seen yet.
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
            scale: Scale::NONE,
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

    /// From the next frame on. A refinement under way is begun anew; what the last one found stays.
    pub fn set_fit_level(&mut self, fit_level: FitLevel) {
        if fit_level != self.fit_level {
            self.fit_level = fit_level;
            self.begun = false;
        }
    }

    /// Whether the last frame took the model.
    pub fn at_work(&self) -> bool {
        self.at_work
    }

    /// Reads the next frame's contact. Any picture is taken.
    ///
    /// Without a contact, and until a refinement of one has some confidence, it is what [`from_sums`] says. Confidence
    /// is that of the last refinement, 255 before the first.
    pub fn read(&mut self, picture: &Picture<ROWS, COLUMNS>, config: &Shaped<ROWS, COLUMNS>) -> Contact {
        let force = picture.force(config);
        self.at_work = false;
        // The sums' bound holds for one table of nodes, which is the pitch's.
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
        // At the beginning, and while the sums are all there is.
        let begins = !self.begun;
        let sums = (begins || self.fitted.is_none()).then(|| from_sums(picture, config));
        if let (true, Some(sums)) = (begins, &sums)
            && !self.start(sums, picture, config)
        {
            self.lose();
            return *sums;
        }
        self.at_work = true;
        // The start has a frame of its own, where a refinement is spread over frames.
        if !begins || self.fit_level.rows(ROWS) == ROWS {
            self.take(force, picture, config);
            if usize::from(self.frames) * self.fit_level.rows(ROWS) >= ROWS {
                self.refine(force, config);
            }
        }
        let contact = match (self.fitted, sums) {
            (Some(fitted), _) => fitted.contact(force, picture, config),
            (None, Some(sums)) => sums,
            // A fit given up in this frame.
            (None, None) => from_sums(picture, config),
        };
        self.doubt = follow_doubt(self.doubt, self.target_doubt(&contact, picture, config));
        Contact { confidence: self.confidence, doubt: (self.doubt >> 8) as u8, ..contact }
    }

    /// Begins a refinement. False where the peak is too low for the model.
    fn start(&mut self, sums: &Contact, picture: &Picture<ROWS, COLUMNS>, config: &Shaped<ROWS, COLUMNS>) -> bool {
        let Some(scale) = Scale::new(picture.peak, &config.geometry) else {
            return false;
        };
        // Where a contact is cut off, the sums' centre lies too far in, and their radius is too small: the fit knows
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

    /// Takes in the frame's share of the rows.
    fn take(&mut self, force: Newtons, picture: &Picture<ROWS, COLUMNS>, config: &Shaped<ROWS, COLUMNS>) {
        let view = View { picture, scale: self.scale };
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
            // As many frames as it takes: a row of every so many.
            row += ROWS.div_ceil(rows.max(1));
        }
        self.forces += i64::from(force.to_bits());
        self.frames += 1;
    }

    /// What is left between the plane and the hemisphere's centre, where the sum's force has become this one: d goes
    /// with the root of the force.
    fn followed(&self, guess: &Guess, force: Newtons) -> i32 {
        let more = i64::from(force.to_bits()) - i64::from(self.force.to_bits());
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
            // Another start may find it. What was found before is kept meanwhile: the force must not jump.
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
            // At the mean of the frames, where noise counts least.
            let mean = Divisor::new(self.frames.into()).divide(self.forces, 0);
            let height = self.followed(&guess, Newtons::from_bits(mean));
            let mean_guess = Guess::new(height, guess.x, guess.y, &config.geometry);
            let fitted = i64::from(config.tip.force(mean_guess.indentation(&config.tip)).to_bits());
            let ratio = Divisor::new(mean.unsigned_abs().into()).divide(fitted, RATIO_BITS);
            self.settle(ratio.max(1).min(RATIO_MAX), Some(guess.centre(&config.tip)));
        }
    }

    /// Takes a refinement's ratio, and its centre where it has one.
    fn settle(&mut self, ratio: i32, centre: Option<[Millimetres; 2]>) {
        // Less than what the taxels carry is no force to press for: only a good likeness may say so.
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

    /// How far the force is known only from below in this frame.
    fn target_doubt(&self, contact: &Contact, picture: &Picture<ROWS, COLUMNS>, config: &Shaped<ROWS, COLUMNS>) -> u8 {
        match self.fitted {
            _ if self.covered => 0,
            Some(fitted) => doubt_of_fit(fitted.ratio, self.confidence),
            None => doubt_of_sums(contact, picture, config),
        }
    }

    /// No contact, none that the model can say anything of, or another model.
    pub(crate) fn lose(&mut self) {
        self.forget();
        (self.begun, self.confidence, self.doubt) = (false, 255, 0);
    }

    /// Back to the sums.
    fn forget(&mut self) {
        (self.next, self.fitted, self.astray, self.afresh) = (None, None, 0, 0);
    }
}

/// A row a frame is taken in steps of so many rows, so that what changes meanwhile is not taken for a slope: three, or
/// the next number that shares no divisor with the number of rows, so that the steps come to each of them once.
const fn row_step(rows: usize) -> usize {
    let mut step = 3;
    while divisor(step, rows) != 1 {
        step += 1;
    }
    step
}

/// The largest divisor of both.
const fn divisor(a: usize, b: usize) -> usize {
    if b == 0 { a } else { divisor(b, a % b) }
}

/// A contact of which the array sees a part.
#[derive(Clone, Copy, Debug)]
struct Fitted {
    /// Of the force to the sum.
    ratio: i32,
    /// Of pressure, from the array's middle.
    centre: [Millimetres; 2],
}

impl Fitted {
    /// The contact, where the sum makes this force.
    fn contact<const ROWS: usize, const COLUMNS: usize>(
        self,
        force: Newtons,
        picture: &Picture<ROWS, COLUMNS>,
        config: &Config,
    ) -> Contact {
        let wide = (i64::from(force.to_bits()) * i64::from(self.ratio)) >> RATIO_BITS;
        let force = Newtons(I16F16::from_bits(wide.min(i64::from(i32::MAX)) as i32));
        contact_of_force(force, self.centre, picture, config)
    }
}

/// Ratios of the force to the sum between which a doubtful fit is doubted: from a fifth of the force hidden to two
/// fifths.
const RATIO_DOUBTED: [i32; 2] = [(5 << RATIO_BITS) / 4, (7 << RATIO_BITS) / 4];
/// Shares of the force hidden by bad taxels, Q8, between which the sums are doubted.
const HIDDEN: [i32; 2] = [1 << 5, 1 << 7];
/// Confidences between which a fit is a good likeness.
const CONFIDENCE: [i32; 2] = [96, 160];

/// Of a fit. Where little is hidden, any fit does; where much is, only a good likeness says how much.
fn doubt_of_fit(ratio: i32, confidence: u8) -> u8 {
    let hidden = ramp(ratio, RATIO_DOUBTED);
    let unlike = u8::MAX - ramp(confidence.into(), CONFIDENCE);
    ((u32::from(hidden) * (u32::from(unlike) + 1)) >> 8) as u8
}

/// Of the sums: none while the rim is within half a pitch of the edge, all from a pitch and a half on; none while bad
/// taxels hide an eighth of the force, all where they hide half of it.
fn doubt_of_sums<const ROWS: usize, const COLUMNS: usize>(
    sums: &Contact,
    picture: &Picture<ROWS, COLUMNS>,
    config: &Config,
) -> u8 {
    let hidden = ramp(hidden(sums, picture, config).unwrap_or(0).cast_signed(), HIDDEN);
    let half_pitch = config.half_pitch.to_bits() >> 4;
    hidden.max(ramp(overhang::<ROWS, COLUMNS>(sums, config), [half_pitch, 3 * half_pitch]))
}

/// Q8: it comes within some 8 frames and goes within some 64.
fn follow_doubt(doubt: u32, target: u8) -> u32 {
    let target = u32::from(target) << 8;
    if target > doubt { doubt + (target - doubt).div_ceil(8) } else { doubt - (doubt - target).div_ceil(64) }
}

/// 0 up to `from`, 255 from `to` on, and a line between.
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
