//! `fingertip latency`.

use super::{Interrupt, say, say_json};
use crate::{Client, Error, numbers};
use fingertip::shipped::address;
use serde_json::json;
use std::time::{Duration, Instant};

/// The state, as DYNAMIXEL drivers read it: 54 bytes.
const FIRST: u16 = address::PRESENT_MODE;
const LENGTH: u16 = 54;

/// Options of the measurement.
#[derive(Debug, clap::Args)]
#[command(after_help = "Examples:\n  fingertip latency --seconds 10")]
pub struct Args {
    /// Duration of the measurement
    #[arg(long, default_value_t = 5.0, value_parser = numbers::seconds)]
    seconds: f64,
}

/// Reads 54 bytes repeatedly without a pause, and reports the times of the answers.
pub fn run(args: &Args, client: &mut Client, json: bool) -> Result<(), Error> {
    let interrupt = Interrupt::catch()?;
    let delay_us = 2 * client.number(address::RETURN_DELAY_TIME)?;
    let (begun, mut took, mut unanswered) = (Instant::now(), Vec::new(), 0);
    while begun.elapsed().as_secs_f64() < args.seconds && !interrupt.came() {
        let asked = Instant::now();
        match client.read(FIRST, LENGTH) {
            Ok(_) => took.push(asked.elapsed()),
            Err(Error::Silent(_) | Error::Damaged(_)) => unanswered += 1,
            Err(why) => return Err(why),
        }
    }
    let per_s = took.len() as f64 / begun.elapsed().as_secs_f64();
    took.sort_unstable();
    let at = |percent: usize| took.get(took.len() * percent / 100).copied().unwrap_or_default();
    let ms = |time: Duration| time.as_secs_f64() * 1e3;
    let (median_ms, most_ms, longest_ms) = (ms(at(50)), ms(at(99)), ms(took.last().copied().unwrap_or_default()));
    if json {
        say_json(&json!({
            "reads": took.len(), "unanswered": unanswered, "reads_per_s": per_s, "return_delay_us": delay_us,
            "median_ms": median_ms, "percentile_99_ms": most_ms, "longest_ms": longest_ms,
        }));
    } else {
        say(format_args!(
            "{} reads of {LENGTH} bytes, {per_s:.0} a second; an answer takes {median_ms:.2} ms in the middle, \
             {most_ms:.2} ms at 99 %, {longest_ms:.2} ms at most ({delay_us} us of it return delay); \
             {unanswered} unanswered",
            took.len()
        ));
    }
    Ok(())
}
