//! Packets out: header, stuffing, length and CRC around bytes that are pushed one by one.

use heapless::Vec;

use super::crc;
use super::packet::{HEADER, STUFFING, StatusError, instruction};

/// The longest packet sent: 256 bytes of data with an FD stuffed after each third of them, and 11 around.
pub const REPLY_MAX: usize = 384;
/// Bytes to send.
pub type Reply = Vec<u8, REPLY_MAX>;

/// Where the length stands.
const LENGTH_PLACE: usize = 5;
/// Where stuffing begins: at the instruction.
const STUFFED_FROM: usize = 7;

/// Writes one packet into a cleared buffer; a packet that does not fit leaves it empty.
#[derive(Debug)]
pub struct Sender<'r> {
    reply: &'r mut Reply,
    fits: bool,
}

impl<'r> Sender<'r> {
    /// Begins a packet.
    pub fn new(reply: &'r mut Reply, id: u8, instruction: u8) -> Self {
        reply.clear();
        let mut sender = Self { reply, fits: true };
        for byte in HEADER.into_iter().chain([id, 0, 0, instruction]) {
            sender.raw(byte);
        }
        sender
    }

    /// Begins a status packet; `alert` says that the hardware error status is not zero.
    pub fn status(reply: &'r mut Reply, id: u8, error: Option<StatusError>, alert: bool) -> Self {
        let mut sender = Self::new(reply, id, instruction::STATUS);
        sender.push(error_byte(error, alert));
        sender
    }

    /// Adds a byte of the parameters, and stuffing where it is due.
    pub fn push(&mut self, byte: u8) {
        self.raw(byte);
        let stuffed = self.reply.get(STUFFED_FROM..).unwrap_or_default();
        if stuffed.ends_with(&[0xFF, 0xFF, STUFFING]) {
            self.raw(STUFFING);
        }
    }

    /// Ends the packet with its length and CRC.
    pub fn finish(mut self) {
        let length = (self.reply.len() + 2).saturating_sub(STUFFED_FROM) as u16;
        for (place, byte) in (LENGTH_PLACE..).zip(length.to_le_bytes()) {
            if let Some(slot) = self.reply.get_mut(place) {
                *slot = byte;
            }
        }
        for byte in crc::update(crc::START, self.reply).to_le_bytes() {
            self.raw(byte);
        }
        if !self.fits {
            self.reply.clear();
        }
    }

    /// Adds a byte as it is.
    fn raw(&mut self, byte: u8) {
        self.fits &= self.reply.push(byte).is_ok();
    }
}

/// The error byte of a status packet.
pub fn error_byte(error: Option<StatusError>, alert: bool) -> u8 {
    error.map_or(0, |error| error as u8) | u8::from(alert) << 7
}
