//! What the demonstration does: a client on the bus that asks for forces and watches.

use super::DemoError;
use super::bus::{ID, Poll, ask, poll, pressures, write_u8};
use crate::Rig;
use crate::front_end::ScanCounts;
use crate::gaps::Gap;
use crate::measure::Latency;
use crate::recorder::Recorder;
use fingertip::link::table::address;
use fingertip::safety::{Limits, Mode};
use host_tests::heatmap::Pressures;
use host_tests::metrics::Sample;

/// The scan, the tare and the guards have settled by then.
const BOOT_MS: u64 = 20;
/// How often the world is sampled.
const SAMPLE_NS: u64 = 100_000;
/// How often the client asks how it goes.
const POLL_MS: u64 = 10;
/// Of how many of these the pressures are asked for too.
const POLLS_A_PICTURE: u64 = 5;
/// Time of a byte on the bus at its speed after a reset, 1 Mbaud.
const BYTE_NS: u64 = 10_000;
/// Bytes of a Write of four.
const GOAL_BYTES: u64 = 16;
/// A goal and how long it stands.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Phase {
    /// The force asked for.
    pub goal_mn: i32,
    /// How long.
    pub hold_ms: u64,
    /// Whether its pressures are kept for a map.
    pub map: bool,
}

/// The phases, the first of them a touch.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Script(Vec<Phase>);

/// The array at the end of a phase.
#[derive(Clone, Copy, Debug)]
pub struct Picture {
    /// The phase's goal.
    pub goal_n: f64,
    /// What the board said.
    pub poll: Poll,
    /// Pressures, kPa.
    pub pressures_kpa: Pressures,
}

/// What came of a run.
#[derive(Clone, Debug, Default)]
pub struct Run {
    /// When each phase's goal had reached the board, and the goal.
    pub goals: Vec<(f64, f64)>,
    /// All polls.
    pub polls: Vec<Poll>,
    /// Pressure maps.
    pub pictures: Vec<Picture>,
    /// When torque was enabled and when it ended.
    pub span_s: [f64; 2],
    /// The frames scanned at these times.
    pub scans: [ScanCounts; 2],
    /// The instructions executed by these times.
    pub instructions: [u64; 2],
    /// The world; from the run's last part only where a snapshot cut it.
    pub trace: Vec<Sample>,
    /// From conversion to duty.
    pub latency: Latency,
    /// The longest loop time, by the board's own measure.
    pub loop_time_max_us: u16,
    /// Emulator gaps that the run touched.
    pub gaps: Vec<Gap>,
    /// The digest of every duty and byte.
    pub trace_hash: String,
}

/// Somebody who watches.
pub trait Watch {
    /// A phase begins.
    fn phase(&mut self, at_ms: u64, phase: Phase);
    /// News from the board.
    fn news(&mut self, at_ms: u64, phase: Phase, poll: &Poll, pressures: Option<&Pressures>);
}

impl Script {
    /// 10 s: touch, steps, release.
    pub fn whole() -> Self {
        let phase = |goal_mn, hold_ms, map| Phase { goal_mn, hold_ms, map };
        Self(vec![
            phase(1_000, 2_000, true),
            phase(200, 1_500, false),
            phase(2_000, 2_000, true),
            phase(5_000, 2_000, true),
            phase(1_000, 1_500, false),
            phase(0, 1_000, false),
        ])
    }

    /// The same goals, held for 250 ms; 500 ms for the touch.
    pub fn quick() -> Self {
        let Self(mut phases) = Self::whole();
        for phase in &mut phases {
            phase.hold_ms = 250;
        }
        phases[0].hold_ms = 500;
        Self(phases)
    }

    /// How many phases it has.
    pub fn phases(&self) -> usize {
        self.0.len()
    }

    /// Virtual time that its phases take.
    pub fn length_ms(&self) -> u64 {
        self.0.iter().map(|phase| phase.hold_ms).sum()
    }

