//! The host at the other end of the bus: it sends its command when the script changes it, and repeats it. Where the
//! scene says so it reads the controller too, and grips harder when it must.

pub mod grip;

use crate::effects::link::Stages;
use crate::events::{self, Request};
use crate::scene::{Goal, Scene};
use grip::{Grip, Reading};
use std::collections::VecDeque;

/// The host of one finger.
#[derive(Clone, Debug)]
pub struct Host {
    script: Vec<Goal>,
    requests: VecDeque<(f64, Request)>,
    silences: Vec<[f64; 2]>,
    next: usize,
    period_s: f64,
    goal_n: f64,
    /// When it sends next: so many periods after its last packet that was no repetition.
    send_s: f64,
    said_s: f64,
    repeats: u64,
    flying: VecDeque<(f64, f64)>,
    arrived_n: f64,
    arrived_s: f64,
    reader: Option<Reader>,
    /// Packets sent.
    pub sent: u64,
    /// Packets among them that do not arrive.
    pub lost: u64,
}

/// What reads the controller for the grip.
#[derive(Clone, Debug)]
struct Reader {
    grip: Grip,
    period_s: f64,
    read_s: f64,
    answers: VecDeque<(f64, Reading)>,
}

impl Host {
    /// Begins at the scene's start, with no force asked for.
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
            next: 0,
            period_s: scene.table("host").number("period_ms") * 1e-3,
            goal_n: 0.0,
            send_s: 0.0,
            said_s: 0.0,
            repeats: 0,
            flying: VecDeque::new(),
            arrived_n: 0.0,
            arrived_s: 0.0,
            reader,
            sent: 0,
            lost: 0,
        }
    }

    /// The goal that has arrived at the controller by a time; times never fall.
    pub fn goal_n(&mut self, time_s: f64, stages: &mut impl Stages) -> f64 {
        while self.arrival(time_s, stages).is_some() {}
        self.arrived_n
    }

    /// Lets the host read the controller where it is time to: the reading arrives later, or not at all. Times never
    /// fall.
    pub fn read(&mut self, time_s: f64, reading: impl FnOnce() -> Reading, stages: &mut impl Stages) {
        if let Some(asked_s) = self.ask(time_s, time_s, stages) {
            self.hear(Grip::answered_s(asked_s), reading());
        }
    }

    /// Asks for a reading where that is due by a time, at `now_s` or when it is due, whichever is later. Says when the
    /// request arrives at the controller; none where nothing is due, or where the request is lost. Times never fall.
    pub fn ask(&mut self, now_s: f64, until_s: f64, stages: &mut impl Stages) -> Option<f64> {
        let reader = self.reader.as_mut().filter(|reader| reader.read_s <= until_s)?;
        let at_s = reader.read_s.max(now_s);
        reader.read_s = at_s + reader.period_s;
        stages.pass(at_s)
    }

    /// A reading came in at a time: it is judged when that time has come.
    pub fn hear(&mut self, at_s: f64, reading: Reading) {
        if let Some(reader) = &mut self.reader {
            reader.answers.push_back((at_s, reading));
        }
    }

    /// The next packet that arrives by a time: when, and its goal. Times never fall.
    pub fn arrival(&mut self, time_s: f64, stages: &mut impl Stages) -> Option<(f64, f64)> {
        self.judge(time_s, stages);
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
            self.send(at_s, stages);
        }
        let packet = self.flying.pop_front_if(|(at_s, _)| *at_s <= time_s)?;
        (self.arrived_s, self.arrived_n) = packet;
        Some(packet)
    }

    /// The next request that reaches the controller by a time. The host repeats a request until it is acknowledged, so
    /// none is lost; those of a silent host wait. Times never fall.
    pub fn request(&mut self, time_s: f64) -> Option<Request> {
        let due = self.requests.front().is_some_and(|(at_s, _)| *at_s <= time_s);
        if !due || self.silent(time_s) { None } else { self.requests.pop_front().map(|(_, request)| request) }
    }

    fn silent(&self, time_s: f64) -> bool {
        self.silences.iter().any(|[from_s, until_s]| (*from_s..*until_s).contains(&time_s))
    }

    /// Since the last packet that arrived, as the controller tells it.
    pub fn silent_ms(&self, time_s: f64) -> u16 {
        ((time_s - self.arrived_s).max(0.0) * 1e3) as u16
    }

    fn judge(&mut self, time_s: f64, stages: &mut impl Stages) {
        while let Some(reader) = &mut self.reader
            && let Some((at_s, reading)) = reader.answers.pop_front_if(|(at_s, _)| *at_s <= time_s)
        {
            if reader.grip.judge(self.goal_n, &reading) {
                self.send(at_s, stages);
            }
        }
    }

    fn send(&mut self, at_s: f64, stages: &mut impl Stages) {
        self.sent += 1;
        // Counted, as a sum of periods would drift.
        if at_s != self.send_s {
            (self.said_s, self.repeats) = (at_s, 0);
        }
        self.repeats += 1;
        self.send_s = self.said_s + self.repeats as f64 * self.period_s;
        let goal_n = self.reader.as_ref().map_or(self.goal_n, |reader| reader.grip.goal_n(self.goal_n));
        let silent = self.silent(at_s);
        match stages.pass(at_s).filter(|_| !silent) {
            Some(arrives_s) => {
                let last_s = self.flying.back().map_or(arrives_s, |(at_s, _)| *at_s);
                self.flying.push_back((arrives_s.max(last_s), goal_n));
            }
            None => self.lost += 1,
        }
    }
}
