//! The crate `dynamixel2` as the bus's host.
//!
//! It talks to a serial port of the operating system, so it gets one end of a pseudo-terminal; at the other end each
//! packet that it sends becomes a transaction of the rig. Virtual time passes only inside transactions, so what the
//! client does repeats exactly. The client measures its timeouts on the wall clock, by the time that a packet takes at
//! the port's speed. Its end is opened at 1 baud, which a pseudo-terminal ignores: the shortest of these timeouts is
//! then two minutes of a board that hangs. A packet that the board leaves unanswered in virtual time is answered at
//! once, by a device that does not exist.

use crate::error::Error;
use crate::link::{is_whole, packet_length};
use crate::rig::Rig;
use dynamixel2::Bus;
use serial2::SerialPort;
use std::io::ErrorKind;
use std::time::Duration;

/// The client's end of the bus.
pub type Client = Bus<Vec<u8>, Vec<u8>>;

/// The client's timeouts believe a byte to take 10 s.
const CLIENT_BAUD: u32 = 1;
/// A status packet of an ID that no device has (253 is reserved): the client fails with `InvalidPacketId`.
const SILENCE: [u8; 11] = [0xff, 0xff, 0xfd, 0, 253, 4, 0, 0x55, 0, 0x01, 0x24];
/// The client's buffers: larger than any packet of the image.
const BUFFER: usize = 2048;
/// The `errno` of a pseudo-terminal whose other end is closed.
const EIO: i32 = 5;

impl Rig {
    /// Runs a client on the bus. An unanswered packet costs the wait's virtual time.
    ///
    /// # Errors
    /// The emulator stopped, or no pseudo-terminal is available.
    ///
    /// # Panics
    /// If the client panics.
    pub fn client<T: Send>(&mut self, wait_ns: u64, job: impl FnOnce(&mut Client) -> T + Send) -> Result<T, Error> {
        let (mut near, mut far) = SerialPort::pair()?;
        for end in [&mut near, &mut far] {
            let mut settings = end.get_configuration()?;
            settings.set_baud_rate(CLIENT_BAUD)?;
            end.set_configuration(&settings)?;
        }
        near.set_read_timeout(Duration::from_secs(3600))?;
        let mut client = Client::with_buffers(far, vec![0; BUFFER], vec![0; BUFFER])
            .map_err(|why| Error::Client(std::io::Error::other(why.to_string())))?;
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
