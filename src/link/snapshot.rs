//! State of the running controller that the bus may read, gathered by the firmware.

use crate::capture;
use crate::frame::Frame;
use crate::pipeline::Status;
use crate::state::Fault;

/// Snapshot of the controller at one moment.
#[derive(Clone, Copy, Debug)]
pub struct Snapshot<'a, const ROWS: usize, const COLUMNS: usize> {
    /// Report of the last step.
    pub status: Status,
    /// Supply of the bridge, mV.
    pub supply_mv: u16,
    /// Time since reset, ms; wraps.
    pub tick_ms: u32,
    /// Time of the frame's last conversion, us since the controller started; wraps.
    pub frame_time_us: u32,
    /// Time from frame to frame, ns.
    pub frame_ns: u32,
    /// Time from the last frame's last conversion to the new duty, us.
    pub loop_time_us: u16,
    /// Longest of these times since reset, us.
    pub loop_time_max_us: u16,
    /// Reason why the microcontroller started.
    pub reset_cause: ResetCause,
    /// The last crash on record.
    pub crash: Crash,
    /// Health of the board.
    pub health: Health,
    /// Frame of the status.
    pub frame: &'a Frame<ROWS, COLUMNS>,
    /// Readings of its taxels above tare, sixteenths of a corrected code.
    pub taxels: &'a [[i32; COLUMNS]; ROWS],
    /// Pressure of such a sixteenth, Pa in Q32.
    pub pascals_per_sum_q32: i64,
    /// Readings of the taxels without contact, corrected codes with [`TARE_BITS`](crate::pressure::TARE_BITS) fractional bits.
    pub tare: &'a [[i32; COLUMNS]; ROWS],
    /// The capture.
    pub capture: Captured<'a>,
}

/// A capture as the bus may read it.
#[derive(Clone, Copy, Debug, Default)]
pub struct Captured<'a> {
    /// Progress of the capture.
    pub standing: capture::CaptureStatus,
    /// Bytes of the capture; none before it is done.
    pub data: &'a [u8],
}

/// Health of the board since the last reset. Counts saturate.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Health {
    /// Number of the microcontroller, from its unique ID.
    pub chip_id: u32,
    /// The option bytes as the last reset loaded them, in the microcontroller's own order.
    pub option_bytes: u32,
    /// Analogue supply, mV; 0 if it is not known.
    pub analogue_mv: u16,
    /// Largest use of the stack, bytes.
    pub stack_bytes: u16,
    /// Longest delay of a frame's end at the processor: critical sections, and interrupts of the same or a higher
    /// priority.
    pub late_ns: u16,
    /// Numbers of incomplete frames by the first defect: a bank was missing, the banks were out of step with the rows,
    /// a converter had overrun, or the next frame had overwritten it.
    pub broken_frames: [u16; 4],
    /// Errors of the scan's transfers: on the memory's bus, and of the stream itself.
    pub transfer_errors: [u16; 2],
    /// Errors on the line of the bus: noise, framing, overrun.
    pub line_errors: [u16; 3],
}

/// Reason why the microcontroller started. The numbers are stable.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[repr(u8)]
pub enum ResetCause {
    /// Unknown cause.
    #[default]
    Unknown = 0,
    /// The supply came up.
    PowerOn = 1,
    /// The supply dipped.
    BrownOut = 2,
    /// The reset pin.
    Pin = 3,
    /// The firmware itself: a Reboot instruction, or the end of a crash.
    Software = 4,
    /// A watchdog: the control task hung.
    Watchdog = 5,
    /// A low-power fault.
    Other = 6,
}

/// Cause of a crash. The numbers are stable.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[repr(u8)]
pub enum CrashCause {
    /// No crash.
    #[default]
    None = 0,
    /// A panic.
    Panic = 1,
    /// A hard fault.
    HardFault = 2,
    /// A hang, ended by the watchdog's reset.
    Hang = 3,
    /// The external clock failed.
    Clock = 4,
}

/// The crash record, which survives a reset.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Crash {
    /// Cause of the last crash.
    pub cause: CrashCause,
    /// Source line of the panic; 0 if it is not known.
    pub line: u16,
    /// Number of crashes since power-on.
    pub count: u32,
    /// Program counter at the fault or the panic; 0 if it is not known.
    pub pc: u32,
}

/// The hardware error status (register 70): the X-series bits where the meaning is the same, 6 and 7 of our own.
pub fn hardware_error(fault: Option<Fault>) -> u8 {
    match fault {
        None => 0,
        Some(Fault::SupplyLow | Fault::SupplyHigh) => 1 << 0,
        Some(Fault::EncoderFrozen | Fault::Reversed) => 1 << 3,
        Some(Fault::Bridge) => 1 << 4,
        Some(Fault::OverForce) => 1 << 5,
        Some(Fault::ArrayBroken | Fault::RowStuck | Fault::ArrayFrozen | Fault::Unseen) => 1 << 6,
        // Controller and bus.
        Some(_) => 1 << 7,
    }
}
