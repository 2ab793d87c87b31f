//! Replies: whether, when and with what; and whose turn it is after a Sync Read, a Bulk Read, and the fast kinds of
//! both.
//!
//! The devices answer in the order of the list. Each waits for the one before it by listening to the bus.

use super::Exchange;
use crate::link::packet::{
    BROADCAST, CRC_START, HEADER, Packet, REPLY_MAX, Sender, StatusError, error_byte, instruction, update_crc,
};
use crate::link::table::{READ_MAX, TableView, check_read};

/// Longest pause in a packet that the devices share, ms, at the slowest speed too: after a longer one the bytes
/// belong to another packet.
const SILENCE_MS: u32 = 5;

// The largest part of a shared packet, its beginning included, fits into a reply.
const _: () = assert!(8 + 2 + READ_MAX as usize + 2 <= REPLY_MAX);

impl<const ROWS: usize, const COLUMNS: usize> Exchange<'_, ROWS, COLUMNS> {
    /// Answers an instruction that returns no data, under the ID and the status return level that it found: it may have
    /// changed them.
    pub(super) fn answer(&mut self, id: u8, level: u8, result: Result<(), StatusError>) {
        if level >= 2 {
            self.state.reply_delay_us = self.state.settings.return_delay_us();
            Sender::status(self.reply, id, result.err(), self.snapshot.faulted()).finish();
        }
    }

    /// Answers a read.
    pub(super) fn answer_read(&mut self, request: Result<Request, StatusError>) {
        let checked = request.and_then(|request| check_read::<ROWS, COLUMNS>(request.address, request.length));
        let error = self.counted(checked).err();
        if self.state.settings.status_return_level == 0 {
            return;
        }
        self.state.reply_delay_us = self.state.settings.return_delay_us();
        let mut sender = Sender::status(self.reply, self.state.settings.record.id, error, self.snapshot.faulted());
        if let (Ok(Request { address, length }), None) = (request, error) {
            let view = TableView { state: self.state, snapshot: self.snapshot };
            view.read(address, length, &mut |byte| sender.push(byte));
        }
        sender.finish();
    }

    /// Sends this device's part of a shared packet; zeros in place of data that cannot be read.
    pub(super) fn answer_shared(&mut self, shared: Shared, Request { address, length }: Request) {
        let error = self.counted(check_read::<ROWS, COLUMNS>(address, length)).err();
        if self.state.settings.status_return_level == 0 || length > READ_MAX {
            return;
        }
        self.state.reply_delay_us = if shared.first() { self.state.settings.return_delay_us() } else { 0 };
        self.state.behind = Some(shared.behind(length));
        self.reply.clear();
        let mut put = |byte| {
            self.reply.push(byte).ok();
        };
        if shared.first() {
            shared.head().into_iter().for_each(&mut put);
        }
        put(error_byte(error, self.snapshot.faulted()));
        put(self.state.settings.record.id);
        if error.is_none() {
            TableView { state: self.state, snapshot: self.snapshot }.read(address, length, &mut put);
        } else {
            (0..length).for_each(|_| put(0));
        }
        for byte in update_crc(shared.crc, self.reply).to_le_bytes() {
            self.reply.push(byte).ok();
        }
    }

    /// Follows a packet that the devices share, and adds this one's part when all before it was heard.
    pub(super) fn listen(&mut self, byte: u8) {
        let Turn::Shared(mut shared, request) = self.state.turn else { return };
        let tick_ms = self.snapshot.tick_ms;
        let silent_ms = tick_ms.wrapping_sub(core::mem::replace(&mut self.state.heard_ms, tick_ms));
        self.state.turn = if silent_ms > SILENCE_MS || !shared.hear(byte) {
            Turn::None
        } else if shared.due() {
            self.answer_shared(shared, request);
            Turn::None
        } else {
            Turn::Shared(shared, request)
        };
    }

    /// Hears another device's status packet, which may be the one that this device waits for.
    pub(super) fn hear_status(&mut self, id: u8) {
        if let Turn::After(before, request) = self.state.turn
            && before == id
        {
            self.state.turn = Turn::None;
            self.answer_read(Ok(request));
        }
    }

    /// A whole packet with a bad CRC: answered where it seems to be an instruction for this device.
    pub(super) fn damaged(&mut self, packet: Packet<'_>) {
        let error = self.counted(Err(StatusError::Crc));
        if packet.id == self.state.settings.record.id && packet.instruction != instruction::STATUS {
            self.answer(packet.id, self.state.settings.status_return_level, error);
        }
    }

    /// Passes a result on, and counts it where it is an error.
    pub(super) fn counted<T>(&mut self, result: Result<T, StatusError>) -> Result<T, StatusError> {
        result.inspect_err(|&error| self.state.counters.count(error))
    }
}

/// Bytes of the reply to a fast read before the first device's part.
const FAST_HEAD: usize = 8;
/// Bytes that each device adds to its data: error, ID and CRC.
const FAST_EXTRA: u16 = 4;

/// Request to this device.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Request {
    pub address: u16,
    pub length: u16,
}

/// Event that this device waits for before it answers.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Turn {
    /// No request.
    None,
    /// The status packet of this device.
    After(u8, Request),
    /// The rest of the packet that the devices share.
    Shared(Shared, Request),
}

/// Follows the packet that the devices share, byte by byte: its data is not stuffed, unlike that of other packets.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Shared {
    /// The packet's length field.
    length: u16,
    heard: u16,
    /// Number of bytes that the devices before this one send, the packet's beginning included; 0 for the first.
    ahead: u16,
    /// Checksum of all that was heard.
    pub crc: u16,
}

impl Shared {
    /// Creates the state for the device at `place` of devices that send `lengths` bytes of data; none if the packet
    /// would be too long.
    pub fn new(place: usize, lengths: impl Iterator<Item = u16>) -> Option<Self> {
        let (mut whole, mut ahead) = (1_u16, 0);
        for (other, length) in lengths.enumerate() {
            if other == place && place > 0 {
                // The packet's length leaves out all before the instruction, the head does not.
                ahead = whole.checked_add(FAST_HEAD as u16 - 1)?;
            }
            whole = whole.checked_add(length.checked_add(FAST_EXTRA)?)?;
        }
        Some(Self { length: whole, heard: 0, ahead, crc: CRC_START })
    }

    /// Returns the beginning of the packet.
    fn head(&self) -> [u8; FAST_HEAD] {
        let [low, high] = self.length.to_le_bytes();
        let [a, b, c, d] = HEADER;
        [a, b, c, d, BROADCAST, low, high, instruction::STATUS]
    }

    /// Returns true if this device begins the packet.
    pub fn first(&self) -> bool {
        self.ahead == 0
    }

    /// Takes a byte of the bus. Returns false if it does not belong to the packet.
    pub fn hear(&mut self, byte: u8) -> bool {
        let fits = self.head().get(usize::from(self.heard)).is_none_or(|&expected| expected == byte);
        self.heard = self.heard.saturating_add(1);
        self.crc = update_crc(self.crc, &[byte]);
        fits
    }

    /// Returns the number of bytes of the packet behind this device's part with `length` bytes of data.
    pub fn behind(&self, length: u16) -> u16 {
        // The length leaves out the seven bytes before the instruction.
        let own = self.ahead.max(FAST_HEAD as u16).saturating_add(length).saturating_add(FAST_EXTRA);
        self.length.saturating_add(FAST_HEAD as u16 - 1).saturating_sub(own)
    }

    /// Returns true if all bytes before this device's part were heard.
    pub fn due(&self) -> bool {
        self.heard >= self.ahead
    }
}
