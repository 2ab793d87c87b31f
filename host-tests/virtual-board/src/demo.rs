//! The demonstration: the flash image touches an object, holds the requested forces, and releases the object.
//!
//! The host sees the board only over its bus; the figures are of the simulated world's true force. A second run of the
//! same scene must leave the same trace.

use crate::image::hex;
use crate::scene::{Boards, simulate};
use crate::{Error, Rig};
use fingertip::shipped::address;
use output::say;
use serde::Serialize;
use sim::demo::{self, Check, Forces, Run, Trace};
use std::path::Path;
use std::thread::JoinHandle;
use std::time::Instant;

/// Runs the demonstration and takes its figures; a quick one is shorter, and without the second run.
pub fn run(image: &Path, quick: bool) -> Result<(Figures, Run), Error> {
    let begun = Instant::now();
    let scene = demo::scene(quick)?;
    let repeat = (!quick).then(|| {
        let (image, scene) = (image.to_owned(), scene.clone());
        std::thread::spawn(move || simulate(&image, &scene, &mut Trace::new(&scene)).map(|summary| summary.digest))
    });

    let mut boards = Boards::power_on(image, &scene)?;
    let flash = boards.rigs[0].flashed()?;
    let from = Counts::of(&mut boards.rigs[0])?;
    let mut trace = Trace::new(&scene);
    let summary = boards.run(&scene, &mut trace)?;
    let rig = &mut boards.rigs[0];
    let to = Counts::of(rig)?;
    let awaited = |repeat: JoinHandle<_>| {
        say::line("waiting for the same run once more, to compare the traces");
        repeat.join().unwrap_or_else(|panic| std::panic::resume_unwind(panic))
    };
    let repeated_trace_sha256 = repeat.map(awaited).transpose()?;
    let run = trace.finish()?;
    let frames = to.frames - from.frames;
    let latency = rig.latency()?;
    // The last request of the scene's host is answered after this time.
    rig.run_ms(QUIET_MS)?;
    rig.take_received()?;
    let loop_time = rig.read(address::LOOP_TIME_MAX_US, 2)?;
    let mut figures = Figures {
        image_sha256: hex(&rigless::snapshot::digest(&flash)),
        image_bytes: flash.len(),
        virtual_time_s: summary.virtual_s,
        wall_time_s: begun.elapsed().as_secs_f64(),
        frames,
        frame_rate_hz: frames as f64 / ((to.at_ns - from.at_ns) as f64 * 1e-9),
        missed_frames: run.missed_frames,
        latency_us: Range { least: latency.min_ns as f64 * 1e-3, largest: latency.max_ns as f64 * 1e-3 },
        loop_time_max_us: u16::from_le_bytes([loop_time[0], loop_time[1]]),
        instructions_a_frame: (to.instructions - from.instructions) as f64 / frames as f64,
        forces: Forces::of(&run)?,
        trace_sha256: summary.digest,
        repeated_trace_sha256,
        checks: Vec::new(),
    };
    // The last frame may be under way at either instant.
    let unanswered = (frames + from.duties).abs_diff(to.duties).saturating_sub(2);
    figures.checks = figures.checked(unanswered, rig.gaps()?.len());
    Ok((figures, run))
}

/// Pause of the line after the last request, ms.
const QUIET_MS: u64 = 2;

/// Counts of a board since power-on.
struct Counts {
    at_ns: u64,
    frames: u64,
    duties: u64,
    instructions: u64,
}

impl Counts {
    fn of(rig: &mut Rig) -> Result<Self, Error> {
        let instructions = rig.with(|stand| stand.stop.instruction_count)?;
        let (frames, duties) = (rig.scan_counts()?.frames, rig.latency()?.frames);
        Ok(Self { at_ns: rig.now_ns(), frames, duties, instructions })
    }
}

/// All figures; the keys end with the unit.
#[derive(Clone, Debug, Serialize)]
pub struct Figures {
    pub image_sha256: String,
    /// Size of the image in flash, bytes.
    pub image_bytes: usize,
    /// Virtual time with torque enabled.
    pub virtual_time_s: f64,
    /// Time that the run took on this machine.
    pub wall_time_s: f64,
    pub frames: u64,
    pub frame_rate_hz: f64,
    pub missed_frames: u32,
    /// Latency from a frame's last conversion to its duty.
    pub latency_us: Range,
    /// Longest latency that the board itself measured.
    pub loop_time_max_us: u16,
    /// Instructions of the whole firmware for a frame: interrupts, executor, step, bus, log. Sleep counts none.
    pub instructions_a_frame: f64,
    #[serde(flatten)]
    pub forces: Forces,
    /// Digest of every duty and every byte on the bus, with their times.
    pub trace_sha256: String,
    /// The same digest of the second run; `None` without a second run.
    pub repeated_trace_sha256: Option<String>,
    pub checks: Vec<Check>,
}

#[derive(Clone, Copy, Debug, Serialize)]
pub struct Range {
    pub least: f64,
    pub largest: f64,
}

impl Figures {
    fn checked(&self, unanswered: u64, unknown_gaps: usize) -> Vec<Check> {
        let at_most = |most: f64| [None, Some(most)];
        let within = |least: f64, most: f64| [Some(least), Some(most)];
        let mut checks = vec![
            Check::new("frame rate", Some(self.frame_rate_hz), "Hz", within(5_000.0, 10_500.0)),
            Check::new("missed frames", Some(f64::from(self.missed_frames)), "", at_most(0.0)),
            Check::new("frames without a new duty", Some(unanswered as f64), "", at_most(0.0)),
            Check::new("last conversion to new duty", Some(self.latency_us.largest), "us", within(1.0, 60.0)),
            Check::new("instructions a frame, all told", Some(self.instructions_a_frame), "", within(2_000.0, 8_000.0)),
            Check::new("emulator gaps not on the allow-list", Some(unknown_gaps as f64), "", at_most(0.0)),
        ];
        checks.extend(self.forces.checks());
        if let Some(repeated) = &self.repeated_trace_sha256 {
            let differ = Some(f64::from(u8::from(*repeated != self.trace_sha256)));
            checks.push(Check::new("traces that differ when repeated", differ, "", at_most(0.0)));
        }
        checks
    }
}
