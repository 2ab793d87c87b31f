//! The emulated board as a finger that is served: no faster than real time, and often slower.

use crate::client::Client;
use crate::{Error, Rig};
use fingertip::params::Params;
use fingertip::shipped::address;
use serve::Finger;
use std::fmt::Display;

/// Time after which the image has started, ms.
const BOOT_MS: u64 = 20;
/// ID of the board on the bus, and longest time of an answer, ns.
const ID: u8 = 1;
const WAIT_NS: u64 = 20_000_000;
/// Time after which a tare has ended, ms.
const TARE_MS: u64 = 300;
/// Time with torque on and a goal of 0, ms.
const TORQUE_MS: u64 = 20;

pub struct Board(Rig);

impl Board {
    /// Starts a board and executes all requests of clients once: the emulator compiles new code for up to 200 ms,
    /// longer than clients wait. Ends with a reboot.
    pub fn warm(mut rig: Rig) -> Result<Self, Error> {
        rig.run_ms(BOOT_MS)?;
        asked(&mut rig, |bus| {
            bus.ping(ID)?;
            bus.read(ID, address::PRESENT_MODE, address::LOOP_TIME_US + 2 - address::PRESENT_MODE)?;
            bus.read(ID, address::PRESSURES, 200)?;
            bus.sync_read_u32(&[ID], address::PRESENT_FORCE_MN)?;
            bus.reg_write_u8(ID, address::STATUS_RETURN_LEVEL, 2)?;
            bus.action(ID)?;
            // The first parameter keeps its default.
            bus.write_u32(ID, address::PARAMS, Params::DEFAULT.tip_radius_um as u32)?;
            // Refused, as it is not tared: that takes its way too.
            let _ = bus.write_u8(ID, address::MEASURE, 3);
            bus.write_u8(ID, address::TARE, 1).map(drop)
        })?;
        rig.run_ms(TARE_MS)?;
        asked(&mut rig, |bus| {
            bus.write_u8(ID, address::TORQUE_ENABLE, 1)?;
            bus.write_u32(ID, address::GOAL_FORCE_MN, 0).map(drop)
        })?;
        rig.run_ms(TORQUE_MS)?;
        asked(&mut rig, |bus| {
            bus.write_u8(ID, address::TORQUE_ENABLE, 0)?;
            bus.write_u8(ID, address::CLEAR_FAULT, 1)?;
            bus.reboot(ID).map(drop)
        })?;
        rig.run_ms(BOOT_MS)?;
        asked(&mut rig, |bus| bus.ping(ID).map(drop))?;
        Ok(Self(rig))
    }
}

/// Has a client ask the board, which must answer.
fn asked<E: Display + Send>(rig: &mut Rig, job: fn(&mut Client) -> Result<(), E>) -> Result<(), Error> {
    rig.client(WAIT_NS, job)?.map_err(|why| std::io::Error::other(format!("the board does not answer: {why}")).into())
}

impl Finger for Board {
    type Error = Error;

    fn now_s(&self) -> f64 {
        self.0.now_ns() as f64 * 1e-9
    }

    fn run_until(&mut self, time_s: f64) -> Result<(), Error> {
        self.0.run_until_ns((time_s * 1e9) as u64)
    }

    fn hear(&mut self, bytes: &[u8]) -> Result<(), Error> {
        self.0.send(bytes)
    }

    fn answer(&mut self) -> Result<Vec<u8>, Error> {
        Ok(self.0.take_received()?.iter().map(|timed| timed.byte).collect())
    }

    fn command(&mut self, _text: &str) -> Result<String, String> {
        Err("the emulated board takes no commands: `cargo xtask serve` without --board virtual does".into())
    }
}
