//! The taxels' gains from presses onto a hard flat plate, without a load cell.
//!
//! A press goes slowly into the plate while the encoder tells how deep ([`crate::identify::Press`]); every taxel's mean
//! reading is kept for 24 steps of the travel ([`Readings`]). What comes then is spread over frames, a part of a taxel in
//! each:
//!
//! 1. the pose, from where the lines of the taxels cross zero, which no gain moves ([`Pose`]),
//! 2. what each taxel should read by the model ([`expected`]), and by how much it reads more,
//! 3. whether that was a press on something hard and flat that stood still ([`judge`]),
//! 4. the proposal, from all presses together ([`Proposal`]).
//!
//! The scale is fixed by the modulus of the parameters: what all taxels have in common is Y times their gain, and only a
//! scale tells these apart (`docs/commissioning.md`). Nothing of it counts before it is accepted; guard and monitor go by
//! the gains in force.

mod expected;
mod judge;
mod number;
mod pose;
mod proposal;
pub mod scale;
mod series;

pub use proposal::{Proposal, UNKNOWN};

/// What the evaluation is made of, to measure what it costs. It may change at any time.
#[doc(hidden)]
pub mod parts {
    pub use super::expected::add_part;
    pub use super::pose::{Equations, Line, Pose};
    pub use super::proposal::Sums;
    pub use super::series::{Readings, STEPS, Series};
}

use crate::config::Shaped;
use crate::config::geometry::PLACE_BITS;
use crate::contact::Contact;
use crate::control::SpeedLoop;
use crate::control::profile::Reference;
use crate::identify::{Identification, Press, PressView};
use crate::pressure::Array;
use crate::state::Limits;
use crate::units::Millimetres;
use judge::Totals;
use number::BITS;
use pose::{Equations, Line, Pose, System, Zero};
use proposal::Sums;
use series::{Readings, STEPS, Series};

/// Rounds of the search for the pose: so many free, then with what they leave taken for what the model is off, then one
/// that judges.
const FREE_ROUNDS: u8 = 3;
const ROUNDS: u8 = FREE_ROUNDS + 3;
/// Presses that are taken together at most.
const PRESSES_MAX: u8 = 200;

/// Why a press was not taken. The numbers are stable.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u8)]
#[non_exhaustive]
pub enum Refusal {
    /// The plate yields: the readings do not grow with the travel as under something hard.
    Soft = 1,
    /// The contact wandered over the array, not evenly.
    Moving = 2,
    /// The contact's centre is too near to the array's edge.
    OffArray = 3,
    /// It is no flat plate, or one that moves evenly.
    NotFlat = 4,
    /// Too few taxels were pressed for long enough.
    TooLittle = 5,
    /// The contact was lost.
    Lost = 6,
    /// The travel ended without a contact.
    NoContact = 7,
    /// The tip did not move on for a second.
    Stalled = 8,
    /// Torque went off, a fault stopped the motor, or parameters or gains changed.
    Interrupted = 9,
    /// Torque is off or the array not tared: there is nothing to press with.
    NotReady = 10,
    /// All taxels together read less than half or more than twice of what the modulus says.
    Range = 11,
}

impl core::fmt::Display for Refusal {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        f.write_str(match self {
            Self::Soft => "what is pressed yields: take something hard, as a glass or steel plate",
            Self::Moving => "the plate moved: hold finger and plate fast",
            Self::OffArray => "the contact is too near to the array's edge: press nearer the middle",
            Self::NotFlat => {
                "what is pressed is not flat, or moves: take a clean plate larger than the tip, hold it fast"
            }
            Self::TooLittle => "too few taxels were pressed: press deeper, force_max_mn allowing",
            Self::Lost => "the contact was lost: hold finger and plate fast",
            Self::NoContact => "the travel ended without a contact: bring the plate nearer",
            Self::Stalled => "the tip did not move on for a second: is the current too small?",
            Self::Interrupted => "torque went off, a fault stopped the motor, or parameters or gains changed",
            Self::NotReady => "torque is off or the array is not tared",
            Self::Range => {
                "all taxels read less than half or more than twice of what the modulus says: identify it first"
            }
        })
    }
}

impl core::error::Error for Refusal {}

/// How the last press stands. The numbers are stable.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum State {
    /// None was asked for since reset.
    #[default]
    None,
    /// It is under way, or being evaluated.
    Running,
    /// It was taken.
    Done,
    /// It was not taken; what was before stands.
    Refused(Refusal),
}

impl State {
    /// 0 none, 1 running, 2 done, 3 refused.
    pub const fn number(self) -> u8 {
        match self {
            Self::None => 0,
            Self::Running => 1,
            Self::Done => 2,
            Self::Refused(_) => 3,
        }
    }

