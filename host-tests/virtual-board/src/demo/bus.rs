//! What the demonstration's client says on the bus, and what it reads.

use super::DemoError;
use crate::Rig;
use crate::client::Client;
use dynamixel2::{InvalidMessage, ReadError, TransferError};
use fingertip::shipped::{COLUMNS, ROWS, address};
use fingertip::state::Mode;
use host_tests::heatmap::Pressures;

/// The board's address on the bus.
pub const ID: u8 = 1;
/// An answer takes at most this long.
const WAIT_NS: u64 = 20_000_000;
/// The status registers, read at once.
const STATUS: u16 = address::PRESENT_MODE;
const STATUS_BYTES: u16 = address::SUPPLY_MV - STATUS;

/// What the board said of itself.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Poll {
    /// When it was asked.
    pub at_s: f64,
    /// Mode.
    pub mode: Mode,
    /// Fault number, 0 for none.
    pub fault: u8,
    /// Limits.
    pub limits: u16,
    /// Sensed force.
    pub force_n: f64,
    /// Indentation from it.
    pub indentation_mm: f64,
    /// Travel of the tip by the encoder, since torque was enabled.
    pub travel_mm: f64,
    /// Centre of the contact, along columns and rows.
    pub centre_mm: [f64; 2],
    /// Contact radius.
    pub radius_mm: f64,
    /// Frame of this state.
    pub frame: u32,
    /// Frames missed since the reset.
    pub missed_frames: u32,
}

/// Has the client do something.
pub fn ask<T: Send + 'static>(
    rig: &mut Rig,
    doing: &str,
    job: impl FnOnce(&mut Client) -> Result<T, TransferError> + Send,
) -> Result<T, DemoError> {
    rig.client(WAIT_NS, job)?.map_err(|why| DemoError::Bus { doing: doing.to_owned(), why })
}

/// Writes a register of one byte.
pub fn write_u8(rig: &mut Rig, doing: &str, address: u16, value: u8) -> Result<(), DemoError> {
    ask(rig, doing, move |bus| bus.write_u8(ID, address, value).map(drop))
}

/// Reads whole registers.
///
/// The client (0.9.1) leaves the stuffing in a reply with FF FF FF FD: a negative number, and a register that begins
/// with FD. Read in two parts, these do not meet.
fn read(rig: &mut Rig, doing: &str, from: u16, bytes: u16) -> Result<Vec<u8>, DemoError> {
    let half = bytes / 8 * 4;
    match rig.client(WAIT_NS, move |bus| bus.read(ID, from, bytes))? {
        Ok(response) => Ok(response.data),
        Err(TransferError::ReadError(ReadError::InvalidMessage(InvalidMessage::InvalidParameterCount(_))))
            if half > 0 =>
        {
            Ok([read(rig, doing, from, half)?, read(rig, doing, from + half, bytes - half)?].concat())
        }
        Err(why) => Err(DemoError::Bus { doing: doing.to_owned(), why }),
    }
}

/// Asks the board how it goes.
pub fn poll(rig: &mut Rig) -> Result<Poll, DemoError> {
    let bytes = read(rig, "status", STATUS, STATUS_BYTES)?;
    let at_s = rig.now_ns() as f64 * 1e-9;
    decode(at_s, &bytes).ok_or_else(|| DemoError::Unexpected(format!("a status of {} bytes", bytes.len())))
}

fn decode(at_s: f64, bytes: &[u8]) -> Option<Poll> {
    let byte = |of: u16| bytes.get(usize::from(of - STATUS)).copied();
    let word = |of: u16| bytes.get(usize::from(of - STATUS)..)?.first_chunk().copied().map(u32::from_le_bytes);
    let thousandths = |of: u16| word(of).map(|word| f64::from(word as i32) * 1e-3);
    let mode = match byte(address::PRESENT_MODE)? {
        0 => Mode::Off,
        1 => Mode::Tare,
        2 => Mode::Approach,
        3 => Mode::Force,
        4 => Mode::Release,
        6 => Mode::Identify,
        _ => Mode::Fault,
    };
    Some(Poll {
        at_s,
        mode,
        fault: byte(address::FAULT)?,
        limits: u16::from_le_bytes([byte(address::LIMITS)?, byte(address::LIMITS + 1)?]),
        force_n: thousandths(address::PRESENT_FORCE_MN)?,
        indentation_mm: thousandths(address::INDENTATION_UM)?,
        travel_mm: thousandths(address::TRAVEL_UM)?,
        centre_mm: [thousandths(address::CENTRE_X_UM)?, thousandths(address::CENTRE_Y_UM)?],
        radius_mm: thousandths(address::CONTACT_RADIUS_UM)?,
        frame: word(address::FRAME_COUNTER)?,
        missed_frames: word(address::MISSED_FRAMES)?,
    })
}

/// The picture of the array, kPa.
pub fn pressures(rig: &mut Rig) -> Result<Pressures, DemoError> {
    let bytes = read(rig, "pressures", address::PRESSURES, (2 * ROWS * COLUMNS) as u16)?;
    let mut pressures = [[0.0; COLUMNS]; ROWS];
    for (kpa, pair) in pressures.as_flattened_mut().iter_mut().zip(bytes.chunks_exact(2)) {
        // In units of 10 Pa.
        *kpa = f64::from(u16::from_le_bytes([pair[0], pair[1]])) * 1e-2;
    }
    Ok(pressures)
}
