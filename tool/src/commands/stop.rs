//! Commands at whose end the finger is at rest: [`Moving`] guards those that move it; `fingertip stop`, `recover` and `tare`
//! begin or end there.

use super::{Interrupt, TOUCHED, answer, aside, at_rest, no_fault, say, say_json, wait_for};
use crate::client::Reach;
use crate::state::{Clock, State};
use crate::{Client, Error, numbers, table};
use fingertip::link::packet::{BROADCAST, StatusError};
use fingertip::pipeline::Taring;
use fingertip::shipped::address;
use fingertip::state::{Limits, Mode};
use serde_json::{Value, json};
use std::time::{Duration, Instant};

/// Bus watchdog while a command moves the finger: the controller stops the motor after this silence. The
/// value is unusual on purpose, so that a watchdog set by another host can be told apart from it.
const WATCHDOG_MS: i64 = 520;
/// Unit of the register `bus_watchdog`, ms.
pub const WATCHDOG_UNIT_MS: i64 = 20;
/// [`WATCHDOG_MS`] in this unit.
const WATCHDOG: i64 = WATCHDOG_MS / WATCHDOG_UNIT_MS;
/// Longest release at the end of a command, in seconds of the controller's clock.
const RELEASE_S: f64 = 10.0;
/// Longest wait for the controller, for example if no frames come and its clock does not advance.
const PATIENCE: Duration = Duration::from_secs(10);
const LOOK: Duration = Duration::from_millis(10);
/// A released tip below this speed and this force is clear of the object.
pub(super) const REST_UM_PER_S: i64 = 1_000;
const CLEAR_MN: i64 = 10;

/// A finger that this program moves. The bus watchdog runs from the beginning on, and the reads of the command feed it:
/// a killed program or a lost cable ends in fault 7. Every other end releases the object and turns torque off.
#[derive(Debug)]
pub struct Moving<'a> {
    pub client: &'a mut Client,
    /// Watchdog to put back at the end; none once the finger was stopped.
    watchdog: Option<i64>,
}

impl<'a> Moving<'a> {
    /// Sets the bus watchdog. `_interrupt` proves that a signal no longer ends the program on the spot.
    pub fn begin(client: &'a mut Client, _interrupt: &Interrupt) -> Result<Self, Error> {
        let watchdog = client.number(address::BUS_WATCHDOG)?;
        if watchdog < 0 {
            return Err("the bus watchdog has tripped: `fingertip recover` resets it".into());
        }
        client.again(|client| client.set(address::BUS_WATCHDOG, WATCHDOG))?;
        // A command that was killed left its own value: that is not put back.
        Ok(Self { client, watchdog: Some(if watchdog == WATCHDOG { 0 } else { watchdog }) })
    }

    /// Stops the finger, whatever the command came to, and puts the watchdog back.
    pub fn finish<T>(mut self, done: Result<T, Error>) -> Result<T, Error> {
        let Err(second) = self.stop() else { return done };
        let why = done.err().map_or(String::new(), |why| format!("{why}; "));
        Err(format!(
            "{why}stopping the finger failed: {second}. The controller stops the motor after {WATCHDOG_MS} ms of \
             silence, with fault 7; `fingertip stop` turns torque off"
        )
        .into())
    }

    fn stop(&mut self) -> Result<(), Error> {
        let Some(watchdog) = self.watchdog.take() else { return Ok(()) };
        let released = release(RELEASE_S, self.client).map(drop);
        if matches!(released, Err(Error::Silent(_))) {
            // A line that stalled would deliver torque off together with the goal 0, and friction would keep most of the
            // force. The bus watchdog releases the object, then turns torque off.
            return released;
        }
        halt(self.client)?;
        // Only with torque off: until then nothing else stops the motor once this program has ended. A watchdog that
        // has tripped stays so, for `fingertip recover`.
        if self.client.again(|client| client.number(address::BUS_WATCHDOG))? >= 0 {
            set_watchdog(self.client, watchdog)?;
        }
        released
    }
}

impl Drop for Moving<'_> {
    fn drop(&mut self) {
        if let Err(why) = self.stop() {
            aside(format_args!("fingertip: stopping the finger failed: {why}"));
        }
    }
}

/// Ends a measuring motion or a grip by goal 0, then waits until the tip is clear of the object, at most for this time.
/// Returns the last state, which in other modes is the first. A press that was ended is a grip.
pub(super) fn release(within_s: f64, client: &mut Client) -> Result<State, Error> {
    let (begun, mut clock) = (Instant::now(), Clock::default());
    loop {
        let state = client.again(State::read)?;
        let is = |mode: Mode| mode as i64 == state.mode;
        let measures = is(Mode::Press) || is(Mode::Strokes);
        let grips = measures || is(Mode::Approach) || is(Mode::Force) || is(Mode::Release);
        let rests = state.speed_um_per_s.abs() < REST_UM_PER_S && state.force_mn < CLEAR_MN;
        let late = clock.time_s(&state).is_none_or(|time_s| time_s > within_s) || begun.elapsed() > PATIENCE;
        if !grips || late || is(Mode::Release) && rests {
            return Ok(state);
        }
        if measures || state.goal_mn != 0 {
            client.again(|client| client.set(address::GOAL_FORCE_MN, 0))?;
        }
        std::thread::sleep(LOOK);
    }
}

