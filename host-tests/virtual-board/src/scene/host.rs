//! The scene's host on the bus of one board: it writes goals when the link lets them through, and reads the status.
//!
//! It takes a turn at each step of the world's grid. Goals go out in time, whatever else is on the line. A read goes
//! out where the line is free for it and for its answer, and where the one before was answered: once in ten frames or
//! more to see what the board does, and when the grip of `[host]` asks for a reading. Each answer is shown, beside the
//! frame that it was made from.

use super::MS;
use super::bus::{self, BYTE_NS, GOAL_BYTES, Listener, READ_BYTES, Write};
use super::finger::{Clock, Seen};
use crate::wire::{TimedByte, Wire};
use fingertip::command::Command;
use fingertip::pipeline::Status;
use fingertip::state::Limits;
use sim::effects::link::Named;
use sim::host::Reading;
use sim::scene::Scene;
use sim::watch::{Cost, Step};
use std::collections::VecDeque;

/// The line is busy with a read and its answer for at most so long.
const READ_NS: u64 = 450_000;
/// What was not answered by then never is.
const LOST_NS: u64 = 10 * MS;
/// Packets on the line.
const GOAL_NS: u64 = GOAL_BYTES * BYTE_NS;
const REQUEST_NS: u64 = READ_BYTES * BYTE_NS;
/// The line rests so long between two packets, for the board to take them for two: a packet begins where the emulated
/// part next has something to do, which may be a slot of the scan later.
const GAP_NS: u64 = 10 * BYTE_NS;
/// A look at what the board does comes once in so many frames: an answer takes the core's time as well as the
/// emulator's.
const LOOK_FRAMES: u64 = 10;
/// Where every frame is shown anyway.
const SELDOM_NS: u64 = 10 * MS;
/// In a long scene there are about so many looks, and more frames between them.
const LOOKS: f64 = 4_000.0;
/// Frames that are kept until an answer speaks of them.
const FRAMES: usize = 128;

/// A goal or a request on its way.
#[derive(Clone, Copy, Debug)]
struct Sent {
    /// Its last byte arrives then.
    arrives_ns: u64,
    write: Write,
}

/// A read that is not answered yet.
#[derive(Clone, Copy, Debug)]
struct Asked {
    at_ns: u64,
    for_grip: bool,
}

/// What there is to show of a step.
#[derive(Clone, Copy, Debug)]
pub struct Shown {
    finger: usize,
    seen: Seen,
    command: Command,
    status: Status,
}

impl Shown {
    /// For the watchers.
    pub fn step(&self) -> Step<'_> {
        Step {
            finger: self.finger,
            time_s: self.seen.time_s,
            frame: &self.seen.frame,
            sense: &self.seen.sense,
            command: &self.command,
            status: &self.status,
            truth: &self.seen.truth,
        }
    }
}

/// The host of one finger during a run.
pub struct Host {
    finger: usize,
    host: sim::host::Host,
    link: Named,
    clock: Clock,
    start_ns: u64,
    watchdog_ns: u64,
    /// On their way or not yet taken by a step, in order.
    sent: VecDeque<Sent>,
    /// When the last of them is through.
    line_free_ns: u64,
    /// When requests of the grip are to arrive.
    asks_ns: VecDeque<u64>,
    asked: Option<Asked>,
    /// When to read next, to see what the board does, and how often: in whole milliseconds.
    look_ns: u64,
    look_every_ns: u64,
    command: Command,
    listener: Listener,
    status: Status,
    /// Whether the tare before the start was seen to end: a scene may ask for another one.
    ready: bool,
    /// From the converters' number of a frame to the board's own.
    offset: u32,
    frames: VecDeque<Seen>,
    shown: Vec<Shown>,
    /// The number of the frame that was shown last, and when that was.
    newest: u64,
    shown_ns: u64,
    /// When the last goal arrived.
    heard_ns: u64,
    every_frame: bool,
}

impl std::fmt::Debug for Host {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Host").field("finger", &self.finger).field("asked", &self.asked).finish_non_exhaustive()
    }
}

