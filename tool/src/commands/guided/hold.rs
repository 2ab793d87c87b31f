//! Forces that are held on a scale, and a weight that lies on the tip.

use super::{Procedure, Run};
use crate::commands::moving::Moving;
use crate::commands::{press, stopped};
use crate::state::State;
use crate::{Client, Error, numbers, table};
use fingertip::shipped::address;
use fingertip::state::Mode;
use serde_json::{Value, json};
use solve::drift::HeldSeries;
use solve::scale::{Held, SWINGS};
use std::time::{Duration, Instant};

/// Longest time for a force to be reached.
const REACHED_S: f64 = 30.0;
/// Time within its tolerance after which a force counts as reached.
const SETTLED: Duration = Duration::from_secs(1);
/// Time for each goal of [`SWINGS`].
const SWING: Duration = Duration::from_millis(500);
/// Time over which readings are averaged.
const AVERAGED: Duration = Duration::from_millis(500);
/// Largest difference between goal and settled force: this share, at least this.
const NEAR: f64 = 0.05;
const NEAR_MN: f64 = 20.0;
const LOOK: Duration = Duration::from_millis(10);
/// Steps of the session.
pub const HOLDS: &str = "holds";
pub const WEIGHT: &str = "weight";
/// A weight on the tip: least force, and time to lay it there.
const WEIGHT_MN: i64 = 100;
const WEIGHT_WITHIN: Duration = Duration::from_secs(60);

impl Procedure<'_> {
    /// Holds each force in turn. Before its reading the finger goes to the goals of [`SWINGS`] around it. The tip is at rest
    /// and clear of the plate afterwards.
    pub fn hold_all(&mut self, goals_mn: &[i64], shown_n: &[f64]) -> Result<(), Error> {
        if self.session.steps.contains_key(HOLDS) {
            return Ok(());
        }
        let moving = Moving::begin(self.client, &self.run.interrupt)?;
        let held = hold(goals_mn, shown_n, &self.run, moving.client);
        let held = moving.finish(held)?;
        self.session.done(HOLDS, held.into())
    }

    /// Shown and read forces. The controller read them with the gains before; `factors` are gains to write over gains before,
    /// by which each taxel's part of the force changes. Numbers of the command line replace those of the session.
    pub fn held(&self, factors: &[f64], shown_n: &[f64]) -> Vec<Held> {
        let holds = self.session.numbers(HOLDS);
        let replaced = |index: usize| shown_n.get(index).copied().filter(|_| shown_n.len() == holds.len());
        let one = |(index, hold): (usize, &Value)| {
            let pressures = hold["pressures_pa"].as_array()?.iter().filter_map(Value::as_f64);
            let (mut sum, mut after) = (0.0, 0.0);
            for (pressure, factor) in pressures.zip(factors) {
                (sum, after) = (sum + pressure, after + pressure * factor);
            }
            let change = if sum > 0.0 { after / sum } else { 1.0 };
            let shown_n = replaced(index).or(hold["shown_n"].as_f64())?;
            Some(Held { shown_n, read_n: hold["read_n"].as_f64()? * change })
        };
        holds.iter().enumerate().filter_map(one).collect()
    }

    /// Readings under a weight that a person lays on the tip, with torque off. A force that the loop holds would not do: the
    /// loop keeps the reading constant, and creep would be in the force.
    pub fn weight(&mut self, seconds: f64) -> Result<HeldSeries, Error> {
        if !self.session.steps.contains_key(WEIGHT) {
            self.run.report(format_args!(
                "lay a weight of 50 to 500 g on the tip within 60 s, and leave it there for {seconds} s"
            ));
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
            self.session.done(WEIGHT, readings.into())?;
            self.run.report("take the weight off the tip within 60 s");
            if !self.force_within(|force_mn| force_mn < WEIGHT_MN / 2)? {
                return Err("the weight still lies on the tip: take it off and run again".into());
            }
        }
        let pair = |pair: &Value| Some([pair[0].as_f64()?, pair[1].as_f64()?]);
        Ok(HeldSeries { readings: self.session.numbers(WEIGHT).iter().filter_map(pair).collect() })
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
            return Err(format!(
                "{goal_mn} mN are not held within {REACHED_S} s: mode {mode}, {force_mn} mN. Is the plate on the scale within reach?"
            )
            .into());
        }
        std::thread::sleep(LOOK);
    }
}

/// The state. Fails in a fault, and where another program stopped the finger. Reading it also feeds the bus watchdog.
fn same_goal(goal_mn: i64, client: &mut Client) -> Result<State, Error> {
    let state = client.again(State::read)?;
    if state.fault != 0 {
        return Err(stopped(state.fault));
    }
    if state.goal_mn != goal_mn {
        return Err("another program stopped the finger while the force was held".into());
    }
    Ok(state)
}
