//! The press that collects the points: back off, seek the contact, press slowly, then the fit.
//!
//! Travel comes from the encoder alone and force from the plain sum of the taxels, so neither depends on the modulus
//! that the parameters hold. The press ends at an indentation of 0.3 a, at the largest force allowed, or where the
//! contact's rim reaches the array's edge or saturates a taxel, whichever comes first. A point is the mean of all
//! frames within 1/128 mm of travel.

use super::fit::TravelFit;
use super::{Identification, Modulus, Refusal};
use crate::config::Config;
use crate::contact;
use crate::contact::Contact;
use crate::control::SpeedLoop;
use crate::control::profile::Reference;
use crate::pressure::Picture;
use crate::root::floor_sqrt;
use crate::state::Limits;
use crate::units::{Kilopascals, Millimetres, MillimetresPerSecond, Newtons};

/// Speed of the press: 2 mm/s.
const SPEED: MillimetresPerSecond = MillimetresPerSecond::from_bits(2 << 16);
/// Frames are taken up to this speed, so that the travel between sensing the array and the encoder does not count.
const SPEED_TAKEN: MillimetresPerSecond = MillimetresPerSecond::from_bits(4 << 16);
/// Travel from point to point, Q24 mm.
const STEP: i32 = 1 << 17;
/// How near to its end the travel counts as used up, Q24 mm.
const END: i32 = 1 << 20;
/// A way that is longer than the brake needs at the speeds of a press.
const FAR: Millimetres = Millimetres::from_bits(4 << 24);
/// The tip must move on within this time, ns.
const STALL_NS: u32 = 1_000_000_000;
/// What the array's readout adds to the standard uncertainty, as a part of the modulus: 0.1 %.
const READOUT_PART: i32 = 1_000;

/// A measurement of the modulus.
#[derive(Clone, Debug)]
pub struct Press {
    phase: Phase,
    outcome: Identification,
    fit: TravelFit,
    step: Step,
    /// Where the tip touched, by the force and the configured modulus: near enough to say how deep it is.
    touch: Millimetres,
    from: Millimetres,
    moved_to: Millimetres,
    still_ns: u32,
    /// It goes on where the array's edge or a bad taxel ends a measurement of the modulus, and gives none.
    deep: bool,
    /// The most taxels that were bad before the touch: of one on the brink of being dead, noise makes a bad one now and then.
    bad_before: u16,
    /// The way from the touch in this frame, where it counts.
    sampled: Option<Millimetres>,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Phase {
    Idle,
    Retreat,
    Seek,
    Squeeze,
}

/// What a frame says to the press.
pub struct View<'a, const ROWS: usize, const COLUMNS: usize> {
    /// The array.
    pub picture: &'a Picture<ROWS, COLUMNS>,
    /// The contact read off it.
    pub contact: &'a Contact,
    /// The encoder's count.
    pub encoder: i32,
    /// The motion estimated.
    pub motion: &'a SpeedLoop,
}

impl Press {
    /// Nothing asked for.
    pub const fn new() -> Self {
        Self {
            phase: Phase::Idle,
            outcome: Identification::None,
            fit: TravelFit::EMPTY,
            step: Step::at(0),
            touch: Millimetres::ZERO,
            from: Millimetres::ZERO,
            moved_to: Millimetres::ZERO,
            still_ns: 0,
            deep: false,
            bad_before: 0,
            sampled: None,
        }
    }

    /// Begins a press; the tip may touch or not. A deep one only ends with the depth, the force, the travel or a taxel
    /// that fails, and gives no modulus.
    pub fn begin(deep: bool, motion: &SpeedLoop) -> Self {
        Self {
            phase: Phase::Retreat,
            outcome: Identification::Running,
            moved_to: motion.observer.travel,
            deep,
            ..Self::new()
        }
    }

    /// Whether it is a deep one, which calibrates the taxels.
    pub fn deep(&self) -> bool {
        self.deep
    }

    /// How far the tip went since the touch was noticed, where this frame is one of the press.
    pub fn sampled(&self) -> Option<Millimetres> {
        self.sampled
    }

