//! Whose turn it is after a Sync Read, a Bulk Read, and the fast kinds of both.
//!
//! The devices answer in the order of the list. Each waits for the one before it by listening to the bus.

use super::crc;
use super::packet::{BROADCAST, HEADER, instruction};

/// Bytes of the reply to a fast read before the first device's part.
const FAST_HEAD: usize = 8;
/// Bytes that each device adds to its data: error, ID and CRC.
const FAST_EXTRA: u16 = 4;

/// What was asked of this device.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Request {
    pub address: u16,
    pub length: u16,
}

/// What this device waits for before it answers.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Turn {
    /// Nothing is asked.
    None,
    /// The status packet of this device.
    After(u8, Request),
    /// This much more of the packet that the devices share.
    Shared(Shared, Request),
}

/// Follows the packet that the devices share, byte by byte: its data is not stuffed, unlike that of other packets.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Shared {
    /// The packet's length field.
    length: u16,
    heard: u16,
    /// How much the devices before this one send, the packet's beginning included; nothing for the first.
    ahead: u16,
    /// Of all that was heard.
    pub crc: u16,
}

impl Shared {
    /// For the device at `place` of those that send so many bytes of data each; none where the packet were too long.
    pub fn new(place: usize, lengths: impl Iterator<Item = u16>) -> Option<Self> {
        let (mut whole, mut ahead) = (1_u16, 0);
        for (other, length) in lengths.enumerate() {
            if other == place && place > 0 {
                // The packet's length leaves out all before the instruction, the head does not.
                ahead = whole.checked_add(FAST_HEAD as u16 - 1)?;
            }
            whole = whole.checked_add(length.checked_add(FAST_EXTRA)?)?;
        }
        Some(Self { length: whole, heard: 0, ahead, crc: crc::START })
    }

    /// How the packet begins.
    fn head(&self) -> [u8; FAST_HEAD] {
        let [low, high] = self.length.to_le_bytes();
        let [a, b, c, d] = HEADER;
        [a, b, c, d, BROADCAST, low, high, instruction::STATUS]
    }

    /// Whether this device begins the packet.
    pub fn first(&self) -> bool {
        self.ahead == 0
    }

    /// What this device sends before its part: the packet's beginning, where it is the first.
    pub fn opening(&self) -> impl Iterator<Item = u8> {
        self.head().into_iter().take(if self.first() { FAST_HEAD } else { 0 })
    }

    /// Takes a byte of the bus; false where it does not belong to the packet.
    pub fn hear(&mut self, byte: u8) -> bool {
        let fits = self.head().get(usize::from(self.heard)).is_none_or(|&expected| expected == byte);
        self.heard = self.heard.saturating_add(1);
        self.crc = crc::update(self.crc, &[byte]);
        fits
    }

    /// How much of the packet comes behind this device's part, which has so many bytes of data.
    pub fn behind(&self, length: u16) -> u16 {
        // The length leaves out the seven bytes before the instruction.
        let own = self.ahead.max(FAST_HEAD as u16).saturating_add(length).saturating_add(FAST_EXTRA);
        self.length.saturating_add(FAST_HEAD as u16 - 1).saturating_sub(own)
    }

    /// Whether all that comes before this device's part was heard.
    pub fn due(&self) -> bool {
        self.heard >= self.ahead
    }
}
