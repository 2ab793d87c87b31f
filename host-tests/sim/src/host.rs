//! The host at the other end of the bus: it sends its command when the script changes it, and repeats it.

use crate::effects::link::Stages;
use crate::scene::{Event, Scene};
use std::collections::VecDeque;

/// The host of one finger.
#[derive(Clone, Debug)]
pub struct Host {
    script: Vec<Event>,
    next: usize,
    period_s: f64,
    goal_n: f64,
    send_s: f64,
    flying: VecDeque<(f64, f64)>,
    arrived_n: f64,
    arrived_s: f64,
    /// Packets sent.
    pub sent: u64,
    /// Packets among them that do not arrive.
    pub lost: u64,
}

impl Host {
    /// Begins at the scene's start, with no force asked for.
    pub fn new(scene: &Scene) -> Self {
        Self {
            script: scene.script.clone(),
            next: 0,
            period_s: scene.table("host").number("period_ms") * 1e-3,
            goal_n: 0.0,
            send_s: 0.0,
            flying: VecDeque::new(),
            arrived_n: 0.0,
            arrived_s: 0.0,
            sent: 0,
            lost: 0,
        }
    }

    /// The goal that has arrived at the controller by a time; times never fall.
    pub fn goal_n(&mut self, time_s: f64, stages: &mut impl Stages) -> f64 {
        while self.arrival(time_s, stages).is_some() {}
        self.arrived_n
    }

    /// The next packet that arrives by a time: when, and its goal. Times never fall.
    pub fn arrival(&mut self, time_s: f64, stages: &mut impl Stages) -> Option<(f64, f64)> {
        loop {
            let event = self.script.get(self.next).filter(|event| event.at_s <= self.send_s);
            let at_s = event.map_or(self.send_s, |event| event.at_s);
            if at_s > time_s {
                break;
            }
            if let Some(event) = event {
                self.goal_n = event.goal_n;
                self.next += 1;
            }
            self.send(at_s, stages);
        }
        let packet = self.flying.pop_front_if(|(at_s, _)| *at_s <= time_s)?;
        (self.arrived_s, self.arrived_n) = packet;
        Some(packet)
    }

    /// Since the last packet that arrived, as the controller tells it.
    pub fn silent_ms(&self, time_s: f64) -> u16 {
        ((time_s - self.arrived_s).max(0.0) * 1e3) as u16
    }

    fn send(&mut self, at_s: f64, stages: &mut impl Stages) {
        self.sent += 1;
        self.send_s = at_s + self.period_s;
        match stages.pass(at_s) {
            Some(arrives_s) => {
                let last_s = self.flying.back().map_or(arrives_s, |(at_s, _)| *at_s);
                self.flying.push_back((arrives_s.max(last_s), self.goal_n));
            }
            None => self.lost += 1,
        }
    }
}
