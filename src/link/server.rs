//! The device on the bus: packets in, replies out, and their requests to the loop and the firmware.

mod answer;
mod execute;

use crate::command::Command;
use crate::pipeline::Status;
use crate::scan::Clocks;
use crate::state::Fault;
use crate::store::Record;
use crate::units::Newtons;
use heapless::Vec;

use super::packet::{Event, Receiver, Reply, StatusError};
use super::settings::{Actions, Saved, Settings};
use super::snapshot::Snapshot;
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

/// State of the device.
#[derive(Clone, Debug)]
pub(super) struct Device<const ROWS: usize, const COLUMNS: usize> {
    pub settings: Settings<ROWS, COLUMNS>,
    pub counters: Counters,
    /// Address and data of a write that waits for its Action.
    pub registered: Option<(u16, Vec<u8, REG_WRITE_MAX>)>,
    /// Actions that wait for the firmware.
    pub actions: Actions,
    turn: Turn,
    /// Number of bytes behind this device's part of a shared packet, once it has sent the part.
    behind: Option<u16>,
    /// Time of the last byte that its turn may depend on, ms.
    heard_ms: u32,
    /// True if the last snapshot showed the fault of the bus watchdog.
    bus_silent: bool,
    reply_delay_us: u32,
    clocks: &'static Clocks,
}

/// The device while it takes bytes: its state, the snapshot of the loop, and the reply.
struct Exchange<'a, const ROWS: usize, const COLUMNS: usize> {
    state: &'a mut Device<ROWS, COLUMNS>,
    snapshot: &'a Snapshot<'a, ROWS, COLUMNS>,
    reply: &'a mut Reply,
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
            bus_silent: false,
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
        let Self { receiver, state } = self;
        state.observe(&snapshot.status);
        let mut exchange = Exchange { state, snapshot, reply };
        for (place, &byte) in bytes.iter().enumerate() {
            exchange.listen(byte);
            let counters = &mut exchange.state.counters;
            match receiver.push(byte) {
                Some(Event::Packet) => exchange.packet(receiver.packet()),
                Some(Event::BadCrc) => exchange.damaged(receiver.packet()),
                Some(Event::Framing) => counters.framing = counters.framing.saturating_add(1),
                None => {}
            }
            if let Some(behind) = exchange.state.behind.take() {
                receiver.take_part(behind);
            }
            if !exchange.reply.is_empty() {
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
}

impl<const ROWS: usize, const COLUMNS: usize> Device<ROWS, COLUMNS> {
    /// Updates the settings. A fault turns torque off, sets the goal to 0 and drops a registered write; a silent bus also
    /// trips the watchdog's register.
    fn observe(&mut self, status: &Status) {
        let command = &mut self.settings.command;
        if status.fault.is_some() {
            command.torque = false;
            command.goal = Newtons::ZERO;
            self.registered = None;
        }
        let bus_silent = status.fault == Some(Fault::BusSilent);
        if bus_silent && !self.bus_silent {
            command.bus_watchdog_ms = 0;
            self.settings.watchdog_tripped = true;
        }
        self.bus_silent = bus_silent;
    }
}
