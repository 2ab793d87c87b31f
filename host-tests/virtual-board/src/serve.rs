//! The emulated board as a finger that is served: no faster than real time, and often slower.

use crate::client::{ID, packet};
use crate::{Error, Rig};
use fingertip::link::packet::{BROADCAST, instruction};
use fingertip::params::Params;
use fingertip::shipped::address;
use serve::Finger;

/// Time after which the image has started, ms.
const BOOT_MS: u64 = 20;
/// Time after which a tare has ended, ms.
const TARE_MS: u64 = 300;
/// Time with torque on and a goal of 0, ms.
const TORQUE_MS: u64 = 20;

/// Executes all requests of clients once on a board that has just started: the emulator compiles new code for up to 200 ms,
/// longer than clients wait. Ends with a reboot.
pub fn warm(rig: &mut Rig) -> Result<(), Error> {
    rig.run_ms(BOOT_MS)?;
    rig.request(instruction::PING, &[])?;
    rig.read(address::PRESENT_MODE, address::LOOP_TIME_US + 2 - address::PRESENT_MODE)?;
    rig.read(address::PRESSURES, 200)?;
    let [low, high] = address::PRESENT_FORCE_MN.to_le_bytes();
    rig.transact(&packet(BROADCAST, instruction::SYNC_READ, &[low, high, 4, 0, ID]))?.ok_or(Error::Silent)?;
    let [low, high] = address::STATUS_RETURN_LEVEL.to_le_bytes();
    rig.request(instruction::REG_WRITE, &[low, high, 2])?;
    rig.request(instruction::ACTION, &[])?;
    // The first parameter keeps its default.
    rig.write(address::PARAMS, &Params::DEFAULT.tip_radius_um.to_le_bytes())?;
    // Refused, as it is not tared: that takes its way too.
    let _ = rig.write(address::MEASURE, &[3]);
    rig.write(address::TARE, &[1])?;
    rig.run_ms(TARE_MS)?;
    rig.write(address::TORQUE_ENABLE, &[1])?;
    rig.write(address::GOAL_FORCE_MN, &[0; 4])?;
    rig.run_ms(TORQUE_MS)?;
    rig.write(address::TORQUE_ENABLE, &[0])?;
    rig.write(address::CLEAR_FAULT, &[1])?;
    rig.request(instruction::REBOOT, &[])?;
    rig.run_ms(BOOT_MS)?;
    rig.request(instruction::PING, &[])?;
    Ok(())
}

impl Finger for Rig {
    type Error = Error;

    fn now_s(&self) -> f64 {
        self.now_ns() as f64 * 1e-9
    }

    fn run_until(&mut self, time_s: f64) -> Result<(), Error> {
        self.run_until_ns((time_s * 1e9) as u64)
    }

    fn hear(&mut self, bytes: &[u8]) -> Result<(), Error> {
        self.send(bytes)
    }

    fn answer(&mut self) -> Result<Vec<u8>, Error> {
        Ok(self.take_received()?.iter().map(|timed| timed.byte).collect())
    }
}
