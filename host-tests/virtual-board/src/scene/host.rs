//! The scene's host on the bus of one board: it writes goals when the link lets them through, and reads the status.
//!
//! The host acts at each step of the world's grid. Goals are sent in time, whatever else is on the line. A read is sent
//! when the line is free for it and its answer, and the read before was answered: every ten frames or more for the
//! status, and when the grip of `[host]` requests a reading. Each answer is shown with the frame that it was made from.

use super::MS;
use super::finger::{Clock, Seen};
use crate::client::{ID, packet};
use crate::wire::{TimedByte, Wire};
use fingertip::command::Command;
use fingertip::config::newtons;
use fingertip::contact::Contact;
use fingertip::link::packet::{Event, Receiver, instruction};
use fingertip::pipeline::Status;
use fingertip::shipped::address;
use fingertip::state::{Fault, Limits, Mode};
use fingertip::units::{Duty, Millimetres, MillimetresPerSecond};
use sim::effects::link::Named;
use sim::events::Request;
use sim::host::Reading;
use sim::scene::Scene;
use std::collections::VecDeque;

/// Longest time for which a read and its answer occupy the line, ns.
const READ_NS: u64 = 450_000;
/// Time after which a read counts as lost, ns.
const LOST_NS: u64 = 10 * MS;
/// Transmission times of a goal and of a read request, ns.
const GOAL_NS: u64 = GOAL_BYTES * BYTE_NS;
const REQUEST_NS: u64 = READ_BYTES * BYTE_NS;
/// Pause between two packets, so that the board separates them, ns. A packet begins at the next event of the emulated
/// part, which may be a slot of the scan later.
const GAP_NS: u64 = 10 * BYTE_NS;
/// Frames between two reads of the board's status: each answer takes time of the emulated core and of the emulator.
const LOOK_FRAMES: u64 = 10;
/// Shortest time between two reads if every frame is shown anyway, ns.
const SELDOM_NS: u64 = 10 * MS;
/// Number of reads in a long scene, about: more frames then pass between two of them.
const LOOKS: f64 = 4_000.0;
/// Number of frames kept until an answer refers to them.
const FRAMES: usize = 128;

/// A goal or a request in transmission.
#[derive(Clone, Copy, Debug)]
struct Sent {
    /// Time at which its last byte arrives, ns.
    arrives_ns: u64,
    write: Write,
}

/// A frame for the display, with the command that the board received and the status that it returned.
pub type Shown = (Seen, Command, Status);

/// The host of one finger during a run.
pub struct Host {
    host: sim::host::Host,
    pub link: Named,
    pub clock: Clock,
    start_ns: u64,
    watchdog_ns: u64,
    /// Packets in transmission or not yet taken by a step, in order.
    sent: VecDeque<Sent>,
    /// Time at which the last of them has arrived, ns.
    line_free_ns: u64,
    /// Times at which requests of the grip must arrive, ns.
    asks_ns: VecDeque<u64>,
    /// A read that is not answered yet: its time, ns, and true if it is for the grip.
    asked: Option<(u64, bool)>,
    /// Time of the next status read, and time between two, ns: whole milliseconds.
    look_ns: u64,
    look_every_ns: u64,
    command: Command,
    receiver: Receiver,
    status: Status,
    /// True once the tare before the start has ended: a scene may request another one.
    ready: bool,
    /// Offset from the converters' frame number to the board's own.
    offset: u32,
    frames: VecDeque<Seen>,
    /// Steps to show that nobody has taken yet.
    pub shown: Vec<Shown>,
    /// Number of the frame that was shown last, and its time, ns.
    newest: u64,
    shown_ns: u64,
    /// Time at which the last goal arrived, ns.
    heard_ns: u64,
    every_frame: bool,
}

