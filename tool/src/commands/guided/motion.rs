//! Steps of a guided procedure: motions that measure, presses, forces held on a scale, a weight on the tip.

use super::{GainRows, Presses, Procedure, Run};
use crate::commands::stop::{Moving, TARE, measure_tare};
use crate::commands::{TOUCHED, at_rest, capture, no_fault, press, wait_for};
use crate::state::{RESTARTED, State};
use crate::{Client, Error, numbers, table};
use fingertip::capture::CaptureState;
use fingertip::measure::{Ended, MeasureState, Task};
use fingertip::pressure::{GAIN_MAX, GAIN_ONE};
use fingertip::shipped::address;
use fingertip::state::{Limits, Mode};
use serde_json::{Value, json};
use solve::gains::Condition;
use solve::modulus::Modulus;
use solve::press::Press;
use solve::record::{self, Reason};
use solve::scale::{Held, SWINGS};
use std::time::{Duration, Instant};

const LOOK: Duration = Duration::from_millis(10);
const REPORT: Duration = Duration::from_secs(1);
const TARE_WITHIN: Duration = Duration::from_secs(5);
/// Longest wait for a controller that releases the object by itself.
const RELEASE: Duration = Duration::from_secs(2);

/// Words for an early end: reason with its number, and what to do.
fn ended_early(task: Task, number: i64, value: i64) -> Error {
    let what = match task {
        Task::Stop => "motion",
        Task::Jog => "jog",
        Task::Strokes => "strokes",
        Task::Press => "press",
    };
    let why = match u8::try_from(number).ok().and_then(Reason::of) {
        None => table::meaning(address::MEASURE_ENDED, number),
        Some(reason) => record::Ended { reason, value: value as i32 }.to_string(),
    };
    format!("{what} ended early: {why} (measure_ended {number}, value {value})").into()
}

/// Name of a press in the session, from 1 on.
pub fn press_name(number: u32) -> String {
    format!("press-{number}")
}