impl Host {
    /// Before the start, with the time of a frame, what lies between it and the board, and between the converters'
    /// numbers of frames and the board's.
    pub fn new(scene: &Scene, finger: usize, link: Named, start_ns: u64, frame_ns: u64, offset: u32) -> Self {
        let watchdog_ms = scene.table("host").whole("watchdog_ms") as u64;
        let least_ns = (scene.duration_s * 1e9 / LOOKS) as u64;
        Self {
            finger,
            host: sim::host::Host::new(scene),
            link,
            clock: Clock::new(start_ns),
            start_ns,
            watchdog_ns: watchdog_ms * MS,
            sent: VecDeque::new(),
            line_free_ns: 0,
            asks_ns: VecDeque::new(),
            asked: None,
            look_ns: 0,
            look_every_ns: (((LOOK_FRAMES * frame_ns).max(least_ns) + MS / 2) / MS).max(1) * MS,
            command: Command { torque: true, tare_request: 1, ..Command::default() },
            listener: Listener::default(),
            status: Status::default(),
            ready: false,
            offset,
            frames: VecDeque::new(),
            shown: Vec::new(),
            newest: 0,
            shown_ns: start_ns,
            heard_ns: start_ns,
            every_frame: false,
        }
    }

    /// From now on every frame is shown, those too that no answer speaks of; so few looks do.
    pub fn show_every_frame(&mut self) {
        (self.every_frame, self.look_every_ns) = (true, self.look_every_ns.max(SELDOM_NS));
    }

    /// From an instant on a second of the board lasts so long.
    pub fn run_at(&mut self, at_ns: u64, second_s: f64) {
        self.clock.run_at(at_ns, second_s);
    }

    /// What the link's effects have cost.
    pub fn costs(&self) -> impl Iterator<Item = Cost> {
        self.link.costs()
    }

    /// What there is to show since the last time.
    pub fn take_shown(&mut self) -> Vec<Shown> {
        std::mem::take(&mut self.shown)
    }

