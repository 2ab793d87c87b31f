//! Execution of each instruction.

use super::answer::{Request, Shared, Turn};
use super::{Device, Exchange};
use crate::link::packet::{BROADCAST, Packet, Sender, StatusError, instruction};
use crate::link::settings::Saved;
use crate::link::table::{Staged, TableView, address};
use crate::store::Record;
use crate::units::Newtons;
use heapless::Vec;

/// Bits of the longest status packet to a Ping, 10 per byte: a device with a higher ID waits for as long.
const PING_SLOT_BITS: u32 = 14 * 10;
/// Clear: the fault.
const CLEAR_FAULT: [u8; 5] = [0x02, b'E', b'R', b'C', b'L'];
/// Control Table Backup: store.
const STORE: [u8; 5] = [0x01, b'C', b'T', b'R', b'L'];

impl<'a, const ROWS: usize, const COLUMNS: usize> Exchange<'a, ROWS, COLUMNS> {
    /// A whole packet with a good CRC.
    pub(super) fn packet(&mut self, packet: Packet<'_>) {
        let Packet { id, instruction, params, complete } = packet;
        if instruction == instruction::STATUS {
            return self.hear_status(id);
        }
        self.state.turn = Turn::None;
        let own = id == self.state.settings.record.id;
        if !own && id != BROADCAST {
            return;
        }
        self.state.counters.good_packets = self.state.counters.good_packets.wrapping_add(1);
        let level = self.state.settings.status_return_level;
        let result = match instruction {
            _ if !complete => Err(StatusError::Length),
            instruction::PING | instruction::ACTION | instruction::REBOOT if !params.is_empty() => {
                Err(StatusError::Length)
            }
            instruction::PING => return self.ping(id),
            instruction::READ if own => return self.answer_read(request_only(params)),
            instruction::READ => return,
            instruction::SYNC_READ
            | instruction::FAST_SYNC_READ
            | instruction::BULK_READ
            | instruction::FAST_BULK_READ
                if !own =>
            {
                return self.read_in_turn(instruction, params);
            }
            instruction::WRITE => word(params).and_then(|(address, data)| self.write(address, data)),
            instruction::REG_WRITE => self.register(params),
            instruction::ACTION => match self.state.registered.take() {
                Some((address, data)) => self.write(address, &data),
                None => Err(StatusError::Result),
            },
            instruction::FACTORY_RESET => self.factory_reset(params, own),
            instruction::REBOOT => {
                self.state.actions.reboot = true;
                Ok(())
            }
            instruction::CLEAR => self.on_key(params, CLEAR_FAULT, address::RECOVER),
            instruction::BACKUP => self.on_key(params, STORE, address::SAVE_PARAMETERS),
            instruction::SYNC_WRITE | instruction::BULK_WRITE if !own => self.write_listed(instruction, params),
            _ => Err(StatusError::Instruction),
        };
        let result = self.counted(result);
        if own {
            self.answer(id, level, result);
        }
    }

    /// Answers always, whatever the status return level; a broadcast after the devices with lower IDs.
    fn ping(&mut self, to: u8) {
        let id = self.state.settings.record.id;
        self.state.reply_delay_us = self.state.settings.return_delay_us();
        if to == BROADCAST {
            let slot_us = (PING_SLOT_BITS * 1_000_000).div_ceil(self.state.settings.baud());
            self.state.reply_delay_us += u32::from(id) * slot_us;
        }
        let mut sender = Sender::status(self.reply, id, None, self.snapshot.faulted());
        let view = TableView { state: self.state, snapshot: self.snapshot };
        for (address, length) in [(address::MODEL_NUMBER, 2), (address::FIRMWARE_VERSION, 1)] {
            view.read(address, length, &mut |byte| sender.push(byte));
        }
        sender.finish();
    }

    /// Writes all or nothing.
    fn write(&mut self, address: u16, data: &[u8]) -> Result<(), StatusError> {
        let mut staged = self.staged();
        staged.write(address, data)?;
        self.commit(staged)
    }

