//! `fingertip calibrate`.

use super::moving::Moving;
use super::{Interrupt, no_fault, say, say_json, wait_for};
use crate::{Client, Error, numbers, table};
use fingertip::shipped::address;
use serde_json::json;
use std::time::Duration;

/// Of `CALIBRATE` and `SCALE`.
const PRESS: i64 = 1;
const FORGET: i64 = 2;
const ACCEPT: i64 = 3;
/// A status packet's error where something stands in the way.
const RESULT: u8 = 1;
/// Of `CALIBRATE_STATE`.
const RUNNING: i64 = 1;
const DONE: i64 = 2;
/// Of `SCALE_POINTS`: the loop has not looked yet.
const WAITS: i64 = 255;
/// Of a proposed gain.
const ONE: f64 = 16_384.0;
const UNKNOWN: i64 = 255;

/// What to do.
#[derive(Debug, clap::Subcommand)]
#[command(after_help = "Examples, with a plate under the finger; docs/commissioning.md has all of it:\n  \
        fingertip tare && fingertip calibrate press    (three times; move finger or plate between)\n  \
        fingertip calibrate show\n  \
        fingertip calibrate accept && fingertip params save\n  \
        fingertip calibrate scale 1.47          (while `fingertip press` holds the force: the scale shows 150 g)\n  \
        fingertip calibrate accept-scale && fingertip params save\n  \
        fingertip calibrate forget")]
pub enum Command {
    /// Press once onto a hard flat plate, and take it into the proposal
    Press {
        /// How long it may take
        #[arg(long, default_value_t = 30.0, value_parser = numbers::seconds)]
        within_s: f64,
    },
    /// Show the gains that the presses propose
    Show,
    /// Make the proposed gains those in force; tare then
    Accept,
    /// While another program holds a force (both through `fingertip share`), tell what a scale under the plate shows
    Scale {
        /// What it shows, N; a gram is 0.00981
        #[arg(value_name = "NEWTONS", value_parser = numbers::shown_mn)]
        shown_mn: i64,
    },
    /// Multiply forces by the factor that the scale's numbers make
    AcceptScale,
    /// Forget all presses and all numbers of a scale
    Forget,
}

/// Does it.
///
/// # Errors
/// The controller refuses: the text says why.
pub fn run(command: &Command, client: &mut Client, json: bool) -> Result<(), Error> {
    match command {
        Command::Press { within_s } => press(*within_s, client, json),
        Command::Show => show(client, json),
        Command::Accept => set(address::CALIBRATE, ACCEPT, "the proposed gains are in force; tare now", client, json),
        Command::Scale { shown_mn } => scale(*shown_mn, client, json),
        Command::AcceptScale => set(address::SCALE, ACCEPT, "forces are multiplied by the factor", client, json),
        Command::Forget => set(address::CALIBRATE, FORGET, "all presses and numbers are forgotten", client, json),
    }
}

/// Sets a register and says what that did.
fn set(register: u16, value: i64, done: &str, client: &mut Client, json: bool) -> Result<(), Error> {
    client.set(register, value).map_err(|why| match why.refused_with(RESULT) {
        true if register == address::CALIBRATE => {
            format!("{why}: is torque off, and was there a `calibrate press`?").into()
        }
        true => format!("{why}: is torque off, and was there a `calibrate scale`?").into(),
        false => why,
    })?;
    if json {
        say_json(&json!({ (table::place(register)): value, "done": done }));
    } else if value == ACCEPT {
        say(format_args!("{done}; `fingertip params save` keeps them over a reset"));
    } else {
        say(done);
    }
    Ok(())
}

