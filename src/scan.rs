//! Timing of the scan: settling, sampling and conversion of every row.

use crate::units::{CoreCycles, ScanTicks};

/// Nanoseconds in a second.
const NS: u64 = 1_000_000_000;

/// Clocks, converters and frame time of a board.
///
/// Example: a board with two converters of 48 MHz, a timer of 150 MHz, and 2,000 frames in a second:
///
/// ```
/// use fingertip::config::Shaped;
/// use fingertip::params::Params;
/// use fingertip::scan::Clocks;
///
/// const QUICK: Clocks = Clocks {
///     timer_hz: 150_000_000,
///     core_hz: 150_000_000,
///     converter_hz: 48_000_000,
///     converters: 2,
///     sample_cycles: &[15],
///     conversion_cycles: 81,
///     trigger_cycles: 2,
///     slot_step: 1,
///     frame_ns: Some(500_000),
/// };
/// let params = Params { pitch_um: 2_000, ..Params::DEFAULT };
/// let timing = Shaped::<6, 4>::new(&params, &QUICK)?.timing;
/// // Two conversions of 96 cycles follow each other in a slot: 194 cycles of the converters are 606.25 ticks.
/// assert_eq!((timing.settle.0, timing.slot.0), (360, 967));
/// // Seven slots take 6,769 ticks. The timer rests for the remainder of the 75,000 ticks.
/// assert_eq!((timing.idle.0, timing.frame_ns), (68_231, 500_000));
///
/// // One converter, 32 columns, 200 frames in a second.
/// let slow = Clocks { converters: 1, frame_ns: Some(5_000_000), ..QUICK };
/// let params = Params { pitch_um: 900, ..Params::DEFAULT };
/// let timing = Shaped::<16, 32>::new(&params, &slow)?.timing;
/// assert_eq!((timing.slot.0, timing.frame_ns), (9_967, 5_000_000));
///
/// // The scan of all rows takes 1.13 ms, so 1 kHz is impossible.
/// let refused = Shaped::<16, 32>::new(&params, &Clocks { frame_ns: Some(1_000_000), ..slow }).unwrap_err();
/// assert_eq!(refused.to_string(), "frame_ns of 1000000: the scan alone takes 1129594");
/// # Ok::<(), fingertip::config::ConfigError>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Clocks {
    /// Frequency of the scan's timer, Hz, at least 100 kHz. The timer counts a slot with 16 bits.
    pub timer_hz: u32,
    /// Frequency of the processor's core, Hz, at least 100 kHz.
    pub core_hz: u32,
    /// Frequency of the converters' clock, Hz, at least 100 kHz.
    pub converter_hz: u32,
    /// Number of converters, 1 or 2. Two convert a pair of columns at the same time, one converts them in turn.
    pub converters: u32,
    /// Sampling times that the converters have, in their cycles.
    pub sample_cycles: &'static [u16],
    /// Converter cycles of a conversion, after sampling.
    pub conversion_cycles: u32,
    /// Time from the trigger to the start of sampling and from the last code to memory, converter cycles, rounded up.
    pub trigger_cycles: u32,
    /// Slot and frame are whole multiples of this number of ticks, for a PWM that keeps step with the frames. 1 or 0
    /// if the board has no such PWM.
    pub slot_step: u32,
    /// Frame time, ns, at most 15 ms. `None` is the shortest that the scan allows. A longer frame has idle time behind
    /// its last slot.
    pub frame_ns: Option<u32>,
}

/// Least frequency of a clock, Hz.
const HZ_LEAST: u32 = 100_000;
/// Longest frame time that a board may request, ns. It lies a little below [`FRAMES_PER_S_LEAST`].
const FRAME_NS_MAX: u32 = 15_000_000;
/// The loop's numbers hold a frame time below 1/64 s.
const FRAMES_PER_S_LEAST: u32 = 64;

