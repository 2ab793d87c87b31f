//! `fingertip calibrate`.

use super::{no_fault, say, say_json, wait_for};
use crate::state::State;
use crate::{Client, Error, table};
use fingertip::shipped::address;
use fingertip::state::Mode;
use serde_json::json;
use std::time::{Duration, Instant};

/// Of `CALIBRATE` and `SCALE`.
const PRESS: i64 = 1;
const FORGET: i64 = 2;
const ACCEPT: i64 = 3;
/// Of `CALIBRATE_STATE`.
const RUNNING: i64 = 1;
const DONE: i64 = 2;
/// Of `SCALE_POINTS`: the loop has not looked yet.
const WAITS: i64 = 255;
/// Of a proposed gain.
const ONE: f64 = 16_384.0;
const UNKNOWN: i64 = 255;
const LOOK: Duration = Duration::from_millis(10);

/// What to do.
#[derive(Debug, clap::Subcommand)]
#[command(after_help = "Example, with a plate under the finger; docs/commissioning.md has all of it:\n  \
        fingertip tare && fingertip calibrate press    (three times; move finger or plate between)\n  \
        fingertip calibrate accept && fingertip params save")]
pub enum Command {
    /// Press once onto a hard flat plate, and take it into the proposal
    Press {
        /// How long it may take
        #[arg(long, default_value_t = 30.0)]
        within_s: f64,
    },
    /// Show the gains that the presses propose
    Show,
    /// Make the proposed gains those in force; tare then
    Accept,
    /// Hold a force in another terminal, and tell what a scale under the plate shows
    Scale {
        /// What it shows, N; a gram is 0.00981
        newtons: f64,
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
        Command::Accept => client.set(address::CALIBRATE, ACCEPT),
        Command::Scale { newtons } => scale(*newtons, client, json),
        Command::AcceptScale => client.set(address::SCALE, ACCEPT),
        Command::Forget => client.set(address::CALIBRATE, FORGET),
    }
}

fn press(within_s: f64, client: &mut Client, json: bool) -> Result<(), Error> {
    no_fault(client)?;
    client.set(address::TORQUE_ENABLE, 1)?;
    let pressed = client.set(address::CALIBRATE, PRESS).and_then(|()| {
        let within = Duration::from_secs_f64(within_s.clamp(0.0, 1e6));
        wait_for(client, address::CALIBRATE_STATE, within, |state| state != RUNNING)
    });
    // Whatever came of it: clear of the plate, then off.
    let begun = Instant::now();
    loop {
        let state = State::read(client)?;
        let clear = state.mode == Mode::Release as i64 && state.speed_um_per_s.abs() < 1_000 && state.force_mn < 10;
        if state.fault != 0 || clear || begun.elapsed() > Duration::from_secs(10) {
            break;
        }
        std::thread::sleep(LOOK);
    }
    client.set(address::TORQUE_ENABLE, 0)?;
    no_fault(client)?;
    if pressed? != DONE {
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

fn scale(newtons: f64, client: &mut Client, json: bool) -> Result<(), Error> {
    let shown_mn = (newtons * 1e3).round();
    if !(0.0..=150_000.0).contains(&shown_mn) {
        return Err(format!("{newtons} N: 0 to 150 N are asked for").into());
    }
    client.set(address::SCALE_SHOWS_MN, shown_mn as i64)?;
    let points = wait_for(client, address::SCALE_POINTS, Duration::from_secs(5), |points| points != WAITS)?;
    let refusal = client.number(address::SCALE_REFUSAL)?;
    if refusal != 0 {
        let why = table::meaning(address::SCALE_REFUSAL, refusal);
        return Err(format!("{newtons} N was not taken: {why} (docs/commissioning.md says what to do)").into());
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
