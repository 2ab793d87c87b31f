//! The device on the bus: packets in, replies out, and their requests to the loop and the firmware.

mod answer;
mod execute;

use heapless::Vec;

use crate::command::Command;
use crate::scan::Clocks;
use crate::store::Record;
use crate::units::Newtons;

use super::packet::{Event, Receiver, Reply, StatusError};

use super::settings::{Actions, Saved, Settings};
use super::snapshot::Snapshot;
use super::stand::Stand;
use answer::Turn;

/// The longest Reg Write: all gains of 10 x 10 taxels at once.
pub const REG_WRITE_MAX: usize = 200;

/// Counts of errors on the bus since reset.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Counters {
    /// Good instruction packets for this device, broadcasts included; wraps.
    pub good_packets: u32,
    /// Runs of bytes that were no packet, or only the beginning of one; holds at its top.
    pub framing: u16,
    refused: [u16; 7],
}

impl Counters {
    /// Number of instructions refused for this reason; saturates.
    ///
    /// [`StatusError::Crc`] counts damaged packets for other devices too.
    pub fn refused(&self, error: StatusError) -> u16 {
        self.refused.get(error as usize - 1).copied().unwrap_or(0)
    }

    fn count(&mut self, error: StatusError) {
        if let Some(count) = self.refused.get_mut(error as usize - 1) {
            *count = count.saturating_add(1);
        }
    }
}

/// A write that waits for its Action.
#[derive(Clone, Debug)]
struct Registered {
    address: u16,
    data: Vec<u8, REG_WRITE_MAX>,
}

/// State of the device.
#[derive(Clone, Debug)]
pub(super) struct Device<const ROWS: usize, const COLUMNS: usize> {
    pub settings: Settings<ROWS, COLUMNS>,
    pub counters: Counters,
    registered: Option<Registered>,
    actions: Actions,
    turn: Turn,
    /// Number of bytes behind this device's part of a shared packet, once it has sent the part.
    behind: Option<u16>,
    /// Time of the last byte that its turn may depend on, ms.
    heard_ms: u32,
    /// State of the loop at the last snapshot.
    stand: Stand,
    reply_delay_us: u32,
    clocks: &'static Clocks,
}

/// The device on the bus.
///
/// ```
/// # use fingertip::{link::Reply, pipeline::Status, shipped::{CLOCKS, COLUMNS, Frame, ROWS, Record, Server, Snapshot}};
/// let mut server = Server::new(Record::DEFAULT, &CLOCKS);
/// let zeros = [[0; COLUMNS]; ROWS];
/// let snapshot = Snapshot {
///     status: Status::default(), supply_mv: 6000, tick_ms: 0, frame_time_us: 0, frame_ns: 0,
///     loop_time_us: 0, loop_time_max_us: 0,
///     reset_cause: Default::default(), crash: Default::default(), health: Default::default(),
///     frame: &Frame::EMPTY, taxels: &zeros, pascals_per_sum_q32: 0, tare: &zeros, capture: Default::default(),
/// };
/// let mut reply = Reply::new();
/// let mut received: &[u8] = &[0xFF, 0xFF, 0xFD, 0x00, 0x01, 0x03, 0x00, 0x01, 0x19, 0x4E];
/// while !received.is_empty() {
///     let taken = server.feed(received, &snapshot, &mut reply);
///     received = &received[taken..];
///     if !reply.is_empty() {
///         // Wait for server.reply_delay_us(), then send the reply.
///     }
///     // Carry out server.take_actions(), pass server.command() on to the loop.
/// }
/// assert_eq!(reply[4..9], [1, 7, 0, 0x55, 0]);
/// ```
#[derive(Clone, Debug)]
pub struct Server<const ROWS: usize, const COLUMNS: usize> {
    receiver: Receiver,
    state: Device<ROWS, COLUMNS>,
}

impl<const ROWS: usize, const COLUMNS: usize> Server<ROWS, COLUMNS> {
    /// Creates a device with these stored settings and torque off, which checks new settings with the board's clocks.
    pub fn new(record: Record<ROWS, COLUMNS>, clocks: &'static Clocks) -> Self {
        let state = Device {
            settings: Settings::new(record),
            counters: Counters::default(),
            registered: None,
            actions: Actions::default(),
            turn: Turn::None,
            behind: None,
            heard_ms: 0,
            stand: Stand::default(),
            reply_delay_us: 0,
            clocks,
        };
        Self { receiver: Receiver::new(), state }
    }

    /// Takes bytes up to the end of the first packet that is answered, and returns how many it took.
    ///
    /// `reply` is cleared first. Where it is not empty afterwards, send it after [`Server::reply_delay_us`], then feed
    /// the rest. Do not feed what this device itself sends.
    pub fn feed(&mut self, bytes: &[u8], snapshot: &Snapshot<'_, ROWS, COLUMNS>, reply: &mut Reply) -> usize {
        reply.clear();
        self.observe(Stand::of(snapshot));
        for (place, &byte) in bytes.iter().enumerate() {
            self.state.listen(byte, snapshot, reply);
            match self.receiver.push(byte) {
                Some(Event::Packet) => self.state.packet(self.receiver.packet(), snapshot, reply),
                Some(Event::BadCrc) => self.state.damaged(self.receiver.packet(), reply),
                Some(Event::Framing) => self.state.counters.framing = self.state.counters.framing.saturating_add(1),
                None => {}
            }
            if let Some(behind) = self.state.behind.take() {
                self.receiver.take_part(behind);
            }
            if !reply.is_empty() {
                return place + 1;
            }
        }
        bytes.len()
    }

    /// Time to wait between the packet's last byte and the reply's first, us.
    pub fn reply_delay_us(&self) -> u32 {
        self.state.reply_delay_us
    }

    /// Requests of the host to the loop.
    pub fn command(&self) -> Command {
        Command { fit_level: self.state.settings.record.fit_level, ..self.state.settings.command }
    }

    /// Settings that the host may change.
    pub fn settings(&self) -> &Settings<ROWS, COLUMNS> {
        &self.state.settings
    }

    /// Counts of errors on the bus.
    pub fn counters(&self) -> &Counters {
        &self.state.counters
    }

    /// Number of good instruction packets for this device, for the bus watchdog.
    pub fn good_packets(&self) -> u32 {
        self.state.counters.good_packets
    }

    /// Returns the actions requested of the firmware, once.
    pub fn take_actions(&mut self) -> Actions {
        core::mem::take(&mut self.state.actions)
    }

    /// Takes the result of a save.
    pub fn note_saved(&mut self, succeeded: bool) {
        self.state.settings.saved = if succeeded { Saved::Same } else { Saved::Failed };
    }

    /// Updates the state of the loop. A fault turns torque off and sets the goal to 0; a silent bus also trips the
    /// watchdog's register.
    fn observe(&mut self, stand: Stand) {
        let settings = &mut self.state.settings;
        if stand.faulted {
            settings.command.torque = false;
            settings.command.goal = Newtons::ZERO;
        }
        if stand.bus_silent && !self.state.stand.bus_silent {
            settings.watchdog_tripped = true;
            settings.command.bus_watchdog_ms = 0;
        }
        self.state.stand = stand;
    }
}

impl<const ROWS: usize, const COLUMNS: usize> Device<ROWS, COLUMNS> {
    /// Returns true while a Reg Write waits.
    pub fn registered(&self) -> bool {
        self.registered.is_some()
    }

    /// Actions that wait for the firmware.
    pub fn actions(&self) -> Actions {
        self.actions
    }
}
