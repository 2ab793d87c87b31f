//! Bytes in, packets out: any slicing, any garbage in between.
//!
//! Stuffing keeps the header out of every packet's inside, so a header always starts a packet, also where an earlier
//! one was cut short. A lost or damaged byte therefore costs the packet it stood in and no other.

use heapless::Vec;

use super::crc;
use super::packet::{BROADCAST, HEADER, Packet, STUFFING};
use crate::store::ID_MAX;

/// Parameters that are kept of a packet: a Sync Read of every ID there is, or a Sync Write of 76 goal forces.
pub const PARAMS_MAX: usize = 384;
/// A longer packet is taken for noise.
pub const LENGTH_MAX: u16 = 2048;
/// A length counts the instruction and the CRC at least.
const LENGTH_MIN: u16 = 3;

/// What a byte brought to an end.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Event {
    /// A whole packet with a good CRC: [`Receiver::packet`].
    Packet,
    /// A whole packet with a bad CRC: its fields, which may be wrong, are in [`Receiver::packet`].
    BadCrc,
    /// A header, after bytes that were no packet or only the beginning of one.
    Framing,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Expect {
    Header,
    Id,
    LengthLow,
    LengthHigh,
    Instruction,
    Params,
    CrcLow,
    CrcHigh,
}

/// Finds packets in a stream of bytes.
#[derive(Clone, Debug)]
pub struct Receiver {
    /// The last four bytes as they came.
    window: u32,
    expect: Expect,
    /// Bytes since the last packet that belong to none.
    stray: u8,
    /// Bytes that still belong to a packet of which this device has sent a part.
    shared: u16,
    id: u8,
    instruction: u8,
    /// Bytes to come before the CRC.
    left: u16,
    crc: u16,
    crc_low: u8,
    params: Vec<u8, PARAMS_MAX>,
    complete: bool,
}

impl Receiver {
    /// A receiver that has heard nothing.
    pub const fn new() -> Self {
        Self {
            window: 0,
            expect: Expect::Header,
            stray: 0,
            shared: 0,
            id: 0,
            instruction: 0,
            left: 0,
            crc: crc::START,
            crc_low: 0,
            params: Vec::new(),
            complete: true,
        }
    }

    /// The packet that the last event spoke of; valid until the next byte.
    pub fn packet(&self) -> Packet<'_> {
        Packet { id: self.id, instruction: self.instruction, params: &self.params, complete: self.complete }
    }

    /// Takes one byte.
    pub fn push(&mut self, byte: u8) -> Option<Event> {
        let stuffing = byte == STUFFING && self.window & 0x00FF_FFFF == u32::from_be_bytes(HEADER) >> 8;
        self.window = self.window << 8 | u32::from(byte);
        let header = self.window == u32::from_be_bytes(HEADER);
        if header && self.expect != Expect::CrcHigh {
            let clean = self.expect == Expect::Header && usize::from(self.stray) < HEADER.len();
            self.begin();
            return (!clean).then_some(Event::Framing);
        }
        if !matches!(self.expect, Expect::Header | Expect::CrcLow | Expect::CrcHigh) {
            self.crc = crc::update(self.crc, &[byte]);
        }
        match self.expect {
            Expect::Header if self.shared > 0 => self.shared -= 1,
            Expect::Header => self.stray = self.stray.saturating_add(1),
            Expect::Id if byte <= ID_MAX || byte == BROADCAST => {
                self.id = byte;
                self.expect = Expect::LengthLow;
            }
            Expect::Id => self.lose(),
            Expect::LengthLow => {
                self.left = u16::from(byte);
                self.expect = Expect::LengthHigh;
            }
            Expect::LengthHigh => {
                let length = u16::from_le_bytes([self.left.to_le_bytes()[0], byte]);
                if (LENGTH_MIN..=LENGTH_MAX).contains(&length) {
                    self.left = length - 2;
                    self.expect = Expect::Instruction;
                } else {
                    self.lose();
                }
            }
            Expect::Instruction => {
                self.instruction = byte;
                self.count_down();
            }
            Expect::Params => {
                if !stuffing && self.params.push(byte).is_err() {
                    self.complete = false;
                }
                self.count_down();
            }
            Expect::CrcLow => {
                self.crc_low = byte;
                self.expect = Expect::CrcHigh;
            }
            Expect::CrcHigh => return Some(self.end(byte, header)),
        }
        None
    }

    /// This device sends a part of the packet that it hears, and does not hear that; so many bytes come behind it.
    pub(super) fn take_part(&mut self, behind: u16) {
        self.window = 0;
        self.stray = 0;
        self.shared = behind;
        self.expect = Expect::Header;
    }

    fn begin(&mut self) {
        self.shared = 0;
        self.crc = crc::update(crc::START, &HEADER);
        self.params.clear();
        self.complete = true;
        self.expect = Expect::Id;
    }

    fn count_down(&mut self) {
        self.left = self.left.saturating_sub(1);
        self.expect = if self.left == 0 { Expect::CrcLow } else { Expect::Params };
    }

    /// What looked like a packet is none.
    fn lose(&mut self) {
        self.stray = u8::MAX;
        self.expect = Expect::Header;
    }

    fn end(&mut self, crc_high: u8, header: bool) -> Event {
        self.stray = 0;
        self.expect = Expect::Header;
        if u16::from_le_bytes([self.crc_low, crc_high]) == self.crc {
            self.window = 0;
            return Event::Packet;
        }
        if header {
            // The packet was cut short, and the next one's header was taken for its end.
            self.begin();
            return Event::Framing;
        }
        Event::BadCrc
    }
}

impl Default for Receiver {
    fn default() -> Self {
        Self::new()
    }
}
