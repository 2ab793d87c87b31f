//! The far end of the bus: what the host sends at its time, what the image sent and when.

use rigless::chip::Timeline;
use rigless::chip::uart::Peer;
use rigless::snapshot::Store;
use rigless::time::VirtualNanos;
use std::collections::VecDeque;

/// A byte and the instant at which its stop bit ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct TimedByte {
    /// Virtual time of the end of its stop bit, ns.
    pub at_ns: u64,
    /// Value of the byte.
    pub byte: u8,
}

/// The host's end of USART2. The port times each byte by its baud rate, both ways.
#[derive(Debug, Default)]
pub struct Wire {
    outgoing: VecDeque<(u64, u8)>,
    incoming: Vec<TimedByte>,
    single: bool,
}

// A run has no snapshot.
impl Store for Wire {}

impl Wire {
    /// Queues bytes that start no earlier than an instant; each follows the one before it.
    pub fn send(&mut self, from_ns: u64, bytes: &[u8]) {
        self.outgoing.extend(bytes.iter().map(|byte| (from_ns, *byte)));
    }

    /// Sets single-wire mode: the receiver is on the transmit pin and receives what the port sends.
    pub fn set_single(&mut self, single: bool) {
        self.single = single;
    }

    /// Earliest time at which the next byte may be sent, ns.
    pub fn sends_ns(&self) -> Option<u64> {
        self.outgoing.front().map(|(from_ns, _)| *from_ns)
    }

    /// Bytes that have not started yet.
    pub fn pending(&self) -> usize {
        self.outgoing.len()
    }

    /// Takes what the image has sent since the last time.
    pub fn take_received(&mut self) -> Vec<TimedByte> {
        std::mem::take(&mut self.incoming)
    }
}

impl Peer for Wire {
    fn receive(&mut self, word: u16, context: &mut Timeline<'_, '_>) {
        let byte = TimedByte { at_ns: context.now().0, byte: (word & 0xff) as u8 };
        self.incoming.push(byte);
        if self.single {
            self.outgoing.push_back((byte.at_ns, byte.byte));
        }
    }

    fn transmit(&mut self, now: VirtualNanos) -> Option<u16> {
        let (_, byte) = self.outgoing.pop_front_if(|(from_ns, _)| *from_ns <= now.0)?;
        Some(u16::from(byte))
    }
}
