//! `fingertip commission`.

use super::moving::Moving;
use super::{Interrupt, no_fault, say, say_json, wait_for};
use crate::state::ANEW;
use crate::{Client, Error, numbers, table};
use fingertip::params::Params;
use fingertip::shipped::address;
use serde_json::json;
use std::time::Duration;

/// Of `COMMISSION`.
const STOP: i64 = 0;
const JOG: i64 = 1;
const MEASURE: i64 = 2;
/// Of `COMMISSION_STATE`.
const RUNNING: i64 = 1;
const JOGGED: i64 = 2;
const MEASURED: i64 = 3;
const REFUSED: i64 = 4;
/// Why nothing else goes while the tip moves, whoever asked for it.
const UNDER_WAY: &str =
    "the tip is moving for a jog or a measurement: wait until it ends, or `fingertip commission stop`";
/// Longest wait until a motion that was stopped has come to rest.
const STOPS_WITHIN: Duration = Duration::from_secs(10);
/// Of `COMMISSION_ACCEPT`.
const DIRECTION: i64 = 1;
const DRIVE: i64 = 2;

/// What to do; docs/commissioning.md has the order.
#[derive(Debug, clap::Subcommand)]
#[command(after_help = "Examples:\n  \
    fingertip tare\n  \
    fingertip commission jog             (watch: the tip must first go towards the object)\n  \
    fingertip commission confirm         (it did: torque may be enabled from now on)\n  \
    fingertip commission measure\n  \
    fingertip commission accept\n  \
    fingertip params save\n  \
    fingertip commission stop            (ends a jog or a measurement that another host began)")]
pub enum Command {
    /// Move the tip a little, at 5 % of duty and for 100 ms at most, towards the object first: proves the direction
    Jog(Within),
    /// Say that the jog first moved the tip towards the object; torque is refused before
    Confirm,
    /// Measure torque constant, time constant, inertia and friction, by motions of 1 mm to both sides in the air
    Measure(Within),
    /// Take what was measured into the parameters
    Accept,
    /// Stop what is under way
    Stop,
}

/// How long it may take.
#[derive(Debug, clap::Args)]
pub struct Within {
    /// How long to wait for the end; a real controller needs 10 s
    #[arg(long, default_value_t = 600.0, value_parser = numbers::seconds)]
    within_s: f64,
}

/// Does it, and tells what came of it.
///
/// # Errors
/// The controller refuses, with its reason.
pub fn run(command: &Command, client: &mut Client, json: bool) -> Result<(), Error> {
    match command {
        Command::Jog(within) => {
            carry_out(JOG, JOGGED, within, client)?;
            if json {
                say_json(&json!({ "direction_proven": true }));
            } else {
                say("motor and encoder go the same way");
                say("did the tip first go towards the object? yes: `fingertip commission confirm`");
                say("no: swap the motor's leads and the encoder's channels, both, and jog again");
            }
            Ok(())
        }
        Command::Measure(within) => {
            carry_out(MEASURE, MEASURED, within, client)?;
            tell(client, json)
        }
        Command::Confirm => accept(DIRECTION, "the direction is confirmed", "there is no jog to confirm", client, json),
        Command::Accept => accept(DRIVE, "the parameters are set", "there is no measurement to accept", client, json),
        Command::Stop => stop(client, json),
    }
}

fn carry_out(task: i64, done: i64, within: &Within, client: &mut Client) -> Result<(), Error> {
    free(client)?;
    let interrupt = Interrupt::catch()?;
    let moving = Moving::begin(client, &interrupt)?;
    let state = strokes(task, within, moving.client, &interrupt);
    let state = moving.finish(state)?;
    interrupt.check()?;
    if state == RUNNING {
        return Err("stopped before its end; the parameters are as they were".into());
    }
    if state == REFUSED {
        let refusal = client.number(address::COMMISSION_REFUSAL)?;
        no_fault(client)?;
        return Err(format!("refused: {}", reason(refusal)).into());
    }
    // Only what came to its end counts: a controller that started anew knows of no task.
    if state == done { Ok(()) } else { Err(format!("it came to no end: {ANEW}, or its parameters were set").into()) }
}

/// Begins a task and waits for its end, for a signal, or until the time is over: the last state.
fn strokes(task: i64, within: &Within, client: &mut Client, interrupt: &Interrupt) -> Result<i64, Error> {
    client.set(address::COMMISSION, task).map_err(|why| {
        Error::from(format!("{why}: tare first (`fingertip tare`), with torque off and nothing at the tip"))
    })?;
    let ended = |state| state != RUNNING || interrupt.came();
    wait_for(client, address::COMMISSION_STATE, Duration::from_secs_f64(within.within_s), ended)
}

