//! Data exchanged between control and the thread tasks. Only whole snapshots cross, so neither side can delay the
//! other.

use core::cell::{Cell, UnsafeCell};
use core::sync::atomic::{AtomicU8, Ordering};

use embassy_sync::blocking_mutex::Mutex;
use embassy_sync::blocking_mutex::raw::CriticalSectionRawMutex;
use embassy_sync::signal::Signal;
use fingertip::capture::CaptureStatus;
use fingertip::command::Command;
use fingertip::params::Params;
use fingertip::pipeline::Status;
use fingertip::shipped::{COLUMNS, Capture, Frame, Gains, ROWS, Record};
use fingertip::state::{Fault, Mode};

use super::flash::SaveError;
use super::guard::Stopwatch;

/// Report of control: after every step, every trip of the guard, and every check of a partial frame that cut the motor off.
#[derive(Clone, Copy, Default)]
pub struct Report {
    /// Report of the pipeline.
    pub status: Status,
    /// Time of the frame's end, us since control started; wraps.
    pub frame_time_us: u32,
    /// Time from frame to frame, ns; 0 before the first.
    pub frame_ns: u32,
    /// Supply of the bridge, mV.
    pub supply_mv: u16,
    /// Time from the frame's end to the new duty.
    pub loop_time: Stopwatch,
    /// Longest of these times.
    pub loop_time_max: Stopwatch,
    /// The capture.
    pub capture: CaptureStatus,
}

/// State of the loop for the LED and the log.
#[derive(Clone, Copy, Default, PartialEq, Eq)]
pub struct LoopState {
    /// Mode of the loop.
    pub mode: Mode,
    /// Reason why the motor was stopped.
    pub fault: Option<Fault>,
    /// Number of missed frames.
    pub missed_frames: u32,
}

/// Reason why a record was not saved.
#[derive(Clone, Copy)]
pub enum NotSaved {
    /// The motor is driven or a tare is under way.
    Busy,
    /// The flash did not take it.
    Failed(SaveError),
}

/// Requests that the link received from the host: as a whole, so that a bus watchdog never arrives without the packet
/// that set it.
#[derive(Clone, Copy, Default)]
pub struct Heard {
    /// Requests of the host to the loop.
    pub command: Command,
    /// Valid packets; only its changes count.
    pub packets: u32,
}

/// Values of a frame that the bus may read, with the report made of it.
pub struct BusSnapshot {
    /// The report; none before the first.
    pub report: Option<Report>,
    /// The frame.
    pub frame: Frame,
    /// Taxels of the frame, sixteenths of a corrected code above tare.
    pub taxels: [[i32; COLUMNS]; ROWS],
    /// Pressure of a sixteenth of a code, Pa, Q32.
    pub pascals_per_sum_q32: i64,
    /// Readings of the taxels without contact, corrected codes with [`fingertip::pressure::TARE_BITS`] fractional
    /// bits.
    pub tare: [[i32; COLUMNS]; ROWS],
}

/// State of the loop.
pub static LOOP_STATE: Shared<LoopState> = Shared::new();
/// Requests of the host.
pub static HEARD: Shared<Heard> = Shared::new();
/// New parameters for control.
pub static PARAMS: Mailbox<Params> = Mailbox::new(Params::DEFAULT);
/// New gains for control.
pub static GAINS: Mailbox<Gains> = Mailbox::new(Gains::ONE);
/// A record for control to save, and how that went.
pub static SAVE: Mailbox<Record> = Mailbox::new(Record::DEFAULT);
/// See [`SAVE`].
pub static SAVED: Signal<CriticalSectionRawMutex, Result<(), NotSaved>> = Signal::new();
/// Newest snapshot; control does not change it while the link answers from it.
pub static PICTURE: Mailbox<BusSnapshot> = Mailbox::full(BusSnapshot {
    report: None,
    frame: Frame::EMPTY,
    taxels: [[0; COLUMNS]; ROWS],
    pascals_per_sum_q32: 0,
    tare: [[0; COLUMNS]; ROWS],
});

/// The capture: full once it is done. All zeros before, so the image does not grow by it.
pub static CAPTURE: Mailbox<Capture> = Mailbox::new(Capture::NEW);

/// A small value that is read and replaced as a whole.
pub struct Shared<T>(Mutex<CriticalSectionRawMutex, Cell<Option<T>>>);

impl<T: Copy + Default> Shared<T> {
    const fn new() -> Self {
        Self(Mutex::new(Cell::new(None)))
    }

    /// The newest value; the default before the first.
    pub fn get(&self) -> T {
        self.0.lock(Cell::get).unwrap_or_default()
    }

    /// Replaces the value.
    pub fn set(&self, value: T) {
        self.0.lock(|cell| cell.set(Some(value)));
    }
}

/// Mailbox for one large value that is filled and emptied in turns. A call out of turn fails and never waits.
///
/// Interrupts stay on while the value is copied.
pub struct Mailbox<T> {
    state: AtomicU8,
    value: UnsafeCell<T>,
}

const EMPTY: u8 = 0;
const FULL: u8 = 1;
const BUSY: u8 = 2;

// SAFETY: the value is reached only between winning the state (EMPTY or FULL to BUSY) and giving it up, so by one at a
// time.
unsafe impl<T: Send> Sync for Mailbox<T> {}

impl<T> Mailbox<T> {
    const fn new(value: T) -> Self {
        Self { state: AtomicU8::new(EMPTY), value: UnsafeCell::new(value) }
    }

    const fn full(value: T) -> Self {
        Self { state: AtomicU8::new(FULL), value: UnsafeCell::new(value) }
    }

    /// Fills the value where the box is empty; false where it is not.
    pub fn fill(&self, write: impl FnOnce(&mut T)) -> bool {
        self.turn(EMPTY, FULL, write).is_some()
    }

    /// Empties the box where it is full.
    pub fn take<R>(&self, read: impl FnOnce(&mut T) -> R) -> Option<R> {
        self.turn(FULL, EMPTY, read)
    }

    /// Changes the value of an empty box, which stays empty: for the only task that fills the box.
    pub fn work<R>(&self, act: impl FnOnce(&mut T) -> R) -> Option<R> {
        self.turn(EMPTY, EMPTY, act)
    }

    /// Reads or replaces the value of a full box, which stays full.
    pub fn visit<R>(&self, act: impl FnOnce(&mut T) -> R) -> Option<R> {
        self.turn(FULL, FULL, act)
    }

    fn turn<R>(&self, from: u8, to: u8, act: impl FnOnce(&mut T) -> R) -> Option<R> {
        self.state.compare_exchange(from, BUSY, Ordering::Acquire, Ordering::Relaxed).ok()?;
        // SAFETY: the exchange above succeeded, so no other task accesses the value until the store below.
        let result = act(unsafe { &mut *self.value.get() });
        self.state.store(to, Ordering::Release);
        Some(result)
    }
}
