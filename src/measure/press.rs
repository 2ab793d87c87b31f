//! The press onto a hard flat plate: approach, then twice in and back, with means of all taxels for every step.
//!
//! ```text
//! back off - seek the touch - 0.5 mm back
//! in and back at 10 mm/s - in at 2 mm/s - hold for 3 s - back at 2 mm/s
//! ```
//!
//! Two speeds show the tip's relaxation, two directions its hysteresis, the hold its creep. A way in ends at a depth
//! of 0.3 a (the range of the paper's measurement), at 7/8 of the largest force, at the travel's end, or when one
//! more taxel than in the air is dead or saturated.

use super::{BuiltIn, Ended, MeasureStatus};
use crate::config::Config;
use crate::contact::Contact;
use crate::control::{Reference, SpeedLoop};
use crate::pressure::TactileImage;
use crate::state::Limits;
use crate::units::{Celsius, Millimetres, MillimetresPerSecond};

/// Speed of the quick way: 10 mm/s, at most that of an approach.
const QUICK: MillimetresPerSecond = MillimetresPerSecond::from_bits(10 << 16);
/// Speed of the slow way: 2 mm/s, at most that of an approach.
const SLOW: MillimetresPerSecond = MillimetresPerSecond::from_bits(2 << 16);
/// Distance before the touch at which a way begins and ends: 0.5 mm, Q24.
const BEFORE: i32 = 1 << 23;
/// Largest number of steps of a way.
pub const STEPS: usize = 28;
/// Least length of a step: 0.1 mm, Q24.
const STEP: i32 = (1 << 24) / 10;
/// Times at which the steps of the hold end, ms.
pub const HOLDS_MS: [u32; 9] = [20, 40, 80, 160, 320, 640, 1_300, 2_100, 3_000];
/// Largest number of rows of a press: four ways, each with a step that is begun before it turns and one that turning
/// makes, and the hold.
pub const ROWS_MAX: usize = 4 * (STEPS + 2) + HOLDS_MS.len();
/// Distance to the travel's end below which the travel counts as used up, Q24 mm.
const END: i32 = 1 << 20;
/// Distance that is longer than the brake needs at the speeds of a press.
const FAR: Millimetres = Millimetres::from_bits(4 << 24);
/// Travel by which the tip must move on within [`STALL_NS`], Q24: 1/128 mm.
const MOVES: i32 = 1 << 17;
/// Time within which the tip must move on by [`MOVES`], ns.
const STALL_NS: u32 = 1_000_000_000;
/// Number of frames in a row in which one more taxel than before must be bad.
const BAD_FRAMES: u8 = 4;
/// Limit of a taxel's code, sixteenths.
const CODE_MAX: i32 = 1 << 17;
/// Limit of the difference of a code to the step's first frame, quarters.
const CHANGE_MAX: i32 = 1_023;
/// Number of parts of a complete step, one a frame: writing all of it takes as long as a step of the loop.
pub const PARTS: u8 = 4;
/// Largest number of frames of a step: the sums then have 31 bits.
const FRAMES_MAX: u16 = 16_383;