/// Turns torque off, which also aborts measurements, and waits until the motor is no longer driven.
pub(super) fn halt(client: &mut Client) -> Result<(), Error> {
    client.again(|client| client.set(address::TORQUE_ENABLE, 0))?;
    let mode = wait_for(client, address::PRESENT_MODE, PATIENCE, is_idle)?;
    if is_idle(mode) { Ok(()) } else { Err(format!("the controller is still in mode {mode}").into()) }
}

/// True for the modes in which the motor is not driven.
pub(super) fn is_idle(mode: i64) -> bool {
    [Mode::Off, Mode::Tare, Mode::Fault].iter().any(|idle| *idle as i64 == mode)
}

/// Longest release before torque goes off, in seconds of the controller's clock.
const QUICK_RELEASE_S: f64 = 0.5;
/// Longest wait for a tip that rolls out behind the shorted motor.
const ROLL_OUT: Duration = Duration::from_secs(2);
/// A tip that still presses with more force gets a hint.
const RESIDUAL_MN: i64 = 50;

#[derive(Debug, clap::Args)]
#[command(after_help = "Examples:\n  \
    fingertip stop\n  \
    fingertip --id 2,3 stop\n  \
    fingertip stop --all    (torque off for every device on the bus, in one packet and without a release)")]
pub struct Stop {
    /// Stop all devices on the bus by the broadcast ID, servos included
    #[arg(long)]
    all: bool,
}

/// Turns torque off, which aborts measurements, sets the bus watchdog to 0, and reports what was found and changed. All
/// fingers release at once, then each is stopped, also after a signal: a finger that was released still has torque on, and
/// perhaps no bus watchdog.
pub fn run(args: &Stop, reach: &Reach, json: bool) -> Result<(), Error> {
    let interrupt = Interrupt::catch()?;
    let mut client = Client::open(reach)?;
    let answered = (address::STATUS_RETURN_LEVEL, ALL_ANSWERED);
    let (ids, first): (&[u8], &[(u16, i64)]) = if args.all {
        client.set_all(address::TORQUE_ENABLE, 0)?;
        aside("torque off was sent to all IDs");
        (&[BROADCAST], &[answered])
    } else {
        (&reach.ids, &[(address::GOAL_FORCE_MN, 0), answered])
    };
    super::each(&mut client, ids, json, false, first, |client| {
        let stopped = stop(client, !args.all, json)?;
        if json {
            say_json(&stopped);
        }
        Ok(())
    })?;
    interrupt.check()
}

/// Status return level at which all instructions are answered. A host may have left another one, at which torque off seems
/// lost.
pub const ALL_ANSWERED: i64 = 2;

/// Sets the bus watchdog of a finger with torque off. Where another client of `fingertip share` commands, it is that
/// client's, and stays. Returns whether it was set.
fn set_watchdog(client: &mut Client, steps: i64) -> Result<bool, Error> {
    let set = client.again(|client| client.set(address::BUS_WATCHDOG, steps)).map(|()| true);
    set.or_else(|why| if why.refused_with(StatusError::Access) { Ok(false) } else { Err(why) })
}

/// Stops one finger. A grip is released first, so that friction keeps no force at the tip; whatever comes of that, torque
/// goes off.
fn stop(client: &mut Client, releases: bool, json: bool) -> Result<Value, Error> {
    let before = client
        .again(State::read)
        .and_then(|before| if releases { release(QUICK_RELEASE_S, client).map(|_| before) } else { Ok(before) });
    let halted = halt(client);
    let before = before?;
    halted?;
    let watchdog = client.again(|client| client.number(address::BUS_WATCHDOG))?;
    let now = if set_watchdog(client, 0)? { "off" } else { "that of the client that commands" };
    let speed = wait_for(client, address::SPEED_UM_PER_S, ROLL_OUT, |speed| speed.abs() < REST_UM_PER_S)?;
    let after = client.again(State::read)?;
    let id = client.id;
    if !json {
        let was = |state: &State| format!("mode {}, {} mN", state.mode_name(), state.force_mn);
        say(format_args!("ID {id}: {} -> {}", was(&before), was(&after)));
        let shown = match watchdog {
            0 => "off".into(),
            ..0 => "tripped".into(),
            steps => format!("{} ms", WATCHDOG_UNIT_MS * steps),
        };
        say(format_args!("torque is off, measurements are aborted, the bus watchdog is {now} (it was {shown})"));
        if let Some(fault) = after.fault_name() {
            say(format_args!("fault {} ({fault}) remains: `fingertip recover` clears it", after.fault));
        }
        if after.force_mn > RESIDUAL_MN {
            say("the tip still presses: friction holds it. A short `fingertip press 0.1` takes it off the object");
        }
    }
    if speed.abs() >= REST_UM_PER_S {
        return Err(format!("torque is off, but the tip still moves at {speed} um/s").into());
    }
    Ok(json!({
        "id": id, "mode_before": before.mode_name(), "force_before_mn": before.force_mn, "mode": after.mode_name(),
        "force_mn": after.force_mn, "fault": after.fault, "fault_name": after.fault_name(),
        "watchdog_before": watchdog, "at_rest": true,
    }))
}

