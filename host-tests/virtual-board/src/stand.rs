//! The driver that the emulator calls, and access to the emulated board at a halt.

use crate::bench::Bench;
use crate::board::FingerBoard;
use crate::link::Listening;
use crate::rig::Order;
use rigless::emulator::{Driver, Host, Settled, Stop};
use rigless::session::Session;
use rigless::time::VirtualNanos;
use std::sync::mpsc::{Receiver, Sender};

/// The run at a halt, between two instructions.
pub struct Stand<'a> {
    /// The board, its registers and the emulator's reports.
    pub session: &'a mut Session<FingerBoard>,
    /// The guest's memory and interrupt lines.
    pub host: &'a mut dyn Host,
    /// The instant.
    pub stop: Stop,
    /// All around the board.
    pub bench: &'a mut Bench,
}

/// Drives a run by orders.
#[derive(Debug)]
pub(crate) struct Hall {
    bench: Bench,
    orders: Receiver<Order>,
    reached: Sender<u64>,
    until_ns: u64,
    listening: Option<Listening>,
}

impl Hall {
    pub(crate) fn new(bench: Bench, orders: Receiver<Order>, reached: Sender<u64>) -> Self {
        let until_ns = bench.next_ns;
        Self { bench, orders, reached, until_ns, listening: None }
    }

    /// Passes received bytes to the listener, if there is one; returns true if the run must go on for its answer.
    fn hears_on(&mut self, session: &mut Session<FingerBoard>) -> bool {
        let Some(listening) = &mut self.listening else { return false };
        let (now_ns, received) = (self.bench.next_ns, std::mem::take(&mut self.bench.received));
        if listening.hear(now_ns, &received, session.board_mut().wire().pending()) {
            self.until_ns = listening.next_look_ns(now_ns);
            return true;
        }
        if let Some(listening) = self.listening.take() {
            listening.end();
        }
        false
    }

    /// Executes orders until one continues the run; returns false after the last order.
    fn halt(&mut self, session: &mut Session<FingerBoard>, stop: Stop, host: &mut dyn Host) -> bool {
        let Self { bench, orders, reached, until_ns, listening } = self;
        if reached.send(bench.next_ns).is_err() {
            return false;
        }
        while let Ok(order) = orders.recv() {
            match order {
                Order::Run(until) => {
                    *until_ns = until;
                    return true;
                }
                Order::Listen(begun) => {
                    *until_ns = begun.next_look_ns(bench.next_ns);
                    *listening = Some(begun);
                    return true;
                }
                Order::Do(job) => job(&mut Stand { session, host, stop, bench }),
            }
        }
        false
    }
}

impl Driver<FingerBoard> for Hall {
    fn on_settled(&mut self, session: &mut Session<FingerBoard>, host: &mut dyn Host, settled: Settled) {
        if let Settled::Stop(stop) = &settled
            && self.bench.flash.word_done(stop.at.0)
        {
            host.hold(self.bench.core_held);
        }
        match settled {
            Settled::Access { access, .. } => {
                self.bench.accessed(session.board_mut(), &access);
                self.bench.flash.stored(session, host, &access);
                self.bench.clock.accessed(session, host, &access);
            }
            Settled::Stop(stop) => self.bench.stopped(session.board_mut(), stop.at.0),
            _ => {}
        }
    }

    fn on_stop(&mut self, session: &mut Session<FingerBoard>, stop: Stop, host: &mut dyn Host) -> Option<VirtualNanos> {
        if stop.at.0 >= self.bench.next_ns {
            self.bench.step(session, host);
            if self.bench.next_ns >= self.until_ns && !self.hears_on(session) && !self.halt(session, stop, host) {
                return None;
            }
            self.bench.go_on();
        }
        Some(self.bench.next_stop(session.board_mut(), stop.at))
    }
}
