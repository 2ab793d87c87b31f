//! `fingertip tare`.

use super::{TOUCHED, no_fault_nor_motion, say, say_json, wait_for};
use crate::{Client, Error, numbers, table};
use fingertip::shipped::address;
use fingertip::state::Limits;
use serde_json::json;
use std::time::Duration;

/// Values of `TARE_STATE`.
const RUNNING: i64 = 1;
const DONE: i64 = 2;

/// Options of the tare.
#[derive(Debug, clap::Args)]
#[command(after_help = "Examples:\n  fingertip tare")]
pub struct Args {
    /// Longest time that it may take; a real controller needs 20 ms
    #[arg(long, default_value_t = 5.0, value_parser = numbers::seconds)]
    within_s: f64,
}

/// Tares, and reports the result.
pub fn run(args: &Args, client: &mut Client, json: bool) -> Result<(), Error> {
    no_fault_nor_motion(client)?;
    if client.number(address::TORQUE_ENABLE)? != 0 {
        return Err("torque is on: the tip may be pressing on something. Turn it off first: `fingertip stop`".into());
    }
    let Tared { touched, least, most } = measure(Duration::from_secs_f64(args.within_s), client)?;
    if json {
        let id = client.id;
        say_json(&json!({ "id": id, "tared": true, "touched": touched, "least_codes": least, "most_codes": most }));
    } else {
        say(format_args!("tared: zeros of {least} to {most} codes"));
    }
    if touched { Err(TOUCHED.into()) } else { Ok(()) }
}

/// Result of a tare.
pub(super) struct Tared {
    /// Something seemed to touch the tip meanwhile.
    pub touched: bool,
    /// Lowest and highest zero, codes.
    least: i64,
    most: i64,
}

/// Measures the zeros, with torque off.
pub(super) fn measure(within: Duration, client: &mut Client) -> Result<Tared, Error> {
    client.set(address::TARE, 1)?;
    let state = wait_for(client, address::TARE_STATE, within, |state| state != RUNNING)?;
    match state {
        DONE => {}
        RUNNING => {
            let within_s = within.as_secs_f64();
            return Err(format!("the tare is still running after {within_s} s: do frames come in?").into());
        }
        _ => return Err(format!("the tare came to nothing: {}", table::meaning(address::TARE_STATE, state)).into()),
    }
    let touched = Limits(client.number(address::LIMITS)? as u16).has(Limits::TARED_TOUCHING);
    let codes = client.block(address::TARE_CODES, address::TARE_CODES)?.numbers(address::TARE_CODES);
    let (least, most) = (codes.iter().min().copied().unwrap_or(0), codes.iter().max().copied().unwrap_or(0));
    Ok(Tared { touched, least, most })
}
