//! Looks at control's reports now and then: the LED, and the log of what changed.

use defmt::{info, warn};
use embassy_stm32::gpio::Output;
use embassy_time::Timer;
use fingertip::state::Mode;

use super::exchange::{HEARD, REPORT};
use super::{health, stack};

const PERIOD_MS: u64 = 20;
/// 5 Hz.
const BLINK_PERIODS: u32 = 5;

/// On with torque, fast blink on fault, off otherwise.
#[embassy_executor::task]
pub async fn run(mut led: Output<'static>) {
    let mut last = (Mode::Off, None);
    let mut missed_frames = 0;
    let mut paint = stack::Paint::default();
    for period in 0u32.. {
        let status = REPORT.get().status;
        if (status.mode, status.fault) != last {
            last = (status.mode, status.fault);
            match status.fault {
                Some(fault) => warn!("fault {=u8}", fault as u8),
                None => info!("mode {=u8}", status.mode as u8),
            }
        }
        if status.missed_frames != missed_frames {
            missed_frames = status.missed_frames;
            warn!("{=u32} frames missed", missed_frames);
        }
        if let Some(bytes) = paint.look() {
            health::set_stack_bytes(bytes);
        }
        let blink = (period / BLINK_PERIODS).is_multiple_of(2);
        let on = if status.mode == Mode::Fault { blink } else { HEARD.get().command.torque };
        led.set_level(on.into());
        Timer::after_millis(PERIOD_MS).await;
    }
}
