//! The frame budget: settle, sampling and conversion of every row, in one place.

use crate::units::{CoreCycles, ScanTicks};

/// What a board's clocks and converters make of a scan: a figure of the board, not of the core.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Clocks {
    /// Ticks of the scan's timer in a second; the timer counts a slot with 16 bits.
    pub timer_hz: u32,
    /// Cycles of the processor's core in a second.
    pub core_hz: u32,
    /// Ticks of the scan's timer in a cycle of the converters' clock.
    pub ticks_per_converter_cycle: u32,
    /// Sampling times that the converters have, in their cycles.
    pub sample_cycles: &'static [u16],
    /// Converter cycles of a conversion, after sampling.
    pub conversion_cycles: u32,
    /// From the trigger to the start of sampling and from the last code to memory, in converter cycles, rounded up.
    pub trigger_cycles: u32,
    /// A slot is a whole multiple of so many ticks, so that what a board keeps in step with the frames finds whole
    /// ticks in it; 1, or 0, where nothing asks for it.
    pub slot_step: u32,
}

impl Clocks {
    /// What is longer than the loop's 32 bits hold of a frame's time: 1/256 s.
    const fn frame_too_long(&self) -> ScanTicks {
        ScanTicks(self.timer_hz / 256)
    }
}

/// How a scan is timed: [`crate::config::Shaped::new`] works it out. Row `n` is driven for [`ScanTiming::slot`]; its
/// conversions start after [`ScanTiming::settle`] and end before the next row.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ScanTiming {
    /// From the row's edge to the trigger of its conversions; 16 bits.
    pub settle: ScanTicks,
    /// From row to row; 16 bits.
    pub slot: ScanTicks,
    /// How long each column is sampled, converter cycles.
    pub sample_cycles: u16,
    /// Rows of the array, and one slot with no row driven.
    pub slots: u16,
    /// From frame to frame, ns, rounded.
    pub frame_ns: u32,
    /// What control has from a frame's end to its new duty: three quarters of the frame's time. The rest is left for
    /// the tasks below it.
    pub deadline: CoreCycles,
}

/// Why a scan cannot be timed so.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum ScanError {
    /// The converters have no such sampling time.
    SampleCycles {
        /// What was asked for.
        cycles: u16,
        /// What they have.
        allowed: &'static [u16],
    },
    /// The slot exceeds the timer's 16 bits: `ticks` of at most 65535.
    SlotTooLong {
        /// What the settle time and the conversions add up to.
        ticks: u32,
    },
    /// The frame is longer than the loop's arithmetic holds.
    FrameTooLong {
        /// What its slots add up to.
        ticks: u32,
        /// It must be less than this.
        end: u32,
    },
}

impl core::fmt::Display for ScanError {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        match self {
            Self::SampleCycles { cycles, allowed } => {
                write!(f, "sample_cycles of {cycles}: {allowed:?} are allowed")
            }
            Self::SlotTooLong { ticks } => {
                write!(f, "settle_ns and sample_cycles make a slot of {ticks} ticks: {} are allowed", u16::MAX)
            }
            Self::FrameTooLong { ticks, end } => {
                write!(f, "settle_ns and sample_cycles make a frame of {ticks} ticks: less than {end} are allowed")
            }
        }
    }
}

impl core::error::Error for ScanError {}

impl ScanTiming {
    /// The tightest scan of so many rows and columns that gives each row `settle_ns` before its conversions.
    ///
    /// # Errors
    /// A sampling time that the converters lack, a slot beyond the timer's range, or a frame beyond the loop's.
    pub fn new(
        settle_ns: u32,
        sample_cycles: u16,
        [rows, columns]: [usize; 2],
        clocks: &Clocks,
    ) -> Result<Self, ScanError> {
        let allowed = clocks.sample_cycles;
        if !allowed.contains(&sample_cycles) {
            return Err(ScanError::SampleCycles { cycles: sample_cycles, allowed });
        }
        let settle = (u64::from(settle_ns) * u64::from(clocks.timer_hz)).div_ceil(1_000_000_000);
        let conversion = u64::from(sample_cycles) + u64::from(clocks.conversion_cycles);
        let cycles = lanes::pairs(columns) as u64 * conversion + u64::from(clocks.trigger_cycles);
        let needed = cycles.saturating_mul(clocks.ticks_per_converter_cycle.into()).saturating_add(settle);
        let step = u64::from(clocks.slot_step.max(1));
        let slot = needed.div_ceil(step).saturating_mul(step);
        if slot > u64::from(u16::MAX) {
            return Err(ScanError::SlotTooLong { ticks: u32::try_from(slot).unwrap_or(u32::MAX) });
        }
        let slots = rows as u16 + 1;
        let frame = slot as u32 * u32::from(slots);
        let end = clocks.frame_too_long().0;
        if frame >= end {
            return Err(ScanError::FrameTooLong { ticks: frame, end });
        }
        let [timer_hz, core_hz, wide] = [clocks.timer_hz, clocks.core_hz, frame].map(u64::from);
        Ok(Self {
            settle: ScanTicks(settle as u32),
            slot: ScanTicks(slot as u32),
            sample_cycles,
            slots,
            frame_ns: ((wide * 1_000_000_000 + timer_hz / 2) / timer_hz.max(1)) as u32,
            deadline: CoreCycles((wide * core_hz / timer_hz.max(1) / 4 * 3) as u32),
        })
    }