impl Clocks {
    /// Refuses a number out of its range.
    fn check(&self) -> Result<(), ScanError> {
        let frame_ns = self.frame_ns.unwrap_or(1);
        let (name, value, min, max) = if self.timer_hz < HZ_LEAST {
            ("timer_hz", self.timer_hz, HZ_LEAST, u32::MAX)
        } else if self.core_hz < HZ_LEAST {
            ("core_hz", self.core_hz, HZ_LEAST, u32::MAX)
        } else if self.converter_hz < HZ_LEAST {
            ("converter_hz", self.converter_hz, HZ_LEAST, u32::MAX)
        } else if !matches!(self.converters, 1 | 2) {
            ("converters", self.converters, 1, 2)
        } else if frame_ns == 0 || frame_ns > FRAME_NS_MAX {
            ("frame_ns", frame_ns, 1, FRAME_NS_MAX)
        } else {
            return Ok(());
        };
        Err(ScanError::Clock { name, value, min, max })
    }
}

/// Timing of a scan, computed by [`crate::config::Shaped::new`]. Row `n` is driven for [`ScanTiming::slot`]; its
/// conversions start after [`ScanTiming::settle`] and end before the next row.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ScanTiming {
    /// Time from the row's edge to the trigger of its conversions; 16 bits.
    pub settle: ScanTicks,
    /// Time from row to row; 16 bits.
    pub slot: ScanTicks,
    /// Sampling time of each column, converter cycles.
    pub sample_cycles: u16,
    /// Number of slots: the rows of the array, and one slot with no row driven.
    pub slots: u16,
    /// Idle time behind the last slot. It may exceed 16 bits.
    pub idle: ScanTicks,
    /// Time from frame to frame, ns, rounded.
    pub frame_ns: u32,
    /// Time that control has from a frame's end to its new duty: three quarters of the frame's time. The rest is left
    /// for the tasks of lower priority.
    pub deadline: CoreCycles,
}

/// Reason why a scan cannot be timed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum ScanError {
    /// A number of [`Clocks`] is out of its range.
    Clock {
        /// The field of [`Clocks`].
        name: &'static str,
        /// Value of the field.
        value: u32,
        /// The least value allowed.
        min: u32,
        /// The largest value allowed.
        max: u32,
    },
    /// The converters have no such sampling time.
    SampleCycles {
        /// Requested sampling time.
        cycles: u16,
        /// Sampling times of the converters.
        allowed: &'static [u16],
    },
    /// The slot exceeds the timer's 16 bits: `ticks` of at most 65535.
    SlotTooLong {
        /// Sum of the settle time and the conversions.
        ticks: u32,
    },
    /// The frame is longer than the loop's arithmetic holds.
    FrameTooLong {
        /// Sum of its slots.
        ticks: u32,
        /// Upper bound, exclusive.
        end: u32,
    },
    /// The requested frame time is shorter than the scan.
    FrameTooShort {
        /// [`Clocks::frame_ns`].
        frame_ns: u32,
        /// Time of all slots, ns, rounded up.
        scan_ns: u32,
    },
}

impl core::fmt::Display for ScanError {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        match self {
            Self::Clock { name, value, min, max } => write!(f, "{name} of {value}: {min} to {max} are allowed"),
            Self::SampleCycles { cycles, allowed } => {
                write!(f, "sample_cycles of {cycles}: {allowed:?} are allowed")
            }
            Self::SlotTooLong { ticks } => {
                write!(f, "settle_ns and sample_cycles make a slot of {ticks} ticks: {} are allowed", u16::MAX)
            }
            Self::FrameTooLong { ticks, end } => {
                write!(f, "settle_ns and sample_cycles make a frame of {ticks} ticks: less than {end} are allowed")
            }
            Self::FrameTooShort { frame_ns, scan_ns } => {
                write!(f, "frame_ns of {frame_ns}: the scan alone takes {scan_ns}")
            }
        }
    }
}

impl core::error::Error for ScanError {}

