//! The numbers of DYNAMIXEL Protocol 2.0.
//!
//! | packet | bytes |
//! | --- | --- |
//! | instruction | FF FF FD 00, ID, length (2), instruction, parameters, CRC (2) |
//! | status | FF FF FD 00, ID, length (2), 55, error, parameters, CRC (2) |
//!
//! The length counts from the instruction to the CRC. From the instruction to the last parameter, FF FF FD is sent
//! as FF FF FD FD, so a header never appears inside a packet.
//!
//! [`Receiver`] takes bytes in any slicing, with any garbage in between. Stuffing keeps the header out of every
//! packet's inside, so a header always starts a packet, also after a packet that was cut short. A lost or damaged byte
//! therefore costs the packet that it belongs to and no other. [`Sender`] puts header, stuffing, length and CRC around
//! bytes that are pushed one by one.

use crate::store::ID_MAX;
use crc::{CRC_16_UMTS, Crc, Table};
use heapless::Vec;

/// The CRC-16 of the protocol: polynomial 8005h, start 0, most significant bit first, nothing inverted.
static TABLE: Crc<u16, Table<1>> = Crc::<u16, Table<1>>::new(&CRC_16_UMTS);

/// Checksum of no bytes.
pub const CRC_START: u16 = 0;

/// Continues a checksum over more bytes: `update_crc(update_crc(CRC_START, a), b)` is the checksum of `a` followed by
/// `b`.
pub fn update_crc(crc: u16, bytes: &[u8]) -> u16 {
    let mut digest = TABLE.digest_with_initial(crc);
    digest.update(bytes);
    digest.finalize()
}

/// First bytes of every packet.
pub const HEADER: [u8; 4] = [0xFF, 0xFF, 0xFD, 0x00];
/// The ID that addresses every device.
pub const BROADCAST: u8 = 254;
/// Sent after FF FF FD, and dropped by the receiver.
pub const STUFFING: u8 = 0xFD;

/// Instruction numbers.
pub mod instruction {
    /// Asks for model number and firmware version.
    pub const PING: u8 = 0x01;
    /// Reads bytes of the control table.
    pub const READ: u8 = 0x02;
    /// Writes registers of the control table.
    pub const WRITE: u8 = 0x03;
    /// Checks a write and keeps it for [`ACTION`].
    pub const REG_WRITE: u8 = 0x04;
    /// Carries out the write that [`REG_WRITE`] kept.
    pub const ACTION: u8 = 0x05;
    /// Sets the stored registers to their defaults.
    pub const FACTORY_RESET: u8 = 0x06;
    /// Resets the controller.
    pub const REBOOT: u8 = 0x08;
    /// Clears what its parameters name: `02 "ERCL"` a fault.
    pub const CLEAR: u8 = 0x10;
    /// Backs up the stored registers (`01 "CTRL"`), or restores them.
    pub const BACKUP: u8 = 0x20;
    /// Marks a device's reply.
    pub const STATUS: u8 = 0x55;
    /// Reads the same addresses of several devices.
    pub const SYNC_READ: u8 = 0x82;
    /// Writes the same addresses of several devices.
    pub const SYNC_WRITE: u8 = 0x83;
    /// Like [`SYNC_READ`], answered in one packet to which each device adds its part.
    pub const FAST_SYNC_READ: u8 = 0x8A;
    /// Reads different addresses of several devices.
    pub const BULK_READ: u8 = 0x92;
    /// Writes different addresses of several devices.
    pub const BULK_WRITE: u8 = 0x93;
    /// Like [`BULK_READ`], answered in one packet to which each device adds its part.
    pub const FAST_BULK_READ: u8 = 0x9A;
}

/// Reason to refuse an instruction, with the protocol's numbers.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u8)]
pub enum StatusError {
    /// The request was understood but cannot be carried out now.
    Result = 1,
    /// The instruction is unknown, or not supported under this ID.
    Instruction = 2,
    /// The packet arrived damaged.
    Crc = 3,
    /// A value lies outside its register's range, or a goal comes after the bus watchdog has tripped.
    Range = 4,
    /// Parameters are missing or too many, a write does not cover whole registers, or a read is too long.
    Length = 5,
    /// A value lies inside its register's range but beyond a limit that other registers set.
    Limit = 6,
    /// No such register, a register that cannot be written, or not while torque is on.
    Access = 7,
}

/// A packet with its CRC checked and its stuffing removed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Packet<'a> {
    /// ID of the addressed device, or in a status packet of the sender.
    pub id: u8,
    /// One of [`instruction`], or a number that this device does not know.
    pub instruction: u8,
    /// Bytes after the instruction; in a status packet the error comes first.
    pub params: &'a [u8],
    /// False where there were more parameters than the receiver holds, and only the first were kept.
    pub complete: bool,
}

/// Number of parameter bytes that are kept of a packet: a Sync Read of every ID, or a Sync Write of 76 goal forces.
pub const PARAMS_MAX: usize = 384;
/// Largest length of a packet: a longer one is taken for noise.
pub const LENGTH_MAX: u16 = 2048;
/// Least length: the instruction and the CRC.
const LENGTH_MIN: u16 = 3;

