//! Commands that move the finger: whatever ends one of them, the finger is at rest afterwards.

use super::{Interrupt, aside, wait_for};
use crate::state::{Clock, State};
use crate::{Client, Error};
use fingertip::measure::Task;
use fingertip::shipped::address;
use fingertip::state::Mode;
use std::time::{Duration, Instant};

/// Bus watchdog while a command moves the finger: the controller stops the motor after this silence.
const WATCHDOG_MS: i64 = 500;
/// The same in steps of the register `bus_watchdog`.
const WATCHDOG: i64 = WATCHDOG_MS / 20;
/// Longest release at the end of a command, in seconds of the controller's clock.
const RELEASE_S: f64 = 10.0;
/// Longest wait for the controller, for example if no frames come and its clock does not advance.
const PATIENCE: Duration = Duration::from_secs(10);
/// `MEASURE`: stops the motion.
const STOP: i64 = Task::Stop as i64;
/// Time between two reads of the state.
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
        let watchdog = client.number(address::BUS_WATCHDOG)?.max(0);
        client.set(address::BUS_WATCHDOG, WATCHDOG)?;
        Ok(Self { client, watchdog: Some(watchdog) })
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
            self.client.again(|client| client.set(address::BUS_WATCHDOG, watchdog))?;
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

/// Ends a motion that measures by `MEASURE` 0 and a grip by the goal 0, then waits until the tip is clear of the object, at
/// most for this time. Returns the last state, which in other modes is the first. A press that was ended is a grip.
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
        if measures {
            client.again(|client| client.set(address::MEASURE, STOP))?;
        }
        if state.goal_mn != 0 {
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