impl ScanTiming {
    /// Computes the tightest scan of an array that gives each row `settle_ns` before its conversions, with idle time
    /// up to the frame time that the board requests.
    ///
    /// # Errors
    /// A clock out of its range, a sampling time that the converters lack, a slot beyond the timer's range, a frame
    /// beyond the loop's, or a frame time that is shorter than the scan.
    pub fn new(
        settle_ns: u32,
        sample_cycles: u16,
        [rows, columns]: [usize; 2],
        clocks: &Clocks,
    ) -> Result<Self, ScanError> {
        clocks.check()?;
        let allowed = clocks.sample_cycles;
        if !allowed.contains(&sample_cycles) {
            return Err(ScanError::SampleCycles { cycles: sample_cycles, allowed });
        }
        let [timer_hz, core_hz, converter_hz] = [clocks.timer_hz, clocks.core_hz, clocks.converter_hz].map(u64::from);
        let settle = (u64::from(settle_ns) * timer_hz).div_ceil(NS);
        let conversion = u64::from(sample_cycles) + u64::from(clocks.conversion_cycles);
        let conversions = if clocks.converters == 1 { columns } else { lanes::pairs(columns) };
        let cycles = conversions as u64 * conversion + u64::from(clocks.trigger_cycles);
        // Cycles that do not fit 32 bits are too many ticks by any clocks.
        let needed = settle + (cycles.min(u32::MAX.into()) * timer_hz).div_ceil(converter_hz);
        let step = clocks.slot_step.max(1);
        let slot = u32::try_from(needed).unwrap_or(u32::MAX).div_ceil(step).saturating_mul(step);
        if slot > u32::from(u16::MAX) {
            return Err(ScanError::SlotTooLong { ticks: slot });
        }
        let slots = rows as u16 + 1;
        let scan = slot * u32::from(slots);
        let mut frame = scan;
        if let Some(frame_ns) = clocks.frame_ns {
            let ticks = (u64::from(frame_ns) * timer_hz / NS) as u32;
            frame = (ticks + step / 2) / step * step;
            if frame < scan {
                let scan_ns = (u64::from(scan) * NS).div_ceil(timer_hz) as u32;
                return Err(ScanError::FrameTooShort { frame_ns, scan_ns });
            }
        }
        let end = clocks.timer_hz / FRAMES_PER_S_LEAST;
        if frame >= end {
            return Err(ScanError::FrameTooLong { ticks: frame, end });
        }
        let wide = u64::from(frame);
        Ok(Self {
            settle: ScanTicks(settle as u32),
            slot: ScanTicks(slot),
            sample_cycles,
            slots,
            idle: ScanTicks(frame - scan),
            frame_ns: ((wide * NS + timer_hz / 2) / timer_hz) as u32,
            deadline: CoreCycles((wide * core_hz / timer_hz / 4 * 3) as u32),
        })
    }

