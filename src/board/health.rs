//! Health of the board. Each count has one writer; the link reads them all for the bus.

use core::sync::atomic::{AtomicU16, AtomicU32, Ordering};

use embassy_stm32::{uid, usart};
use fingertip::link::snapshot::Health;

use super::flash;
use super::guard::{self, Stopwatch};

/// Defect of a frame that is not whole.
#[derive(Clone, Copy)]
pub enum Broken {
    /// The first bank is missing.
    Bank,
    /// The banks are out of step with the rows.
    OutOfStep,
    /// A converter has overrun.
    Overrun,
    /// The next frame came over it.
    Overwritten,
}

static BROKEN_FRAMES: [Count; 4] = [const { Count::new() }; 4];
static TRANSFER_ERRORS: [Count; 2] = [const { Count::new() }; 2];
static LINE_ERRORS: [Count; 3] = [const { Count::new() }; 3];
static LATE: AtomicU32 = AtomicU32::new(0);
static ANALOGUE_MV: AtomicU16 = AtomicU16::new(0);
static STACK_BYTES: AtomicU16 = AtomicU16::new(0);

/// A count that holds at its top.
struct Count(AtomicU16);

impl Count {
    const fn new() -> Self {
        Self(AtomicU16::new(0))
    }

    fn add(&self) {
        self.0.store(self.0.load(Ordering::Relaxed).saturating_add(1), Ordering::Relaxed);
    }

    fn get(&self) -> u16 {
        self.0.load(Ordering::Relaxed)
    }
}

/// A frame is not whole.
pub fn note_broken(broken: Broken) {
    BROKEN_FRAMES[broken as usize].add();
}

/// Transfers of the scan failed: on the memory's bus, in a stream.
pub fn note_transfers(bus: bool, stream: bool) {
    for (count, _) in TRANSFER_ERRORS.iter().zip([bus, stream]).filter(|(_, failed)| *failed) {
        count.add();
    }
}

/// The line of the bus failed.
pub fn note_line(error: usart::Error) {
    match error {
        usart::Error::Noise => LINE_ERRORS[0].add(),
        usart::Error::Framing | usart::Error::Parity => LINE_ERRORS[1].add(),
        usart::Error::Overrun => LINE_ERRORS[2].add(),
        _ => {}
    }
}

/// A frame's end came so much later after the one before than it should: it, or less of it, was held up.
pub fn note_interval(late: Stopwatch) {
    if late.0 > LATE.load(Ordering::Relaxed) {
        LATE.store(late.0, Ordering::Relaxed);
    }
}

/// The analogue supply; 0 where it is not known.
pub fn set_analogue_mv(millivolts: u16) {
    ANALOGUE_MV.store(millivolts, Ordering::Relaxed);
}

/// The deepest that the stack has been.
pub fn set_stack_bytes(bytes: u16) {
    STACK_BYTES.store(bytes, Ordering::Relaxed);
}

/// The FNV-1a hash of the unique ID: lot, wafer and place on the wafer differ from chip to chip.
fn chip_id() -> u32 {
    uid::uid().iter().fold(0x811c_9dc5, |hash, &byte| (hash ^ u32::from(byte)).wrapping_mul(0x0100_0193))
}

/// All of it, for the bus.
pub fn health() -> Health {
    let late_ns = u64::from(LATE.load(Ordering::Relaxed)) * 1_000 / u64::from(guard::TICKS_PER_US);
    Health {
        chip_id: chip_id(),
        option_bytes: flash::option_bytes(),
        analogue_mv: ANALOGUE_MV.load(Ordering::Relaxed),
        stack_bytes: STACK_BYTES.load(Ordering::Relaxed),
        late_ns: u16::try_from(late_ns).unwrap_or(u16::MAX),
        broken_frames: BROKEN_FRAMES.each_ref().map(Count::get),
        transfer_errors: TRANSFER_ERRORS.each_ref().map(Count::get),
        line_errors: LINE_ERRORS.each_ref().map(Count::get),
    }
}
