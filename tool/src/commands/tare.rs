//! `fingertip tare`.

use super::{TOUCHED, no_fault, say, say_json, wait_for};
use crate::{Client, Error, numbers, table};
use fingertip::shipped::address;
use fingertip::state::Limits;
use serde_json::json;
use std::time::Duration;

/// Of `TARE_STATE`.
const RUNNING: i64 = 1;
const DONE: i64 = 2;

/// How to tare.
#[derive(Debug, clap::Args)]
#[command(after_help = "Examples:\n  fingertip tare")]
pub struct Args {
    /// How long it may take; a real controller needs 20 ms
    #[arg(long, default_value_t = 5.0, value_parser = numbers::seconds)]
    within_s: f64,
}

/// Tares, and tells what came of it.
///
/// # Errors
/// Torque is on, a fault stands, or something touched.
pub fn run(args: &Args, client: &mut Client, json: bool) -> Result<(), Error> {
    no_fault(client)?;
    if client.number(address::TORQUE_ENABLE)? != 0 {
        return Err("torque is on: the tip may be pressing on something. Turn it off first: `fingertip stop`".into());
    }
    client.set(address::TARE, 1)?;
    let within = Duration::from_secs_f64(args.within_s);
    let state = wait_for(client, address::TARE_STATE, within, |state| state != RUNNING)?;
    match state {
        DONE => {}
        RUNNING => {
            return Err(format!("the tare is still running after {} s: do frames come in?", args.within_s).into());
        }
        _ => return Err(format!("the tare came to nothing: {}", table::meaning(address::TARE_STATE, state)).into()),
    }
    let limits = client.number(address::LIMITS)? as u16;
    let touched = Limits(limits).has(Limits::TARED_TOUCHING);
    let codes = client.block(address::TARE_CODES, address::TARE_CODES)?.numbers(address::TARE_CODES);
    let (least, most) = (codes.iter().min().copied().unwrap_or(0), codes.iter().max().copied().unwrap_or(0));
    if json {
        say_json(
            &json!({ "id": client.id, "tared": true, "touched": touched, "least_codes": least, "most_codes": most }),
        );
    } else {
        say(format_args!("tared: zeros of {least} to {most} codes"));
    }
    if touched {
        return Err(TOUCHED.into());
    }
    Ok(())
}