    fn staged(&self) -> Staged<'a, ROWS, COLUMNS> {
        let Device { settings, actions, clocks, .. } = *self.state;
        Staged { settings, actions, stops: false, snapshot: self.snapshot, clocks }
    }

    /// Replaces the settings, once they are checked.
    fn commit(&mut self, mut staged: Staged<'_, ROWS, COLUMNS>) -> Result<(), StatusError> {
        staged.check(&self.state.settings)?;
        let (before, after) = (&self.state.settings.record, &staged.settings.record);
        if before != after {
            staged.actions.configure |= before.params != after.params;
            staged.actions.calibrate |= before.gains != after.gains;
            staged.actions.baud |= before.baud_code != after.baud_code;
            staged.settings.saved = Saved::Changed;
        }
        let command = &mut staged.settings.command;
        if !command.torque {
            command.goal = Newtons::ZERO;
        }
        self.state.settings = staged.settings;
        self.state.actions = staged.actions;
        if staged.stops {
            self.state.registered = None;
        }
        Ok(())
    }

    /// Reg Write: checked now, written by Action.
    fn register(&mut self, params: &[u8]) -> Result<(), StatusError> {
        let (address, data) = word(params)?;
        let mut staged = self.staged();
        staged.write(address, data)?;
        staged.check(&self.state.settings)?;
        self.state.registered = Some((address, Vec::from_slice(data).map_err(|_| StatusError::Length)?));
        Ok(())
    }

    /// Executes an instruction that also has a register; an option selects it, and a key prevents mistakes.
    /// Other options are for functions that do not exist here.
    fn on_key(&mut self, params: &[u8], key: [u8; 5], request: u16) -> Result<(), StatusError> {
        match params.as_array() {
            None => Err(StatusError::Length),
            Some(params) if *params == key => self.write(request, &[1]),
            Some(_) => Err(StatusError::Range),
        }
    }

    /// Defaults to the stored registers: 1 keeps the ID, 2 the ID and the bus speed, FF nothing, but not by broadcast.
    fn factory_reset(&mut self, params: &[u8], own: bool) -> Result<(), StatusError> {
        let &[kind] = params else { return Err(StatusError::Length) };
        let mut staged = self.staged();
        let Record { id, baud_code, .. } = staged.settings.record;
        let record = match kind {
            0x01 => Record { id, ..Record::DEFAULT },
            0x02 => Record { id, baud_code, ..Record::DEFAULT },
            0xFF if own => Record::DEFAULT,
            0xFF => return Ok(()),
            _ => return Err(StatusError::Range),
        };
        if staged.moves() {
            return Err(StatusError::Access);
        }
        staged.settings.record = record;
        staged.actions.save = true;
        self.commit(staged)
    }

    /// Writes this device's entries of a Sync Write (one address and length for all) or of a Bulk Write. After an entry
    /// that is refused, the next one is still written: it may be a stop.
    fn write_listed(&mut self, instruction: u8, params: &[u8]) -> Result<(), StatusError> {
        let (mut common, mut list, mut written) = (None, params, Ok(()));
        if instruction == instruction::SYNC_WRITE {
            let (wanted, entries) = request(params)?;
            if !entries.len().is_multiple_of(usize::from(wanted.length) + 1) {
                return Err(StatusError::Length);
            }
            (common, list) = (Some(wanted), entries);
        }
        while let Some((&id, entry)) = list.split_first() {
            let (Request { address, length }, rest) = match common {
                Some(common) => (common, entry),
                None => request(entry)?,
            };
            let (data, rest) = rest.split_at_checked(usize::from(length)).ok_or(StatusError::Length)?;
            if id == self.state.settings.record.id {
                written = written.and(self.write(address, data));
            }
            list = rest;
        }
        written
    }

    /// Answers a read of several devices: now, after the device before this one in the list, or with its part of the
    /// packet that they share.
    fn read_in_turn(&mut self, instruction: u8, params: &[u8]) {
        let bulk = matches!(instruction, instruction::BULK_READ | instruction::FAST_BULK_READ);
        let Ok(mut entries) = self.counted(listed(bulk, params)) else { return };
        let id = self.state.settings.record.id;
        let Some(place) = entries.clone().position(|(other, _)| other == id) else { return };
        let Some((_, wanted)) = entries.clone().nth(place) else { return };
        if matches!(instruction, instruction::SYNC_READ | instruction::BULK_READ) {
            match place.checked_sub(1).and_then(|before| entries.nth(before)) {
                None => self.answer_read(Ok(wanted)),
                Some((before, _)) => self.state.turn = Turn::After(before, wanted),
            }
            return;
        }
        match Shared::new(place, entries.map(|(_, other)| other.length)) {
            None => self.state.counters.count(StatusError::Length),
            Some(shared) if shared.due() => self.answer_shared(shared, wanted),
            Some(shared) => {
                self.state.heard_ms = self.snapshot.tick_ms;
                self.state.turn = Turn::Shared(shared, wanted);
            }
        }
    }
}

/// Returns the devices of a read in their order, each with the request to it.
fn listed(bulk: bool, params: &[u8]) -> Result<impl Iterator<Item = (u8, Request)> + Clone, StatusError> {
    let (common, list) =
        if bulk { (None, params) } else { request(params).map(|(common, ids)| (Some(common), ids))? };
    let entries = list.chunks_exact(if bulk { 5 } else { 1 });
    if !entries.remainder().is_empty() {
        return Err(StatusError::Length);
    }
    Ok(entries.filter_map(move |entry| {
        let (&id, own) = entry.split_first()?;
        Some((id, common.or_else(|| request_only(own).ok())?))
    }))
}

/// Splits off a 16-bit number.
fn word(params: &[u8]) -> Result<(u16, &[u8]), StatusError> {
    let (bytes, rest) = params.split_first_chunk().ok_or(StatusError::Length)?;
    Ok((u16::from_le_bytes(*bytes), rest))
}

/// Splits off an address and a length.
fn request(params: &[u8]) -> Result<(Request, &[u8]), StatusError> {
    let (address, rest) = word(params)?;
    let (length, rest) = word(rest)?;
    Ok((Request { address, length }, rest))
}

/// Reads an address and a length, and nothing else.
fn request_only(params: &[u8]) -> Result<Request, StatusError> {
    match request(params)? {
        (request, []) => Ok(request),
        _ => Err(StatusError::Length),
    }
}