/// Stops a jog or a measurement, and nothing else.
fn stop(client: &mut Client, json: bool) -> Result<(), Error> {
    let runs = client.number(address::COMMISSION_STATE)? == RUNNING;
    client.set(address::COMMISSION, STOP)?;
    if runs && wait_for(client, address::COMMISSION_STATE, STOPS_WITHIN, |state| state != RUNNING)? == RUNNING {
        return Err("the tip does not come to rest: `fingertip stop` turns torque off".into());
    }
    let mode = client.number(address::PRESENT_MODE)?;
    if client.number(address::TORQUE_ENABLE)? != 0 {
        let mode = table::meaning(address::PRESENT_MODE, mode);
        return Err(format!(
            "no jog and no measurement of the drive was under way, so nothing was stopped; torque is on, mode {mode}: \
             `fingertip stop` stops the finger"
        )
        .into());
    }
    if json {
        say_json(&json!({ "stopped": runs }));
    } else if runs {
        say("the motion is stopped; the parameters are as they were");
    } else {
        say("no jog and no measurement of the drive was under way; torque is off (`fingertip stop` stops all else)");
    }
    Ok(())
}

/// Fails where the motor is stopped, or the tip is moving already.
fn free(client: &mut Client) -> Result<(), Error> {
    no_fault(client)?;
    if client.number(address::COMMISSION_STATE)? == RUNNING { Err(UNDER_WAY.into()) } else { Ok(()) }
}

/// What the refusal's number means, and what to do.
fn reason(refusal: i64) -> String {
    use fingertip::commission::Refusal::{
        Astray, Blocked, HeldBack, Interrupted, NotReady, Range, Restless, Reversed, Still, Touched, Unconfirmed,
        Unsteady,
    };
    let all = [
        Interrupted,
        NotReady,
        Unconfirmed,
        Still,
        Reversed,
        Astray,
        Touched,
        Blocked,
        HeldBack,
        Restless,
        Unsteady,
        Range,
    ];
    let found = all.into_iter().find(|known| *known as i64 == refusal);
    found.map_or_else(|| table::meaning(address::COMMISSION_REFUSAL, refusal), |known| known.to_string())
}

/// What was measured beside what the parameters hold.
fn tell(client: &mut Client, json: bool) -> Result<(), Error> {
    let rows = [
        ("torque_constant_unm_per_a", address::MEASURED_TORQUE_CONSTANT, address::TORQUE_CONSTANT_SIGMA),
        ("time_constant_us", address::MEASURED_TIME_CONSTANT, address::TIME_CONSTANT_SIGMA),
        ("inertia_ug_m2", address::MEASURED_INERTIA, address::INERTIA_SIGMA),
        ("friction_forward_unm", address::MEASURED_FRICTION_FORWARD, address::FRICTION_FORWARD_SIGMA),
        ("friction_back_unm", address::MEASURED_FRICTION_BACK, address::FRICTION_BACK_SIGMA),
    ];
    let mut all = serde_json::Map::new();
    for (name, register, sigma) in rows {
        let (value, sigma) = (client.number(register)?, client.number(sigma)? as f64 * 0.1);
        let place = Params::RANGES.iter().position(|(known, ..)| *known == name);
        let now = place.map(|place| client.number(address::PARAMS + 4 * place as u16)).transpose()?;
        if json {
            all.insert(name.into(), json!({ "value": value, "sigma_percent": sigma, "now": now }));
        } else {
            let now = now.map_or(String::new(), |now| format!(", the parameter is {now}"));
            say(format_args!("{name:26} {value:>7} +- {sigma:.1} %{now}"));
        }
    }
    if json {
        say_json(&all.into());
        return Ok(());
    }
    say("inertia and friction hold where resistance_mohm does: nothing on the board tells the current, so resistance \
         cannot be");
    say("measured here, nor the gear's play: docs/commissioning.md says why. Next: `fingertip commission accept`");
    Ok(())
}

fn accept(what: i64, done: &str, nothing: &str, client: &mut Client, json: bool) -> Result<(), Error> {
    free(client)?;
    client.set(address::COMMISSION_ACCEPT, what).map_err(|why| Error::from(format!("{nothing}: {why}")))?;
    if json {
        say_json(&json!({ "accepted": what, "done": done }));
    } else {
        say(format_args!("{done} until the next reset; `fingertip params save` keeps it"));
    }
    Ok(())
}