    /// The number of the [`Refusal`]; 0 where it was not refused.
    pub const fn refusal(self) -> u8 {
        if let Self::Refused(refusal) = self { refusal as u8 } else { 0 }
    }
}

/// How a calibration stands.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Standing {
    /// The last press.
    pub state: State,
    /// How far it is, percent.
    pub progress: u8,
    /// Presses taken.
    pub presses: u8,
    /// Taxels that have a proposal.
    pub reached: u16,
    /// Counts proposals: it changes with every new one.
    pub proposals: u8,
}

/// A calibration under way, and what it proposes.
#[derive(Clone, Debug)]
pub struct Calibrator<const ROWS: usize, const COLUMNS: usize> {
    press: Press,
    phase: Phase,
    standing: Standing,
    readings: Readings<ROWS, COLUMNS>,
    travel: [Option<i64>; STEPS],
    /// The contact's centre at the end of the press, in tip radii.
    centre: [i64; 2],
    pose: Pose,
    equations: Equations,
    system: System,
    /// Of the taxel at work.
    zero: Option<Zero>,
    line: Option<Line>,
    /// What the zeros miss the model by, in tip radii.
    scatter: i64,
    expected: Series,
    totals: Totals,
    /// Of the presses taken before.
    sums: [[Sums; COLUMNS]; ROWS],
    /// What was taken before does not count any more.
    fresh: bool,
    /// Rows of the readings that are cleared for the next press: one in a frame.
    cleared: usize,
    proposal: Proposal<ROWS, COLUMNS>,
}

/// What a frame has to do. Places count taxels row by row.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Phase {
    Idle,
    Press,
    /// A step's travel.
    Travel(usize),
    /// The series' sums become means.
    Settle(usize),
    /// In a round of the pose, where a taxel's line should cross zero,
    Zero(u8, usize),
    /// where it does,
    Line(u8, usize),
    /// and what that says of the pose.
    Take(u8, usize),
    /// The pose anew: an unknown of it.
    Solve(u8, u8),
    /// A part of a taxel's expectation,
    Expect(usize, u8),
    /// and what it reads of that.
    Compare(usize),
    /// Whether the press is to be taken.
    Judge,
    /// A taxel's proposal.
    Propose(usize),
}

impl<const ROWS: usize, const COLUMNS: usize> Default for Calibrator<ROWS, COLUMNS> {
    fn default() -> Self {
        Self::new()
    }
}

impl<const ROWS: usize, const COLUMNS: usize> Calibrator<ROWS, COLUMNS> {
    const TAXELS: usize = ROWS * COLUMNS;

    /// Nothing asked for.
    pub const fn new() -> Self {
        Self {
            press: Press::new(),
            phase: Phase::Idle,
            standing: Standing { state: State::None, progress: 0, presses: 0, reached: 0, proposals: 0 },
            readings: Readings::NONE,
            travel: [None; STEPS],
            centre: [0; 2],
            pose: Pose { touch: 0, axis: [0; 2], tilt: [0; 2], roundness: 0 },
            equations: Equations::NONE,
            system: System::NONE,
            zero: None,
            line: None,
            scatter: 0,
            expected: [0; STEPS],
            totals: Totals::NONE,
            sums: [[Sums::NONE; COLUMNS]; ROWS],
            fresh: true,
            cleared: 0,
            proposal: Proposal::NONE,
        }
    }

    /// How it stands.
    pub fn standing(&self) -> Standing {
        self.standing
    }

    /// What is proposed.
    pub fn proposal(&self) -> &Proposal<ROWS, COLUMNS> {
        &self.proposal
    }

    /// Whether it needs the motor.
    pub fn running(&self) -> bool {
        self.phase == Phase::Press
    }

    /// Whether a press is under way or being worked out.
    pub fn busy(&self) -> bool {
        self.phase != Phase::Idle
    }

    /// Starts a press; what was proposed before stands.
    pub fn start(&mut self, motion: &SpeedLoop) {
        self.press.start_deep(motion);
        self.cleared = 0;
        self.phase = Phase::Press;
        (self.standing.state, self.standing.progress) = (State::Running, 0);
    }

    /// Ends the press that is under way, or what was asked for and cannot be.
    pub fn refuse(&mut self, refusal: Refusal) {
        self.phase = Phase::Idle;
        (self.standing.state, self.standing.progress) = (State::Refused(refusal), 0);
    }

    /// The press was taken from the motor.
    pub fn interrupt(&mut self) {
        if self.running() {
            self.refuse(Refusal::Interrupted);
        }
    }

    /// Forgets all presses and what they propose: gains or parameters are others now, or the host wants so.
    pub fn forget(&mut self) {
        if self.busy() {
            self.refuse(Refusal::Interrupted);
        }
        self.fresh = true;
        self.proposal = Proposal::NONE;
        self.standing = Standing {
            state: self.standing.state,
            proposals: self.standing.proposals.wrapping_add(1),
            ..Standing::default()
        };
    }