impl Procedure<'_> {
    /// Fails if a motion of the session cannot begin, with the reason.
    pub fn ready(&mut self) -> Result<(), Error> {
        at_rest(self.client)?;
        self.unchanged()
    }

    /// Waits in the air with torque off, then tares.
    pub fn tare_after(&mut self, seconds: f64) -> Result<(), Error> {
        self.ready()?;
        self.run.report(format!("pause of {seconds} s in the air: after a press the creep needs that time to decay"));
        self.run.interrupt.pause(Instant::now() + Duration::from_secs_f64(seconds));
        self.run.interrupt.check()?;
        self.tare()
    }

    pub fn tare(&mut self) -> Result<(), Error> {
        self.ready()?;
        self.zeros()
    }

    /// True if the controller has zeros for its gains that were measured in the air.
    pub fn is_tared(&mut self) -> Result<bool, Error> {
        let limits = Limits(self.client.again(|client| client.number(address::LIMITS))? as u16);
        Ok(!limits.has(Limits::NOT_TARED) && !limits.has(Limits::TARED_TOUCHING))
    }

    pub fn zeros(&mut self) -> Result<(), Error> {
        at_rest(self.client)?;
        self.run.report("tare: nothing may touch the tip");
        if measure_tare(TARE, TARE_WITHIN, self.client)?.touched { Err(TOUCHED.into()) } else { Ok(()) }
    }

    /// Carries out a motion, which always ends at rest with torque off. Returns the record; a jog has none.
    pub fn motion(&mut self, task: Task) -> Result<Vec<u8>, Error> {
        self.ready()?;
        self.run.interrupt.check()?;
        let count = self.client.number(address::CAPTURE_COUNT)?;
        let moving = Moving::begin(self.client, &self.run.interrupt)?;
        let ended = carry_out(task, &self.run, moving.client);
        moving.finish(ended)?;
        if task == Task::Jog {
            return self.unchanged().map(|()| Vec::new());
        }
        let kept = self.client.block(address::CAPTURE_STATE, address::CAPTURE_COUNT)?;
        let now = kept.number(address::CAPTURE_COUNT);
        if kept.number(address::CAPTURE_STATE) != CaptureState::Done as i64 || now == count {
            let why =
                format!("the controller has no record of the motion: {RESTARTED}, or another host began a capture");
            return Err(why.into());
        }
        let bytes = capture::fetch(self.client, now, self.run.json)?;
        self.unchanged().map(|()| bytes)
    }

    /// Waits until the controller's chip has this temperature.
    pub fn warm(&mut self, chip_c: f64, within: Duration) -> Result<(), Error> {
        self.ready()?;
        let (until, mut reported) = (Instant::now() + within, None);
        loop {
            let now_c = self.client.again(|client| client.number(address::CHIP_MC))? as f64 * 1e-3;
            if now_c >= chip_c {
                return Ok(());
            }
            let status = format!("the controller has {now_c:.1} C, {chip_c:.1} C are needed");
            self.run.interrupt.check()?;
            if Instant::now() > until {
                return Err(format!("{status}: --warm-within-s waits longer").into());
            }
            if reported.is_none_or(|at: Instant| at.elapsed() >= 10 * REPORT) {
                reported = Some(Instant::now());
                self.run.report(format_args!("warm the finger: {status}"));
            }
            self.run.interrupt.pause(Instant::now() + REPORT);
        }
    }

    /// Presses until the session has this number of presses. Moving finger or plate between presses reaches other taxels.
    pub fn press_all(&mut self, count: u32, options: &Presses) -> Result<(), Error> {
        for number in 1..=count {
            let question = if number == 1 {
                "put a hard flat plate under the finger, a few mm away, and hold both fast".to_owned()
            } else {
                format!("press {number} of {count}: move finger or plate by 1 to 3 mm, or tilt the plate by a degree")
            };
            self.press(&press_name(number), &question, options)?;
        }
        Ok(())
    }

    /// Presses once, unless the session has it: pause in the air, press, release.
    pub fn press(&mut self, name: &str, question: &str, options: &Presses) -> Result<(), Error> {
        if self.reuses(name) {
            return Ok(());
        }
        self.ready()?;
        if !options.no_wait {
            self.run.enter(question, "--no-wait")?;
        }
        self.tare_after(options.pause_s)?;
        self.run.report("press: takes about 10 s");
        let bytes = self.motion(Task::Press)?;
        // Damaged bytes are no step that is done.
        record::press(&bytes, &self.session.before.params()).map_err(|why| why.to_string())?;
        self.session.recorded(name, &bytes)
    }

    pub fn pressed(&self, name: &str) -> Result<Press, Error> {
        let bytes = self.session.record(name)?;
        Ok(record::press(&bytes, &self.session.before.params()).map_err(|why| format!("{name}: {why}"))?)
    }

    /// Solves all presses together, and reports those that do not count, and taxels that are dead or odd. Returns
    /// none if no press counts: the session drops all presses, and the next run presses again.
    pub fn modulus(&mut self, count: u32) -> Result<Option<Modulus>, Error> {
        let presses = (1..=count).map(|number| self.pressed(&press_name(number))).collect::<Result<Vec<_>, _>>()?;
        self.run.report("solving modulus, poses and gains");
        let modulus = match solve::modulus(&presses) {
            Ok(modulus) => modulus,
            Err(why) => {
                let why = format!("the presses give no modulus: {why}. The next run presses again");
                return self.without("press-", why).map(|()| None);
            }
        };
        let (gains, found) = (&modulus.gains, &mut self.found);
        for (press, why) in &gains.left_out {
            found.refused.push(format!("press {} does not count: {why}", press + 1));
        }
        for (name, condition) in [("dead", Condition::Dead), ("odd", Condition::Odd)] {
            let taxels = gains.taxels.iter().enumerate().filter(|(_, taxel)| taxel.condition == condition);
            let places = taxels.map(|(taxel, _)| json!([taxel / gains.columns, taxel % gains.columns]));
            found.more.insert(name.into(), places.collect());
        }
        found.notes.push(modulus.to_string());
        Ok(Some(modulus))
    }

    /// Finds the gains to write: those in force over what each taxel reads too much.
    pub fn find_gains(&mut self, modulus: &Modulus) {
        let (before, found) = (&self.session.before, &mut self.found);
        let (mut after, mut sigma) = (before.gains.clone(), Vec::new());
        let curve_permille = before.params().curve_permille;
        let [least, most] = [f64::from(GAIN_ONE) / 2.0, f64::from(GAIN_MAX)];
        let taxels = modulus.gains.taxels.chunks(modulus.gains.columns);
        for (row, (gains, taxels)) in after.iter_mut().zip(taxels).enumerate() {
            let one = |(column, (gain, taxel)): (usize, (&mut u16, &solve::gains::Gain))| {
                let wanted = (f64::from(*gain) * taxel.factor(curve_permille)).round();
                if taxel.condition != Condition::Sound {
                    return None;
                }
                if !(least..=most).contains(&wanted) {
                    let why = format!("{wanted} is outside of {least} to {most}");
                    found.refused.push(format!("the taxel in row {row}, column {column} keeps its gain: {why}"));
                    return None;
                }
                *gain = wanted as u16;
                Some(taxel.sigma)
            };
            sigma.push(gains.iter_mut().zip(taxels).enumerate().map(one).collect());
        }
        found.gains = Some(GainRows { after, sigma });
    }
}

