//! What is logged in more than one word, without the text formatting that it would cost the flash.
//!
//! Modes, faults and causes are logged by their stable numbers.

use defmt::{error, info, warn};
use fingertip::config::ConfigError;
use fingertip::params::ParamError;
use fingertip::scan::ScanError;
use fingertip::store::{Damage, StoreError};

use super::crash::Boot;

/// Why this run began.
pub fn log_boot(boot: Boot) {
    info!("fingertip {=str}, reset cause {=u8}", env!("CARGO_PKG_VERSION"), boot.reset as u8);
    let crash = boot.crash;
    if boot.crashed {
        warn!("the last run crashed: cause {=u8}, line {=u16}, pc {=u32:#x}", crash.cause as u8, crash.line, crash.pc);
    }
}

/// Why the newest stored record was not taken.
pub fn log_damage(error: StoreError) {
    error!("stored parameters: the record at {=usize:#x} is damaged", error.offset);
    match error.damage {
        Damage::Unreadable => error!("cut short, damaged, or written by another firmware"),
        Damage::Head => error!("ID, baud code, return delay or effort out of range"),
        Damage::Param(cause) => log_parameter(cause),
    }
}

/// Why parameters make no configuration.
pub fn log_refusal(error: ConfigError) {
    match error {
        ConfigError::Param(cause) => log_parameter(cause),
        ConfigError::Scan(ScanError::SampleCycles { cycles, .. }) => {
            error!("no sampling time of {=u16} cycles", cycles)
        }
        ConfigError::Scan(ScanError::SlotTooLong { ticks }) => error!("a slot of {=u32} ticks, 65535 at most", ticks),
        ConfigError::Scan(ScanError::FrameTooLong { ticks, .. }) => {
            error!("a frame of {=u32} ticks is too long", ticks)
        }
        ConfigError::Order([(low, low_value), (high, high_value)]) => {
            error!("{=str} of {=i32} is not below {=str} of {=i32}", low, low_value, high, high_value)
        }
        _ => error!("the scan cannot be timed so"),
    }
}

fn log_parameter(error: ParamError) {
    error!("{=str} = {=i32}, allowed {=i32} to {=i32}", error.name, error.value, error.min, error.max);
}
