//! Execution of each instruction.

use heapless::Vec;

use crate::link::packet::{BROADCAST, Packet, Reply, Sender, StatusError, instruction};

use crate::link::settings::Saved;
use crate::link::snapshot::Snapshot;
use crate::link::table::{self, Staged, TableView, address};

use crate::store::Record;

use super::answer::{Request, Shared, Turn};
use super::{Device, Registered};

/// Bits of the longest status packet to a Ping, 10 per byte: a device with a higher ID waits for as long.
const PING_SLOT_BITS: u32 = 14 * 10;
/// Clear: the fault.
const CLEAR_FAULT: [u8; 5] = [0x02, b'E', b'R', b'C', b'L'];
/// Control Table Backup: store.
const STORE: [u8; 5] = [0x01, b'C', b'T', b'R', b'L'];

impl<const ROWS: usize, const COLUMNS: usize> Device<ROWS, COLUMNS> {
    /// A whole packet with a good CRC.
    pub(super) fn packet(&mut self, packet: Packet<'_>, snapshot: &Snapshot<'_, ROWS, COLUMNS>, reply: &mut Reply) {
        if packet.instruction == instruction::STATUS {
            return self.hear_status(packet.id, snapshot, reply);
        }
        self.turn = Turn::None;
        let own = packet.id == self.settings.record.id;
        if !own && packet.id != BROADCAST {
            return;
        }
        self.counters.good_packets = self.counters.good_packets.wrapping_add(1);
        let level = self.settings.status_return_level;
        if !packet.complete {
            return self.conclude(packet, level, Err(StatusError::Length), reply);
        }
        let params = packet.params;
        match packet.instruction {
            instruction::PING if params.is_empty() => self.ping(packet.id, snapshot, reply),
            instruction::PING => self.conclude(packet, level, Err(StatusError::Length), reply),
            instruction::READ if own => self.answer_read(request_only(params), snapshot, reply),
            instruction::READ => {}
            instruction::SYNC_READ if !own => self.sync_read(params, snapshot, reply),
            instruction::FAST_SYNC_READ if !own => self.fast_sync_read(params, snapshot, reply),
            instruction::BULK_READ if !own => self.bulk_read(params, snapshot, reply),
            instruction::FAST_BULK_READ if !own => self.fast_bulk_read(params, snapshot, reply),
            _ => {
                let result = self.change(packet, own);
                self.conclude(packet, level, result, reply);
            }
        }
    }

    /// Counts an error, and answers if only this device was addressed.
    fn conclude(&mut self, packet: Packet<'_>, level: u8, result: Result<(), StatusError>, reply: &mut Reply) {
        let result = self.counted(result);
        if packet.id != BROADCAST {
            self.answer(packet.id, level, result, reply);
        }
    }

    /// The instructions that change something and return no data.
    fn change(&mut self, packet: Packet<'_>, own: bool) -> Result<(), StatusError> {
        let params = packet.params;
        match packet.instruction {
            instruction::WRITE => {
                let (address, data) = word(params).ok_or(StatusError::Length)?;
                self.write(address, data)
            }
            instruction::REG_WRITE => self.register(params),
            instruction::ACTION if params.is_empty() => {
                let registered = self.registered.take().ok_or(StatusError::Result)?;
                self.write(registered.address, &registered.data)
            }
            instruction::FACTORY_RESET => self.factory_reset(params, own),
            instruction::REBOOT if params.is_empty() => {
                self.actions.reboot = true;
                Ok(())
            }
            instruction::ACTION | instruction::REBOOT => Err(StatusError::Length),
            instruction::CLEAR => self.on_key(params, CLEAR_FAULT, address::RECOVER),
            instruction::BACKUP => self.on_key(params, STORE, address::SAVE_PARAMETERS),
            instruction::SYNC_WRITE if !own => self.sync_write(params),
            instruction::BULK_WRITE if !own => self.bulk_write(params),
            _ => Err(StatusError::Instruction),
        }
    }