    /// The speed to follow while it presses.
    pub fn reference(&self, motion: &mut SpeedLoop, config: &Shaped<ROWS, COLUMNS>, limits: &mut Limits) -> Reference {
        self.press.reference(motion, config, limits)
    }

    /// Takes a frame of the press.
    pub fn observe(&mut self, view: &PressView<ROWS, COLUMNS>, config: &Shaped<ROWS, COLUMNS>) {
        if !self.running() {
            return;
        }
        self.press.observe(view, config);
        if self.cleared < ROWS {
            self.readings.clear(self.cleared);
            self.cleared += 1;
        } else if let Some(way) = self.press.sampled() {
            let whole = Press::depth_goal(config).to_bits();
            self.readings.take(way.to_bits(), whole, view.picture);
            self.standing.progress = percent(i64::from(way.to_bits()), i64::from(whole)).min(50);
            // While it slows down from the approach it may leave again what it just touched.
            if way.to_bits() > whole / 8 && view.contact.force < config.contact_off {
                return self.refuse(Refusal::Lost);
            }
        }
        if let Identification::Refused(cause) = self.press.outcome() {
            self.end(cause, view.contact, config);
        }
    }

    /// The press is at its end: what became of it is worked out, or why not.
    fn end(&mut self, cause: crate::identify::Refusal, contact: &Contact, config: &Shaped<ROWS, COLUMNS>) {
        use crate::identify::Refusal as Cause;
        match cause {
            Cause::NoContact => return self.refuse(Refusal::NoContact),
            Cause::Interrupted | Cause::NotReady => return self.refuse(Refusal::Interrupted),
            _ => {}
        }
        if self.readings.steps() < judge::STEPS_LEAST {
            let stalled = cause == Cause::Stalled;
            return self.refuse(if stalled { Refusal::Stalled } else { Refusal::TooLittle });
        }
        let radii = |length: Millimetres| {
            number::held((i64::from(length.to_bits()) * i64::from(config.geometry.inverse_radius)) >> (56 - BITS))
        };
        self.centre = [radii(contact.centre_x), radii(contact.centre_y)];
        self.pose = Pose { touch: radii(self.press.touched()), axis: self.centre, tilt: [0; 2], roundness: 0 };
        self.phase = Phase::Travel(0);
    }

    /// A frame's share of what is left to be worked out.
    #[inline(always)]
    pub fn work(&mut self, array: &Array<ROWS, COLUMNS>, config: &Shaped<ROWS, COLUMNS>) {
        if !matches!(self.phase, Phase::Idle | Phase::Press) {
            self.work_on(array, config);
        }
    }

    #[inline(never)]
    fn work_on(&mut self, array: &Array<ROWS, COLUMNS>, config: &Shaped<ROWS, COLUMNS>) {
        self.phase = match self.phase {
            Phase::Idle | Phase::Press => return,
            Phase::Travel(step) => {
                let (travel, part) = self.readings.measure(step, config);
                if let (Some(own), Some(whole)) = (self.travel.get_mut(step), self.expected.get_mut(step)) {
                    (*own, *whole) = (travel, part);
                }
                if step + 1 < STEPS { Phase::Travel(step + 1) } else { Phase::Settle(0) }
            }
            Phase::Settle(place) => {
                self.readings.settle(place / COLUMNS, place % COLUMNS, &self.expected);
                self.equations = Equations::NONE;
                self.follow(place, 50, Phase::Settle, Phase::Zero(0, 0))
            }
            Phase::Zero(round, place) => {
                self.zero = self.pose.zero(taxel(place / COLUMNS, place % COLUMNS, config), pitch(config));
                Phase::Line(round, place)
            }
            Phase::Line(round, place) => {
                let (row, column) = (place / COLUMNS, place % COLUMNS);
                let zero = self.zero.filter(|_| !self.bad(row, column));
                let reading = self.readings.of(row, column);
                self.line = zero.and_then(|zero| Line::of(&zero, &self.travel, &reading));
                Phase::Take(round, place)
            }
            Phase::Take(round, place) => {
                if let (Some(zero), Some(line)) = (&self.zero, &self.line) {
                    self.equations.take(zero, line);
                }
                self.follow(place, 60, |place| Phase::Zero(round, place), Phase::Solve(round, 0))
            }
            Phase::Solve(round, step) => self.solve(round, step),
            Phase::Expect(place, part) => {
                self.expect(place, part, config);
                if part + 1 < expected::PARTS { Phase::Expect(place, part + 1) } else { Phase::Compare(place) }
            }
            Phase::Compare(place) => {
                self.compare(place / COLUMNS, place % COLUMNS);
                self.follow(place, 80, |place| Phase::Expect(place, 0), Phase::Judge)
            }
            Phase::Judge => return self.conclude(config),
            Phase::Propose(place) => {
                self.propose(place, array, config);
                let next = self.follow(place, 90, Phase::Propose, Phase::Idle);
                if next == Phase::Idle {
                    self.fresh = false;
                    self.standing.proposals = self.standing.proposals.wrapping_add(1);
                    (self.standing.state, self.standing.progress) = (State::Done, 100);
                }
                next
            }
        };
    }

