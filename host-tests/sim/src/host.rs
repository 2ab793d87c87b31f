//! Host on the other end of the bus. It sends its command when the script changes it, and repeats it. If the scene has
//! `read_ms`, it also reads the controller and increases the grip before the contact slips, or after a slip.
//!
//! The host knows only force and centre of pressure. A load along the surface stretches the patch and moves the centre:
//!
//! ```text
//! s = centre - centre at rest        T = grip_n_per_mm |s|
//! margin: the goal is at least T / grip_friction, 10 % more once it has to rise
//! slip:   |s| falls by grip_drop_mm from its largest value at a constant force: the patch springs back as friction falls
//!         from still to slipping. The goal rises by a quarter. Only a loaded contact can slip
//! ```
//!
//! The higher goal remains until the script releases the object. A slip without a fall of friction shows no drop: only
//! the margin helps.
//!
//! Two fingers that hold a free object with independent forces push it aside without end, since two arrays never read
//! alike. So a finger that has advanced by x since its force settled reduces its goal by centre_n_per_mm x, and a
//! finger that was pushed back increases its goal.

use crate::events::{self, Request};
use crate::scene::tables::Values;
use crate::scene::{Goal, Scene};
use fingertip::pipeline::Status;
use std::collections::VecDeque;

/// Link of the host to the board: time of arrival for a time of sending, s; none if the packet is lost.
pub type Pass<'a> = &'a mut dyn FnMut(f64) -> Option<f64>;

#[derive(Clone, Debug, Default)]
pub struct Host {
    script: Vec<Goal>,
    requests: VecDeque<(f64, Request)>,
    silences: Vec<[f64; 2]>,
    next: usize,
    period_s: f64,
    goal_n: f64,
    /// Time of the next packet: a whole number of periods after the last one that was not a repetition.
    send_s: f64,
    said_s: f64,
    repeats: u64,
    flying: VecDeque<(f64, f64)>,
    arrived_n: f64,
    arrived_s: f64,
    reader: Option<Reader>,
    pub sent: u64,
    /// Packets that were sent and do not arrive.
    pub lost: u64,
}

/// Readings of the controller for the grip.
#[derive(Clone, Debug)]
struct Reader {
    grip: Grip,
    period_s: f64,
    read_s: f64,
    answers: VecDeque<(f64, Reading)>,
}

impl Host {
    /// Creates the host at the start of the scene, with a goal of 0.
    pub fn new(scene: &Scene) -> Self {
        let read_ms = scene.table("host").number("read_ms");
        let reader = (read_ms > 0.0).then(|| Reader {
            grip: Grip::new(scene.table("host")),
            period_s: read_ms * 1e-3,
            read_s: 0.0,
            answers: VecDeque::new(),
        });
        Self {
            script: scene.script.clone(),
            requests: Request::all(&scene.events).into(),
            silences: events::silences(&scene.events),
            period_s: scene.table("host").number("period_ms") * 1e-3,
            reader,
            ..Self::default()
        }
    }

    /// Returns the goal that has arrived at the controller by a time. Times never fall.
    pub fn goal_n(&mut self, time_s: f64, pass: Pass) -> f64 {
        while self.arrival(time_s, pass).is_some() {}
        self.arrived_n
    }

    /// Reads the controller when a reading is due. The reading arrives later, or not at all. Times never fall.
    pub fn read(&mut self, time_s: f64, reading: impl FnOnce() -> Reading, pass: Pass) {
        if let Some(asked_s) = self.ask(time_s, time_s, pass) {
            self.hear(asked_s + READ_S, reading());
        }
    }

    /// Requests a reading that is due by a time, at `now_s` or when it is due, whichever is later. Returns the arrival
    /// of the request at the controller; none if nothing is due or the request is lost. Times never fall.
    pub fn ask(&mut self, now_s: f64, until_s: f64, pass: Pass) -> Option<f64> {
        let reader = self.reader.as_mut().filter(|reader| reader.read_s <= until_s)?;
        let at_s = reader.read_s.max(now_s);
        reader.read_s = at_s + reader.period_s;
        pass(at_s)
    }

    /// Receives a reading. It is judged at this time.
    pub fn hear(&mut self, at_s: f64, reading: Reading) {
        if let Some(reader) = &mut self.reader {
            reader.answers.push_back((at_s, reading));
        }
    }