    /// Answers always, whatever the status return level; a broadcast after the devices with lower IDs.
    fn ping(&mut self, to: u8, snapshot: &Snapshot<'_, ROWS, COLUMNS>, reply: &mut Reply) {
        let id = self.settings.record.id;
        self.reply_delay_us = self.settings.return_delay_us();
        if to == BROADCAST {
            self.reply_delay_us += u32::from(id) * (PING_SLOT_BITS * 1_000_000).div_ceil(self.settings.baud());
        }
        let mut sender = Sender::status(reply, id, None, self.stand.faulted);
        for (address, length) in [(address::MODEL_NUMBER, 2), (address::FIRMWARE_VERSION, 1)] {
            table::read(TableView { state: self, snapshot }, address, length, |byte| sender.push(byte));
        }
        sender.finish();
    }

    /// Writes all or nothing.
    fn write(&mut self, address: u16, data: &[u8]) -> Result<(), StatusError> {
        let mut staged = self.staged();
        table::write::<ROWS, COLUMNS>(&mut staged, address, data)?;
        self.commit(staged);
        Ok(())
    }

    fn staged(&self) -> Staged<ROWS, COLUMNS> {
        Staged { settings: self.settings, actions: self.actions, stand: self.stand, clocks: self.clocks }
    }

    fn commit(&mut self, mut staged: Staged<ROWS, COLUMNS>) {
        let (before, after) = (&self.settings.record, &staged.settings.record);
        let params = before.params != after.params;
        staged.actions.configure |= params;
        let gains = before.gains != after.gains;
        staged.actions.calibrate |= gains;
        staged.actions.baud |= before.baud_code != after.baud_code;
        if before != after {
            staged.settings.saved = Saved::Changed;
        }
        self.settings = staged.settings;
        self.actions = staged.actions;
    }

    /// Reg Write: checked now, written by Action.
    fn register(&mut self, params: &[u8]) -> Result<(), StatusError> {
        let (address, data) = word(params).ok_or(StatusError::Length)?;
        table::write::<ROWS, COLUMNS>(&mut self.staged(), address, data)?;
        let data = Vec::from_slice(data).map_err(|_| StatusError::Length)?;
        self.registered = Some(Registered { address, data });
        Ok(())
    }

    /// Executes an instruction that also has a register; an option selects it, and a key prevents mistakes.
    /// Other options are for functions that do not exist here.
    fn on_key(&mut self, params: &[u8], key: [u8; 5], request: u16) -> Result<(), StatusError> {
        let params: [u8; 5] = params.try_into().map_err(|_| StatusError::Length)?;
        if params == key { self.write(request, &[1]) } else { Err(StatusError::Range) }
    }

    /// Defaults to the stored registers: 1 keeps the ID, 2 the ID and the bus speed, FF nothing, but not by broadcast.
    fn factory_reset(&mut self, params: &[u8], own: bool) -> Result<(), StatusError> {
        let &[kind] = params else { return Err(StatusError::Length) };
        let kept = &self.settings.record;
        let record = match kind {
            0x01 => Record { id: kept.id, ..Record::DEFAULT },
            0x02 => Record { id: kept.id, baud_code: kept.baud_code, ..Record::DEFAULT },
            0xFF if own => Record::DEFAULT,
            0xFF => return Ok(()),
            _ => return Err(StatusError::Range),
        };
        if self.settings.command.torque || self.stand.strokes(&self.settings.command) {
            return Err(StatusError::Access);
        }
        let mut staged = self.staged();
        staged.settings.record = record;
        staged.settings.check(true, staged.clocks)?;
        staged.actions.save = true;
        staged.stand.check(&staged.settings.command, &staged.settings.command, staged.actions)?;
        self.commit(staged);
        Ok(())
    }

    fn sync_write(&mut self, params: &[u8]) -> Result<(), StatusError> {
        let (Request { address, length }, list) = request(params).ok_or(StatusError::Length)?;
        let entries = list.chunks_exact(usize::from(length) + 1);
        if !entries.remainder().is_empty() {
            return Err(StatusError::Length);
        }
        for entry in entries {
            if let Some((&id, data)) = entry.split_first()
                && id == self.settings.record.id
            {
                return self.write(address, data);
            }
        }
        Ok(())
    }

    fn bulk_write(&mut self, mut list: &[u8]) -> Result<(), StatusError> {
        while let Some((&id, entry)) = list.split_first() {
            let (Request { address, length }, rest) = request(entry).ok_or(StatusError::Length)?;
            let (data, rest) = rest.split_at_checked(usize::from(length)).ok_or(StatusError::Length)?;
            if id == self.settings.record.id {
                return self.write(address, data);
            }
            list = rest;
        }
        Ok(())
    }

