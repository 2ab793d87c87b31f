//! The bus from the host's side: bytes at their time, whole transactions, and the crate `dynamixel2` as a client.
//!
//! The client talks to a serial port of the operating system, so it gets one end of a pseudo-terminal; at the other end each
//! packet that it sends becomes a transaction of the rig. Virtual time passes only inside transactions, so what the
//! client does repeats exactly. The client measures its timeouts on the wall clock, by the time that a packet takes at
//! the port's speed. Its end is opened at 1 baud, which a pseudo-terminal ignores: the shortest of these timeouts is
//! then two minutes of a board that hangs. A packet that the board leaves unanswered in virtual time is answered at
//! once, by a device that does not exist.

use crate::Error;
use crate::rig::{Rig, Stand};
use crate::wire::TimedByte;
use dynamixel2::Bus;
use fingertip::link::Reply;
use fingertip::link::packet::Sender;
use serial2::SerialPort;
use std::io::ErrorKind;
use std::sync::mpsc;
use std::time::Duration;

pub type Client = Bus<Vec<u8>, Vec<u8>>;

/// The client's timeouts believe a byte to take 10 s.
const CLIENT_BAUD: u32 = 1;
/// A status packet of an ID that no device has (253 is reserved): the client fails with `InvalidPacketId`.
const SILENCE: [u8; 11] = [0xff, 0xff, 0xfd, 0, 253, 4, 0, 0x55, 0, 0x01, 0x24];
/// The client's buffers: larger than any packet of the image.
const BUFFER: usize = 2048;
/// The `errno` of a pseudo-terminal whose other end is closed.
const EIO: i32 = 5;

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

    /// Sends a packet and runs until a whole status packet has come back, or nothing has for the wait's time after the
    /// last byte either way. What came back is not checked.
    pub fn transact(&mut self, packet: &[u8], wait_ns: u64) -> Result<Vec<u8>, Error> {
        self.take_received()?;
        self.send(packet)?;
        let (mut reply, mut quiet_since_ns) = (Vec::new(), self.now_ns());
        let (answer, answered) = mpsc::channel();
        let look = move |stand: &mut Stand<'_>| {
            let (now_ns, received) = (stand.bench.next_ns, std::mem::take(&mut stand.bench.received));
            if !received.is_empty() || stand.session.board_mut().wire().pending() > 0 {
                quiet_since_ns = now_ns;
            }
            reply.extend(received.iter().map(|timed| timed.byte));
            let goes_on = !is_whole(&reply) && now_ns < quiet_since_ns + wait_ns;
            // An error means that nobody waits for the reply any more.
            let _ = goes_on || answer.send(std::mem::take(&mut reply)).is_ok();
            goes_on
        };
        self.run_while(LOOK_NS, Box::new(look))?;
        self.answer(&answered)
    }

    /// Runs a client on the bus. An unanswered packet costs the wait's virtual time.
    pub fn client<T: Send>(&mut self, wait_ns: u64, job: impl FnOnce(&mut Client) -> T + Send) -> Result<T, Error> {
        let (mut near, mut far) = SerialPort::pair()?;
        for end in [&mut near, &mut far] {
            let mut settings = end.get_configuration()?;
            settings.set_baud_rate(CLIENT_BAUD)?;
            end.set_configuration(&settings)?;
        }
        near.set_read_timeout(Duration::from_secs(3600))?;
        let mut client = Client::with_buffers(far, vec![0; BUFFER], vec![0; BUFFER])
            .map_err(|why| std::io::Error::other(why.to_string()))?;
        std::thread::scope(|scope| {
            let client = scope.spawn(move || job(&mut client));
            let pumped = self.pump(&near, wait_ns);
            // Closed before the join: a client whose transaction failed must not wait for the answer.
            drop(near);
            let result = client.join().unwrap_or_else(|panic| std::panic::resume_unwind(panic));
            pumped.map(|()| result)
        })
    }

    fn pump(&mut self, near: &SerialPort, wait_ns: u64) -> Result<(), Error> {
        let (mut buffer, mut bytes) = ([0; BUFFER], Vec::new());
        loop {
            match near.read(&mut buffer) {
                Ok(0) => return Ok(()),
                Ok(count) => bytes.extend_from_slice(&buffer[..count]),
                Err(error) if error.raw_os_error() == Some(EIO) => return Ok(()),
                Err(error) if matches!(error.kind(), ErrorKind::Interrupted | ErrorKind::TimedOut) => {}
                Err(error) => return Err(error.into()),
            }
            while let Some(length) = packet_length(&bytes).filter(|length| bytes.len() >= *length && !bytes.is_empty())
            {
                let packet: Vec<u8> = bytes.drain(..length).collect();
                let reply = self.transact(&packet, wait_ns)?;
                let answered = reply.len() >= SILENCE.len() && is_whole(&reply);
                near.write_all(if answered { &reply } else { &SILENCE })?;
            }
        }
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

/// Returns true if the bytes hold a whole packet of the protocol: FF FF FD 00, ID, length of the rest.
fn is_whole(bytes: &[u8]) -> bool {
    packet_length(bytes).is_some_and(|length| bytes.len() >= length)
}

/// Length of the packet at the start of the bytes, once its header is complete; 1 if they begin no packet.
fn packet_length(bytes: &[u8]) -> Option<usize> {
    const HEADER: [u8; 4] = [0xff, 0xff, 0xfd, 0x00];
    if bytes.iter().zip(HEADER).any(|(byte, header)| *byte != header) {
        return Some(1);
    }
    let length = bytes.get(5..7)?;
    Some(7 + usize::from(u16::from_le_bytes([length[0], length[1]])))
}