fn carry_out(task: Task, run: &Run<'_>, client: &mut Client) -> Result<(), Error> {
    if task == Task::Press {
        client.set(address::TORQUE_ENABLE, 1)?;
    }
    if let Err(why) = client.set(address::MEASURE, task as i64) {
        no_fault(client)?;
        return Err(Error::Other(format!("{why}: is a capture under way?")));
    }
    let within_s = run.options.within_s;
    let (until, mut reported) = (Instant::now() + Duration::from_secs_f64(within_s), Instant::now());
    loop {
        let block = client.again(|client| client.block(address::MEASURE_STATE, address::MEASURE_TASK))?;
        let [state, ended, value, of] =
            [address::MEASURE_STATE, address::MEASURE_ENDED, address::MEASURE_VALUE, address::MEASURE_TASK]
                .map(|register| block.number(register));
        run.interrupt.check()?;
        if state != MeasureState::Running as i64 {
            no_fault(client)?;
            let full = task == Task::Press && ended == Ended::Full as i64;
            // Another client may have stopped it before it began: then it has no task.
            return if state == MeasureState::None as i64 || ![task as i64, Task::Stop as i64].contains(&of) {
                Err(format!("the motion came to no end: {RESTARTED}").into())
            } else if state == MeasureState::Done as i64 || full {
                Ok(())
            } else {
                if ended == Ended::Interrupted as i64 {
                    // On a silent bus the controller releases the object first: the fault follows.
                    wait_for(client, address::PRESENT_MODE, RELEASE, |mode| mode != Mode::Release as i64)?;
                    no_fault(client)?;
                }
                Err(ended_early(task, ended, value))
            };
        }
        if Instant::now() > until {
            let why = format!("the motion takes longer than {within_s} s: it was stopped; --within-s allows more");
            return Err(why.into());
        }
        if reported.elapsed() >= REPORT {
            reported = Instant::now();
            run.report(format_args!("{:3} % of the motion", block.number(address::MEASURE_PROGRESS)));
        }
        std::thread::sleep(LOOK);
    }
}

const REACHED_S: f64 = 30.0;
/// Time within its tolerance after which a force counts as reached.
const SETTLED: Duration = Duration::from_secs(1);
/// Time for each goal of [`SWINGS`].
const SWING: Duration = Duration::from_millis(500);
const AVERAGED: Duration = Duration::from_millis(500);
/// Largest difference between goal and settled force: this share, at least this.
const NEAR: f64 = 0.05;
const NEAR_MN: f64 = 20.0;
pub const HOLDS: &str = "holds";
pub const WEIGHT: &str = "weight";
/// A weight on the tip: least force, and time to lay it there.
const WEIGHT_MN: i64 = 100;
const WEIGHT_WITHIN: Duration = Duration::from_secs(60);