impl Host {
    /// Host before the start; `offset` leads from the converters' frame numbers to the board's.
    pub fn new(scene: &Scene, link: Named, start_ns: u64, frame_ns: u64, offset: u32) -> Self {
        let watchdog_ms = scene.table("host").whole("watchdog_ms") as u64;
        let least_ns = (scene.duration_s * 1e9 / LOOKS) as u64;
        Self {
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
            receiver: Receiver::default(),
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

    /// Shows every frame from now on, also frames without an answer; fewer reads are then enough.
    pub fn show_every_frame(&mut self) {
        (self.every_frame, self.look_every_ns) = (true, self.look_every_ns.max(SELDOM_NS));
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

    /// Acts once: processes bytes and frames since the last time, and sends the packets due before the next.
    pub fn turn(&mut self, now_ns: u64, next_ns: u64, received: Vec<TimedByte>, seen: Vec<Seen>, wire: &mut Wire) {
        self.frames.extend(seen);
        self.frames.drain(..self.frames.len().saturating_sub(FRAMES));
        for timed in received {
            if let Some(status) = heard(&mut self.receiver, timed.byte) {
                self.answered(status, timed.at_ns);
            }
        }
        // If reads are rare, the frames in between are shown with the status that was read last.
        if self.watchdog_ns > 0 && now_ns >= self.shown_ns + self.look_every_ns {
            let newest = self.frames.back().copied();
            newest.into_iter().for_each(|seen| self.show(seen, now_ns));
        }
        if self.every_frame {
            // The world moves from this time on.
            let begins_ns = self.start_ns - MS;
            let unseen = self.frames.iter().filter(|seen| seen.number > self.newest && seen.end_ns >= begins_ns);
            unseen.copied().collect::<Vec<_>>().into_iter().for_each(|seen| self.show(seen, now_ns));
        }
        self.send(now_ns, next_ns, wire);
    }

    fn answered(&mut self, status: Status, at_ns: u64) {
        self.status = status;
        self.ready |= !status.limits.has(Limits::NOT_TARED);
        if self.asked.take().is_some_and(|(_, for_grip)| for_grip) {
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
        self.shown.push((seen, self.command, self.status));
    }

    fn send(&mut self, now_ns: u64, next_ns: u64, wire: &mut Wire) {
        let until_s = self.clock.time_s(next_ns + GOAL_NS);
        while let Some((arrives_s, goal_n)) = self.host.arrival(until_s, &mut |sent_s| self.link.pass(sent_s)) {
            let goal_mn = (goal_n * 1e3 + 0.5).floor() as i32;
            self.write(self.clock.at_ns(arrives_s), now_ns, Write::Goal(goal_mn), wire);
        }
        while let Some(request) = self.host.request(until_s) {
            self.write(now_ns, now_ns, Write::Request(request), wire);
        }
        if now_ns >= self.start_ns {
            let (now_s, until_s) = (self.clock.time_s(now_ns), self.clock.time_s(next_ns));
            if let Some(arrives_s) = self.host.ask(now_s, until_s, &mut |sent_s| self.link.pass(sent_s)) {
                self.asks_ns.push_back(self.clock.at_ns(arrives_s));
            }
        }
        if self.asked.is_none_or(|(at_ns, _)| now_ns > at_ns + LOST_NS) {
            self.asked = self.read(now_ns, next_ns);
            if let Some((at_ns, _)) = self.asked {
                wire.send(at_ns, &read());
                self.line_free_ns = at_ns + REQUEST_NS + GAP_NS;
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
    fn read(&mut self, now_ns: u64, next_ns: u64) -> Option<(u64, bool)> {
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
        Some((at_ns, for_grip))
    }

    /// Earliest time from which the line is free of goals for the duration of a read, ns.
    fn free_from_ns(&self, mut at_ns: u64) -> u64 {
        for Sent { arrives_ns, .. } in &self.sent {
            if at_ns < arrives_ns + GAP_NS && arrives_ns - GOAL_NS < at_ns + READ_NS {
                at_ns = arrives_ns + GAP_NS;
            }
        }
        at_ns
    }

    /// Time of the next status read.
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

/// Time of a byte at 3 Mbaud, rounded up.
pub const BYTE_NS: u64 = 3_334;
/// Bytes of a goal's packet, the longest that is written.
pub const GOAL_BYTES: u64 = 16;
pub const READ_BYTES: u64 = 14;
/// The status registers, read at once.
const FROM: u16 = address::PRESENT_MODE;
const BYTES: u16 = address::SUPPLY_MV - FROM;

/// Value that a packet writes into the board.
#[derive(Clone, Copy, Debug)]
pub enum Write {
    Goal(i32),
    Request(Request),
}

impl Write {
    pub fn packet(self) -> Vec<u8> {
        let (register, value) = match self {
            Self::Goal(goal_mn) => (address::GOAL_FORCE_MN, goal_mn.to_le_bytes().to_vec()),
            Self::Request(Request::Torque(on)) => (address::TORQUE_ENABLE, vec![on.into()]),
            Self::Request(Request::Tare) => (address::TARE, vec![1]),
            Self::Request(Request::Clear) => (address::CLEAR_FAULT, vec![1]),
        };
        packet(ID, instruction::WRITE, &[&register.to_le_bytes()[..], &value].concat())
    }

    /// Puts it into the command that the board then has.
    pub fn apply(self, command: &mut Command) {
        match self {
            Self::Goal(goal_mn) => command.goal = newtons(goal_mn),
            Self::Request(request) => request.apply(command),
        }
    }
}

/// Packet that requests the status registers.
pub fn read() -> Vec<u8> {
    let ([a, b], [c, d]) = (FROM.to_le_bytes(), BYTES.to_le_bytes());
    packet(ID, instruction::READ, &[a, b, c, d])
}

/// Takes a byte of the image; returns the status registers if the byte completes them.
fn heard(receiver: &mut Receiver, byte: u8) -> Option<Status> {
    if receiver.push(byte) != Some(Event::Packet) {
        return None;
    }
    let packet = receiver.packet();
    let of_board = packet.id == ID && packet.instruction == instruction::STATUS;
    // An error byte comes first; its top bit only says that the board has a fault.
    let (error, data) = packet.params.split_first()?;
    if of_board && error & 0x7f == 0 { status(data) } else { None }
}

fn status(bytes: &[u8]) -> Option<Status> {
    let byte = |of: u16| bytes.get(usize::from(of - FROM)).copied();
    let half = |of: u16| bytes.get(usize::from(of - FROM)..)?.first_chunk().copied().map(u16::from_le_bytes);
    let word = |of: u16| bytes.get(usize::from(of - FROM)..)?.first_chunk().copied().map(i32::from_le_bytes);
    let mm = |of: u16| word(of).map(|um| Millimetres::from_bits(scaled(um, 1 << 24)));
    Some(Status {
        sequence: word(address::FRAME_COUNTER)? as u32,
        missed_frames: word(address::MISSED_FRAMES)? as u32,
        mode: Mode::of(byte(address::PRESENT_MODE)?).unwrap_or(Mode::Fault),
        fault: Fault::of(byte(address::FAULT)?),
        limits: Limits(half(address::LIMITS)?),
        contact: Contact {
            force: newtons(word(address::PRESENT_FORCE_MN)?),
            indentation: mm(address::INDENTATION_UM)?,
            centre_x: mm(address::CENTRE_X_UM)?,
            centre_y: mm(address::CENTRE_Y_UM)?,
            radius: mm(address::CONTACT_RADIUS_UM)?,
            peak_pa: word(address::PEAK_PRESSURE_PA)? as u32,
            confidence: byte(address::CONFIDENCE)?,
            bad_taxels: byte(address::BAD_TAXELS)?,
            ..Contact::default()
        },
        travel: mm(address::TRAVEL_UM)?,
        speed: MillimetresPerSecond::from_bits(scaled(word(address::SPEED_UM_PER_S)?, 1 << 16)),
        duty: Duty(scaled(i32::from(half(address::DUTY_PERMILLE)? as i16), i32::from(Duty::FULL).into()) as i16),
        ..Status::default()
    })
}

/// Thousandths in units of the last place.
fn scaled(thousandths: i32, one: i64) -> i32 {
    let bits = (i64::from(thousandths) * one).div_euclid(1000);
    bits.clamp(i32::MIN.into(), i32::MAX.into()) as i32
}
