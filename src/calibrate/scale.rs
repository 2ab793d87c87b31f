//! The absolute scale, by what a kitchen scale under the plate shows while a force is held.
//!
//! A press tells the taxels' gain times Y and no more: a harder tip under less sensitive taxels reads the same. What the
//! scale shows tells the force itself, so it fixes the gain, and with what the press told the modulus. The factor k is the
//! least-squares slope of what was shown, s, against what was read, r: `k = sum(r s) / sum(r^2)`.

use crate::config::Config;
use crate::contact::Contact;
use crate::root::floor_sqrt;
use crate::state::Mode;
use crate::units::Newtons;

/// Points at most.
const POINTS: usize = 8;
/// A force must be held for so long before it counts, and its mean is taken over as long, ns.
const HELD_NS: u32 = 300_000_000;
/// What a point may be off the others: this, mN,
const OFF_MN: i64 = 20;
/// and this part of what is shown: a 50th.
const OFF_PART: i64 = 50;
/// The least that is shown: below that the scale's own steps count too much.
const LEAST_MN: i32 = 100;
/// What a scale with steps of 5 mN leaves, and a hand that reads it: 3 mN.
const READ_MN: i64 = 3;

/// Why a number was not taken. The numbers are stable.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u8)]
#[non_exhaustive]
pub enum Refusal {
    /// No force is held, or not for 0.3 s.
    NotHeld = 1,
    /// The array does not see all of the contact.
    OffArray = 2,
    /// Less than 100 mN is shown.
    TooLittle = 3,
    /// It is less than half or more than twice of what the array reads.
    Range = 4,
    /// It contradicts the numbers before: by more than 2 % and 20 mN.
    Contradiction = 5,
    /// There are eight already.
    TooMany = 6,
}

impl core::fmt::Display for Refusal {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        f.write_str(match self {
            Self::NotHeld => "no force is held, or not yet for 0.3 s: hold one first",
            Self::OffArray => "the array does not see all of the contact: press nearer the middle",
            Self::TooLittle => "less than 100 mN is shown: hold a larger force",
            Self::Range => "it is less than half or more than twice of what the array reads: is the scale zeroed?",
            Self::Contradiction => {
                "it contradicts the numbers before by more than 2 % and 20 mN: read again, or forget all"
            }
            Self::TooMany => "there are eight numbers already: accept or forget them",
        })
    }
}

impl core::error::Error for Refusal {}

/// How it stands.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Standing {
    /// Why the last number was not taken; none where it was.
    pub refusal: Option<Refusal>,
    /// Numbers taken.
    pub points: u8,
    /// What a force that is read is to be multiplied by, millionths; 0 where there is no number.
    pub factor_ppm: u32,
    /// Its standard uncertainty.
    pub sigma_ppm: u32,
}

/// The numbers shown, and what was read.
#[derive(Clone, Debug, Default)]
pub struct Scale {
    /// Shown and read, mN.
    points: [[i32; 2]; POINTS],
    standing: Standing,
    held_ns: u32,
    /// Which force that is.
    goal: Newtons,
    /// A mean of the force, Q16 of its bits.
    mean: i64,
}

impl Scale {
    /// No number yet.
    pub const fn new() -> Self {
        Self {
            points: [[0; 2]; POINTS],
            standing: Standing { refusal: None, points: 0, factor_ppm: 0, sigma_ppm: 0 },
            held_ns: 0,
            goal: Newtons::ZERO,
            mean: 0,
        }
    }

    /// How it stands.
    pub fn standing(&self) -> Standing {
        self.standing
    }

    /// Forgets all numbers.
    pub fn forget(&mut self) {
        *self = Self { held_ns: self.held_ns, goal: self.goal, mean: self.mean, ..Self::new() };
    }

    /// Follows the force that is held: the reading without its creep and its drift, which are taken off beside the scale.
    #[inline(always)]
    pub fn observe(&mut self, mode: Mode, goal: Newtons, force: Newtons, config: &Config) {
        let force = i64::from(force.to_bits()) << 16;
        if mode != Mode::Force || core::mem::replace(&mut self.goal, goal) != goal {
            (self.held_ns, self.mean) = (0, force);
            return;
        }
        self.held_ns = self.held_ns.saturating_add(config.timing.frame_ns).min(4 * HELD_NS);
        // A time constant of 1024 frames.
        self.mean += (force - self.mean) >> 10;
    }

    /// Takes what the scale shows.
    pub fn take(&mut self, shown_mn: i32, contact: &Contact) {
        let read_mn = (((self.mean >> 16) * 1_000) >> 16) as i32;
        self.standing.refusal = self.refusal(shown_mn, read_mn, contact);
        if self.standing.refusal.is_some() {
            return;
        }
        if let Some(place) = self.points.get_mut(usize::from(self.standing.points)) {
            *place = [shown_mn, read_mn];
            self.standing.points += 1;
            (self.standing.factor_ppm, self.standing.sigma_ppm) = self.fit(self.standing.points);
        }
    }

    fn refusal(&mut self, shown_mn: i32, read_mn: i32, contact: &Contact) -> Option<Refusal> {
        if usize::from(self.standing.points) >= POINTS {
            return Some(Refusal::TooMany);
        }
        if self.held_ns < HELD_NS {
            return Some(Refusal::NotHeld);
        }
        if contact.doubt > 0 {
            return Some(Refusal::OffArray);
        }
        if shown_mn < LEAST_MN {
            return Some(Refusal::TooLittle);
        }
        if shown_mn / 2 > read_mn || read_mn / 2 > shown_mn {
            return Some(Refusal::Range);
        }
        let place = usize::from(self.standing.points);
        *self.points.get_mut(place)? = [shown_mn, read_mn];
        let (factor_ppm, _) = self.fit(self.standing.points + 1);
        let worst = self.points.iter().take(place + 1).any(|[shown, read]| {
            let off = i64::from(*shown) - i64::from(*read) * i64::from(factor_ppm) / 1_000_000;
            off.abs() > OFF_MN + i64::from(*shown) / OFF_PART
        });
        worst.then_some(Refusal::Contradiction)
    }

    /// The factor and its standard uncertainty by the first so many points.
    fn fit(&self, count: u8) -> (u32, u32) {
        let points =
            || self.points.iter().take(count.into()).map(|[shown, read]| [i64::from(*shown), i64::from(*read)]);
        let (mut both, mut square) = (0_i64, 0_i64);
        for [shown, read] in points() {
            both = both.saturating_add(shown.saturating_mul(read));
            square = square.saturating_add(read.saturating_mul(read));
        }
        // Forces below 2^18 mN: the sums are below 2^39.
        let factor = (both * 1_000_000).checked_div(square).unwrap_or(0).max(0).min(4_000_000);
        let mut left = READ_MN * READ_MN * i64::from(count);
        for [shown, read] in points() {
            let off = shown - read * factor / 1_000_000;
            left = left.saturating_add(off * off);
        }
        let variance = left.checked_div(i64::from(count).max(1)).unwrap_or(0);
        // Over the root of the sum of squares.
        let root = i64::from(floor_sqrt(square.unsigned_abs())).max(1);
        let scatter = i64::from(floor_sqrt(variance.unsigned_abs() << 20)) * 1_000_000;
        let sigma = scatter.checked_div(root << 10).unwrap_or(0);
        (factor as u32, sigma.max(0).min(1_000_000) as u32)
    }
}
