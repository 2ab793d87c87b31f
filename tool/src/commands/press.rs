//! `fingertip press`.

use super::stop::Moving;
use super::{Interrupt, TOUCHED, no_fault, report, say, say_json, stopped};
use crate::state::{Clock, RESTARTED, State};
use crate::{Client, Error, numbers, table};
use fingertip::link::packet::StatusError;
use fingertip::shipped::address;
use fingertip::state::{Limits, Mode};
use serde_json::json;
use std::time::{Duration, Instant};

/// Interval of the checks, and of the reports.
const LOOK: Duration = Duration::from_millis(10);
const SAY: Duration = Duration::from_millis(500);
/// Least tolerance of a held force, for small goals: the resolution of a usual array, mN.
const TOLERANCE_MN: f64 = 20.0;
/// Time within the tolerance after which a force counts as reached, s: an overshoot passes through faster.
const SETTLED_S: f64 = 0.1;

#[derive(Debug, clap::Args)]
#[command(
    after_help = "Examples:\n  fingertip press 1.5\n  fingertip press 0.5 --seconds 10 --tolerance-percent 2\n\n\
    The force is reached once it has been within the tolerance for 0.1 s; from then on it is held. Exit code 1: it was not \
    reached; 3: it was reached, but a state was outside the tolerance while it was held."
)]
pub struct Args {
    /// Force to hold, N
    #[arg(value_name = "NEWTONS", allow_negative_numbers = true, value_parser = numbers::goal_mn)]
    goal_mn: i64,
    /// Time for which the force is held
    #[arg(long, default_value_t = 2.0, value_parser = numbers::seconds)]
    seconds: f64,
    /// Tolerance of the held force as the controller senses it, in percent of the goal; 20 mN at least
    #[arg(long, default_value_t = 5.0, value_parser = numbers::percent)]
    tolerance_percent: f64,
    /// Longest time until the force is reached
    #[arg(long, default_value_t = 10.0, value_parser = numbers::seconds)]
    within_s: f64,
}

/// Held forces, and the last state.
#[derive(Default)]
struct Held {
    /// States while the force was held; empty if it was not reached.
    count: u32,
    outside: u32,
    sum_mn: f64,
    least_mn: i64,
    most_mn: i64,
    from_s: f64,
    held_s: f64,
    last: State,
}

/// Touches, holds, releases, turns torque off. Whatever ends it, it releases before.
pub fn run(args: &Args, client: &mut Client, json: bool) -> Result<(), Error> {
    no_fault(client)?;
    if Limits(client.number(address::LIMITS)? as u16).has(Limits::NOT_TARED) {
        return Err("the tip is not tared since the controller started: free it, then `fingertip tare`".into());
    }
    let least_mn = client.number(table::find("contact_on_mn")?.address)?;
    if (least_mn - args.goal_mn) as f64 > tolerance_mn(args) {
        let goal_mn = args.goal_mn;
        return Err(format!("{goal_mn} mN are less than the finger can hold: contact_on_mn is {least_mn}").into());
    }
    let interrupt = Interrupt::catch()?;
    let moving = Moving::begin(client, &interrupt)?;
    let pressed = press(args, moving.client, json, &interrupt);
    let held = moving.finish(pressed)?;
    let Held { count, outside, least_mn, most_mn, held_s, .. } = held;
    let (goal_mn, tolerance_mn, reached) = (args.goal_mn, tolerance_mn(args), count > 0);
    let mean_mn = reached.then(|| held.sum_mn / f64::from(count));
    if json {
        say_json(&json!({
            "goal_mn": goal_mn, "tolerance_mn": tolerance_mn, "reached": reached, "held": reached && outside == 0,
            "held_s": held_s, "states": count, "states_outside": outside, "mean_mn": mean_mn,
            "least_mn": reached.then_some(least_mn), "most_mn": reached.then_some(most_mn),
            "interrupted": interrupt.came(),
        }));
    } else if let Some(mean_mn) = mean_mn {
        say(format_args!(
            "reached; mean {mean_mn:.1} mN over {held_s:.2} s, {least_mn} to {most_mn} mN in {count} states; released"
        ));
    }
    interrupt.check()?;
    if !reached {
        let (mode, limits, force_mn) = (held.last.mode_name(), held.last.limits_text(), held.last.force_mn);
        let (within_s, travel_mm) = (args.within_s, held.last.travel_um as f64 * 1e-3);
        let state = format!("mode {mode}, {force_mn} mN, travel {travel_mm:.2} mm, limits: {limits}");
        let why = format!("{goal_mn} mN are not reached within {within_s} s: {state}");
        let ask = "Is there something to press on? If the tip is at the end of its travel, push it back by hand";
        return Err(format!("{why}. {ask}").into());
    }
    if outside > 0 {
        let band = format!("{goal_mn} +- {tolerance_mn:.0} mN (--tolerance-percent)");
        let why = format!("{goal_mn} mN were reached, but not held: {outside} of {count} states are outside {band}");
        return Err(Error::NotHeld(why));
    }
    Ok(())
}