impl Procedure<'_> {
    /// Holds each force in turn, after the goals of [`SWINGS`] around it. The tip is clear of the plate afterwards.
    pub fn hold_all(&mut self, goals_mn: &[i64], shown_n: &[f64]) -> Result<(), Error> {
        self.ready()?;
        let moving = Moving::begin(self.client, &self.run.interrupt)?;
        let held = hold(goals_mn, shown_n, &self.run, moving.client);
        let held = moving.finish(held)?;
        self.unchanged()?;
        self.session.done(HOLDS, held.into())
    }

    /// Readings under a weight that a person lays on the tip, with torque off. A force that the loop holds would not do: the
    /// loop keeps the reading constant, and creep would be in the force.
    pub fn weight(&mut self, seconds: f64) -> Result<Vec<[f64; 2]>, Error> {
        if !self.reuses(WEIGHT) {
            self.ready()?;
            let what = "lay a weight of 50 to 500 g on the tip within 60 s, and leave it there for";
            self.run.report(format_args!("{what} {seconds} s"));
            if !self.force_within(|force_mn| force_mn >= WEIGHT_MN)? {
                return Err("no weight of 100 mN was laid on the tip within 60 s: run without --creep-s".into());
            }
            let settled = Instant::now() + SETTLED;
            self.force_within(|_| Instant::now() > settled)?;
            let (begun, mut readings) = (Instant::now(), Vec::new());
            while begun.elapsed().as_secs_f64() < seconds {
                self.run.interrupt.check()?;
                let force_mn = self.client.again(State::read)?.force_mn;
                let time_s = begun.elapsed().as_secs_f64();
                if force_mn < WEIGHT_MN / 2 {
                    return Err(format!("the weight was taken off after {time_s:.1} s").into());
                }
                readings.push(json!([time_s, force_mn as f64 * 1e-3]));
                std::thread::sleep(10 * LOOK);
            }
            self.unchanged()?;
            self.session.done(WEIGHT, readings.into())?;
            self.run.report("take the weight off the tip within 60 s");
            if !self.force_within(|force_mn| force_mn < WEIGHT_MN / 2)? {
                return Err("the weight still lies on the tip: take it off and run again".into());
            }
        }
        let pair = |pair: &Value| Some([pair[0].as_f64()?, pair[1].as_f64()?]);
        Ok(self.session.numbers(WEIGHT).iter().filter_map(pair).collect())
    }

    /// Waits for a force on the tip, with torque off. Returns false if it does not come in time.
    fn force_within(&mut self, wanted: impl Fn(i64) -> bool) -> Result<bool, Error> {
        let until = Instant::now() + WEIGHT_WITHIN;
        while !wanted(self.client.again(State::read)?.force_mn) {
            self.run.interrupt.check()?;
            if Instant::now() > until {
                return Ok(false);
            }
            std::thread::sleep(LOOK);
        }
        Ok(true)
    }
}

/// Shown and read forces of holds. The read ones are those after each taxel's gain has changed by its factor.
pub fn held(holds: &[Value], factors: &[f64]) -> Vec<Held> {
    let one = |hold: &Value| {
        let pressures = hold["pressures_pa"].as_array()?.iter().filter_map(Value::as_f64);
        let (mut sum, mut after) = (0.0, 0.0);
        for (pressure, factor) in pressures.zip(factors) {
            (sum, after) = (sum + pressure, after + pressure * factor);
        }
        let change = if sum > 0.0 { after / sum } else { 1.0 };
        Some(Held { shown_n: hold["shown_n"].as_f64()?, read_n: hold["read_n"].as_f64()? * change })
    };
    holds.iter().filter_map(one).collect()
}

