//! The script played on the board: a client on the bus asks for forces and watches.

use super::DemoError;
use super::bus::{ID, Poll, ask, poll, pressures, write_u8};
use crate::Rig;
use crate::front_end::ScanCounts;
use crate::gaps::Gap;
use crate::measure::Latency;
use crate::recorder::Recorder;
use fingertip::shipped::address;
use fingertip::state::{Limits, Mode};
use host_tests::demo::{self, Phase, Picture};
use host_tests::heatmap::Pressures;

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

/// What came of a run.
#[derive(Clone, Debug, Default)]
pub struct Run {
    /// The goals, the world and the pressure maps.
    pub seen: demo::Run,
    /// All polls.
    pub polls: Vec<Poll>,
    /// The frames scanned at these times.
    pub scans: [ScanCounts; 2],
    /// The instructions executed by these times.
    pub instructions: [u64; 2],
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

impl Run {
    /// Boots, pings, tares and enables torque.
    ///
    /// # Errors
    /// The board does not answer, or not as it should.
    pub fn begin(rig: &mut Rig) -> Result<Self, DemoError> {
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
        let seen = demo::Run { span_s: [now_s; 2], ..demo::Run::default() };
        Ok(Self { seen, scans: [scans; 2], instructions, ..Self::default() })
    }

    /// Plays one phase: writes its goal, then asks now and then how it goes.
    ///
    /// # Errors
    /// The board does not answer, or stopped with a fault.
    pub fn play(&mut self, phase: Phase, rig: &mut Rig, watch: &mut dyn Watch) -> Result<(), DemoError> {
        let start_ns = rig.now_ns();
        let begun_ns = (self.seen.span_s[0] * 1e9).round() as u64;
        let at_ms = |rig: &Rig| (rig.now_ns() - begun_ns) / 1_000_000;
        watch.phase(at_ms(rig), phase);
        self.seen.goals.push(((start_ns + GOAL_BYTES * BYTE_NS) as f64 * 1e-9, phase.goal_n()));
        let goal = phase.goal_mn as u32;
        ask(rig, "goal force", move |bus| bus.write_u32(ID, address::GOAL_FORCE_MN, goal).map(drop))?;
        for tick in 1..=phase.hold_ms / POLL_MS {
            let last = tick == phase.hold_ms / POLL_MS;
            let poll = poll(rig)?;
            let pressures = if last || tick % POLLS_A_PICTURE == 0 { Some(pressures(rig)?) } else { None };
            watch.news(at_ms(rig), phase, &poll, pressures.as_ref());
            if let Some(pressures_kpa) = pressures.filter(|_| last && phase.map) {
                let Poll { force_n, centre_mm, radius_mm, .. } = poll;
                let picture = Picture { goal_n: phase.goal_n(), force_n, centre_mm, radius_mm, pressures_kpa };
                self.seen.pictures.push(picture);
            }
            self.polls.push(poll);
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
    pub fn end(&mut self, rig: &mut Rig) -> Result<(), DemoError> {
        self.seen.span_s[1] = rig.now_ns() as f64 * 1e-9;
        self.scans[1] = rig.scan_counts()?;
        self.instructions[1] = rig.instructions()?;
        self.loop_time_max_us = ask(rig, "loop time", |bus| bus.read_u16(ID, address::LOOP_TIME_MAX_US))?.data;
        self.latency = rig.latency()?;
        self.gaps = rig.gaps()?;
        self.trace_hash = rig.trace_hash()?;
        let recorder = rig.with(|stand| stand.bench.recorder.take())?;
        self.seen.trace = recorder.map(|recorder| recorder.samples).unwrap_or_default();
        self.fill_in();
        Ok(())
    }

    /// Puts what the client knows into the trace: the goal, and the mode and the force that it read last.
    fn fill_in(&mut self) {
        let (mut goals, mut polls) = (self.seen.goals.iter().peekable(), self.polls.iter().peekable());
        let (mut goal_n, mut known) = (0.0, Poll::default());
        for sample in &mut self.seen.trace {
            while let Some((_, next_n)) = goals.next_if(|(at_s, _)| *at_s <= sample.time_s) {
                goal_n = *next_n;
            }
            while let Some(poll) = polls.next_if(|poll| poll.at_s <= sample.time_s) {
                known = *poll;
            }
            (sample.goal_n, sample.sensed_force_n, sample.mode) = (goal_n, known.force_n, known.mode);
        }
    }
}