    /// Returns the next packet that arrives by a time, with its goal. Times never fall.
    pub fn arrival(&mut self, time_s: f64, pass: Pass) -> Option<(f64, f64)> {
        self.judge(time_s, pass);
        loop {
            let goal = self.script.get(self.next).filter(|goal| goal.at_s <= self.send_s);
            let at_s = goal.map_or(self.send_s, |goal| goal.at_s);
            if at_s > time_s {
                break;
            }
            if let Some(goal) = goal {
                self.goal_n = goal.goal_n;
                self.next += 1;
            }
            self.send(at_s, pass);
        }
        let packet = self.flying.pop_front_if(|(at_s, _)| *at_s <= time_s)?;
        (self.arrived_s, self.arrived_n) = packet;
        Some(packet)
    }

    /// Returns the next request that reaches the controller by a time. The host repeats a request until it is
    /// acknowledged, so none is lost. Requests of a silent host wait. Times never fall.
    pub fn request(&mut self, time_s: f64) -> Option<Request> {
        let due = self.requests.front().is_some_and(|(at_s, _)| *at_s <= time_s);
        if !due || self.silent(time_s) { None } else { self.requests.pop_front().map(|(_, request)| request) }
    }

    fn silent(&self, time_s: f64) -> bool {
        self.silences.iter().any(|[from_s, until_s]| (*from_s..*until_s).contains(&time_s))
    }

    /// Returns the time since the last packet that arrived, ms.
    pub fn silent_ms(&self, time_s: f64) -> u16 {
        ((time_s - self.arrived_s).max(0.0) * 1e3) as u16
    }

    fn judge(&mut self, time_s: f64, pass: Pass) {
        while let Some(reader) = &mut self.reader
            && let Some((at_s, reading)) = reader.answers.pop_front_if(|(at_s, _)| *at_s <= time_s)
        {
            if reader.grip.judge(self.goal_n, &reading) {
                self.send(at_s, pass);
            }
        }
    }

    fn send(&mut self, at_s: f64, pass: Pass) {
        self.sent += 1;
        // Counting repetitions avoids the drift of a sum of periods.
        if at_s != self.send_s {
            (self.said_s, self.repeats) = (at_s, 0);
        }
        self.repeats += 1;
        self.send_s = self.said_s + self.repeats as f64 * self.period_s;
        let goal_n = self.reader.as_ref().map_or(self.goal_n, |reader| reader.grip.goal_n(self.goal_n));
        let silent = self.silent(at_s);
        match pass(at_s).filter(|_| !silent) {
            Some(arrives_s) => {
                let last_s = self.flying.back().map_or(arrives_s, |(at_s, _)| *at_s);
                self.flying.push_back((arrives_s.max(last_s), goal_n));
            }
            None => self.lost += 1,
        }
    }
}

/// Time from the request for a reading to its arrival without further delay: 14 and 23 bytes at 1 Mbaud, and the turn of the controller.
const READ_S: f64 = 0.5e-3;
/// Largest deviation of a settled force from the goal, as a share of the goal.
const SETTLED_SHARE: f64 = 0.1;
/// Readings at a settled force that determine the centre at rest.
const RESTS: u32 = 8;
/// Load, as a share of the trusted friction, from which a drop counts as a slip. The centre of a contact with less load
/// moves by noise alone, and a finger that then presses harder pushes a free object into the other one.
const BEARS: f64 = 0.25;
/// Factors of the goal beyond the margin, and after a slip.
const AHEAD: f64 = 1.1;
const AFTER_SLIP: f64 = 1.25;

#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Reading {
    pub force_n: f64,
    pub centre_mm: [f64; 2],
    pub travel_mm: f64,
}

impl Reading {
    pub fn of(status: &Status) -> Self {
        let contact = &status.contact;
        Self {
            travel_mm: status.travel.0.to_num(),
            force_n: contact.force.0.to_num(),
            centre_mm: [contact.centre_x.0.to_num(), contact.centre_y.0.to_num()],
        }
    }
}

/// Policy of the grip, and its state.
#[derive(Clone, Debug, Default)]
struct Grip {
    friction: f64,
    n_per_mm: f64,
    drop_mm: f64,
    most_n: f64,
    centre_n_per_mm: f64,
    on_mm: f64,
    rest_travel_mm: f64,
    rest_mm: [f64; 2],
    rests: u32,
    farthest_mm: f64,
    asked_n: f64,
}

