//! A scene on the emulated board: the flash image, unmodified, in the world that the scene names.
//!
//! The scene's parameters lie in the image's parameter sector. The host tares, enables torque, and writes the script's goals over
//! the bus at the times at which the scene's link lets them through; once a millisecond it reads the status registers, where no goal is in the way. A step of
//! the run is what such a read says, together with the frame that it was made from and what was true at that frame's end. What the
//! core has inside and no register shows is not in it, so a recording of such a run cannot be fed through the core again.
//!
//! The world stands still until a millisecond before the scene's start: the boards come up and are tared in it.
//!
//! A scene with two fingers has two boards, each on a line of its own, in the one world.

pub mod bus;
pub mod finger;
mod host;
mod joint;

use crate::{Error, Options, Rig, flash};
use finger::{Clock, Finger};
use fingertip::config::Config;
use fingertip::link::table::address;
use fingertip::pressure::TARE_FRAMES;
use fingertip::store::{self, Record};
use host::Host;
use sim::SimError;
use sim::scene::{Scene, controller};
use sim::watch::{Controller, Summary, Watch};
use std::path::Path;
use std::time::Instant;

/// One millisecond of the board: how often the host reads and plans.
const MS: u64 = 1_000_000;
/// The scan and the guards have settled by then.
const BOOT_NS: u64 = 20 * MS;
/// From the end of a tare to the scene's start: the host sets the board up.
const SET_UP_NS: u64 = 8 * MS;
/// An answer takes at most this long.
const WAIT_NS: u64 = 2 * MS;
/// 3 Mbaud by the protocol's code, and no pause before a reply: a read a millisecond leaves room for goals.
const BAUD_CODE: u8 = 5;
/// The unit of the bus watchdog's register.
const WATCHDOG_MS: i64 = 20;

/// Runs a scene. The times of the board and of the scene's script begin together.
///
/// # Errors
/// The image does not run, or what the scene asks for cannot be simulated.
pub fn simulate(image: &Path, scene: &Scene, watch: &mut dyn Watch) -> Result<Summary, Error> {
    let begun = Instant::now();
    let params = controller::params(scene);
    let config = Config::new(&params).map_err(SimError::Controller)?;
    let tare_ns = u64::from(TARE_FRAMES + 2) * u64::from(config.timing.frame_ns());
    let start_ns = (BOOT_NS + tare_ns + SET_UP_NS).next_multiple_of(MS);
    let moves_from_s = -(MS as f64) * 1e-9;
    let record = Record { params, baud_code: BAUD_CODE, return_delay_2us: 0, ..Record::DEFAULT };
    let options =
        Options { presets: vec![(flash::SECTOR.start, store::encode(&record).to_vec())], ..Options::default() };
    let mut units = Vec::new();
    for finger in Finger::all(scene, Clock::new(start_ns), moves_from_s)? {
        let mut rig = Rig::new(image, finger, &options)?;
        set_up(&mut rig, scene, start_ns)?;
        units.push((rig, Host::new(scene, units.len(), start_ns)));
    }
    watch.begin(&vec![Controller { params, calibration: None }; units.len()]);
    let mut now_ns = start_ns - MS;
    while units[0].1.time_s(now_ns) < scene.duration_s {
        // As on the native board, all boards have the first one's clock.
        let second_s = units[0].1.second_s(now_ns);
        for (rig, host) in &mut units {
            host.send(rig, second_s, watch)?;
        }
        now_ns += MS;
        units.iter_mut().try_for_each(|(rig, _)| rig.set_out(now_ns))?;
        units.iter_mut().try_for_each(|(rig, _)| rig.await_reached())?;
        for (rig, host) in &mut units {
            host.receive(rig, watch)?;
        }
    }
    let (mut costs, mut digests) = (Vec::new(), Vec::new());
    for (rig, host) in &mut units {
        rig.check_gaps()?;
        costs.extend(rig.finger(|finger| finger.costs())?);
        costs.extend(host.costs());
        digests.push(rig.trace_hash()?);
    }
    Ok(Summary {
        virtual_s: scene.duration_s,
        wall_s: begun.elapsed().as_secs_f64(),
        ledger: sim::ledger::by_effect(scene, &costs),
        digest: digests.join(" "),
    })
}

/// Tares and enables torque before the scene begins.
fn set_up(rig: &mut Rig, scene: &Scene, start_ns: u64) -> Result<(), Error> {
    rig.run_until_ns(BOOT_NS)?;
    if let Some(reset) = rig.resets()?.first() {
        let why = format!("the board does not start: it resets, by {}", reset.cause);
        return Err(Error::Host { at_ms: reset.at_ns as f64 * 1e-6, why });
    }
    write_u8(rig, "tare", address::TARE, 1)?;
    rig.run_until_ns(start_ns - 3 * MS)?;
    let watchdog_ms = scene.table("host").whole("watchdog_ms");
    if watchdog_ms > 0 {
        let code = (watchdog_ms + WATCHDOG_MS - 1) / WATCHDOG_MS;
        write_u8(rig, "bus watchdog", address::BUS_WATCHDOG, code.min(127) as u8)?;
    }
    write_u8(rig, "torque enable", address::TORQUE_ENABLE, 1)?;
    // Goals are not answered, so that the line is free for reads.
    write_u8(rig, "status return level", address::STATUS_RETURN_LEVEL, 1)?;
    rig.run_until_ns(start_ns - MS)?;
    if rig.now_ns() > start_ns - MS {
        return Err(Error::Host {
            at_ms: rig.now_ns() as f64 * 1e-6,
            why: "setting the board up took too long".into(),
        });
    }
    Ok(())
}

fn write_u8(rig: &mut Rig, doing: &str, register: u16, value: u8) -> Result<(), Error> {
    let at_ms = rig.now_ns() as f64 * 1e-6;
    let written = rig.client(WAIT_NS, move |line| line.write_u8(bus::ID, register, value).map(drop))?;
    written.map_err(|why| Error::Host { at_ms, why: format!("{doing}: {why}") })
}
