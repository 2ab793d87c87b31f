//! What a press is worked out to, a part of a taxel in each frame.

use super::expected;
use super::judge::{self, Totals};
use super::number::BITS;
use super::pose::{Equations, Line, System};
use super::proposal::Sums;
use super::series::STEPS;
use super::{Calibrator, Phase, State};
use crate::config::Shaped;
use crate::config::geometry::PLACE_BITS;
use crate::identify::Press;
use crate::pressure::Array;

/// Rounds of the search for the pose: so many free, then with what they leave taken for what the model is off, then one
/// that judges.
const FREE_ROUNDS: u8 = 3;
const ROUNDS: u8 = FREE_ROUNDS + 3;
/// Presses that are taken together at most.
const PRESSES_MAX: u8 = 200;

impl<const ROWS: usize, const COLUMNS: usize> Calibrator<ROWS, COLUMNS> {
    const TAXELS: usize = ROWS * COLUMNS;

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