    /// The same for the next taxel, or what comes behind the last one.
    fn follow(&mut self, place: usize, percent: u8, same: impl Fn(usize) -> Phase, then: Phase) -> Phase {
        self.standing.progress = self.standing.progress.max(percent);
        if place + 1 < Self::TAXELS { same(place + 1) } else { then }
    }

    fn solve(&mut self, round: u8, step: u8) -> Phase {
        // The last round only judges.
        if round + 1 == ROUNDS {
            (self.totals, self.expected) = (Totals::NONE, [0; STEPS]);
            return Phase::Expect(0, 0);
        }
        if step == 0 {
            if round <= FREE_ROUNDS {
                self.scatter = if round == FREE_ROUNDS { self.equations.misfit() } else { 0 };
            }
            self.system = self.equations.system(&self.pose, self.scatter);
        } else if step <= System::PIVOTS {
            self.system.eliminate(step - 1);
        } else {
            self.pose = self.system.solve(&self.pose);
            self.equations = Equations::NONE;
            return Phase::Zero(round + 1, 0);
        }
        Phase::Solve(round, step + 1)
    }

    /// A part of what a taxel should read.
    fn expect(&mut self, place: usize, part: u8, config: &Shaped<ROWS, COLUMNS>) {
        let (row, column) = (place / COLUMNS, place % COLUMNS);
        let at = taxel(row, column, config);
        if part == 0 {
            self.expected = [0; STEPS];
        }
        let step = self.depth_goal(config) / STEPS as i64;
        expected::add_part(&mut self.expected, &self.pose, at, pitch(config), part, &self.travel, step);
    }

    /// What a taxel reads of what it should.
    fn compare(&mut self, row: usize, column: usize) {
        let sums = if self.bad(row, column) {
            Sums::NONE
        } else {
            let reading = self.readings.of(row, column);
            let sums = Sums::of(&reading, &self.expected, &self.travel);
            self.totals.take(&reading, &self.expected, &self.travel, sums.share());
            sums
        };
        self.readings.keep(row, column, sums.to_words());
    }

    /// The whole press in tip radii.
    fn depth_goal(&self, config: &Shaped<ROWS, COLUMNS>) -> i64 {
        (i64::from(Press::depth_goal(config).to_bits()) * i64::from(config.geometry.inverse_radius)) >> (56 - BITS)
    }

    /// Takes the press, or refuses it.
    fn conclude(&mut self, config: &Shaped<ROWS, COLUMNS>) {
        if let Some(refusal) = judge::refusal(self.centre, &self.pose, &self.equations, &self.totals, config) {
            return self.refuse(refusal);
        }
        self.standing.presses = (self.standing.presses + 1).min(PRESSES_MAX);
        self.standing.reached = 0;
        self.phase = Phase::Propose(0);
    }

    fn propose(&mut self, place: usize, array: &Array<ROWS, COLUMNS>, config: &Shaped<ROWS, COLUMNS>) {
        let (row, column) = (place / COLUMNS, place % COLUMNS);
        let Some(sums) = self.sums.get_mut(row).and_then(|row| row.get_mut(column)) else { return };
        let now = Sums::from_words(self.readings.kept(row, column));
        if self.fresh {
            *sums = Sums::NONE;
        }
        sums.add(&now, self.totals.highest);
        let reached = self.proposal.set(place, sums, array.gain(row, column), config);
        self.standing.reached += u16::from(reached);
    }

    fn bad(&self, row: usize, column: usize) -> bool {
        self.readings.bad.get(row).is_some_and(|bad| bad >> (column & 31) & 1 != 0)
    }
}

/// A taxel's middle from the array's, in tip radii, Q30.
fn taxel<const ROWS: usize, const COLUMNS: usize>(
    row: usize,
    column: usize,
    config: &Shaped<ROWS, COLUMNS>,
) -> [i64; 2] {
    let place = |of: &[i32], at: usize| i64::from(of.get(at).copied().unwrap_or(0)) << (BITS - PLACE_BITS);
    [place(&config.columns, column), place(&config.rows, row)]
}

/// The pitch in tip radii, Q30.
fn pitch<const ROWS: usize, const COLUMNS: usize>(config: &Shaped<ROWS, COLUMNS>) -> i64 {
    i64::from(config.geometry.pitch) << 2
}

fn percent(part: i64, whole: i64) -> u8 {
    (part.max(0) * 100).checked_div(whole).unwrap_or(0).min(100) as u8
}
