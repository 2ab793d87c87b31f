//! The log and the LED. Modes, faults and causes are logged by their stable numbers, which takes less flash than text.

use defmt::{error, info, warn};
use embassy_stm32::gpio::Output;
use embassy_time::Timer;
use fingertip::config::ConfigError;
use fingertip::params::ParamError;
use fingertip::state::{Fault, Mode};
use fingertip::store::Remark;

use super::crash::Boot;
use super::exchange::{HEARD, LOOP_STATE, LoopState};
use super::flash::SaveError;
use super::{health, stack};

/// Logs the reason of this start.
pub fn log_boot(boot: Boot) {
    info!("fingertip {=str}, reset cause {=u8}", env!("CARGO_PKG_VERSION"), boot.reset as u8);
    let crash = boot.crash;
    if boot.crashed {
        warn!("the last run crashed: cause {=u8}, line {=u16}, pc {=u32:#x}", crash.cause as u8, crash.line, crash.pc);
    }
}

/// Logs why the board must not drive a motor.
pub fn log_unfit(fault: Fault) {
    match fault {
        Fault::NoClock => error!("no 8 MHz clock at PH0: internal oscillator, no torque until the next start"),
        Fault::BrownOutLevel => error!("brown-out reset is not at level 3, no torque: run `cargo xtask flash`"),
        _ => error!("no torque until the next start: fault {=u8}", fault as u8),
    }
}

/// Logs a remark about the stored parameters.
pub fn log_remark(remark: Remark) {
    match remark {
        Remark::NoneWhole => error!("stored parameters: no whole record, defaults"),
        Remark::Torn => {
            error!("stored parameters: the newest record was cut short or damaged, the one before it counts")
        }
        Remark::Refused(cause) => log_parameter(cause),
        Remark::Unknown { number, value } => warn!("stored parameter {=u32:#x} = {=i32} is unknown", number, value),
        Remark::New(name) => info!("{=str} is new: its default", name),
    }
}

/// Logs why parameters were not saved, or no room made for them.
pub fn log_save_error(error: SaveError) {
    match error {
        SaveError::Full => error!("parameter sectors full until the next start"),
        SaveError::Flash(cause) => error!("parameter sector: {}", cause),
        SaveError::Verify => error!("parameter sector reads back something else"),
    }
}

/// Logs why parameters make no configuration.
pub fn log_refusal(error: ConfigError) {
    match error {
        ConfigError::Param(cause) => log_parameter(cause),
        _ => {
            let [first, second] = error.parameters();
            error!("{=str} and {=str} do not go together: set back to their defaults", first, second);
        }
    }
}

fn log_parameter(error: ParamError) {
    error!("{=str} = {=i32}, allowed {=i32} to {=i32}", error.name, error.value, error.min, error.max);
}

const PERIOD_MS: u64 = 20;
/// 5 Hz.
const BLINK_PERIODS: u32 = 5;

/// Drives the LED: on with torque, fast blink in a fault, off otherwise.
#[embassy_executor::task]
pub async fn run(mut led: Output<'static>) {
    let mut last = LoopState::default();
    let mut paint = stack::Paint::default();
    for period in 0u32.. {
        let now = LOOP_STATE.get();
        if (now.mode, now.fault) != (last.mode, last.fault) {
            match now.fault {
                Some(fault) => warn!("fault {=u8}", fault as u8),
                None => info!("mode {=u8}", now.mode as u8),
            }
        }
        if now.missed_frames != last.missed_frames {
            warn!("{=u32} frames missed", now.missed_frames);
        }
        last = now;
        if let Some(bytes) = paint.look() {
            health::set_stack_bytes(bytes);
        }
        let blink = (period / BLINK_PERIODS).is_multiple_of(2);
        let on = if now.mode == Mode::Fault { blink } else { HEARD.get().command.torque };
        led.set_level(on.into());
        Timer::after_millis(PERIOD_MS).await;
    }
}