    /// Why the board is not fit for the scene, if so.
    pub fn trouble(&self, now_ns: u64) -> Option<&'static str> {
        if self.ready || now_ns <= self.start_ns + self.look_every_ns {
            None
        } else if self.status.limits.has(Limits::NOT_TARED) {
            Some("the tare has not ended before the scene's start")
        } else if self.status.sequence == 0 {
            Some("the board does not answer a read")
        } else {
            None
        }
    }

    /// A turn: takes in what came from the board and the frames made since the last one, and puts on the line what is
    /// to go out until the next one.
    pub fn turn(&mut self, now_ns: u64, next_ns: u64, received: Vec<TimedByte>, seen: Vec<Seen>, wire: &mut Wire) {
        self.frames.extend(seen);
        while self.frames.len() > FRAMES {
            self.frames.pop_front();
        }
        for timed in received {
            if let Some(status) = self.listener.push(timed.byte) {
                self.answered(status, timed.at_ns);
            }
        }
        // Where reads are rare the frames between are shown beside what was read last.
        if self.watchdog_ns > 0 && now_ns >= self.shown_ns + self.look_every_ns {
            let newest = self.frames.back().copied();
            newest.into_iter().for_each(|seen| self.show(seen, now_ns));
        }
        if self.every_frame {
            // From when the world moves on.
            let begins_ns = self.start_ns - MS;
            let unseen = self.frames.iter().filter(|seen| seen.number > self.newest && seen.end_ns >= begins_ns);
            unseen.copied().collect::<Vec<_>>().into_iter().for_each(|seen| self.show(seen, now_ns));
        }
        self.send(now_ns, next_ns, wire);
    }

    fn answered(&mut self, status: Status, at_ns: u64) {
        self.status = status;
        self.ready |= !status.limits.has(Limits::NOT_TARED);
        if self.asked.take().is_some_and(|asked| asked.for_grip) {
            self.host.hear(self.clock.time_s(at_ns), Reading::of(&status));
        }
        let number = status.sequence.wrapping_sub(self.offset);
        if let Some(seen) = self.frames.iter().find(|seen| seen.number as u32 == number).copied() {
            self.show(seen, at_ns);
        }
    }

    fn show(&mut self, seen: Seen, now_ns: u64) {
        if seen.number <= self.newest {
            return;
        }
        (self.newest, self.shown_ns) = (seen.number, now_ns);
        let at_ns = self.clock.at_ns(seen.time_s);
        while let Some(sent) = self.sent.pop_front_if(|sent| sent.arrives_ns <= at_ns) {
            sent.write.apply(&mut self.command);
        }
        self.shown.push(Shown { finger: self.finger, seen, command: self.command, status: self.status });
    }

    fn send(&mut self, now_ns: u64, next_ns: u64, wire: &mut Wire) {
        let until_s = self.clock.time_s(next_ns + GOAL_NS);
        while let Some((arrives_s, goal_n)) = self.host.arrival(until_s, &mut self.link) {
            let goal_mn = (goal_n * 1e3 + 0.5).floor() as i32;
            self.write(self.clock.at_ns(arrives_s), now_ns, Write::Goal(goal_mn), wire);
        }
        while let Some(request) = self.host.request(until_s) {
            self.write(now_ns, now_ns, Write::Request(request), wire);
        }
        if now_ns >= self.start_ns {
            let (now_s, until_s) = (self.clock.time_s(now_ns), self.clock.time_s(next_ns));
            if let Some(arrives_s) = self.host.ask(now_s, until_s, &mut self.link) {
                self.asks_ns.push_back(self.clock.at_ns(arrives_s));
            }
        }
        if self.asked.is_none_or(|asked| now_ns > asked.at_ns + LOST_NS) {
            self.asked = self.read(now_ns, next_ns);
            if let Some(asked) = self.asked {
                wire.send(asked.at_ns, &bus::read());
                self.line_free_ns = asked.at_ns + REQUEST_NS + GAP_NS;
            }
        }
    }

    /// Writes so that it arrives at an instant; the line carries one packet after another.
    fn write(&mut self, at_ns: u64, now_ns: u64, write: Write, wire: &mut Wire) {
        let from_ns = at_ns.saturating_sub(GOAL_NS).max(self.line_free_ns).max(now_ns);
        self.line_free_ns = from_ns + GOAL_NS + GAP_NS;
        self.sent.push_back(Sent { arrives_ns: from_ns + GOAL_NS, write });
        wire.send(from_ns, &write.packet());
    }

    /// A read that goes out before the next turn, if one is due and the line is free for it.
    fn read(&mut self, now_ns: u64, next_ns: u64) -> Option<Asked> {
        let for_grip = self.asks_ns.front().is_some_and(|arrives_ns| *arrives_ns < next_ns + REQUEST_NS);
        let due_ns =
            if for_grip { self.asks_ns[0].saturating_sub(REQUEST_NS) } else { self.look_due_ns(now_ns, next_ns)? };
        let at_ns = self.free_from_ns(due_ns.max(now_ns));
        if at_ns >= next_ns {
            return None;
        }
        if for_grip {
            self.asks_ns.pop_front();
        }
        self.look_ns = (at_ns + 1).next_multiple_of(self.look_every_ns);
        Some(Asked { at_ns, for_grip })
    }

    /// From when the line is free of goals for as long as a read takes.
    fn free_from_ns(&self, mut at_ns: u64) -> u64 {
        for Sent { arrives_ns, .. } in &self.sent {
            if at_ns < arrives_ns + GAP_NS && arrives_ns - GOAL_NS < at_ns + READ_NS {
                at_ns = arrives_ns + GAP_NS;
            }
        }
        at_ns
    }

    /// When to look at the board next.
    ///
    /// The board's bus watchdog counts a read as a sign of life. Where a scene sets it, a read therefore comes only
    /// right behind a goal, and once more when the watchdog must have tripped.
    fn look_due_ns(&mut self, now_ns: u64, next_ns: u64) -> Option<u64> {
        let due = (self.look_ns < next_ns).then_some(self.look_ns);
        if self.watchdog_ns == 0 || now_ns < self.start_ns {
            return due;
        }
        let arrived = self.sent.iter().rfind(|sent| (now_ns..next_ns).contains(&sent.arrives_ns));
        if let Some(sent) = arrived {
            self.heard_ns = sent.arrives_ns;
            return Some(sent.arrives_ns);
        }
        if now_ns < self.heard_ns + 2 * self.watchdog_ns + 20 * MS {
            return None;
        }
        self.heard_ns = now_ns;
        Some(now_ns)
    }
}
