//! The demonstration's figures, each against its bound.

use super::DemoError;
use super::flashable::Flashable;
use super::script::Run;
use fingertip::params::Params;
use host_tests::metrics::{self, DriveLimits, Step, Touch};
use host_tests::plant::Setup;
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
    /// The first touch.
    pub touch: Touch,
    /// The force steps.
    pub steps: Vec<Step>,
    /// Letting go.
    pub release: Release,
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

/// Letting go.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct Release {
    /// From the goal of 0 until nothing is touched for good; none where something still is.
    pub clear_after_ms: Option<f64>,
    /// How far from the object the tip ends.
    pub clearance_mm: f64,
}

/// A figure against its bound.
#[derive(Clone, Debug, Serialize)]
pub struct Check {
    /// What is measured.
    pub name: String,
    /// The figure; none where there is none, which fails.
    pub measured: Option<f64>,
    /// Its unit.
    pub unit: &'static str,
    /// It must not be less; a figure too good to be true fails too.
    pub at_least: Option<f64>,
    /// It must not be more.
    pub at_most: Option<f64>,
    /// Whether it is so.
    pub pass: bool,
}

impl Check {
    fn new(name: impl Into<String>, measured: Option<f64>, unit: &'static str, bounds: [Option<f64>; 2]) -> Self {
        let [at_least, at_most] = bounds;
        let inside =
            |value: f64| at_least.is_none_or(|least| value >= least) && at_most.is_none_or(|most| value <= most);
        Self { name: name.into(), measured, unit, at_least, at_most, pass: measured.is_some_and(inside) }
    }
}

impl Figures {
    /// Takes the figures of a run.
    ///
    /// # Errors
    /// The run was not what the script asked for: nothing was touched, or a force never reached.
    pub fn of(run: &Run, flash: &Flashable, repeated: Option<String>, wall: Duration) -> Result<Self, DemoError> {
        let setup = Setup::default();
        let limits = DriveLimits {
            volts: f64::from(Params::DEFAULT.voltage_max_mv) * 1e-3,
            amperes: f64::from(Params::DEFAULT.current_max_ma) * 1e-3,
        };
        let mut touch = None;
        let mut steps = Vec::new();
        let mut release = None;
        for (place, (from_s, goal_n)) in run.goals.iter().enumerate() {
            let to_s = run.goals.get(place + 1).map_or(f64::INFINITY, |(next_s, _)| *next_s);
            let stretch = metrics::stretch(&run.trace, *from_s, to_s);
            if place == 0 {
                touch = Some(metrics::touch(stretch)?);
            } else if *goal_n > 0.0 {
                steps.push(metrics::step(stretch, &setup, limits)?);
            } else {
                release = Some(Release::of(stretch, &setup));
            }
        }
        let none = || DemoError::Unexpected("the script has no touch or no release".to_owned());
        let virtual_time_s = run.span_s[1] - run.span_s[0];
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
            touch: touch.ok_or_else(none)?,
            steps,
            release: release.ok_or_else(none)?,
            trace_sha256: run.trace_hash.clone(),
            repeated_trace_sha256: repeated,
            checks: Vec::new(),
        };
        figures.checks = figures.check(run);
        Ok(figures)
    }

    /// How many bounds are missed.
    pub fn missed(&self) -> usize {
        self.checks.iter().filter(|check| !check.pass).count()
    }

    fn check(&self, run: &Run) -> Vec<Check> {
        let at_most = |most: f64| [None, Some(most)];
        let within = |least: f64, most: f64| [Some(least), Some(most)];
        let count = |number: usize| Some(number as f64);
        let touch = &self.touch;
        let mut checks = vec![
            Check::new("frame rate", Some(self.frame_rate_hz), "Hz", within(5_000.0, 10_500.0)),
            Check::new("missed frames", Some(f64::from(self.missed_frames)), "", at_most(0.0)),
            Check::new("frames without a new duty", self.unanswered(run), "", at_most(0.0)),
            Check::new("last conversion to new duty", Some(self.latency_us.largest), "us", within(1.0, 60.0)),
            Check::new("instructions a frame, all told", Some(self.instructions_a_frame), "", within(2_000.0, 8_000.0)),
            Check::new("emulator gaps not on the allow-list", count(unknown_gaps(run)), "", at_most(0.0)),
            Check::new("first touch: way before it", Some(touch.distance_mm), "mm", within(4.9, 5.1)),
            Check::new("first touch: speed", Some(touch.approach_mm_per_s), "mm/s", within(20.0, 100.0)),
            Check::new("first touch: peak above goal", Some(touch.peak_above_goal_percent), "%", within(-1.0, 10.0)),
            Check::new(
                "first touch: steady error",
                Some(touch.steady_error_mn),
                "mN",
                at_most(steady_mn(touch.goal_n)),
            ),
        ];
        for step in &self.steps {
            let name = |what: &str| format!("{:.1} to {:.1} N: {what}", step.from_n, step.to_n);
            let ratio = step.settling_to_optimal_ratio;
            checks.extend([
                Check::new(name("rise, 10 to 90 %"), Some(step.rise_ms), "ms", within(1.0, 20.0)),
                Check::new(name("overshoot"), Some(step.overshoot_percent), "%", at_most(2.0)),
                Check::new(name("settled to 2 %"), step.settling_ms, "ms", within(1.0, 40.0)),
                Check::new(name("settling over time-optimal"), ratio, "", within(0.8, 2.0)),
                Check::new(name("steady error"), Some(step.steady_error_mn), "mN", at_most(steady_mn(step.to_n))),
            ]);
        }
        checks.push(Check::new("release: lets go after", self.release.clear_after_ms, "ms", within(1.0, 100.0)));
        checks.push(Check::new("release: clearance", Some(self.release.clearance_mm), "mm", within(0.5, 1.5)));
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

impl Release {
    fn of(stretch: &[metrics::Sample], setup: &Setup) -> Self {
        let clear = stretch.iter().rposition(|sample| sample.true_force_n > 0.0).map_or(0, |last| last + 1);
        let clear_after_ms = stretch.get(clear).zip(stretch.first()).map(|(at, from)| (at.time_s - from.time_s) * 1e3);
        let travel_mm = stretch.last().map_or(f64::NAN, |sample| sample.travel_mm);
        Self { clear_after_ms, clearance_mm: setup.wall.distance_mm - travel_mm }
    }
}

/// The steady error allowed: 0.5 % and 5 mN.
fn steady_mn(goal_n: f64) -> f64 {
    goal_n * 5.0 + 5.0
}

fn unknown_gaps(run: &Run) -> usize {
    run.gaps.iter().filter(|gap| gap.reason().is_none()).count()
}
