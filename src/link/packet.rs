//! The numbers of DYNAMIXEL Protocol 2.0.
//!
//! | packet | bytes |
//! | --- | --- |
//! | instruction | FF FF FD 00, ID, length (2), instruction, parameters, CRC (2) |
//! | status | FF FF FD 00, ID, length (2), 55, error, parameters, CRC (2) |
//!
//! The length counts from the instruction to the CRC. From the instruction to the last parameter, FF FF FD is sent
//! as FF FF FD FD, so a header never appears inside a packet.

/// What every packet begins with.
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

/// Why an instruction was refused, with the protocol's numbers.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u8)]
pub enum StatusError {
    /// It was understood but could not be carried out just now.
    Result = 1,
    /// There is no such instruction here, or not under this ID.
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
    /// Whom it is for, or in a status packet from.
    pub id: u8,
    /// One of [`instruction`], or a number that this device does not know.
    pub instruction: u8,
    /// What follows the instruction; in a status packet the error comes first.
    pub params: &'a [u8],
    /// False where there were more parameters than the receiver holds, and only the first were kept.
    pub complete: bool,
}