fn tolerance_mn(args: &Args) -> f64 {
    (args.tolerance_percent * 1e-2 * args.goal_mn as f64).max(TOLERANCE_MN)
}

/// The controller refuses torque before.
pub(super) fn direction_confirmed(client: &mut Client) -> Result<(), Error> {
    if client.number(table::find("direction_confirmed")?.address)? != 0 {
        return Ok(());
    }
    Err("nobody confirmed yet which way the motor goes: `fingertip commission`, and watch the tip".into())
}

pub(super) fn begin(goal_mn: i64, client: &mut Client) -> Result<(), Error> {
    let why = match client.set(address::TORQUE_ENABLE, 1).and_then(|()| client.set(address::GOAL_FORCE_MN, goal_mn)) {
        Err(why) => why,
        done => return done,
    };
    // Some faults show only once torque is on: then it is not the goal that is wrong.
    no_fault(client)?;
    if why.refused_with(StatusError::Result)
        && Limits(client.number(address::LIMITS)? as u16).has(Limits::TARED_TOUCHING)
    {
        return Err(TOUCHED.into());
    }
    if !why.refused_with(StatusError::Limit) {
        return Err(why);
    }
    let most_mn = client.number(table::find("force_max_mn")?.address)?;
    Err(format!("{why}: the parameter force_max_mn is {most_mn}").into())
}

/// Fails in a fault, and where the finger has another goal.
pub(super) fn has_goal(goal_mn: i64, state: &State) -> Result<(), Error> {
    if state.fault != 0 {
        return Err(stopped(state.fault));
    }
    if state.goal_mn != goal_mn {
        return Err(format!("another program stopped the finger or set another goal: {} mN", state.goal_mn).into());
    }
    Ok(())
}

fn press(args: &Args, client: &mut Client, json: bool, interrupt: &Interrupt) -> Result<Held, Error> {
    let goal_mn = args.goal_mn;
    direction_confirmed(client)?;
    begin(goal_mn, client)?;
    let (begun, mut said, mut clock, mut held) = (Instant::now(), Instant::now(), Clock::default(), Held::default());
    // Controller's time since when the force is within its tolerance.
    let mut near_s = None;
    loop {
        let state = client.again(State::read)?;
        let time_s = clock.time_s(&state).ok_or(RESTARTED)?;
        has_goal(goal_mn, &state)?;
        let force_mn = state.force_mn;
        let near = state.mode == Mode::Force as i64 && ((force_mn - goal_mn) as f64).abs() <= tolerance_mn(args);
        near_s = if near { near_s.or(Some(time_s)) } else { None };
        let settled = near_s.is_some_and(|near_s| time_s - near_s >= SETTLED_S);
        if held.count == 0 && settled {
            held = Held { from_s: time_s, least_mn: force_mn, most_mn: force_mn, ..held };
            report(format_args!("reached after {time_s:.2} s"), json);
        }
        if held.count > 0 || settled {
            held.count += 1;
            held.outside += u32::from(!near);
            held.sum_mn += force_mn as f64;
            held.least_mn = held.least_mn.min(force_mn);
            held.most_mn = held.most_mn.max(force_mn);
            held.held_s = time_s - held.from_s;
        }
        if said.elapsed() >= SAY {
            said = Instant::now();
            report(format_args!("{:10} {force_mn:6} mN of {goal_mn} mN", state.mode_name()), json);
        }
        let late = held.count == 0 && begun.elapsed().as_secs_f64() > args.within_s;
        let done = held.count > 1 && held.held_s >= args.seconds;
        held.last = state;
        if late || done || interrupt.came() {
            return Ok(held);
        }
        std::thread::sleep(LOOK);
    }
}