    /// From frame to frame.
    pub const fn frame(self) -> ScanTicks {
        ScanTicks(self.slot.0 * self.slots as u32)
    }

    /// The longest time, at most `longest`, that fits a whole number of times into a frame.
    pub fn whole_part(self, longest: ScanTicks) -> ScanTicks {
        let frame = self.frame().0;
        let fewest = frame.div_ceil(longest.0.max(1)).max(1);
        let count = (fewest..=frame).find(|count| frame.is_multiple_of(*count)).unwrap_or(1);
        ScanTicks(frame / count)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::params::Params;

    const CLOCKS: Clocks = Clocks {
        timer_hz: 168_000_000,
        core_hz: 168_000_000,
        ticks_per_converter_cycle: 8,
        sample_cycles: &[3, 15, 28],
        conversion_cycles: 12,
        trigger_cycles: 5,
        slot_step: 1,
    };

    fn timing(settle_ns: u32, sample_cycles: u16, shape: [usize; 2]) -> Result<ScanTiming, ScanError> {
        ScanTiming::new(settle_ns, sample_cycles, shape, &CLOCKS)
    }

    #[test]
    fn the_default_scan_makes_ten_thousand_frames_a_second() {
        let Params { settle_ns, sample_cycles, .. } = Params::DEFAULT;
        let timing = timing(settle_ns as u32, sample_cycles as u16, [10, 10]).unwrap();
        assert!((90_000..=100_000).contains(&timing.frame_ns), "{} ns", timing.frame_ns);
        let of_the_frame = |share: u32| timing.frame_ns / 1_000 * share / 1_000 * 168;
        assert!((of_the_frame(740)..of_the_frame(760)).contains(&timing.deadline.0), "{:?}", timing.deadline);
    }

    #[test]
    fn what_the_hardware_cannot_time_is_refused() {
        assert!(matches!(timing(2_000, 16, [10, 10]), Err(ScanError::SampleCycles { cycles: 16, .. })));
        assert!(matches!(timing(400_000, 15, [10, 10]), Err(ScanError::SlotTooLong { .. })));
        assert!(matches!(timing(u32::MAX, 15, [10, 10]), Err(ScanError::SlotTooLong { .. })));
        assert!(matches!(timing(300_000, 15, [16, 16]), Err(ScanError::FrameTooLong { .. })));
    }

    #[test]
    fn a_core_quicker_than_the_timer_has_more_cycles() {
        let Params { settle_ns, sample_cycles, .. } = Params::DEFAULT;
        let of = |core_hz: u32| {
            let clocks = Clocks { core_hz, ..CLOCKS };
            ScanTiming::new(settle_ns as u32, sample_cycles as u16, [10, 10], &clocks).unwrap().deadline.0
        };
        assert_eq!(of(2 * CLOCKS.core_hz) / 2, of(CLOCKS.core_hz));
    }

    #[test]
    fn a_slot_is_as_short_as_its_step_allows() {
        for settle_ns in 1_000..3_000 {
            let of = |slot_step| ScanTiming::new(settle_ns, 15, [10, 10], &Clocks { slot_step, ..CLOCKS }).unwrap();
            let ([free, zero, stepped], settle) = ([1, 0, 12].map(|step| of(step).slot.0), of(12).settle);
            assert_eq!([free, zero], [free; 2]);
            assert!(stepped.is_multiple_of(12) && (free..free + 12).contains(&stepped), "{stepped} for {free}");
            assert_eq!(settle, of(1).settle);
        }
    }

    /// What the shipped board makes of it: a PWM of 20 to 40 kHz in step with whatever scan is asked for.
    #[test]
    fn a_frame_is_a_whole_number_of_its_parts() {
        let clocks = Clocks { slot_step: 12, ..CLOCKS };
        for settle_ns in (0..340_000).step_by(37) {
            let Ok(timing) = ScanTiming::new(settle_ns, 15, [10, 10], &clocks) else { continue };
            let part = timing.whole_part(ScanTicks(8_400)).0;
            assert_eq!(timing.frame().0 % part, 0);
            assert!((4_200..=8_400).contains(&part), "{part} ticks of {:?}", timing.frame());
        }
        let timing = timing(1_000, 15, [10, 10]).unwrap();
        assert_eq!(timing.whole_part(ScanTicks(0)), ScanTicks(1));
        assert_eq!(timing.whole_part(timing.frame()), timing.frame());
    }

    #[test]
    fn clocks_that_no_timer_has_are_refused_without_an_overflow() {
        let clocks = Clocks { conversion_cycles: u32::MAX, ticks_per_converter_cycle: u32::MAX, ..CLOCKS };
        assert!(matches!(ScanTiming::new(u32::MAX, 3, [16, 32], &clocks), Err(ScanError::SlotTooLong { .. })));
    }
}