    /// Time from frame to frame.
    pub const fn frame(self) -> ScanTicks {
        ScanTicks(self.slot.0 * self.slots as u32 + self.idle.0)
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
pub(crate) mod tests {
    use super::*;
    use crate::params::Params;
    use std::string::ToString;

    pub(crate) const CLOCKS: Clocks = Clocks {
        timer_hz: 168_000_000,
        core_hz: 168_000_000,
        converter_hz: 21_000_000,
        converters: 2,
        sample_cycles: &[3, 15, 28],
        conversion_cycles: 12,
        trigger_cycles: 5,
        slot_step: 1,
        frame_ns: None,
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
        let slow = ScanTiming::new(1_000_000, 15, [16, 16], &Clocks { timer_hz: 1_000_000, ..CLOCKS });
        assert!(matches!(slow, Err(ScanError::FrameTooLong { ticks: 17_187, end: 15_625 })), "{slow:?}");
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

    /// Timing of the shipped board: a PWM of 20 to 40 kHz in step with the requested scan.
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
        let clocks = Clocks { conversion_cycles: u32::MAX, timer_hz: u32::MAX, ..CLOCKS };
        assert!(matches!(ScanTiming::new(u32::MAX, 3, [16, 32], &clocks), Err(ScanError::SlotTooLong { .. })));
        for (clocks, words) in [
            (Clocks { timer_hz: 0, ..CLOCKS }, "timer_hz of 0: 100000 to 4294967295 are allowed"),
            (Clocks { core_hz: 0, ..CLOCKS }, "core_hz of 0: 100000 to 4294967295 are allowed"),
            (Clocks { converter_hz: 0, ..CLOCKS }, "converter_hz of 0: 100000 to 4294967295 are allowed"),
            (Clocks { converters: 0, ..CLOCKS }, "converters of 0: 1 to 2 are allowed"),
            (Clocks { converters: 3, ..CLOCKS }, "converters of 3: 1 to 2 are allowed"),
            (Clocks { frame_ns: Some(0), ..CLOCKS }, "frame_ns of 0: 1 to 15000000 are allowed"),
            (Clocks { frame_ns: Some(20_000_000), ..CLOCKS }, "frame_ns of 20000000: 1 to 15000000 are allowed"),
            (Clocks { frame_ns: Some(90_000), ..CLOCKS }, "frame_ns of 90000: the scan alone takes 99786"),
        ] {
            assert_eq!(ScanTiming::new(2_400, 15, [10, 10], &clocks).unwrap_err().to_string(), words);
        }
    }

    /// Every clock ratio, frame time and shape, against the same sums without rounding.
    #[test]
    fn a_slot_is_never_too_short_and_a_frame_takes_the_time_asked_for() {
        let (mut made, mut refused) = (0, 0);
        for (timer_hz, converter_hz) in
            [(1, 1), (150, 48), (168, 21), (64, 16), (125, 3), (240, 80), (48, 64), (500, 1)]
        {
            let [timer_hz, converter_hz] = [timer_hz, converter_hz].map(|mhz: u32| mhz * 1_000_000);
            for (rows, columns, converters) in (3..=16)
                .flat_map(|rows| (3..=32_usize).flat_map(move |columns| [(rows, columns, 1), (rows, columns, 2)]))
            {
                for frame_ns in [None, Some(83_333), Some(123_457), Some(1_000_000), Some(10_000_000)] {
                    let clocks = Clocks { timer_hz, converter_hz, converters, slot_step: 3, frame_ns, ..CLOCKS };
                    let conversions = columns.div_ceil(converters as usize) as f64;
                    let needed_s = 2_400e-9 + (27.0 * conversions + 5.0) / f64::from(converter_hz);
                    let tick_s = 1.0 / f64::from(timer_hz);
                    let scan_s = (rows + 1) as f64 * needed_s;
                    match ScanTiming::new(2_400, 15, [rows, columns], &clocks) {
                        Ok(timing) => {
                            made += 1;
                            let slot_s = f64::from(timing.slot.0) * tick_s;
                            assert!((-1e-15..5.0 * tick_s).contains(&(slot_s - needed_s)), "{clocks:?} {timing:?}");
                            let frame_s = f64::from(timing.frame().0) * tick_s;
                            assert!(timing.frame().0.is_multiple_of(3));
                            assert!((frame_s * 1e9 - f64::from(timing.frame_ns)).abs() <= 0.501);
                            match frame_ns {
                                None => assert_eq!(timing.idle, ScanTicks(0)),
                                Some(ns) => assert!((frame_s - f64::from(ns) * 1e-9).abs() < 2.6 * tick_s),
                            }
                        }
                        Err(ScanError::FrameTooShort { frame_ns, scan_ns }) => {
                            refused += 1;
                            assert!(scan_ns > frame_ns && f64::from(scan_ns) > scan_s * 1e9 - 1e-3, "{clocks:?}");
                        }
                        Err(ScanError::SlotTooLong { ticks }) => {
                            assert!(ticks > 65_535 && needed_s > 65_530.0 * tick_s)
                        }
                        Err(error) => panic!("{error}: {clocks:?}"),
                    }
                }
            }
        }
        assert!(made > 20_000 && refused > 5_000, "{made} made, {refused} refused");
    }
}