fn press(within_s: f64, client: &mut Client, json: bool) -> Result<(), Error> {
    no_fault(client)?;
    let interrupt = Interrupt::catch()?;
    let moving = Moving::begin(client, &interrupt)?;
    let state = press_once(within_s, moving.client, &interrupt);
    let state = moving.finish(state)?;
    interrupt.check()?;
    no_fault(client)?;
    if state != DONE {
        let refusal = client.number(address::CALIBRATE_REFUSAL)?;
        let why = table::meaning(address::CALIBRATE_REFUSAL, refusal);
        return Err(format!("the press was not taken: {why} (docs/commissioning.md says what to do)").into());
    }
    let [presses, taxels] = [client.number(address::CALIBRATE_PRESSES)?, client.number(address::CALIBRATE_TAXELS)?];
    if json {
        say_json(&json!({ "presses": presses, "taxels": taxels }));
    } else {
        say(format_args!("{presses} presses reached {taxels} taxels"));
    }
    Ok(())
}

/// Begins a press and waits for its end, for a signal, or until the time is over: the last state.
fn press_once(within_s: f64, client: &mut Client, interrupt: &Interrupt) -> Result<i64, Error> {
    if let Err(why) = client.set(address::TORQUE_ENABLE, 1).and_then(|()| client.set(address::CALIBRATE, PRESS)) {
        return no_fault(client).and(Err(why));
    }
    let ended = |state| state != RUNNING || interrupt.came();
    wait_for(client, address::CALIBRATE_STATE, Duration::from_secs_f64(within_s), ended)
}

fn show(client: &mut Client, json: bool) -> Result<(), Error> {
    let gains = client.block(address::PROPOSED_GAINS, address::PROPOSED_GAINS)?.numbers(address::PROPOSED_GAINS);
    let sigmas = client.block(address::PROPOSED_SIGMAS, address::PROPOSED_SIGMAS)?.numbers(address::PROPOSED_SIGMAS);
    let columns = (client.number(address::MODEL_INFORMATION)? >> 8 & 0xFF).max(1) as usize;
    let taxel = |(gain, sigma): (&i64, &i64)| (*gain as f64 / ONE, (*sigma != UNKNOWN).then_some(*sigma as f64 * 1e-3));
    let taxels: Vec<(f64, Option<f64>)> = gains.iter().zip(&sigmas).map(taxel).collect();
    if json {
        let all = taxels.iter().map(|(gain, sigma)| json!({ "gain": gain, "relative_sigma": sigma }));
        say_json(&json!({ "taxels": all.collect::<Vec<_>>() }));
        return Ok(());
    }
    for row in taxels.chunks(columns) {
        let cells = row.iter().map(|(gain, sigma)| match sigma {
            Some(_) => format!("{gain:6.3}"),
            None => "     -".to_owned(),
        });
        say(cells.collect::<Vec<_>>().join(" "));
    }
    let known: Vec<f64> = taxels.iter().filter_map(|(_, sigma)| *sigma).collect();
    let worst = known.iter().copied().fold(0.0, f64::max);
    say(format_args!("{} taxels known, the worst to {:.1} %; - keeps its gain", known.len(), 100.0 * worst));
    Ok(())
}

fn scale(shown_mn: i64, client: &mut Client, json: bool) -> Result<(), Error> {
    client.set(address::SCALE_SHOWS_MN, shown_mn)?;
    let points = wait_for(client, address::SCALE_POINTS, Duration::from_secs(5), |points| points != WAITS)?;
    let refusal = client.number(address::SCALE_REFUSAL)?;
    if refusal != 0 {
        let why = table::meaning(address::SCALE_REFUSAL, refusal);
        return Err(format!("{shown_mn} mN was not taken: {why} (docs/commissioning.md says what to do)").into());
    }
    let [factor, sigma] = [
        client.number(address::SCALE_FACTOR_PPM)? as f64 * 1e-6,
        client.number(address::SCALE_SIGMA_PPM)? as f64 * 1e-6,
    ];
    if json {
        say_json(&json!({ "factor": factor, "sigma": sigma, "numbers": points }));
    } else {
        say(format_args!("forces times {factor:.4} +- {sigma:.4} by {points} numbers"));
    }
    Ok(())
}