/// State of a press.
#[derive(Clone, Copy, Debug)]
pub struct Press {
    _built_in: BuiltIn,
    phase: Phase,
    /// Travel to which the tip backs off at most; a contact there ends the press.
    rest: Millimetres,
    /// Travel at which the tip touched, by the force and the configured modulus.
    touch: Millimetres,
    /// Depth of the quick cycle.
    deepest: Millimetres,
    /// Travel at which the step under way began.
    step_from: Millimetres,
    /// Time of the hold, ns, and the steps of it that are over.
    held_ns: u32,
    holds: u8,
    moved_to: Millimetres,
    still_ns: u32,
    /// Largest number of bad taxels in the air, and number of frames in a row with more.
    bad_before: u16,
    bad_frames: u8,
    /// Part of a complete step that this frame adds to the record.
    part: Option<u8>,
    /// True if the next frame begins a step.
    fresh: bool,
    /// Number of complete steps of this motion.
    steps: u8,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Phase {
    /// Backs off until nothing touches.
    Retreat,
    /// Approaches until something touches.
    Seek,
    /// Backs off to the travel at which the loading cycles begin.
    Before,
    In(Cycle),
    Hold,
    Back(Cycle),
    /// The last step is being recorded.
    Last,
    /// The press has ended.
    Over,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Cycle {
    Quick,
    Slow,
}

/// Inputs of a press in a frame.
pub struct PressInputs<'a, const ROWS: usize, const COLUMNS: usize> {
    /// Number of the frame.
    pub sequence: u32,
    /// Tactile image.
    pub picture: &'a TactileImage<ROWS, COLUMNS>,
    /// Contact by the plain sum.
    pub contact: &'a Contact,
    /// True if it lasts longer than a peak of noise.
    pub lasts: bool,
    /// Count of the encoder.
    pub encoder: i32,
    /// Estimated motion.
    pub motion: &'a SpeedLoop,
    /// Voltage of the bridge since the frame before, mV.
    pub applied_mv: i32,
    /// Temperature of the microcontroller.
    pub chip: Option<Celsius>,
}

/// Sums over the frames of a step.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Step<const ROWS: usize, const COLUMNS: usize> {
    /// Numbers of its first and last frame.
    pub frames: [u32; 2],
    /// Encoder counts at these frames.
    pub counts: [i32; 2],
    /// Number of frames in the sums.
    pub taken: u16,
    /// True if the tip moved back.
    pub back: bool,
    /// Sum of the bridge's voltage, mV.
    pub voltage_mv: i32,
    /// Temperature of the microcontroller at the end of the step.
    pub chip: Option<Celsius>,
    /// Reading of each taxel in the first frame, sixteenths of a corrected code above tare.
    pub first: [[i32; COLUMNS]; ROWS],
    /// Sum of each taxel's readings.
    pub sums: [[i32; COLUMNS]; ROWS],
    /// Sum of the squared differences of each taxel to the first frame, quarters of a code.
    pub squares: [[u32; COLUMNS]; ROWS],
    /// Bits of the columns that were bad in any frame, for each row.
    pub bad: [u32; ROWS],
}

impl<const ROWS: usize, const COLUMNS: usize> Step<ROWS, COLUMNS> {
    /// Step of no frames.
    pub const NONE: Self = Self {
        frames: [0; 2],
        counts: [0; 2],
        taken: 0,
        back: false,
        voltage_mv: 0,
        chip: None,
        first: [[0; COLUMNS]; ROWS],
        sums: [[0; COLUMNS]; ROWS],
        squares: [[0; COLUMNS]; ROWS],
        bad: [0; ROWS],
    };

    /// Takes a frame; a fresh one begins the step.
    fn take(&mut self, view: &PressInputs<ROWS, COLUMNS>, fresh: bool, back: bool) {
        (self.frames[1], self.counts[1], self.chip) = (view.sequence, view.encoder, view.chip);
        if fresh {
            (self.frames[0], self.counts[0]) = (view.sequence, view.encoder);
            (self.taken, self.voltage_mv, self.back) = (1, view.applied_mv, back);
            (self.first, self.bad) = (view.picture.taxels, view.picture.bad);
            // The first frame is copied, not added: no frame both clears a step and adds to it.
            self.sums = view.picture.taxels;
            self.squares = [[0; COLUMNS]; ROWS];
            return;
        }
        if self.taken >= FRAMES_MAX {
            return;
        }
        self.taken += 1;
        self.voltage_mv = self.voltage_mv.saturating_add(view.applied_mv);
        self.bad.iter_mut().zip(&view.picture.bad).for_each(|(all, bad)| *all |= bad);
        let taxels = view.picture.taxels.as_flattened().iter().zip(self.first.as_flattened());
        let sums = self.sums.as_flattened_mut().iter_mut().zip(self.squares.as_flattened_mut());
        for ((taxel, first), (sum, square)) in taxels.zip(sums) {
            *sum = sum.wrapping_add((*taxel).max(-CODE_MAX).min(CODE_MAX));
            let change = (taxel.wrapping_sub(*first) >> 2).max(-CHANGE_MAX).min(CHANGE_MAX);
            *square = square.saturating_add((change * change).cast_unsigned());
        }
    }
}

impl Press {
    /// Begins a press. The tip may touch or not; it backs off to `rest` at most.
    pub fn begin(motion: &SpeedLoop, rest: Millimetres, built_in: BuiltIn) -> Self {
        Self {
            _built_in: built_in,
            phase: Phase::Retreat,
            rest,
            touch: Millimetres::ZERO,
            deepest: Millimetres::ZERO,
            step_from: Millimetres::ZERO,
            held_ns: 0,
            holds: 0,
            moved_to: motion.observer.travel,
            still_ns: 0,
            bad_before: 0,
            bad_frames: 0,
            part: None,
            fresh: true,
            steps: 0,
        }
    }