    /// Where the tip touched, from where that was noticed; not above 0.
    pub fn touched(&self) -> Millimetres {
        Millimetres(self.touch.0.saturating_sub(self.from.0))
    }

    /// How deep a press goes: 0.3 a, the range of the paper's measurement.
    pub fn depth_goal(config: &Config) -> Millimetres {
        depth_goal(config)
    }

    /// Whether it still needs the motor.
    pub fn running(&self) -> bool {
        self.phase != Phase::Idle
    }

    /// How it stands.
    // Inlined, the compiler copies it by `memmove`, which nothing else needs: 1.6 KB of flash.
    #[inline(never)]
    pub fn outcome(&self) -> Identification {
        self.outcome
    }

    /// Ends without a result.
    pub fn refuse(&mut self, refusal: Refusal) {
        self.phase = Phase::Idle;
        self.outcome = Identification::Refused(refusal);
    }

    /// Takes a frame.
    pub fn observe<const ROWS: usize, const COLUMNS: usize>(&mut self, view: &View<ROWS, COLUMNS>, config: &Config) {
        if self.phase == Phase::Idle {
            return;
        }
        self.sampled = None;
        if self.deep && self.phase != Phase::Squeeze {
            self.bad_before = self.bad_before.max(view.picture.bad_count);
        }
        if view.picture.bad_count > self.bad_before {
            return self.finish(Refusal::BadTaxels);
        }
        if self.stalled(view, config) {
            return self.finish(Refusal::Stalled);
        }
        let travel = view.motion.observer.travel;
        let at_end = config.travel_max.0.saturating_sub(travel.0).to_bits() < END;
        match self.phase {
            Phase::Idle => {}
            Phase::Retreat if view.contact.force < config.contact_off => self.phase = Phase::Seek,
            Phase::Retreat => {}
            Phase::Seek if view.contact.force >= config.contact_on => self.touch(view, config),
            Phase::Seek if at_end => self.refuse(Refusal::NoContact),
            Phase::Seek => {}
            Phase::Squeeze => self.squeeze(view, at_end, config),
        }
    }

    /// The speed to follow.
    pub fn reference(&self, motion: &mut SpeedLoop, config: &Config, limits: &mut Limits) -> Reference {
        let (way, speed) = match self.phase {
            Phase::Idle => (Millimetres::ZERO, config.approach),
            Phase::Retreat => (Millimetres(-FAR.0), config.approach),
            Phase::Seek => (motion.within_travel(FAR, config, limits), config.approach),
            Phase::Squeeze => (motion.within_travel(FAR, config, limits), config.approach.min(SPEED)),
        };
        motion.towards(way, Millimetres::ZERO, speed, config).0
    }

    fn stalled<const ROWS: usize, const COLUMNS: usize>(
        &mut self,
        view: &View<ROWS, COLUMNS>,
        config: &Config,
    ) -> bool {
        let travel = view.motion.observer.travel;
        if travel.0.saturating_sub(self.moved_to.0).saturating_abs().to_bits() > STEP {
            self.moved_to = travel;
            self.still_ns = 0;
        }
        self.still_ns = self.still_ns.saturating_add(config.timing.frame_ns);
        self.still_ns > STALL_NS
    }

    fn touch<const ROWS: usize, const COLUMNS: usize>(&mut self, view: &View<ROWS, COLUMNS>, config: &Config) {
        let travel = view.motion.observer.travel;
        self.touch = Millimetres(travel.0.saturating_sub(config.tip.indentation(view.contact.force).0));
        self.from = travel;
        self.fit = TravelFit::new(travel, depth_goal(config), config.force_fault);
        self.step = Step::at(0);
        self.phase = Phase::Squeeze;
    }

