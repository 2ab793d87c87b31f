//! What the scene's host sends and reads: goals out, status registers in.

use fingertip::command::Command;
use fingertip::config::newtons;
use fingertip::contact::Contact;
use fingertip::link::Reply;
use fingertip::link::packet::{Event, Receiver, Sender, instruction};
use fingertip::pipeline::Status;
use fingertip::shipped::address;
use fingertip::state::{Fault, Limits, Mode};
use fingertip::units::{Duty, Millimetres, MillimetresPerSecond};
use sim::events::Request;

/// The board's address on the bus.
pub const ID: u8 = 1;
/// Time of a byte at 3 Mbaud, rounded up.
pub const BYTE_NS: u64 = 3_334;
/// Bytes of a goal's packet, the longest that is written.
pub const GOAL_BYTES: u64 = 16;
/// Bytes of a read's packet.
pub const READ_BYTES: u64 = 14;
/// The status registers, read at once.
const FROM: u16 = address::PRESENT_MODE;
const BYTES: u16 = address::SUPPLY_MV - FROM;

/// Value that a packet writes into the board.
#[derive(Clone, Copy, Debug)]
pub enum Write {
    /// A goal, mN.
    Goal(i32),
    /// A request of an event.
    Request(Request),
}

impl Write {
    /// The packet that writes it.
    pub fn packet(self) -> Vec<u8> {
        let (register, value) = match self {
            Self::Goal(goal_mn) => (address::GOAL_FORCE_MN, goal_mn.to_le_bytes().to_vec()),
            Self::Request(Request::Torque(on)) => (address::TORQUE_ENABLE, vec![on.into()]),
            Self::Request(Request::Tare) => (address::TARE, vec![1]),
            Self::Request(Request::Clear) => (address::CLEAR_FAULT, vec![1]),
        };
        packet(instruction::WRITE, &[&register.to_le_bytes()[..], &value].concat())
    }

    /// Puts it into the command that the board then has.
    pub fn apply(self, command: &mut Command) {
        match self {
            Self::Goal(goal_mn) => command.goal = newtons(goal_mn),
            Self::Request(request) => request.apply(command),
        }
    }
}

/// Packet that requests the status registers.
pub fn read() -> Vec<u8> {
    let ([a, b], [c, d]) = (FROM.to_le_bytes(), BYTES.to_le_bytes());
    packet(instruction::READ, &[a, b, c, d])
}

fn packet(instruction: u8, params: &[u8]) -> Vec<u8> {
    let mut bytes = Reply::new();
    let mut sender = Sender::new(&mut bytes, ID, instruction);
    params.iter().for_each(|byte| sender.push(*byte));
    sender.finish();
    bytes.to_vec()
}

/// Takes the image's bytes and finds the status registers among them.
#[derive(Debug, Default)]
pub struct Listener(Receiver);

impl Listener {
    /// The status, where this byte completes it.
    pub fn push(&mut self, byte: u8) -> Option<Status> {
        if self.0.push(byte) != Some(Event::Packet) {
            return None;
        }
        let packet = self.0.packet();
        let of_board = packet.id == ID && packet.instruction == instruction::STATUS;
        // An error byte comes first; its top bit only says that the board has a fault.
        packet
            .params
            .split_first()
            .filter(|(error, _)| of_board && **error & 0x7f == 0)
            .and_then(|(_, data)| status(data))
    }
}

fn status(bytes: &[u8]) -> Option<Status> {
    let byte = |of: u16| bytes.get(usize::from(of - FROM)).copied();
    let half = |of: u16| bytes.get(usize::from(of - FROM)..)?.first_chunk().copied().map(u16::from_le_bytes);
    let word = |of: u16| bytes.get(usize::from(of - FROM)..)?.first_chunk().copied().map(i32::from_le_bytes);
    let mm = |of: u16| word(of).map(|um| Millimetres::from_bits(scaled(um, 1 << 24)));
    Some(Status {
        sequence: word(address::FRAME_COUNTER)? as u32,
        missed_frames: word(address::MISSED_FRAMES)? as u32,
        mode: mode(byte(address::PRESENT_MODE)?),
        fault: fault(byte(address::FAULT)?),
        limits: Limits(half(address::LIMITS)?),
        contact: Contact {
            force: newtons(word(address::PRESENT_FORCE_MN)?),
            indentation: mm(address::INDENTATION_UM)?,
            centre_x: mm(address::CENTRE_X_UM)?,
            centre_y: mm(address::CENTRE_Y_UM)?,
            radius: mm(address::CONTACT_RADIUS_UM)?,
            peak_pa: word(address::PEAK_PRESSURE_PA)? as u32,
            confidence: byte(address::CONFIDENCE)?,
            bad_taxels: byte(address::BAD_TAXELS)?,
            ..Contact::default()
        },
        travel: mm(address::TRAVEL_UM)?,
        speed: MillimetresPerSecond::from_bits(scaled(word(address::SPEED_UM_PER_S)?, 1 << 16)),
        duty: Duty(scaled(i32::from(half(address::DUTY_PERMILLE)? as i16), i32::from(Duty::FULL).into()) as i16),
        ..Status::default()
    })
}

/// Thousandths in units of the last place.
fn scaled(thousandths: i32, one: i64) -> i32 {
    let bits = (i64::from(thousandths) * one).div_euclid(1000);
    bits.clamp(i32::MIN.into(), i32::MAX.into()) as i32
}

fn mode(number: u8) -> Mode {
    Mode::ALL.into_iter().find(|mode| *mode as u8 == number).unwrap_or(Mode::Fault)
}

fn fault(number: u8) -> Option<Fault> {
    Fault::ALL.into_iter().find(|fault| *fault as u8 == number)
}