/// The controller takes a frame or two.
const RECOVERED_WITHIN: Duration = Duration::from_secs(2);

/// Clears what stopped the motor: one register does it.
pub fn recover(client: &mut Client, json: bool) -> Result<(), Error> {
    let fault = client.number(address::FAULT)?;
    let tripped = client.number(address::BUS_WATCHDOG)? < 0;
    let words = (fault != 0).then(|| table::meaning(address::FAULT, fault));
    if let Err(why) = client.set(address::RECOVER, 1) {
        let hindrance = client.number(address::RECOVER_HINDRANCE)?;
        if why.refused_with(StatusError::Result) && hindrance != 0 {
            let hindrance = table::meaning(address::RECOVER_HINDRANCE, hindrance);
            return Err(format!("fault {fault} ({}) cannot be cleared: {hindrance}", words.unwrap_or_default()).into());
        }
        return Err(why);
    }
    let left = wait_for(client, address::FAULT, RECOVERED_WITHIN, |fault| fault == 0)?;
    if left != 0 {
        let words = table::meaning(address::FAULT, left);
        return Err(format!("fault {left} ({words}) is back: what causes it is still there").into());
    }
    let untared = client.number(address::LIMITS)? as u16 & Limits::NOT_TARED != 0;
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

/// Values of `TARE`: a tare, and one that takes as zero whatever the array reads.
pub(super) const TARE: i64 = 1;
const TARE_FORCED: i64 = 2;

#[derive(Debug, clap::Args)]
#[command(
    after_help = "Examples:\n  fingertip tare\n  fingertip tare --force    (in the air, while the reading of a contact decays)"
)]
pub struct Tare {
    /// Take the present reading as zero, even if something seems to touch: a force that is there now is not measured then
    #[arg(long)]
    force: bool,
    /// Longest time that it may take; a real controller needs 20 ms
    #[arg(long, default_value_t = 5.0, value_parser = numbers::seconds)]
    within_s: f64,
}

pub fn tare(args: &Tare, client: &mut Client, json: bool) -> Result<(), Error> {
    at_rest(client)?;
    let request = if args.force { TARE_FORCED } else { TARE };
    let Tared { touched, least, most } = measure_tare(request, Duration::from_secs_f64(args.within_s), client)?;
    let value = json!({ "id": client.id, "tared": true, "touched": touched, "least_codes": least, "most_codes": most });
    answer(json, &value, format_args!("tared: zeros of {least} to {most} codes"));
    if !touched {
        return Ok(());
    }
    if !args.force {
        return Err(TOUCHED.into());
    }
    aside("what touched is taken as zero: a force that presses now is missing in what is read from here on");
    Ok(())
}

pub(super) struct Tared {
    pub touched: bool,
    /// Lowest and highest zero, codes.
    least: i64,
    most: i64,
}

/// Reason for which a tare ended in this `TARE_STATE`: a fault, a restart, or something that touches.
pub(super) fn no_tare(state: i64, client: &mut Client) -> Error {
    if let Err(fault) = no_fault(client) {
        return fault;
    }
    let why = if state == Taring::Refused as i64 {
        "refused. Something seems to touch: free the tip; then wait until the reading has decayed, or use \
         `fingertip tare --force`"
    } else {
        "the controller restarted meanwhile"
    };
    format!("the tare came to nothing: {why}").into()
}

pub(super) fn measure_tare(request: i64, within: Duration, client: &mut Client) -> Result<Tared, Error> {
    client.set(address::TARE, request)?;
    let running = Taring::Running as i64;
    let state = wait_for(client, address::TARE_STATE, within, |state| state != running)?;
    if state == running {
        let within_s = within.as_secs_f64();
        return Err(format!("the tare is still running after {within_s} s: do frames come in?").into());
    }
    if state != Taring::Done as i64 {
        return Err(no_tare(state, client));
    }
    let touched = Limits(client.number(address::LIMITS)? as u16).has(Limits::TARED_TOUCHING);
    let codes = client.block(address::TARE_CODES, address::TARE_CODES)?.numbers(address::TARE_CODES);
    let (least, most) = (codes.iter().min().copied().unwrap_or(0), codes.iter().max().copied().unwrap_or(0));
    Ok(Tared { touched, least, most })
}