    /// Returns true while the press needs the motor.
    pub fn running(&self) -> bool {
        self.phase != Phase::Over
    }

    /// Part of a complete step that this frame adds to the record.
    pub fn part(&self) -> Option<u8> {
        self.part
    }

    /// Takes a frame.
    #[inline(never)]
    pub fn observe<const ROWS: usize, const COLUMNS: usize>(
        &mut self,
        view: &PressInputs<ROWS, COLUMNS>,
        step: &mut Step<ROWS, COLUMNS>,
        standing: &mut MeasureStatus,
        config: &Config,
    ) {
        // Meanwhile the motion continues, and no frame is taken.
        self.part = self.part.and_then(|part| (part + 1 < PARTS).then_some(part + 1));
        if self.part.is_some() {
            return;
        }
        let travel = view.motion.observer.travel;
        if self.stalled(travel, config) {
            return self.end(standing, Ended::Stalled, travel);
        }
        let bad = self.one_more_bad(view.picture.bad_count);
        let at_end = config.travel_max.0.saturating_sub(travel.0).to_bits() < END;
        let force = view.contact.force;
        let measured = view.motion.observer.measured(view.encoder, config);
        // Something pushes back, or follows: the grip that comes next releases it faster than this motion would.
        let touched = match self.phase {
            Phase::Retreat => force >= config.contact_off && travel <= self.rest,
            Phase::In(_) | Phase::Hold | Phase::Back(_) => force > config.force_max,
            Phase::Seek | Phase::Before | Phase::Last | Phase::Over => false,
        };
        if touched {
            self.phase = Phase::Over;
            return standing.end(Ended::Touched, super::millinewtons(force));
        }
        match self.phase {
            Phase::Over => {}
            Phase::Last => self.end(standing, Ended::Complete, Millimetres::ZERO),
            Phase::Retreat if force < config.contact_off => self.phase = Phase::Seek,
            Phase::Retreat => {}
            Phase::Seek if view.lasts && force >= config.contact_on => {
                self.touch = Millimetres(travel.0.saturating_sub(config.tip.indentation(force).0));
                self.phase = Phase::Before;
            }
            Phase::Seek if at_end => self.end(standing, Ended::NoContact, travel),
            Phase::Seek => {}
            Phase::Before if travel <= self.start(config) => self.next(Phase::In(Cycle::Quick), measured, standing),
            Phase::Before => {}
            Phase::In(cycle) => {
                let depth = Millimetres(measured.0.saturating_sub(self.touch.0));
                let most = if cycle == Cycle::Quick { depth_goal(config) } else { self.deepest };
                let pressed = force.0 >= config.force_max.0 - (config.force_max.0 >> 3);
                let turns = bad || at_end || pressed || depth >= most;
                self.sample(view, step, measured, turns, config);
                if turns {
                    let after = if cycle == Cycle::Quick { Phase::Back(Cycle::Quick) } else { Phase::Hold };
                    self.deepest = if cycle == Cycle::Quick { depth } else { self.deepest };
                    self.next(after, measured, standing);
                }
            }
            Phase::Hold => {
                self.held_ns = self.held_ns.saturating_add(config.timing.frame_ns);
                let over = |holds: u8| HOLDS_MS.get(usize::from(holds)).is_none_or(|ms| self.held_ns >= ms * 1_000_000);
                let complete = over(self.holds);
                step.take(view, self.fresh, false);
                (self.fresh, self.part) = (complete, complete.then_some(0));
                self.holds += u8::from(complete);
                if usize::from(self.holds) >= HOLDS_MS.len() {
                    self.next(Phase::Back(Cycle::Slow), measured, standing);
                }
            }
            Phase::Back(cycle) => {
                let turns = travel <= self.start(config);
                self.sample(view, step, measured, turns, config);
                match (turns, cycle) {
                    (false, _) => {}
                    (true, Cycle::Quick) => self.next(Phase::In(Cycle::Slow), measured, standing),
                    (true, Cycle::Slow) => self.phase = Phase::Last,
                }
            }
        }
    }

