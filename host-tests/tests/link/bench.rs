//! A server with a made-up loop behind it, and a host's side of the talk.

use fingertip::capture::CaptureStatus;
use fingertip::command::Command;
pub use fingertip::link::Actions;
pub use fingertip::link::packet::{BROADCAST, CRC_START, Event, Receiver, StatusError, update_crc};
use fingertip::link::packet::{Packet, Sender};
pub use fingertip::link::table::READ_MAX;
pub use fingertip::link::table::indirect::BLOCK;
use fingertip::link::{Captured, Crash, CrashCause, Health, Reply, ResetCause};
use fingertip::params::Params;
use fingertip::pipeline::{AcknowledgedRequests, Status, Taring};
use fingertip::pressure::TARE_BITS;
use fingertip::shipped::{CLOCKS, COLUMNS, Frame, ROWS, SLOTS, Server, Snapshot, address};
pub use fingertip::shipped::{REGISTERS, Record};
use fingertip::state::{Fault, Mode};

pub const ID: u8 = 1;

#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Answer {
    pub id: u8,
    pub error: u8,
    pub data: Vec<u8>,
}

impl Answer {
    /// The error's number, without the alert.
    pub fn number(&self) -> u8 {
        self.error & 0x7F
    }

    fn result(self) -> Result<Vec<u8>, u8> {
        if self.number() == 0 { Ok(self.data) } else { Err(self.number()) }
    }
}

pub struct Bench {
    pub server: Server,
    pub status: Status,
    frame: Frame,
    taxels: [[i32; COLUMNS]; ROWS],
    tare: [[i32; COLUMNS]; ROWS],
    /// Time; does not advance by itself.
    pub tick_ms: u32,
    /// The made-up capture, and its bytes.
    pub capture: CaptureStatus,
    pub captured: Vec<u8>,
}

impl Bench {
    pub fn new() -> Self {
        let params = Params { direction_confirmed: 1, ..Params::DEFAULT };
        Self::with(Record { id: ID, params, ..Record::DEFAULT })
    }

    /// The same with torque.
    pub fn on() -> Self {
        let mut bench = Self::new();
        bench.write(address::TORQUE_ENABLE, &[1]).expect("torque");
        bench
    }

    pub fn with(record: Record) -> Self {
        let mut frame = Frame::EMPTY;
        for place in 0..SLOTS * COLUMNS {
            frame.set_code(place / COLUMNS, place % COLUMNS, 1000 + place as u16);
        }
        Self {
            server: Server::new(record, &CLOCKS),
            status: Status::default(),
            frame,
            taxels: by_place(|place| 20_000 + place),
            tare: by_place(|place| (300 + place) << TARE_BITS),
            tick_ms: 0x1_8123,
            capture: CaptureStatus::default(),
            captured: Vec::new(),
        }
    }

    /// Stops the made-up loop, or lets it run.
    pub fn set_fault(&mut self, fault: Option<Fault>) {
        self.status.fault = fault;
        self.status.mode = if fault.is_some() { Mode::Fault } else { Mode::Off };
    }

    /// Accepts the requests like a loop that executes a tare and a clear at once.
    pub fn take_up(&mut self) {
        let Command { tare_request: tare, clear_request: clear, measure_request: measure, torque, .. } =
            self.server.command();
        if clear != self.status.taken.clear && !torque {
            self.set_fault(None);
        }
        if tare != self.status.taken.tare {
            self.status.tare = if self.status.fault.is_some() { Taring::Refused } else { Taring::Done };
        }
        self.status.taken = AcknowledgedRequests { tare, clear, measure };
    }

    /// Returns the packets that the bus sends in return.
    pub fn hear(&mut self, bytes: &[u8]) -> Vec<Vec<u8>> {
        let snapshot = Snapshot {
            status: self.status,
            supply_mv: 6012,
            tick_ms: self.tick_ms,
            frame_time_us: 0xFEDC_BA98,
            frame_ns: 99_762,
            loop_time_us: 41,
            loop_time_max_us: 47,
            reset_cause: ResetCause::Watchdog,
            crash: Crash { cause: CrashCause::Panic, line: 321, count: 7, pc: 0x0800_1234 },
            health: Health {
                chip_id: 0xF1D0_2A17,
                option_bytes: 0x0fff_aae1,
                analogue_mv: 3_301,
                stack_bytes: 15_080,
                late_ns: 412,
                broken_frames: [1, 2, 3, 4],
                transfer_errors: [5, 6],
                line_errors: [7, 8, 9],
            },
            frame: &self.frame,
            taxels: &self.taxels,
            pascals_per_sum_q32: 10 << 32,
            tare: &self.tare,
            capture: Captured { standing: self.capture, data: &self.captured },
        };
        let mut reply = Reply::new();
        let mut replies = Vec::new();
        let mut rest = bytes;
        while !rest.is_empty() {
            let taken = self.server.feed(rest, &snapshot, &mut reply);
            rest = &rest[taken..];
            if !reply.is_empty() {
                replies.push(reply.to_vec());
            }
        }
        replies
    }

