//! `fingertip press`.

use super::moving::Moving;
use super::{Interrupt, aside, no_fault, say, say_json, stopped};
use crate::state::{ANEW, Clock, State};
use crate::{Client, Error, numbers, table};
use fingertip::shipped::address;
use fingertip::state::{Limits, Mode};
use serde_json::json;
use std::time::{Duration, Instant};

/// How often it looks, and how often it says what it sees.
const LOOK: Duration = Duration::from_millis(10);
const SAY: Duration = Duration::from_millis(500);
/// Held once the force is within this share of the goal, or this much.
const NEAR: f64 = 0.02;
const NEAR_MN: f64 = 10.0;
/// A status packet's error for a value beyond what other registers allow.
const BEYOND: u8 = 6;

/// What to press, and for how long.
#[derive(Debug, clap::Args)]
#[command(after_help = "Examples:\n  fingertip press 1.5\n  fingertip press 0.5 --seconds 10")]
pub struct Args {
    /// Force to hold, N
    #[arg(value_name = "NEWTONS", value_parser = numbers::goal_mn)]
    goal_mn: i64,
    /// How long to hold it
    #[arg(long, default_value_t = 2.0, value_parser = numbers::seconds)]
    seconds: f64,
    /// How long the approach may take until the force is held
    #[arg(long, default_value_t = 10.0, value_parser = numbers::seconds)]
    within_s: f64,
}

/// What was held.
#[derive(Default)]
struct Held {
    count: u32,
    sum_mn: f64,
    least_mn: i64,
    most_mn: i64,
    from_s: f64,
    to_s: f64,
}

/// Touches, holds, lets go, turns torque off. Whatever ends it, it lets go before.
///
/// # Errors
/// A fault stands or comes, the tip is not tared, or nothing is touched in time.
pub fn run(args: &Args, client: &mut Client, json: bool) -> Result<(), Error> {
    no_fault(client)?;
    if Limits(client.number(address::LIMITS)? as u16).has(Limits::NOT_TARED) {
        return Err("the tip is not tared since the controller started: free it, then `fingertip tare`".into());
    }
    let interrupt = Interrupt::catch()?;
    let moving = Moving::begin(client, &interrupt)?;
    let pressed = press(args, moving.client, json, &interrupt);
    let held = moving.finish(pressed)?;
    let mean_mn = held.sum_mn / f64::from(held.count.max(1));
    let held_s = held.to_s - held.from_s;
    if json {
        say_json(&json!({
            "goal_mn": args.goal_mn, "held_s": held_s, "states": held.count, "mean_mn": mean_mn,
            "least_mn": held.least_mn, "most_mn": held.most_mn, "interrupted": interrupt.came(),
        }));
    } else {
        let (least, most) = (held.least_mn, held.most_mn);
        say(format_args!(
            "held {mean_mn:.1} mN for {held_s:.2} s, {least} to {most} mN in {} states; let go",
            held.count
        ));
    }
    interrupt.check()
}

/// The controller refuses torque before.
pub(super) fn direction_confirmed(client: &mut Client) -> Result<(), Error> {
    if client.number(table::find("direction_confirmed")?.address)? != 0 {
        return Ok(());
    }
    Err("nobody confirmed yet which way the motor goes: `fingertip commission jog`, and watch the tip".into())
}

/// Turns torque on and sets the goal.
pub(super) fn begin(goal_mn: i64, client: &mut Client) -> Result<(), Error> {
    let why = match client.set(address::TORQUE_ENABLE, 1).and_then(|()| client.set(address::GOAL_FORCE_MN, goal_mn)) {
        Err(why) => why,
        done => return done,
    };
    // Some faults show only once torque is on: then it is not the goal that is wrong.
    no_fault(client)?;
    if !why.refused_with(BEYOND) {
        return Err(why);
    }
    let most_mn = client.number(table::find("force_max_mn")?.address)?;
    Err(format!("{why}: the parameter force_max_mn is {most_mn}").into())
}

fn press(args: &Args, client: &mut Client, json: bool, interrupt: &Interrupt) -> Result<Held, Error> {
    let goal_mn = args.goal_mn;
    direction_confirmed(client)?;
    begin(goal_mn, client)?;
    let (begun, mut said, mut clock, mut held) = (Instant::now(), Instant::now(), Clock::default(), None::<Held>);
    loop {
        let state = client.again(State::read)?;
        let time_s = clock.time_s(&state).ok_or(ANEW)?;
        if state.fault != 0 {
            return Err(stopped(state.fault));
        }
        let near_mn = (NEAR * goal_mn as f64).max(NEAR_MN);
        let near = state.mode == Mode::Force as i64 && ((state.force_mn - goal_mn) as f64).abs() <= near_mn;
        if let Some(held) = &mut held {
            held.count += 1;
            held.sum_mn += state.force_mn as f64;
            held.least_mn = held.least_mn.min(state.force_mn);
            held.most_mn = held.most_mn.max(state.force_mn);
            held.to_s = time_s;
        } else if near {
            let force_mn = state.force_mn;
            held =
                Some(Held { least_mn: force_mn, most_mn: force_mn, from_s: time_s, to_s: time_s, ..Held::default() });
        } else if begun.elapsed().as_secs_f64() > args.within_s {
            let (mode, force_mn, travel_mm) = (state.mode_name(), state.force_mn, state.travel_um as f64 * 1e-3);
            let limits = state.limit_names().join(", ");
            return Err(format!(
                "{goal_mn} mN are not reached within {} s: mode {mode}, {force_mn} mN, travel {travel_mm:.2} mm, \
                 limits: {limits}. Is there something to press on?",
                args.within_s
            )
            .into());
        }
        if !json && said.elapsed() >= SAY {
            said = Instant::now();
            aside(format_args!("{:10} {:6} mN of {goal_mn} mN", state.mode_name(), state.force_mn));
        }
        match held {
            Some(held) if held.count > 0 && held.to_s - held.from_s >= args.seconds || interrupt.came() => {
                return Ok(held);
            }
            None if interrupt.came() => return Ok(Held::default()),
            _ => std::thread::sleep(LOOK),
        }
    }
}