    fn squeeze<const ROWS: usize, const COLUMNS: usize>(
        &mut self,
        view: &View<ROWS, COLUMNS>,
        at_end: bool,
        config: &Config,
    ) {
        // The sum's reading, whatever the loop itself goes by: it does not depend on the modulus.
        let contact = contact::from_sums(view.picture, config);
        let speed = view.motion.observer.speed;
        let measured = view.motion.observer.measured(view.encoder, config);
        let way = measured.0.saturating_sub(self.from.0).to_bits();
        if way >= 0 && speed >= MillimetresPerSecond(-SPEED_TAKEN.0) && speed <= SPEED_TAKEN {
            self.sampled = Some(Millimetres::from_bits(way));
            if let Some((way, force)) = self.step.take(way, contact.force) {
                self.fit.add(Millimetres(self.from.0.saturating_add(way.0)), force);
            }
        }
        let depth = Millimetres(measured.0.saturating_sub(self.touch.0));
        let at_edge = !self.deep && beyond_edge::<ROWS, COLUMNS>(&contact, depth, config);
        if at_edge || at_end || depth >= depth_goal(config) || contact.force >= config.force_max {
            self.finish(if at_edge { Refusal::Edge } else { Refusal::Span });
        }
    }

    /// Ends with what the points so far give; where they are too few, what ended the press is the reason.
    fn finish(&mut self, cause: Refusal) {
        self.phase = Phase::Idle;
        if self.deep {
            self.outcome = Identification::Refused(cause);
            return;
        }
        self.outcome = match self.fit.modulus() {
            Ok(result) => Identification::Done(Modulus { sigma: with_readout(result), ..result }),
            Err(Refusal::Span | Refusal::Points) => Identification::Refused(cause),
            Err(refusal) => Identification::Refused(refusal),
        };
    }
}

impl Default for Press {
    fn default() -> Self {
        Self::new()
    }
}

/// Frames that are to make one point.
#[derive(Clone, Copy, Debug)]
struct Step {
    begin: i32,
    frames: u32,
    ways: u64,
    forces: u64,
}

impl Step {
    const fn at(begin: i32) -> Self {
        Self { begin, frames: 0, ways: 0, forces: 0 }
    }

    /// Takes a frame; gives the mean of those before it where it begins a new step.
    fn take(&mut self, way: i32, force: Newtons) -> Option<(Millimetres, Newtons)> {
        let full = way.saturating_sub(self.begin) >= STEP && self.frames > 0;
        let mean = full.then(|| {
            let frames = u64::from(self.frames.max(1));
            (Millimetres::from_bits((self.ways / frames) as i32), Newtons::from_bits((self.forces / frames) as i32))
        });
        if full {
            *self = Self::at(way);
        }
        self.frames = self.frames.saturating_add(1);
        self.ways = self.ways.saturating_add(u64::from(way.max(0).unsigned_abs()));
        self.forces = self.forces.saturating_add(u64::from(force.to_bits().max(0).unsigned_abs()));
        mean
    }
}

/// How deep a press goes: 0.3 a, the range of the paper's measurement.
fn depth_goal(config: &Config) -> Millimetres {
    Millimetres::from_bits((i64::from(config.tip.radius().to_bits()) * 3 / 10) as i32)
}

/// Whether the rim of a contact this deep is beyond the array.
fn beyond_edge<const ROWS: usize, const COLUMNS: usize>(
    contact: &Contact,
    depth: Millimetres,
    config: &Config,
) -> bool {
    let half_pitch = i64::from(config.half_pitch.to_bits());
    let beyond =
        |centre: Millimetres, side: usize| i64::from(centre.0.saturating_abs().to_bits()) - half_pitch * side as i64;
    let furthest = beyond(contact.centre_x, COLUMNS).max(beyond(contact.centre_y, ROWS));
    furthest + i64::from(config.tip.contact_radius(depth).to_bits()) > 0
}

/// The scatter's uncertainty and the readout's together.
fn with_readout(result: Modulus) -> Kilopascals {
    let square = |bits: i32| i64::from(bits).pow(2).unsigned_abs();
    let sum = square(result.sigma.to_bits()) + square(result.modulus.to_bits() / READOUT_PART);
    Kilopascals::from_bits(floor_sqrt(sum) as i32)
}
