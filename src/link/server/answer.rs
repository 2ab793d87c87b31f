//! Replies: whether, when and with what.

use crate::link::crc;
use crate::link::packet::{Packet, StatusError, instruction};
use crate::link::sender::{REPLY_MAX, Reply, Sender, error_byte};
use crate::link::snapshot::Snapshot;
use crate::link::table::{self, READ_MAX, View};
use crate::link::turn::{Request, Shared, Turn};

use super::State;

/// Who makes a pause as long as this in a packet that the devices share, at the slowest speed too, sends it no further:
/// what comes then is another's.
const SILENCE_MS: u32 = 5;

// The largest part of a shared packet, its beginning included, fits into a reply.
const _: () = assert!(8 + 2 + READ_MAX as usize + 2 <= REPLY_MAX);

impl<const ROWS: usize, const COLUMNS: usize> State<ROWS, COLUMNS> {
    /// Answers an instruction that returns no data, under the ID and the status return level that it found: it may have
    /// changed them.
    pub(super) fn answer(&mut self, id: u8, level: u8, result: Result<(), StatusError>, reply: &mut Reply) {
        if level >= 2 {
            self.reply_delay_us = self.settings.return_delay_us();
            Sender::status(reply, id, result.err(), self.stand.faulted).finish();
        }
    }

    /// Answers a read.
    pub(super) fn answer_read(
        &mut self,
        request: Result<Request, StatusError>,
        snapshot: &Snapshot<'_, ROWS, COLUMNS>,
        reply: &mut Reply,
    ) {
        let request = self.counted(request.and_then(checked::<ROWS, COLUMNS>));
        if self.settings.status_return_level == 0 {
            return;
        }
        self.reply_delay_us = self.settings.return_delay_us();
        let mut sender = Sender::status(reply, self.settings.record.id, request.err(), self.stand.faulted);
        if let Ok(Request { address, length }) = request {
            table::read(View { state: self, snapshot }, address, length, |byte| sender.push(byte));
        }
        sender.finish();
    }

    /// Sends this device's part of a shared packet; zeros in place of data that cannot be read.
    pub(super) fn answer_shared(
        &mut self,
        shared: Shared,
        request: Request,
        snapshot: &Snapshot<'_, ROWS, COLUMNS>,
        reply: &mut Reply,
    ) {
        let readable = self.counted(checked::<ROWS, COLUMNS>(request));
        if self.settings.status_return_level == 0 || request.length > READ_MAX {
            return;
        }
        self.reply_delay_us = if shared.first() { self.settings.return_delay_us() } else { 0 };
        self.behind = Some(shared.behind(request.length));
        reply.clear();
        let mut put = |byte| {
            reply.push(byte).ok();
        };
        shared.opening().for_each(&mut put);
        put(error_byte(readable.err(), self.stand.faulted));
        put(self.settings.record.id);
        match readable {
            Ok(_) => table::read(View { state: self, snapshot }, request.address, request.length, &mut put),
            Err(_) => (0..request.length).for_each(|_| put(0)),
        }
        for byte in crc::update(shared.crc, reply).to_le_bytes() {
            reply.push(byte).ok();
        }
    }

    /// Follows a packet that the devices share, and adds this one's part when all before it was heard.
    pub(super) fn listen(&mut self, byte: u8, snapshot: &Snapshot<'_, ROWS, COLUMNS>, reply: &mut Reply) {
        let Turn::Shared(mut shared, request) = self.turn else { return };
        let silent_ms = snapshot.tick_ms.wrapping_sub(core::mem::replace(&mut self.heard_ms, snapshot.tick_ms));
        self.turn = if silent_ms > SILENCE_MS || !shared.hear(byte) {
            Turn::None
        } else if shared.due() {
            self.answer_shared(shared, request, snapshot, reply);
            Turn::None
        } else {
            Turn::Shared(shared, request)
        };
    }

    /// Hears another device's status packet, which may be the one that this device waits for.
    pub(super) fn hear_status(&mut self, id: u8, snapshot: &Snapshot<'_, ROWS, COLUMNS>, reply: &mut Reply) {
        if let Turn::After(before, request) = self.turn
            && before == id
        {
            self.turn = Turn::None;
            self.answer_read(Ok(request), snapshot, reply);
        }
    }

    /// A whole packet with a bad CRC: answered where it seems to be an instruction for this device.
    pub(super) fn damaged(&mut self, packet: Packet<'_>, reply: &mut Reply) {
        let error = self.counted(Err(StatusError::Crc));
        if packet.id == self.settings.record.id && packet.instruction != instruction::STATUS {
            self.answer(packet.id, self.settings.status_return_level, error, reply);
        }
    }

    /// Passes a result on, and counts it where it is an error.
    pub(super) fn counted<T>(&mut self, result: Result<T, StatusError>) -> Result<T, StatusError> {
        result.inspect_err(|&error| self.counters.count(error))
    }
}

fn checked<const ROWS: usize, const COLUMNS: usize>(request: Request) -> Result<Request, StatusError> {
    table::check_read::<ROWS, COLUMNS>(request.address, request.length).map(|()| request)
}