    /// Returns the speed reference.
    pub fn reference(&self, motion: &mut SpeedLoop, config: &Config, limits: &mut Limits) -> Reference {
        let back = Millimetres(-FAR.0);
        let of = |cycle| config.approach.min(if cycle == Cycle::Quick { QUICK } else { SLOW });
        let (way, speed) = match self.phase {
            Phase::Over | Phase::Last => (Millimetres::ZERO, config.approach),
            Phase::Retreat => (back, config.approach),
            Phase::Before => (back, of(Cycle::Quick)),
            Phase::Seek => (motion.within_travel(FAR, config, limits), config.approach),
            Phase::In(cycle) => (motion.within_travel(FAR, config, limits), of(cycle)),
            Phase::Hold => {
                let held = self.step_from.0.saturating_sub(motion.observer.travel.0);
                (motion.within_travel(Millimetres(held), config, limits), of(Cycle::Slow))
            }
            Phase::Back(cycle) => (back, of(cycle)),
        };
        motion.towards(way, Millimetres::ZERO, speed, config).0
    }

    /// Adds a frame to the present step, which ends after its length, or when the motion reverses.
    fn sample<const ROWS: usize, const COLUMNS: usize>(
        &mut self,
        view: &PressInputs<ROWS, COLUMNS>,
        step: &mut Step<ROWS, COLUMNS>,
        at: Millimetres,
        turns: bool,
        config: &Config,
    ) {
        step.take(view, self.fresh, matches!(self.phase, Phase::Back(_)));
        let gone = at.0.saturating_sub(self.step_from.0).saturating_abs().to_bits();
        let whole = depth_goal(config).to_bits().saturating_add(BEFORE);
        // A tip that goes to and fro makes the last step longer, not the record.
        let more = usize::from(self.steps) <= STEPS;
        self.fresh = turns || more && gone >= STEP.max(whole / STEPS as i32);
        self.part = self.fresh.then_some(0);
        if self.fresh {
            (self.step_from, self.steps) = (at, self.steps.saturating_add(1));
        }
    }

    /// Starts the next part of the press. Its first step begins, and a hold holds, at the travel of the turn.
    fn next(&mut self, phase: Phase, at: Millimetres, standing: &mut MeasureStatus) {
        (self.phase, self.step_from, self.fresh, self.steps) = (phase, at, true, 0);
        standing.progress = match phase {
            Phase::In(Cycle::Quick) => 10,
            Phase::Back(Cycle::Quick) => 20,
            Phase::In(Cycle::Slow) => 30,
            Phase::Hold => 50,
            _ => 80,
        };
    }

    fn end(&mut self, standing: &mut MeasureStatus, ended: Ended, at: Millimetres) {
        self.phase = Phase::Over;
        standing.end(ended, ((i64::from(at.to_bits()) * 1_000) >> 24) as i32);
    }

    /// Travel at which the ways begin: before the touch, and within the guard's rear end.
    fn start(&self, config: &Config) -> Millimetres {
        let rear = config.bounds.back.to_bits().saturating_neg().saturating_add(BEFORE / 2);
        Millimetres::from_bits(self.touch.to_bits().saturating_sub(BEFORE).max(rear))
    }

    /// Returns true once more taxels are bad than in the air for [`BAD_FRAMES`] frames.
    fn one_more_bad(&mut self, bad: u16) -> bool {
        if !matches!(self.phase, Phase::In(_) | Phase::Hold | Phase::Back(_)) {
            self.bad_before = self.bad_before.max(bad);
        }
        self.bad_frames = if bad > self.bad_before { self.bad_frames.saturating_add(1) } else { 0 };
        self.bad_frames >= BAD_FRAMES
    }

    fn stalled(&mut self, travel: Millimetres, config: &Config) -> bool {
        if self.phase == Phase::Hold || travel.0.saturating_sub(self.moved_to.0).saturating_abs().to_bits() > MOVES {
            self.moved_to = travel;
            self.still_ns = 0;
        }
        self.still_ns = self.still_ns.saturating_add(config.timing.frame_ns);
        self.running() && self.still_ns > STALL_NS
    }
}

/// Depth of a press: 0.3 a, the range of the paper's measurement.
fn depth_goal(config: &Config) -> Millimetres {
    Millimetres::from_bits((i64::from(config.tip.radius().to_bits()) * 3 / 10) as i32)
}
