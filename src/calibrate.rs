//! The taxels' gains from presses onto a hard flat plate, without a load cell.
//!
//! A press goes slowly into the plate while the encoder tells how deep ([`crate::identify::Press`]); every taxel's mean
//! reading is kept for 24 steps of the travel (`Readings`). What comes then is spread over frames, a part of a taxel in
//! each:
//!
//! 1. the pose, from where the lines of the taxels cross zero, which no gain moves (`Pose`),
//! 2. what each taxel should read by the model (`expected`), and by how much it reads more,
//! 3. whether that was a press on something hard and flat that stood still (`judge`),
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
mod standing;
mod work;

pub use proposal::{Proposal, UNKNOWN};
pub use standing::{Refusal, Standing, State};

/// What the evaluation is made of, to measure what it costs. It may change at any time.
#[doc(hidden)]
pub mod parts {
    pub use super::expected::add_part;
    pub use super::pose::{Equations, Line, Pose};
    pub use super::proposal::Sums;
    pub use super::series::{Readings, STEPS, Series};
}

use crate::config::Shaped;
use crate::contact::Contact;
use crate::identify::{Identification, Press, PressView};
use crate::units::Millimetres;
use judge::Totals;
use number::BITS;
use pose::{Equations, Line, Pose, System, Zero};
use proposal::Sums;
use series::{Readings, STEPS, Series};

/// A calibration under way, and what it proposes.
#[derive(Clone, Debug)]
pub struct Calibrator<const ROWS: usize, const COLUMNS: usize> {
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
    /// Nothing asked for.
    pub const fn new() -> Self {
        Self {
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

    /// The same in place. What a press is worked out with is begun by each press, so it may stay.
    pub fn renew(&mut self) {
        self.phase = Phase::Idle;
        self.forget();
        self.standing = Standing::default();
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
    pub fn start(&mut self) {
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

    /// Takes a frame of the press.
    pub fn observe(&mut self, press: &Press, view: &PressView<ROWS, COLUMNS>, config: &Shaped<ROWS, COLUMNS>) {
        if !self.running() {
            return;
        }
        if self.cleared < ROWS {
            self.readings.clear(self.cleared);
            self.cleared += 1;
        } else if let Some(way) = press.sampled() {
            let whole = Press::depth_goal(config).to_bits();
            self.readings.take(way.to_bits(), whole, view.picture);
            self.standing.progress = percent(i64::from(way.to_bits()), i64::from(whole)).min(50);
            // While it slows down from the approach it may leave again what it just touched.
            if way.to_bits() > whole / 8 && view.contact.force < config.contact_off {
                return self.refuse(Refusal::Lost);
            }
        }
        if let Identification::Refused(cause) = press.outcome() {
            self.end(cause, press, view.contact, config);
        }
    }

    /// The press is at its end: what became of it is worked out, or why not.
    fn end(
        &mut self,
        cause: crate::identify::Refusal,
        press: &Press,
        contact: &Contact,
        config: &Shaped<ROWS, COLUMNS>,
    ) {
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
            number::clamped((i64::from(length.to_bits()) * i64::from(config.geometry.inverse_radius)) >> (56 - BITS))
        };
        self.centre = [radii(contact.centre_x), radii(contact.centre_y)];
        self.pose = Pose { touch: radii(press.touched()), axis: self.centre, tilt: [0; 2], roundness: 0 };
        self.phase = Phase::Travel(0);
    }
}

fn percent(part: i64, whole: i64) -> u8 {
    (part.max(0) * 100).checked_div(whole).unwrap_or(0).min(100) as u8
}
