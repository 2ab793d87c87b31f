//! A contact followed from frame to frame, with little work in each.
//!
//! A refinement is spread over six frames: two rows in each of five, its solution in the last. What it tells is how many times larger the contact's force
//! is than the sum of the taxels over those frames: 1 where the array sees all of it. That ratio changes slowly, while
//! the sum follows every frame. So the force is the sum times the last ratio, as quick as the sum itself.

use super::guess::{Guess, Pressed};
use super::step::{self, Equations, Taxels};
use super::view::View;
use super::{TAXELS_MIN, confidence, covers, from_sums};
use crate::config::Config;
use crate::frame::ROWS;
use crate::pipeline::Contact;
use crate::pressure::Picture;
use crate::units::{Millimetres, Newtons};
use fixed::types::I16F16;

/// Frames that are taken in for a refinement; it is solved in one more.
const FRAMES: u8 = 5;
/// Refinements in a row without any confidence after which the guess is given up: more than any contact needs to be found.
const ASTRAY_MAX: u8 = 12;
/// With fewer live taxels than this in the model's contact there are other contacts that look the same.
const TAXELS_LEAST: i32 = 8;
/// Fractional bits of the ratio of the force to the sum.
const RATIO_BITS: u32 = 16;
/// The largest ratio: at least a 64th of the force must be seen.
const RATIO_MAX: i64 = 64 << RATIO_BITS;

/// A contact's fit between frames.
#[derive(Clone, Debug)]
pub struct Fit {
    /// Frames taken in since the last refinement.
    frames: u8,
    /// Whether the array sees the whole contact, as at the first of them.
    covered: bool,
    /// The contact supposed.
    guess: Guess,
    /// Its peak at the first frame.
    peak: i32,
    /// The sum's force over the frames, in its smallest units.
    forces: i64,
    equations: Equations,
    confidence: u8,
    /// Refinements without any confidence since the last that had some.
    astray: u8,
    /// What the last refinement made of the guess.
    next: Option<Guess>,
    /// What the last refinement with some confidence says.
    fitted: Option<Fitted>,
}

/// A contact of which the array sees a part.
#[derive(Clone, Copy, Debug)]
struct Fitted {
    /// Of the force to the sum.
    ratio: u32,
    centre: [Millimetres; 2],
}

impl Default for Fit {
    fn default() -> Self {
        Self::new()
    }
}

impl Fit {
    /// Nothing seen yet.
    pub const fn new() -> Self {
        Self {
            frames: 0,
            covered: true,
            guess: Guess { rest: 0, x: 0, y: 0 },
            peak: 0,
            forces: 0,
            equations: Equations::NONE,
            confidence: 255,
            astray: 0,
            next: None,
            fitted: None,
        }
    }

    /// Rows, a bit each, whose taxels the next frame's reading looks at where there is a contact.
    pub fn rows(&self) -> u16 {
        if self.frames < FRAMES { 1 << self.frames | 1 << (self.frames + FRAMES) } else { 0 }
    }

    /// Reads the next frame's contact. Any picture is taken.
    ///
    /// Without a contact, and until a refinement of one has some confidence, it is what [`from_sums`] says. Confidence is that of the last
    /// refinement, 255 before the first.
    pub fn read(&mut self, picture: &Picture, config: &Config) -> Contact {
        let sums = from_sums(picture, config);
        if sums.force < config.contact_off {
            *self = Self::new();
            return sums;
        }
        if self.frames == 0 {
            self.start(&sums, picture, config);
        }
        match View::new(picture, self.peak, &config.geometry) {
            Some(view) if self.frames < FRAMES => self.take(&sums, &view, config),
            Some(view) => self.refine(&view, config),
            None => *self = Self::new(),
        }
        let Some(Fitted { ratio, centre: [centre_x, centre_y] }) = self.fitted else {
            return Contact { confidence: self.confidence, ..sums };
        };
        let wide = (i64::from(sums.force.to_bits()) * i64::from(ratio)) >> RATIO_BITS;
        let force = Newtons(I16F16::from_bits(wide.min(i64::from(i32::MAX)) as i32));
        let indentation = config.tip.indentation(force);
        let radius = config.tip.contact_radius(indentation);
        Contact { force, indentation, centre_x, centre_y, radius, confidence: self.confidence, ..sums }
    }

    /// Begins a refinement.
    fn start(&mut self, sums: &Contact, picture: &Picture, config: &Config) {
        self.covered = covers(sums, picture, config);
        if self.covered {
            self.forget();
        }
        self.guess = self
            .next
            .unwrap_or_else(|| Guess::from_lengths(sums.indentation, sums.centre_x, sums.centre_y, &config.geometry));
        self.peak = picture.peak;
        self.forces = 0;
        self.equations = Equations::NONE;
    }

    /// Takes in a frame.
    fn take(&mut self, sums: &Contact, view: &View, config: &Config) {
        let pressed = Pressed::new(&self.guess, view, &config.geometry);
        let rows = Taxels::rows(usize::from(self.frames), usize::from(FRAMES));
        if self.covered {
            step::compare(&mut self.equations.misfit, &pressed, view, rows);
        } else {
            self.equations.take(&pressed, view, rows, None);
        }
        self.forces += i64::from(sums.force.to_bits());
        self.frames += 1;
    }

    /// Ends a refinement.
    fn refine(&mut self, view: &View, config: &Config) {
        self.frames = 0;
        self.confidence = confidence(&self.equations.misfit, view);
        if self.covered {
            return;
        }
        self.astray = if self.confidence > 0 { 0 } else { self.astray + 1 };
        if self.equations.misfit.taxels < TAXELS_MIN || self.astray > ASTRAY_MAX {
            return self.forget();
        }
        let guess = self.equations.solve(&self.guess, view, &config.geometry);
        self.next = Some(guess);
        if self.confidence > 0 && self.equations.misfit.taxels >= TAXELS_LEAST {
            let force = i64::from(config.tip.force(guess.indentation(&config.tip)).to_bits());
            let ratio = ((i64::from(FRAMES) * force) << RATIO_BITS) / self.forces.max(1);
            self.fitted = Some(Fitted { ratio: ratio.max(1).min(RATIO_MAX) as u32, centre: guess.centre(&config.tip) });
        }
    }

    /// Back to the sums.
    fn forget(&mut self) {
        (self.next, self.fitted, self.astray) = (None, None, 0);
    }
}

const _: () = assert!(ROWS.is_multiple_of(FRAMES as usize));
