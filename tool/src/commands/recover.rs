//! `fingertip recover`.

use super::{say, say_json, wait_for};
use crate::{Client, Error, table};
use fingertip::shipped::address;
use serde_json::json;
use std::time::Duration;

/// The controller takes a frame or two.
const WITHIN: Duration = Duration::from_secs(2);
/// Error number of a status packet if something prevents the request.
const RESULT: u8 = 1;

/// Clears what stopped the motor: one register does it.
pub fn run(client: &mut Client, json: bool) -> Result<(), Error> {
    let fault = client.number(address::FAULT)?;
    let tripped = client.number(address::BUS_WATCHDOG)? < 0;
    let words = (fault != 0).then(|| table::meaning(address::FAULT, fault));
    if let Err(why) = client.set(address::RECOVER, 1) {
        let hindrance = client.number(address::RECOVER_HINDRANCE)?;
        if why.refused_with(RESULT) && hindrance != 0 {
            let hindrance = table::meaning(address::RECOVER_HINDRANCE, hindrance);
            return Err(format!("fault {fault} ({}) cannot be cleared: {hindrance}", words.unwrap_or_default()).into());
        }
        return Err(why);
    }
    let left = wait_for(client, address::FAULT, WITHIN, |fault| fault == 0)?;
    if left != 0 {
        let words = table::meaning(address::FAULT, left);
        return Err(format!("fault {left} ({words}) is back: what causes it is still there").into());
    }
    let untared = client.number(address::LIMITS)? as u16 & fingertip::state::Limits::NOT_TARED != 0;
    let on = client.number(address::TORQUE_ENABLE)? != 0;
    if json {
        say_json(&json!({
            "id": client.id, "fault": fault, "fault_name": words, "watchdog_tripped": tripped, "tared": !untared,
            "torque": on,
        }));
        return Ok(());
    }
    match words {
        Some(words) => say(format_args!("fault {fault} ({words}) is cleared; torque is off, the goal is 0")),
        None if tripped => say("the bus watchdog had tripped: it is reset, torque is off, the goal is 0"),
        None if on => {
            say("there was nothing to recover from; torque is on, and stays so: `fingertip stop` turns it off");
            return Ok(());
        }
        None => say("there was nothing to recover from; torque is off, the goal is 0"),
    }
    say(if untared {
        "next: `fingertip tare`, with nothing at the tip"
    } else {
        "next: `fingertip press`, or torque_enable"
    });
    Ok(())
}