fn hold(goals_mn: &[i64], shown_n: &[f64], run: &Run<'_>, client: &mut Client) -> Result<Vec<Value>, Error> {
    let mut held = Vec::new();
    let [least_mn, most_mn] = ["contact_on_mn", "force_max_mn"].map(table::find);
    let [least_mn, most_mn] = [client.number(least_mn?.address)?, client.number(most_mn?.address)?];
    for (index, goal_mn) in goals_mn.iter().enumerate() {
        let goal_n = *goal_mn as f64 * 1e-3;
        run.report(format_args!("holding {goal_n} N"));
        press::begin(*goal_mn, client)?;
        reach(*goal_mn, run, client)?;
        for share in SWINGS {
            // Near the largest goal there is no room above: then the reading stays on one side of the hysteresis.
            let swing_mn = ((goal_n * 1e3 * share) as i64).min(most_mn.max(*goal_mn)).max(least_mn);
            client.set(address::GOAL_FORCE_MN, swing_mn)?;
            let until = Instant::now() + SWING;
            while Instant::now() < until {
                run.interrupt.check()?;
                same_goal(swing_mn, client)?;
                std::thread::sleep(LOOK);
            }
        }
        client.set(address::GOAL_FORCE_MN, *goal_mn)?;
        reach(*goal_mn, run, client)?;
        let shown = match shown_n.get(index) {
            Some(shown) => *shown,
            None => {
                let question = format!("{goal_n} N are held: what does the scale show, in N (1 g is 0.00981 N)?");
                run.parsed(&question, "--shown-n", numbers::shown_n, &mut || same_goal(*goal_mn, client).map(drop))?
            }
        };
        let until = Instant::now() + AVERAGED;
        let (mut count, mut sum_mn, mut sums_pa) = (0.0, 0.0, Vec::new());
        while Instant::now() < until || count == 0.0 {
            run.interrupt.check()?;
            same_goal(*goal_mn, client)?;
            let state = client.again(State::read_picture)?;
            // Creep and temperature drift are taken off the force.
            let creep_mn = client.again(|client| client.number(address::PRESENT_CREEP_MN))?;
            let drift_mn = client.again(|client| client.number(address::PRESENT_DRIFT_MN))?;
            count += 1.0;
            sum_mn += (state.force_mn - creep_mn - drift_mn) as f64;
            sums_pa.resize(state.pressures_pa.len(), 0.0);
            sums_pa.iter_mut().zip(state.pressures_pa).for_each(|(sum, pa)| *sum += pa as f64);
            std::thread::sleep(LOOK);
        }
        let pressures: Vec<f64> = sums_pa.iter().map(|sum| (sum / count).round()).collect();
        held.push(json!({
            "goal_n": goal_n, "shown_n": shown, "read_n": sum_mn / count * 1e-3, "pressures_pa": pressures,
        }));
    }
    Ok(held)
}

/// Waits until the force has been held for a second.
fn reach(goal_mn: i64, run: &Run<'_>, client: &mut Client) -> Result<(), Error> {
    let (begun, mut near_since) = (Instant::now(), None);
    loop {
        run.interrupt.check()?;
        let state = same_goal(goal_mn, client)?;
        let tolerance_mn = (NEAR * goal_mn as f64).max(NEAR_MN);
        let near = state.mode == Mode::Force as i64 && ((state.force_mn - goal_mn) as f64).abs() <= tolerance_mn;
        near_since = if near { near_since.or(Some(Instant::now())) } else { None };
        if near_since.is_some_and(|since| since.elapsed() >= SETTLED) {
            return Ok(());
        }
        if begun.elapsed().as_secs_f64() > REACHED_S {
            let (mode, force_mn) = (state.mode_name(), state.force_mn);
            let why = format!("{goal_mn} mN are not held within {REACHED_S} s: mode {mode}, {force_mn} mN");
            return Err(format!("{why}. Is the plate on the scale within reach?").into());
        }
        std::thread::sleep(LOOK);
    }
}

/// The state. Fails in a fault, and where the finger has another goal. Reading it also feeds the bus watchdog.
fn same_goal(goal_mn: i64, client: &mut Client) -> Result<State, Error> {
    let state = client.again(State::read)?;
    press::has_goal(goal_mn, &state).map(|()| state)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_early_end_names_reason_and_number() {
        let said = ended_early(Task::Strokes, 5, -12).to_string();
        assert!(said.contains("counted -12 against the voltage"), "{said}");
        assert!(said.ends_with("(measure_ended 5, value -12)"), "{said}");
    }
}
