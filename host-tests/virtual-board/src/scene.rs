//! A scene on the emulated board: the flash image, unmodified, in the world that the scene names.
//!
//! The scene's parameters lie in the image's parameter sector. The host tares, enables torque, and writes the script's
//! goals over the bus at the times at which the scene's link lets them through; it reads the status registers once in
//! ten frames, and when its grip requests it. A step of the run consists of an answer, the frame that it was made
//! from, and the true state at that frame's end. It does not include the internal state of the core, so a recording of
//! such a run cannot be replayed through the core.
//!
//! A run is slow because of the halts of the emulated core, and of the code that must be translated after each halt. So
//! the world advances when something depends on it, and otherwise in steps of
//! [`finger::Finger::grid_ns`]; the scan's slots are simulated together ([`crate::front_end::Scan`]), the bridge's
//! timer sleeps ([`crate::timers`]), and the host acts only where the core is stopped anyway.
//!
//! The world is frozen until a millisecond before the scene's start: the boards boot and are tared in it.
//!
//! A scene with two fingers has two boards in one world, each on a separate bus.

pub mod finger;
pub mod host;

use crate::board::Surroundings;
use crate::rig::Stand;
use crate::{Error, Options, Rig};
use finger::{Clock, Finger, Seen};
use fingertip::contact::FitLevel;
use fingertip::params::Params;
use fingertip::shipped::{Config, Record, TARE_FRAMES, address};
use host::{Host, Shown};
use rigless::soc::Width;
use sim::SimError;
use sim::effects::Parts;
use sim::effects::link;
use sim::scene::Scene;
use sim::watch::{Controller, Step, Summary, Watch};
use std::collections::VecDeque;
use std::path::Path;
use std::sync::mpsc::Receiver;
use std::time::{Duration, Instant};

/// One millisecond of the board: time between two reads of the host, ns.
const MS: u64 = 1_000_000;
/// Time after which the scan and the guards have settled, ns.
const BOOT_NS: u64 = 20 * MS;
/// Time from the end of the tare to the scene's start, in which the host sets the board up, ns.
const SET_UP_NS: u64 = 9 * MS;
/// 3 Mbaud by the protocol's code, and no pause before a reply: a read a millisecond leaves room for goals.
const BAUD_CODE: u8 = 5;
const WATCHDOG_MS: i64 = 20;

/// Runs a scene. The times of the board and of the scene's script begin together.
pub fn simulate(image: &Path, scene: &Scene, watch: &mut dyn Watch) -> Result<Summary, Error> {
    let mut boards = Boards::power_on(image, scene)?;
    let summary = boards.run(scene, watch)?;
    boards.rigs.iter_mut().try_for_each(Rig::check_gaps)?;
    Ok(summary)
}

/// A scene's boards, a board for each finger.
pub struct Boards {
    /// Rigs in the order of the fingers.
    pub rigs: Vec<Rig>,
    params: Params,
    // As on the native board, all boards have the first one's clock.
    clock: Clock,
    clock_link: link::Named,
    now_ns: u64,
    set_up: Duration,
}

impl Boards {
    /// Boots and tares them and enables torque: the scene begins a millisecond later.
    pub fn power_on(image: &Path, scene: &Scene) -> Result<Self, Error> {
        let begun = Instant::now();
        let params = scene.params();
        let config = Config::shipped(&params).map_err(SimError::Controller)?;
        let frame_ns = u64::from(config.timing.frame_ns);
        let tare_ns = u64::from(TARE_FRAMES + 2) * frame_ns;
        let start_ns = (BOOT_NS + tare_ns + SET_UP_NS).next_multiple_of(MS);
        let moves_from_s = -(MS as f64) * 1e-9;
        let record = Record { params, baud_code: BAUD_CODE, return_delay_2us: 0, ..Record::DEFAULT };
        let options = Options::stored(&record);
        let mut rigs = Vec::new();
        let clock = Clock::new(start_ns);
        for (number, finger) in Finger::all(scene, clock, moves_from_s)?.into_iter().enumerate() {
            let mut rig = Rig::new(image, Surroundings::Scene(Box::new(finger)), &options)?;
            set_up(&mut rig, scene, start_ns)?;
            let offset = frame_offset(&mut rig)?;
            let host = Host::new(scene, Parts::of(scene, number).link, start_ns, frame_ns, offset);
            rig.with(move |stand| stand.bench.host = Some(Box::new(host)))?;
            rigs.push(rig);
        }
        let clock_link = Parts::of(scene, 0).link;
        Ok(Self { rigs, params, clock, clock_link, now_ns: start_ns - MS, set_up: begun.elapsed() })
    }

