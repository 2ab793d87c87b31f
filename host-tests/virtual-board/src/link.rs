//! The bus from the host's side: bytes at their time, and whole transactions.

use crate::error::Error;
use crate::rig::{Order, Rig};
use crate::wire::TimedByte;
use std::sync::mpsc;

/// Time between two looks at the bytes that the image sent, ns.
const LOOK_NS: u64 = 50_000;

impl Rig {
    /// Sends bytes from now on, one after another at the port's baud rate.
    pub fn send(&mut self, bytes: &[u8]) -> Result<(), Error> {
        let bytes = bytes.to_vec();
        self.with(move |stand| {
            let from_ns = stand.bench.next_ns;
            stand.session.board_mut().wire().send(from_ns, &bytes);
        })
    }

    /// Takes the bytes that the image has sent.
    pub fn take_received(&mut self) -> Result<Vec<TimedByte>, Error> {
        self.with(|stand| std::mem::take(&mut stand.bench.received))
    }

    /// Sends a packet and runs until a whole status packet has come back, or nothing has for the wait's time after the
    /// last byte either way. What came back is not checked.
    pub fn transact(&mut self, packet: &[u8], wait_ns: u64) -> Result<Vec<u8>, Error> {
        self.take_received()?;
        self.send(packet)?;
        let (answer, answered) = mpsc::channel();
        let quiet_since_ns = self.now_ns();
        self.order(Order::Listen(Listening { wait_ns, quiet_since_ns, reply: Vec::new(), answer }))?;
        self.await_reached()?;
        self.answer(&answered)
    }
}

/// Listener for an answer while the board runs.
#[derive(Debug)]
pub(crate) struct Listening {
    wait_ns: u64,
    quiet_since_ns: u64,
    reply: Vec<u8>,
    answer: mpsc::Sender<Vec<u8>>,
}

impl Listening {
    /// Time at which to look at the received bytes next, ns.
    pub(crate) fn next_look_ns(&self, now_ns: u64) -> u64 {
        now_ns + LOOK_NS
    }

    /// Appends the received bytes; returns true while the packet is incomplete and its wait has not run out.
    pub(crate) fn hear(&mut self, now_ns: u64, received: &[TimedByte], unsent: usize) -> bool {
        if !received.is_empty() || unsent > 0 {
            self.quiet_since_ns = now_ns;
        }
        self.reply.extend(received.iter().map(|timed| timed.byte));
        !is_whole(&self.reply) && now_ns < self.quiet_since_ns + self.wait_ns
    }

    /// Sends the received bytes to the waiting thread.
    pub(crate) fn end(self) {
        // An error means that nobody waits for the answer any more.
        let _ = self.answer.send(self.reply);
    }
}

/// Returns true if the bytes hold a whole packet of the protocol: FF FF FD 00, ID, length of the rest.
pub fn is_whole(bytes: &[u8]) -> bool {
    packet_length(bytes).is_some_and(|length| bytes.len() >= length)
}

/// Length of the packet at the start of the bytes, once its header is complete; 1 if they begin no packet.
pub fn packet_length(bytes: &[u8]) -> Option<usize> {
    const HEADER: [u8; 4] = [0xff, 0xff, 0xfd, 0x00];
    if bytes.iter().zip(HEADER).any(|(byte, header)| *byte != header) {
        return Some(1);
    }
    let length = bytes.get(5..7)?;
    Some(7 + usize::from(u16::from_le_bytes([length[0], length[1]])))
}
