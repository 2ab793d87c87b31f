//! The bus from the host's side: bytes at their time, whole transactions, and requests to the board.
//!
//! Virtual time passes only inside transactions, so a host's run repeats exactly on a machine of any speed. A packet
//! that the board leaves unanswered costs virtual time, no more.

use crate::Error;
use crate::rig::Rig;
use crate::wire::TimedByte;
use fingertip::link::Reply;
use fingertip::link::packet::{Event, Receiver, Sender, instruction};

/// The board's ID on the bus.
pub const ID: u8 = 1;
/// The bit of a status packet's error that only says that the board has a fault.
const ALERT: u8 = 0x80;
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

    pub fn take_received(&mut self) -> Result<Vec<TimedByte>, Error> {
        self.with(|stand| std::mem::take(&mut stand.bench.received))
    }

    /// Sends a packet and runs until a status packet has come back: its error, then its parameters. `None` if nothing has
    /// for [`Rig::wait_ns`] after the last byte either way.
    pub fn transact(&mut self, packet: &[u8]) -> Result<Option<Vec<u8>>, Error> {
        self.take_received()?;
        self.send(packet)?;
        let (mut receiver, mut quiet_since_ns) = (Receiver::new(), self.now_ns());
        while self.now_ns() < quiet_since_ns + self.wait_ns {
            self.run_until_ns(self.now_ns() + LOOK_NS)?;
            let received = self.take_received()?;
            if received.iter().any(|timed| receiver.push(timed.byte) == Some(Event::Packet)) {
                return Ok(Some(receiver.packet().params.to_vec()));
            }
            if !received.is_empty() || self.with(|stand| stand.session.board_mut().wire().pending() > 0)? {
                quiet_since_ns = self.now_ns();
            }
        }
        Ok(None)
    }

    /// Sends an instruction to the board, which must answer; returns the answer's parameters.
    pub fn request(&mut self, instruction: u8, params: &[u8]) -> Result<Vec<u8>, Error> {
        match self.transact(&packet(ID, instruction, params))?.as_deref() {
            Some([error, data @ ..]) if error & !ALERT == 0 => Ok(data.to_vec()),
            Some([error, ..]) => Err(Error::Refused(*error)),
            _ => Err(Error::Silent),
        }
    }

    pub fn read(&mut self, register: u16, bytes: u16) -> Result<Vec<u8>, Error> {
        self.request(instruction::READ, [register.to_le_bytes(), bytes.to_le_bytes()].as_flattened())
    }

    pub fn write(&mut self, register: u16, bytes: &[u8]) -> Result<(), Error> {
        self.request(instruction::WRITE, &[&register.to_le_bytes(), bytes].concat()).map(drop)
    }
}

/// The bytes of an instruction.
pub fn packet(id: u8, instruction: u8, params: &[u8]) -> Vec<u8> {
    let mut bytes = Reply::new();
    let mut sender = Sender::new(&mut bytes, id, instruction);
    params.iter().for_each(|byte| sender.push(*byte));
    sender.finish();
    bytes.to_vec()
}
