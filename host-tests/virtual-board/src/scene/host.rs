//! The scene's host: writes goals when the link lets them through, reads the status once a millisecond.

use super::MS;
use super::bus::{self, BYTE_NS, GOAL_BYTES, Listener};
use super::finger::{Clock, Finger, Seen};
use crate::{Error, Rig};
use fingertip::config::newtons;
use fingertip::pipeline::{Command, Status};
use fingertip::safety::Limits;
use sim::effects::link::{self, Stages as _};
use sim::effects::set::{Named, Parts, Set};
use sim::scene::Scene;
use sim::watch::{Cost, Step, Watch};
use std::collections::VecDeque;

/// The line is busy with a read and its answer for at most so long.
const READ_NS: u64 = 450_000;
/// A goal's packet on the line.
const GOAL_NS: u64 = GOAL_BYTES * BYTE_NS;

/// A goal on its way.
#[derive(Clone, Copy, Debug)]
struct Goal {
    /// Its last byte arrives then.
    arrives_ns: u64,
    goal_mn: i32,
}

/// The host of one finger during a run.
pub struct Host {
    finger: usize,
    host: sim::host::Host,
    link: link::Named,
    clock: Clock,
    start_ns: u64,
    watchdog_ns: u64,
    /// On their way or not yet taken by a step, in order.
    goals: VecDeque<Goal>,
    /// When the last of them is through.
    line_free_ns: u64,
    command: Command,
    listener: Listener,
    status: Status,
    /// From the converters' number of a frame to the board's own, as far as it was seen.
    offset: i32,
    /// The frames of the millisecond before: an early answer speaks of its last.
    before: Vec<Seen>,
    /// The number of the frame that was shown last.
    shown: u64,
    /// When the last goal arrived.
    heard_ns: u64,
}

impl Host {
    /// Before the start.
    pub fn new(scene: &Scene, finger: usize, start_ns: u64) -> Self {
        let Parts { link, .. } = Named::of(scene, finger);
        let watchdog_ms = scene.table("host").whole("watchdog_ms") as u64;
        Self {
            finger,
            host: sim::host::Host::new(scene),
            link,
            clock: Clock::new(start_ns),
            start_ns,
            watchdog_ns: watchdog_ms * MS,
            goals: VecDeque::new(),
            line_free_ns: 0,
            command: Command { torque: true, tare_request: 1, ..Command::default() },
            listener: Listener::default(),
            status: Status::default(),
            offset: i32::MIN,
            before: Vec::new(),
            shown: 0,
            heard_ns: start_ns,
        }
    }

    /// The scene's time at an instant of the board.
    pub fn time_s(&self, now_ns: u64) -> f64 {
        self.clock.time_s(now_ns)
    }

    /// How long a second of the board lasts from an instant on.
    pub fn second_s(&mut self, now_ns: u64) -> f64 {
        self.link.second_s(self.clock.time_s(now_ns))
    }

    /// Puts on the line what is due in the millisecond to come.
    ///
    /// # Errors
    /// The emulator stopped.
    pub fn send(&mut self, rig: &mut Rig, second_s: f64, watch: &mut dyn Watch) -> Result<(), Error> {
        let now_ns = rig.now_ns();
        self.clock.run_at(now_ns, second_s);
        let wants = watch.wants_pressures(self.finger, self.clock.time_s(now_ns));
        rig.finger(move |finger| {
            finger.clock.run_at(now_ns, second_s);
            finger.wants_pressures = wants;
        })?;
        let sends = self.plan(now_ns);
        rig.with(move |stand| {
            let wire = stand.session.board_mut().wire();
            sends.iter().for_each(|(from_ns, bytes)| wire.send(*from_ns, bytes));
        })
    }

    /// Shows what came in the millisecond that is over.
    ///
    /// # Errors
    /// The emulator stopped, or the board is not ready.
    pub fn receive(&mut self, rig: &mut Rig, watch: &mut dyn Watch) -> Result<(), Error> {
        let received = rig.take_received()?;
        let answered_ns = received.first().map_or(0, |timed| timed.at_ns - BYTE_NS);
        let read = received.into_iter().filter_map(|timed| self.listener.push(timed.byte)).last();
        let seen = rig.finger(Finger::take_seen)?;
        if let Some(read) = read {
            self.status = read;
            self.find_offset(answered_ns, &seen);
        }
        self.look(read.is_some(), seen, rig.now_ns(), watch)
    }

    /// What the link's effects have cost.
    pub fn costs(&self) -> impl Iterator<Item = Cost> {
        self.link.costs()
    }

