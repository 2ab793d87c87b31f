//! The demonstration's figures, each against its bound.

use super::DemoError;
use super::flashable::Flashable;
use super::play::Run;
use host_tests::demo::{Check, Forces};
use serde::Serialize;
use std::time::Duration;

/// All figures; the keys end with the unit.
#[derive(Clone, Debug, Serialize)]
pub struct Figures {
    /// SHA-256 of the bytes that the flash gets.
    pub image_sha256: String,
    /// How many these are.
    pub image_bytes: usize,
    /// Virtual time with torque enabled.
    pub virtual_time_s: f64,
    /// Time that it took here.
    pub wall_time_s: f64,
    /// Frames in that virtual time.
    pub frames: u64,
    /// Their rate.
    pub frame_rate_hz: f64,
    /// Frames that the control missed.
    pub missed_frames: u32,
    /// From a frame's last conversion to its duty.
    pub latency_us: Range,
    /// The longest, by the board's own measure.
    pub loop_time_max_us: u16,
    /// Instructions of the whole firmware for a frame: interrupts, executor, step, bus, log. Sleep counts none.
    pub instructions_a_frame: f64,
    /// What the true force did.
    #[serde(flatten)]
    pub forces: Forces,
    /// Digest of every duty and every byte on the bus, with their times.
    pub trace_sha256: String,
    /// The same of the second run, cut by a snapshot; none where it was left out.
    pub repeated_trace_sha256: Option<String>,
    /// Every figure that has a bound.
    pub checks: Vec<Check>,
}

/// The least and the largest.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct Range {
    /// The least.
    pub least: f64,
    /// The largest.
    pub largest: f64,
}

impl Figures {
    /// Takes the figures of a run.
    ///
    /// # Errors
    /// The run was not what the script asked for: nothing was touched, or a force never reached.
    pub fn of(run: &Run, flash: &Flashable, repeated: Option<String>, wall: Duration) -> Result<Self, DemoError> {
        let forces = Forces::of(&run.seen)?;
        let virtual_time_s = run.seen.span_s[1] - run.seen.span_s[0];
        let frames = run.scans[1].frames - run.scans[0].frames;
        let mut figures = Self {
            image_sha256: flash.sha256(),
            image_bytes: flash.bytes.len(),
            virtual_time_s,
            wall_time_s: wall.as_secs_f64(),
            frames,
            frame_rate_hz: frames as f64 / virtual_time_s,
            missed_frames: run.polls.last().map_or(u32::MAX, |poll| poll.missed_frames),
            latency_us: Range { least: run.latency.min_ns as f64 * 1e-3, largest: run.latency.max_ns as f64 * 1e-3 },
            loop_time_max_us: run.loop_time_max_us,
            instructions_a_frame: (run.instructions[1] - run.instructions[0]) as f64 / frames as f64,
            forces,
            trace_sha256: run.trace_hash.clone(),
            repeated_trace_sha256: repeated,
            checks: Vec::new(),
        };
        figures.checks = figures.check(run);
        Ok(figures)
    }

    fn check(&self, run: &Run) -> Vec<Check> {
        let at_most = |most: f64| [None, Some(most)];
        let within = |least: f64, most: f64| [Some(least), Some(most)];
        let count = |number: usize| Some(number as f64);
        let mut checks = vec![
            Check::new("frame rate", Some(self.frame_rate_hz), "Hz", within(5_000.0, 10_500.0)),
            Check::new("missed frames", Some(f64::from(self.missed_frames)), "", at_most(0.0)),
            Check::new("frames without a new duty", self.unanswered(run), "", at_most(0.0)),
            Check::new("last conversion to new duty", Some(self.latency_us.largest), "us", within(1.0, 60.0)),
            Check::new("instructions a frame, all told", Some(self.instructions_a_frame), "", within(2_000.0, 8_000.0)),
            Check::new("emulator gaps not on the allow-list", count(unknown_gaps(run)), "", at_most(0.0)),
        ];
        checks.extend(self.forces.checks());
        if let Some(repeated) = &self.repeated_trace_sha256 {
            let differ = count(usize::from(*repeated != self.trace_sha256));
            checks.push(Check::new("traces that differ when repeated and cut", differ, "", at_most(0.0)));
        }
        checks
    }

    /// Frames since the reset that the scan finished but no duty followed while the bridge was driven.
    fn unanswered(&self, run: &Run) -> Option<f64> {
        let (first, last) = (run.polls.first()?, run.polls.last()?);
        let stepped = last.frame.wrapping_sub(first.frame);
        let scanned = (last.at_s - first.at_s) * self.frame_rate_hz;
        // The two polls may each be a frame early or late.
        Some(((scanned - f64::from(stepped)).abs() - 2.0).max(0.0).floor())
    }
}

fn unknown_gaps(run: &Run) -> usize {
    run.gaps.iter().filter(|gap| gap.reason().is_none()).count()
}