    /// Runs the scene from its beginning to its end, once.
    pub fn run(&mut self, scene: &Scene, watch: &mut dyn Watch) -> Result<Summary, Error> {
        let begun = Instant::now();
        let fingers = self.rigs.len();
        watch.begin(&vec![Controller { params: self.params, calibration: None }; fingers]);
        if watch.wants_every_frame() {
            for rig in &mut self.rigs {
                rig.with(|stand| stand.bench.host.iter_mut().for_each(|host| host.show_every_frame()))?;
            }
        }
        let mut ahead = VecDeque::new();
        loop {
            let time_s = self.clock.time_s(self.now_ns);
            if time_s < scene.duration_s {
                let second_s = self.clock_link.second_s();
                self.clock.run_at(self.now_ns, second_s);
                for (number, rig) in self.rigs.iter_mut().enumerate() {
                    let wants = watch.wants_pressures(number, time_s);
                    ahead.push_back(set_out(rig, self.now_ns, second_s, wants)?);
                }
                self.now_ns += MS;
                // The boards run on while their results are processed.
                if ahead.len() == fingers {
                    continue;
                }
            } else if ahead.is_empty() {
                break;
            }
            for (finger, (rig, made)) in self.rigs.iter_mut().zip(ahead.drain(..fingers)).enumerate() {
                rig.await_reached()?;
                let (shown, trouble) = rig.answer(&made)?;
                for (Seen { time_s, frame, sense, truth, .. }, command, status) in &shown {
                    watch.step(&Step { finger, time_s: *time_s, frame, sense, command, status, truth });
                }
                if let Some(why) = trouble {
                    return Err(Error::Host(rig.now_ns(), why.into()));
                }
            }
        }
        let (mut costs, mut digests) = (self.clock_link.costs().collect::<Vec<_>>(), Vec::new());
        for rig in &mut self.rigs {
            costs.extend(rig.with(|stand| stand.bench.front_end.lock().world.costs())?);
            // The host is removed: the line is free for other requests.
            let host = rig.with(|stand| stand.bench.host.take())?;
            costs.extend(host.iter().flat_map(|host| host.link.costs()));
            digests.push(rig.trace_hash()?);
        }
        Ok(Summary {
            virtual_s: scene.duration_s,
            set_up_s: self.set_up.as_secs_f64(),
            wall_s: begun.elapsed().as_secs_f64(),
            ledger: sim::run::by_effect(scene, &costs),
            digest: digests.join(" "),
        })
    }
}

/// Steps to show of a millisecond, and the failure of the board, if there is one.
type Made = (Vec<Shown>, Option<&'static str>);

fn set_out(rig: &mut Rig, now_ns: u64, second_s: f64, wants_pressures: bool) -> Result<Receiver<Made>, Error> {
    rig.post(move |Stand { bench, .. }| {
        if let Surroundings::Scene(finger) = &mut bench.front_end.lock().world {
            finger.clock.run_at(now_ns, second_s);
            finger.wants_pressures = wants_pressures;
        }
        if let Some(host) = &mut bench.host {
            host.clock.run_at(now_ns, second_s);
        }
    })?;
    rig.set_out(now_ns + MS)?;
    rig.ask(move |stand| {
        let host = stand.bench.host.as_mut();
        host.map_or_else(Made::default, |host| (std::mem::take(&mut host.shown), host.trouble(now_ns)))
    })
}

/// Tares and enables torque before the scene begins.
fn set_up(rig: &mut Rig, scene: &Scene, start_ns: u64) -> Result<(), Error> {
    rig.run_until_ns(BOOT_NS)?;
    if let Some((cause, at_ns)) = rig.resets()?.pop() {
        return Err(Error::Host(at_ns, format!("the board does not start: it resets, by {cause}")));
    }
    write_u8(rig, "tare", address::TARE, 1)?;
    rig.run_until_ns(start_ns - 4 * MS)?;
    let watchdog_ms = scene.table("host").whole("watchdog_ms");
    if watchdog_ms > 0 {
        let code = (watchdog_ms + WATCHDOG_MS - 1) / WATCHDOG_MS;
        write_u8(rig, "bus watchdog", address::BUS_WATCHDOG, code.min(127) as u8)?;
    }
    let fit_level = scene.table("host").whole("fit_level") as u8;
    if fit_level != FitLevel::default() as u8 {
        write_u8(rig, "fit level", address::FIT_LEVEL, fit_level)?;
    }
    write_u8(rig, "torque enable", address::TORQUE_ENABLE, 1)?;
    // Goals are not answered, so that the line is free for reads.
    write_u8(rig, "status return level", address::STATUS_RETURN_LEVEL, 1)?;
    rig.run_until_ns(start_ns - 2 * MS)?;
    if rig.now_ns() > start_ns - 2 * MS {
        return Err(Error::Host(rig.now_ns(), "setting the board up took too long".into()));
    }
    Ok(())
}

/// Offset from the converters' frame number to the image's own, which is in memory at the symbol.
///
/// The status alone does not show it: the least delay of an answer depends on the load of the core.
fn frame_offset(rig: &mut Rig) -> Result<u32, Error> {
    let Some(address) = rig.image.item("scan", "SEQUENCE") else {
        let why = "the image has no counter of frames named `scan::SEQUENCE`".into();
        return Err(Error::Host(rig.now_ns(), why));
    };
    let mut offset = i32::MIN;
    // Just after a frame's end the image has not counted it yet: the largest difference of several looks is right.
    for _ in 0..3 {
        rig.run_until_ns(rig.now_ns() + MS / 10)?;
        let (number, frames) = rig.with(move |stand| {
            let number = stand.host.read(address, Width::W32).unwrap_or(0) as u32;
            (number, stand.bench.front_end.lock().counts.frames as u32)
        })?;
        offset = offset.max(number.wrapping_sub(frames) as i32);
    }
    rig.run_until_ns(rig.now_ns().next_multiple_of(MS))?;
    Ok(offset as u32)
}

fn write_u8(rig: &mut Rig, doing: &str, register: u16, value: u8) -> Result<(), Error> {
    let at_ns = rig.now_ns();
    rig.write(register, &[value]).map_err(|why| Error::Host(at_ns, format!("{doing}: {why}")))
}