    /// What goes on the line in the millisecond to come, and from when.
    fn plan(&mut self, now_ns: u64) -> Vec<(u64, Vec<u8>)> {
        let mut sends = Vec::new();
        let until_s = self.clock.time_s(now_ns + MS + GOAL_NS);
        while let Some((arrives_s, goal_n)) = self.host.arrival(until_s, &mut self.link) {
            // Ends when it is to arrive; the line carries one packet after another.
            let from_ns = self.clock.at_ns(arrives_s).saturating_sub(GOAL_NS).max(self.line_free_ns);
            let goal_mn = (goal_n * 1e3 + 0.5).floor() as i32;
            self.line_free_ns = from_ns + GOAL_NS + 2 * BYTE_NS;
            self.goals.push_back(Goal { arrives_ns: from_ns + GOAL_NS, goal_mn });
            sends.push((from_ns, bus::goal(goal_mn)));
        }
        if let Some(at_ns) = self.read_at_ns(now_ns) {
            sends.push((at_ns, bus::read()));
            sends.sort_by_key(|(from_ns, _)| *from_ns);
        }
        sends
    }

    /// When the line is free for a read in the millisecond to come, if it is.
    ///
    /// The board's bus watchdog counts a read as a sign of life. Where a scene sets it, a read therefore comes only right behind a
    /// goal, and once more when the watchdog must have tripped.
    fn read_at_ns(&mut self, now_ns: u64) -> Option<u64> {
        let until_ns = now_ns + MS;
        let (mut at_ns, mut behind) = (now_ns, false);
        for Goal { arrives_ns, .. } in &self.goals {
            if at_ns < arrives_ns + 2 * BYTE_NS && arrives_ns - GOAL_NS < at_ns + READ_NS {
                at_ns = arrives_ns + 2 * BYTE_NS;
            }
            if (now_ns..until_ns).contains(arrives_ns) {
                (behind, self.heard_ns) = (true, *arrives_ns);
            }
        }
        if at_ns + READ_NS > until_ns {
            return None;
        }
        if self.watchdog_ns > 0 && !behind && now_ns >= self.start_ns {
            if now_ns < self.heard_ns + 2 * self.watchdog_ns + 20 * MS {
                return None;
            }
            self.heard_ns = now_ns;
        }
        Some(at_ns)
    }

    /// The status is of the newest frame that had ended when the answer began, or of the one before where the control step was
    /// still under way: the larger difference is the numbers' own.
    fn find_offset(&mut self, answered_ns: u64, seen: &[Seen]) {
        if let Some(newest) = self.before.iter().chain(seen).rfind(|seen| seen.end_ns < answered_ns) {
            self.offset = self.offset.max(self.status.sequence.wrapping_sub(newest.number as u32) as i32);
        }
    }

    /// A step for the watchers, of what came in this millisecond.
    fn look(&mut self, read: bool, seen: Vec<Seen>, now_ns: u64, watch: &mut dyn Watch) -> Result<(), Error> {
        if now_ns > self.start_ns && self.status.limits.has(Limits::NOT_TARED) {
            let why = "the tare has not ended before the scene's start".into();
            return Err(Error::Host { at_ms: now_ns as f64 * 1e-6, why });
        }
        if now_ns > self.start_ns && self.status.sequence == 0 {
            return Err(Error::Host { at_ms: now_ns as f64 * 1e-6, why: "the board does not answer a read".into() });
        }
        // The frame that the status speaks of. A millisecond without an answer shows nothing, but where reads are rare: then the newest.
        let number = self.status.sequence.wrapping_sub(self.offset as u32);
        let of_status = |seen: &&Seen| read && seen.number as u32 == number;
        let frame = self.before.iter().chain(&seen).find(of_status);
        let newest = seen.last().filter(|_| !read && self.watchdog_ns > 0);
        let frame = frame.or(newest);
        if let Some(frame) = frame.filter(|frame| frame.number > self.shown) {
            self.shown = frame.number;
            let at_ns = self.clock.at_ns(frame.time_s);
            while let Some(goal) = self.goals.pop_front_if(|goal| goal.arrives_ns <= at_ns) {
                self.command.goal = newtons(goal.goal_mn);
            }
            watch.step(&Step {
                finger: self.finger,
                time_s: frame.time_s,
                frame: &frame.frame,
                sense: &frame.sense,
                command: &self.command,
                status: &self.status,
                truth: &frame.truth,
            });
        }
        self.before = seen;
        Ok(())
    }
}
