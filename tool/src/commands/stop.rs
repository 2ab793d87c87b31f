//! `fingertip stop`.

use super::moving::{self, REST_UM_PER_S};
use super::{say, say_json, wait_for};
use crate::client::Reach;
use crate::state::State;
use crate::{Client, Error};
use fingertip::shipped::address;
use serde_json::{Value, json};
use std::time::Duration;

/// Longest release before torque goes off, in seconds of the controller's clock.
const RELEASE_S: f64 = 0.5;
/// Longest wait for a tip that rolls out behind the shorted motor.
const ROLL_OUT: Duration = Duration::from_secs(2);
/// A tip that still presses with more force gets a hint.
const RESIDUAL_MN: i64 = 50;

/// Options of a stop.
#[derive(Debug, clap::Args)]
#[command(after_help = "Examples:\n  \
    fingertip stop\n  \
    fingertip --id 2,3 stop\n  \
    fingertip stop --all    (torque off for every device on the bus, in one packet and without a release)")]
pub struct Args {
    /// Stop all devices on the bus by the broadcast ID, servos included
    #[arg(long)]
    all: bool,
}

/// Turns torque off, which aborts measurements, sets the bus watchdog to 0, and reports what was found and changed.
pub fn run(args: &Args, reach: &Reach, json: bool) -> Result<(), Error> {
    if !args.all {
        return super::each(reach, false, |client| {
            let stopped = stop(client, true, json)?;
            if json {
                say_json(&stopped);
            }
            Ok(())
        });
    }
    let mut client = Client::open(reach)?;
    client.set_all(address::TORQUE_ENABLE, 0)?;
    let found = client.ping_all()?;
    if found.is_empty() {
        return Err("torque off was sent to all IDs, but nothing answers: is the baud rate right?".into());
    }
    let (mut all, mut failed) = (Vec::new(), Vec::new());
    for pong in found {
        client.id = pong.id;
        if !pong.is_fingertip() {
            super::aside(format_args!("ID {} is no fingertip: torque off was sent, not checked", pong.id));
            continue;
        }
        match stop(&mut client, false, json) {
            Ok(stopped) => all.push(stopped),
            Err(why) => failed.push(why.to_string()),
        }
    }
    if json {
        say_json(&json!(all));
    }
    if failed.is_empty() { Ok(()) } else { Err(failed.join("; ").into()) }
}

/// Stops one finger. A grip is released first, so that friction keeps no force at the tip; whatever comes of that, torque
/// goes off.
fn stop(client: &mut Client, releases: bool, json: bool) -> Result<Value, Error> {
    let before = client
        .again(State::read)
        .and_then(|before| if releases { moving::release(RELEASE_S, client).map(|_| before) } else { Ok(before) });
    let halted = moving::halt(client);
    let before = before?;
    halted?;
    let watchdog = client.again(|client| client.number(address::BUS_WATCHDOG))?;
    client.again(|client| client.set(address::BUS_WATCHDOG, 0))?;
    let speed = wait_for(client, address::SPEED_UM_PER_S, ROLL_OUT, |speed| speed.abs() < REST_UM_PER_S)?;
    let after = client.again(State::read)?;
    let id = client.id;
    if !json {
        let was = |state: &State| format!("mode {}, {} mN", state.mode_name(), state.force_mn);
        say(format_args!("ID {id}: {} -> {}", was(&before), was(&after)));
        let shown = match watchdog {
            0 => "off".into(),
            ..0 => "tripped".into(),
            steps => format!("{} ms", 20 * steps),
        };
        say(format_args!("torque is off, measurements are aborted, the bus watchdog is off (it was {shown})"));
        if let Some(fault) = after.fault_name() {
            say(format_args!("fault {} ({fault}) remains: `fingertip recover` clears it", after.fault));
        }
        if after.force_mn > RESIDUAL_MN {
            say("the tip still presses: friction holds it. A short `fingertip press 0.1` takes it off the object");
        }
    }
    if speed.abs() >= REST_UM_PER_S {
        return Err(format!("ID {id}: torque is off, but the tip still moves at {speed} um/s").into());
    }
    Ok(json!({
        "id": id, "mode_before": before.mode_name(), "force_before_mn": before.force_mn, "mode": after.mode_name(),
        "force_mn": after.force_mn, "fault": after.fault, "fault_name": after.fault_name(),
        "watchdog_before": watchdog, "at_rest": true,
    }))
}
