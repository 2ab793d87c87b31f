//! Looks at control's reports now and then: the LED, and the log of what changed.

use defmt::{info, warn};
use embassy_stm32::gpio::Output;
use embassy_time::Timer;
use fingertip::state::Mode;

use super::exchange::{HEARD, STANDING, Standing};
use super::{health, stack};

const PERIOD_MS: u64 = 20;
/// 5 Hz.
const BLINK_PERIODS: u32 = 5;

/// On with torque, fast blink on fault, off otherwise.
#[embassy_executor::task]
pub async fn run(mut led: Output<'static>) {
    let mut last = Standing::default();
    let mut paint = stack::Paint::default();
    for period in 0u32.. {
        let now = STANDING.get();
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