    /// The answer to an instruction packet, where there is one.
    pub fn ask_as(&mut self, id: u8, instruction: u8, params: &[u8]) -> Option<Answer> {
        let mut replies = self.hear(&packet(id, instruction, params));
        assert!(replies.len() <= 1, "{replies:02X?}");
        replies.pop().map(|reply| answer(&reply))
    }

    /// The answer to an instruction packet for the device under test.
    pub fn ask(&mut self, instruction: u8, params: &[u8]) -> Answer {
        self.ask_as(self.server.settings().record.id, instruction, params).expect("an answer")
    }

    pub fn read(&mut self, address: u16, length: u16) -> Result<Vec<u8>, u8> {
        self.ask(0x02, &[address.to_le_bytes(), length.to_le_bytes()].concat()).result()
    }

    pub fn write(&mut self, address: u16, data: &[u8]) -> Result<(), u8> {
        self.ask(0x03, &[&address.to_le_bytes(), data].concat()).result().map(|data| assert!(data.is_empty()))
    }

    /// Reads a number of `width` bytes, unsigned.
    pub fn number(&mut self, address: u16, width: u16) -> u32 {
        let mut bytes = self.read(address, width).expect("a register");
        bytes.resize(4, 0);
        u32::from_le_bytes(bytes.try_into().expect("four bytes"))
    }

    /// Number of instructions that were refused for this reason.
    pub fn refused(&self, error: StatusError) -> u16 {
        self.server.counters().refused(error)
    }
}

pub fn param(name: &str) -> u16 {
    REGISTERS.iter().find(|register| register.name == name).map(|register| register.address).expect("a parameter")
}

/// True if a register has this byte.
pub fn owned(address: u16) -> bool {
    REGISTERS.iter().any(|register| (register.address..register.address + register.bytes()).contains(&address))
}

/// The first address behind the table.
pub fn table_end() -> u16 {
    REGISTERS.last().map(|last| last.address + last.bytes()).expect("registers")
}

/// A number for each taxel.
fn by_place(number: impl Fn(i32) -> i32) -> [[i32; COLUMNS]; ROWS] {
    std::array::from_fn(|row| std::array::from_fn(|column| number((COLUMNS * row + column) as i32)))
}

/// An instruction or status packet as it goes over the wire.
pub fn packet(id: u8, instruction: u8, params: &[u8]) -> Vec<u8> {
    let mut bytes = Reply::new();
    let mut sender = Sender::new(&mut bytes, id, instruction);
    params.iter().for_each(|&byte| sender.push(byte));
    sender.finish();
    assert!(!bytes.is_empty(), "{} parameters do not fit", params.len());
    bytes.to_vec()
}

pub fn hex(text: &str) -> Vec<u8> {
    text.split_whitespace().map(|byte| u8::from_str_radix(byte, 16).expect("hexadecimal")).collect()
}

/// ID, instruction and parameters of a packet.
pub type Content = (u8, u8, Vec<u8>);

/// Packets and events that a receiver finds in some bytes.
pub fn receive(receiver: &mut Receiver, bytes: &[u8]) -> (Vec<Content>, Vec<Event>) {
    let (mut packets, mut events) = (Vec::new(), Vec::new());
    for &byte in bytes {
        let Some(event) = receiver.push(byte) else { continue };
        if event == Event::Packet {
            let Packet { id, instruction, params, complete } = receiver.packet();
            assert!(complete);
            packets.push((id, instruction, params.to_vec()));
        } else {
            events.push(event);
        }
    }
    (packets, events)
}

pub fn answer(reply: &[u8]) -> Answer {
    let (packets, events) = receive(&mut Receiver::new(), reply);
    assert!(packets.len() == 1 && events.is_empty(), "{reply:02X?}");
    let (id, instruction, params) = packets[0].clone();
    assert_eq!(instruction, 0x55);
    Answer { id, error: params[0], data: params[1..].to_vec() }
}