impl Grip {
    pub fn new(host: &Values) -> Self {
        Self {
            friction: host.number("grip_friction"),
            n_per_mm: host.number("grip_n_per_mm"),
            drop_mm: host.number("grip_drop_mm"),
            most_n: host.number("grip_most_n"),
            centre_n_per_mm: host.number("centre_n_per_mm"),
            ..Self::default()
        }
    }

    pub fn goal_n(&self, script_n: f64) -> f64 {
        // Centres the object by at most half of the force of the script.
        let centring_n = (self.centre_n_per_mm * self.on_mm).clamp(-0.5 * script_n, 0.5 * script_n);
        if script_n > 0.0 { self.grip_n(script_n) - centring_n } else { 0.0 }
    }

    fn grip_n(&self, script_n: f64) -> f64 {
        script_n.max(self.asked_n)
    }

    /// Judges a reading. Returns true if the goal rises now.
    pub fn judge(&mut self, script_n: f64, reading: &Reading) -> bool {
        if script_n == 0.0 {
            (self.rests, self.farthest_mm, self.asked_n, self.on_mm) = (0, 0.0, 0.0, 0.0);
            return false;
        }
        let goal_n = self.grip_n(script_n);
        let settled = (reading.force_n - self.goal_n(script_n)).abs() <= SETTLED_SHARE * goal_n;
        if self.rests < RESTS {
            if settled {
                self.rests += 1;
                let share = 1.0 / f64::from(self.rests);
                for (rest, centre) in self.rest_mm.iter_mut().zip(reading.centre_mm) {
                    *rest += share * (centre - *rest);
                }
                self.rest_travel_mm += share * (reading.travel_mm - self.rest_travel_mm);
            }
            return false;
        }
        self.on_mm = reading.travel_mm - self.rest_travel_mm;
        let [x, y] = [0, 1].map(|axis| reading.centre_mm[axis] - self.rest_mm[axis]);
        let shift_mm = (x * x + y * y).sqrt();
        let bears = self.n_per_mm * self.farthest_mm >= BEARS * self.friction * goal_n;
        let dropped = settled && bears && shift_mm < self.farthest_mm - self.drop_mm;
        self.farthest_mm = if dropped { shift_mm } else { self.farthest_mm.max(shift_mm) };
        let needed_n = self.n_per_mm * shift_mm / self.friction;
        let mut asked_n = goal_n;
        if needed_n > goal_n {
            asked_n = AHEAD * needed_n;
        }
        if dropped {
            asked_n = asked_n.max(AFTER_SLIP * goal_n);
        }
        self.asked_n = asked_n.min(self.most_n);
        self.grip_n(script_n) > goal_n
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn at_rest() -> Grip {
        let mut grip = Grip { friction: 0.5, n_per_mm: 1.0, drop_mm: 0.05, most_n: 4.0, ..Grip::default() };
        for _ in 0..RESTS {
            assert!(!grip.judge(1.0, &reading(1.0, 0.2)));
        }
        grip
    }

    fn reading(force_n: f64, y_mm: f64) -> Reading {
        Reading { force_n, centre_mm: [0.3, y_mm], travel_mm: 6.0 }
    }

    #[test]
    fn noise_of_a_contact_that_bears_nothing_is_no_slip() {
        let mut grip = at_rest();
        assert!(!grip.judge(1.0, &reading(1.0, 0.32)), "less than a quarter of what friction holds");
        assert!(!grip.judge(1.0, &reading(1.0, 0.2)));
        assert!(!grip.judge(1.0, &reading(1.0, 0.33)) && grip.judge(1.0, &reading(1.0, 0.2)));
    }

    #[test]
    fn a_drop_is_a_slip_only_while_the_force_stands() {
        let mut grip = at_rest();
        assert!(!grip.judge(1.0, &reading(1.0, 0.6)));
        assert!(!grip.judge(1.0, &reading(1.0, 0.56)), "less than the drop that counts");
        assert!(!grip.judge(1.0, &reading(0.7, 0.4)), "the force falls too");
        assert!(grip.judge(1.0, &reading(1.0, 0.5)));
        assert_eq!(grip.goal_n(1.0), 1.25);
        assert!(grip.judge(1.0, &reading(1.25, 9.0)));
        assert_eq!(grip.goal_n(1.0), 4.0, "never more than the most");
        assert!(!grip.judge(0.0, &reading(1.0, 0.5)));
        assert_eq!(grip.goal_n(0.0), 0.0, "the script lets go");
        assert_eq!(grip.goal_n(1.0), 1.0, "and what was asked for is forgotten");
    }
}