    fn sync_read(&mut self, params: &[u8], snapshot: &Snapshot<'_, ROWS, COLUMNS>, reply: &mut Reply) {
        let Ok((wanted, ids)) = self.counted(request(params).ok_or(StatusError::Length)) else { return };
        let mut before = None;
        for &id in ids {
            if id == self.settings.record.id {
                return self.take_turn(before, wanted, snapshot, reply);
            }
            before = Some(id);
        }
    }

    fn bulk_read(&mut self, params: &[u8], snapshot: &Snapshot<'_, ROWS, COLUMNS>, reply: &mut Reply) {
        let Ok(entries) = self.counted(bulk(params)) else { return };
        let mut before = None;
        for (id, wanted) in entries {
            if id == self.settings.record.id {
                return self.take_turn(before, wanted, snapshot, reply);
            }
            before = Some(id);
        }
    }

    /// Answers now, or after the device before this one in the list.
    fn take_turn(
        &mut self,
        before: Option<u8>,
        wanted: Request,
        snapshot: &Snapshot<'_, ROWS, COLUMNS>,
        reply: &mut Reply,
    ) {
        match before {
            None => self.answer_read(Ok(wanted), snapshot, reply),
            Some(id) => self.turn = Turn::After(id, wanted),
        }
    }

    fn fast_sync_read(&mut self, params: &[u8], snapshot: &Snapshot<'_, ROWS, COLUMNS>, reply: &mut Reply) {
        let Ok((wanted, ids)) = self.counted(request(params).ok_or(StatusError::Length)) else { return };
        let Some(place) = ids.iter().position(|&id| id == self.settings.record.id) else { return };
        self.share(Shared::new(place, ids.iter().map(|_| wanted.length)), wanted, snapshot, reply);
    }

    fn fast_bulk_read(&mut self, params: &[u8], snapshot: &Snapshot<'_, ROWS, COLUMNS>, reply: &mut Reply) {
        let Ok(entries) = self.counted(bulk(params)) else { return };
        let own = |&(_, (id, _)): &(usize, (u8, Request))| id == self.settings.record.id;
        let Some((place, (_, wanted))) = entries.clone().enumerate().find(own) else { return };
        self.share(Shared::new(place, entries.map(|(_, entry)| entry.length)), wanted, snapshot, reply);
    }

    /// Adds this device's part now, or when those before it have added theirs.
    fn share(
        &mut self,
        shared: Option<Shared>,
        wanted: Request,
        snapshot: &Snapshot<'_, ROWS, COLUMNS>,
        reply: &mut Reply,
    ) {
        match shared {
            None => self.counters.count(StatusError::Length),
            Some(shared) if shared.due() => self.answer_shared(shared, wanted, snapshot, reply),
            Some(shared) => {
                self.heard_ms = snapshot.tick_ms;
                self.turn = Turn::Shared(shared, wanted);
            }
        }
    }
}

/// Entries of a bulk read: ID and request.
fn bulk(params: &[u8]) -> Result<impl Iterator<Item = (u8, Request)> + Clone, StatusError> {
    let (entries, []) = params.as_chunks::<5>() else { return Err(StatusError::Length) };
    Ok(entries.iter().map(|&[id, a, b, c, d]| {
        (id, Request { address: u16::from_le_bytes([a, b]), length: u16::from_le_bytes([c, d]) })
    }))
}

/// Splits off a 16-bit number.
fn word(params: &[u8]) -> Option<(u16, &[u8])> {
    let (bytes, rest) = params.split_first_chunk()?;
    Some((u16::from_le_bytes(*bytes), rest))
}

/// Splits off an address and a length.
fn request(params: &[u8]) -> Option<(Request, &[u8])> {
    let (address, rest) = word(params)?;
    let (length, rest) = word(rest)?;
    Some((Request { address, length }, rest))
}

/// Reads an address and a length, and nothing else.
fn request_only(params: &[u8]) -> Result<Request, StatusError> {
    match request(params) {
        Some((request, [])) => Ok(request),
        _ => Err(StatusError::Length),
    }
}