/// Event that a byte completes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Event {
    /// A whole packet with a good CRC: [`Receiver::packet`].
    Packet,
    /// A whole packet with a bad CRC: its fields, which may be wrong, are in [`Receiver::packet`].
    BadCrc,
    /// A header, after bytes that were no packet or only the beginning of one.
    Framing,
}

/// Finds packets in a stream of bytes.
#[derive(Clone, Debug, Default)]
pub struct Receiver {
    /// The last four bytes as they came.
    window: u32,
    /// Number of bytes after the header of the packet under way; none outside of a packet.
    place: Option<u16>,
    /// Number of bytes after the header of the whole packet, once its length is known.
    end: u16,
    /// Number of bytes since the last packet that belong to none.
    stray: u8,
    /// Number of bytes that still belong to a packet of which this device has sent a part.
    shared: u16,
    /// ID, length and instruction.
    head: [u8; 4],
    crc: u16,
    crc_low: u8,
    params: Vec<u8, PARAMS_MAX>,
    /// True if parameters did not fit.
    cut: bool,
}

impl Receiver {
    /// Creates a receiver.
    pub fn new() -> Self {
        Self::default()
    }

    /// Packet of the last event; valid until the next byte.
    pub fn packet(&self) -> Packet<'_> {
        let [id, _, _, instruction] = self.head;
        Packet { id, instruction, params: &self.params, complete: !self.cut }
    }

    /// Takes one byte.
    pub fn push(&mut self, byte: u8) -> Option<Event> {
        let stuffing = byte == STUFFING && self.window & 0x00FF_FFFF == u32::from_be_bytes(HEADER) >> 8;
        self.window = self.window << 8 | u32::from(byte);
        let header = self.window == u32::from_be_bytes(HEADER);
        let last = self.place.is_some_and(|place| place + 1 == self.end);
        if header && !last {
            let clean = self.place.is_none() && usize::from(self.stray) < HEADER.len();
            self.begin();
            return (!clean).then_some(Event::Framing);
        }
        let Some(place) = self.place else {
            if self.shared > 0 {
                self.shared -= 1;
            } else {
                self.stray = self.stray.saturating_add(1);
            }
            return None;
        };
        if last {
            return Some(self.finish(byte, header));
        }
        self.place = Some(place + 1);
        if place + 2 == self.end {
            self.crc_low = byte;
            return None;
        }
        self.crc = update_crc(self.crc, &[byte]);
        match self.head.get_mut(usize::from(place)) {
            Some(slot) => {
                *slot = byte;
                self.check_head(place);
            }
            None if !stuffing => self.cut |= self.params.push(byte).is_err(),
            None => {}
        }
        None
    }

    /// Takes note that this device sends a part of the packet, which it does not hear; `behind` bytes follow the
    /// part.
    pub(super) fn take_part(&mut self, behind: u16) {
        self.window = 0;
        self.stray = 0;
        self.shared = behind;
        self.place = None;
    }

    fn begin(&mut self) {
        self.shared = 0;
        self.crc = update_crc(CRC_START, &HEADER);
        self.params.clear();
        self.cut = false;
        (self.place, self.end) = (Some(0), u16::MAX);
    }

    /// Drops a header that was no packet, as its ID or its length shows.
    fn check_head(&mut self, place: u16) {
        let [id, low, high, _] = self.head;
        let length = u16::from_le_bytes([low, high]);
        match place {
            0 if id <= ID_MAX || id == BROADCAST => {}
            2 if (LENGTH_MIN..=LENGTH_MAX).contains(&length) => self.end = length + 3,
            0 | 2 => (self.stray, self.place) = (u8::MAX, None),
            _ => {}
        }
    }

    fn finish(&mut self, crc_high: u8, header: bool) -> Event {
        self.stray = 0;
        self.place = None;
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

/// The longest packet sent: 256 bytes of data with an FD stuffed after each third of them, and 11 around.
pub const REPLY_MAX: usize = 384;
/// Bytes to send.
pub type Reply = Vec<u8, REPLY_MAX>;

/// Position of the length.
const LENGTH_PLACE: usize = 5;
/// Position from which bytes are stuffed: the instruction.
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

    /// Begins a status packet; `alert` is true if the hardware error status is not zero.
    pub fn status(reply: &'r mut Reply, id: u8, error: Option<StatusError>, alert: bool) -> Self {
        let mut sender = Self::new(reply, id, instruction::STATUS);
        sender.push(error_byte(error, alert));
        sender
    }

    /// Adds a byte of the parameters, and stuffing if it is needed.
    pub fn push(&mut self, byte: u8) {
        self.raw(byte);
        if byte == STUFFING {
            let stuffed = self.reply.get(STUFFED_FROM..).unwrap_or_default();
            if stuffed.ends_with(&[0xFF, 0xFF, STUFFING]) {
                self.raw(STUFFING);
            }
        }
    }

    /// Ends the packet with its length and CRC.
    pub fn finish(mut self) {
        let length = (self.reply.len() + 2).saturating_sub(STUFFED_FROM) as u16;
        if let Some(place) = self.reply.get_mut(LENGTH_PLACE..).and_then(|rest| rest.first_chunk_mut()) {
            *place = length.to_le_bytes();
        }
        for byte in update_crc(CRC_START, self.reply).to_le_bytes() {
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