    /// Boots, pings, tares and enables torque.
    ///
    /// # Errors
    /// The board does not answer, or not as it should.
    pub fn begin(&self, rig: &mut Rig, _watch: &mut dyn Watch) -> Result<Run, DemoError> {
        rig.run_until_ns(BOOT_MS * 1_000_000)?;
        if let Some(reset) = rig.resets()?.first() {
            let (at_ms, cause) = (reset.at_ns as f64 * 1e-6, &reset.cause);
            return Err(DemoError::Unexpected(format!(
                "the board does not start: it resets after {at_ms:.3} ms, by {cause}"
            )));
        }
        ask(rig, "ping", |bus| bus.ping(ID).map(drop))?;
        write_u8(rig, "tare", address::TARE, 1)?;
        let begun_ns = rig.now_ns();
        loop {
            let poll = poll(rig)?;
            if poll.mode == Mode::Off && poll.limits & Limits::NOT_TARED == 0 {
                break;
            }
            if poll.fault != 0 || rig.now_ns() > begun_ns + 1_000_000_000 {
                return Err(DemoError::Unexpected(format!("the tare does not end: {poll:?}")));
            }
            rig.run_ms(POLL_MS)?;
        }
        write_u8(rig, "torque enable", address::TORQUE_ENABLE, 1)?;
        // On a round ms, so that the phases begin and the samples fall on round times.
        rig.run_until_ns((rig.now_ns() + 1).next_multiple_of(1_000_000))?;
        let scans = rig.with(|stand| {
            stand.bench.recorder = Some(Recorder::every(SAMPLE_NS));
            stand.bench.front_end.lock().counts
        })?;
        let now_s = rig.now_ns() as f64 * 1e-9;
        let instructions = [rig.instructions()?; 2];
        Ok(Run { span_s: [now_s; 2], scans: [scans; 2], instructions, ..Run::default() })
    }

    /// Plays one phase: writes its goal, then asks now and then how it goes.
    ///
    /// # Errors
    /// The board does not answer, or stopped with a fault.
    pub fn play(&self, place: usize, rig: &mut Rig, run: &mut Run, watch: &mut dyn Watch) -> Result<(), DemoError> {
        let phase = self.0[place];
        let start_ns = rig.now_ns();
        let at_ms = |rig: &Rig| (rig.now_ns() - (run.span_s[0] * 1e9).round() as u64) / 1_000_000;
        watch.phase(at_ms(rig), phase);
        run.goals.push(((start_ns + GOAL_BYTES * BYTE_NS) as f64 * 1e-9, f64::from(phase.goal_mn) * 1e-3));
        let goal = phase.goal_mn as u32;
        ask(rig, "goal force", move |bus| bus.write_u32(ID, address::GOAL_FORCE_MN, goal).map(drop))?;
        for tick in 1..=phase.hold_ms / POLL_MS {
            let last = tick == phase.hold_ms / POLL_MS;
            let poll = poll(rig)?;
            let pressures = if last || tick % POLLS_A_PICTURE == 0 { Some(pressures(rig)?) } else { None };
            watch.news(at_ms(rig), phase, &poll, pressures.as_ref());
            if let Some(pressures_kpa) = pressures.filter(|_| last && phase.map) {
                run.pictures.push(Picture { goal_n: f64::from(phase.goal_mn) * 1e-3, poll, pressures_kpa });
            }
            run.polls.push(poll);
            if poll.fault != 0 {
                return Err(DemoError::Unexpected(format!("the board stopped with fault {}: {poll:?}", poll.fault)));
            }
            rig.run_until_ns(start_ns + tick * POLL_MS * 1_000_000)?;
        }
        Ok(())
    }

    /// Takes what the bench has recorded.
    ///
    /// # Errors
    /// The board does not answer.
    pub fn end(&self, rig: &mut Rig, run: &mut Run) -> Result<(), DemoError> {
        run.span_s[1] = rig.now_ns() as f64 * 1e-9;
        run.scans[1] = rig.scan_counts()?;
        run.instructions[1] = rig.instructions()?;
        run.loop_time_max_us = ask(rig, "loop time", |bus| bus.read_u16(ID, address::LOOP_TIME_MAX_US))?.data;
        run.latency = rig.latency()?;
        run.gaps = rig.gaps()?;
        run.trace_hash = rig.trace_hash()?;
        let recorder = rig.with(|stand| stand.bench.recorder.take())?;
        run.trace = recorder.map(|recorder| recorder.samples).unwrap_or_default();
        fill_in(run);
        Ok(())
    }
}

/// Puts what the client knows into the trace: the goal, and the mode and the force that it read last.
fn fill_in(run: &mut Run) {
    let (mut goals, mut polls) = (run.goals.iter().peekable(), run.polls.iter().peekable());
    let (mut goal_n, mut known) = (0.0, Poll::default());
    for sample in &mut run.trace {
        while let Some((_, next_n)) = goals.next_if(|(at_s, _)| *at_s <= sample.time_s) {
            goal_n = *next_n;
        }
        while let Some(poll) = polls.next_if(|poll| poll.at_s <= sample.time_s) {
            known = *poll;
        }
        (sample.goal_n, sample.sensed_force_n, sample.mode) = (goal_n, known.force_n, known.mode);
    }
}
