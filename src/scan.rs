//! The frame budget: settle, sampling and conversion of every row, in one place.

/// Ticks of the scan timer in a second (TIM8 at 168 MHz).
pub const TIMER_HZ: u32 = 168_000_000;
/// Scan timer ticks in a cycle of the converter's clock (21 MHz).
pub const TICKS_PER_ADC_CYCLE: u32 = 8;
/// The longest frame: 1/256 s, what the loop's 32 bits hold of a frame's time.
pub const FRAME_TICKS_MAX: u32 = TIMER_HZ / 256;
/// Converter cycles for a 12-bit conversion, after sampling.
pub const CONVERSION_CYCLES: u32 = 12;
/// From the trigger to the start of sampling and from the last code to memory, in converter cycles, rounded up.
pub const TRIGGER_CYCLES: u32 = 5;

/// How a scan is timed. Row `n` is driven for [`ScanTiming::slot_ticks`]; its conversions start after
/// [`ScanTiming::settle_ticks`] and end before the next row.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ScanTiming {
    /// From the row's edge to the trigger of its conversions, scan timer ticks.
    pub settle_ticks: u16,
    /// From row to row, scan timer ticks.
    pub slot_ticks: u16,
    /// How long each column is sampled, converter cycles.
    pub sample_cycles: u16,
    /// Rows of the array, and one slot with no row driven.
    pub slots: u16,
    /// From frame to frame, ns, rounded.
    pub frame_ns: u32,
}

/// Why a scan cannot be timed so.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ScanError {
    /// The converter has no such sampling time: 3, 15, 28, 56, 84, 112, 144 and 480 cycles are to be had.
    SampleCycles(u16),
    /// The slot exceeds the timer's 16 bits: `ticks` of at most 65535.
    SlotTooLong {
        /// What the settle time and the conversions add up to.
        ticks: u32,
    },
    /// The frame is longer than the loop's arithmetic holds: `ticks` of at most [`FRAME_TICKS_MAX`].
    FrameTooLong {
        /// What its slots add up to.
        ticks: u32,
    },
}

impl core::fmt::Display for ScanError {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        match self {
            Self::SampleCycles(cycles) => {
                write!(f, "sample_cycles of {cycles}: 3, 15, 28, 56, 84, 112, 144 and 480 are allowed")
            }
            Self::SlotTooLong { ticks } => {
                write!(f, "settle_ns and sample_cycles make a slot of {ticks} ticks: {} are allowed", u16::MAX)
            }
            Self::FrameTooLong { ticks } => {
                write!(f, "settle_ns and sample_cycles make a frame of {ticks} ticks: {FRAME_TICKS_MAX} are allowed")
            }
        }
    }
}

impl core::error::Error for ScanError {}

/// What control has from a frame's end to its new duty; the last quarter of the frame's time is left for the tasks below it.
pub const fn deadline_ticks(frame_ticks: u32) -> u32 {
    frame_ticks / 4 * 3
}

impl ScanTiming {
    /// A settle time of 2.4 us and 15 cycles of sampling: 10 kHz.
    pub const DEFAULT_SETTLE_NS: u32 = 2_400;
    /// 15 cycles at 21 MHz settle a source of up to 10 kOhm to half a code (RM0390 and DS10693, table "ADC accuracy").
    pub const DEFAULT_SAMPLE_CYCLES: u16 = 15;

    /// The tightest scan of so many rows and columns that gives each row `settle_ns` before its conversions.
    ///
    /// # Errors
    /// A sampling time that the converter lacks, a slot beyond the timer's range, or a frame beyond the loop's.
    pub const fn new(settle_ns: u32, sample_cycles: u16, rows: usize, columns: usize) -> Result<Self, ScanError> {
        if !matches!(sample_cycles, 3 | 15 | 28 | 56 | 84 | 112 | 144 | 480) {
            return Err(ScanError::SampleCycles(sample_cycles));
        }
        let settle = (settle_ns as u64 * TIMER_HZ as u64).div_ceil(1_000_000_000);
        let cycles = lanes::pairs(columns) as u32 * (sample_cycles as u32 + CONVERSION_CYCLES) + TRIGGER_CYCLES;
        let slot = settle + (cycles * TICKS_PER_ADC_CYCLE) as u64;
        if slot > u16::MAX as u64 {
            let ticks = if slot > u32::MAX as u64 { u32::MAX } else { slot as u32 };
            return Err(ScanError::SlotTooLong { ticks });
        }
        let slots = rows as u16 + 1;
        let mut timing =
            Self { settle_ticks: settle as u16, slot_ticks: slot as u16, sample_cycles, slots, frame_ns: 0 };
        if timing.frame_ticks() >= FRAME_TICKS_MAX {
            return Err(ScanError::FrameTooLong { ticks: timing.frame_ticks() });
        }
        let frame = timing.frame_ticks() as u64 * 1_000_000_000;
        timing.frame_ns = ((frame + TIMER_HZ as u64 / 2) / TIMER_HZ as u64) as u32;
        Ok(timing)
    }

    /// From frame to frame, scan timer ticks.
    pub const fn frame_ticks(self) -> u32 {
        self.slot_ticks as u32 * self.slots as u32
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_default_scan_makes_ten_thousand_frames_a_second() {
        let timing = ScanTiming::new(ScanTiming::DEFAULT_SETTLE_NS, ScanTiming::DEFAULT_SAMPLE_CYCLES, 10, 10).unwrap();
        assert!((90_000..=100_000).contains(&timing.frame_ns), "{} ns", timing.frame_ns);
    }

    #[test]
    fn what_the_hardware_cannot_time_is_refused() {
        assert_eq!(ScanTiming::new(2_000, 16, 10, 10), Err(ScanError::SampleCycles(16)));
        assert!(matches!(ScanTiming::new(400_000, 15, 10, 10), Err(ScanError::SlotTooLong { .. })));
        assert!(matches!(ScanTiming::new(u32::MAX, 15, 10, 10), Err(ScanError::SlotTooLong { .. })));
        assert!(matches!(ScanTiming::new(300_000, 15, 16, 16), Err(ScanError::FrameTooLong { .. })));
    }

    #[test]
    fn each_row_and_each_pair_of_columns_takes_its_time() {
        let frame_us = |rows, columns| ScanTiming::new(2_400, 15, rows, columns).unwrap().frame_ns / 1_000;
        let shapes = [(3, 3), (3, 5), (4, 4), (8, 8), (16, 16), (16, 32)];
        assert_eq!(shapes.map(|(rows, columns)| frame_us(rows, columns)), [20, 26, 26, 70, 219, 394]);
    }
}
