//! Motions that measure, and what presses onto a hard plate give.

use super::result::GainRows;
use super::{Presses, Procedure, Run};
use crate::commands::moving::Moving;
use crate::commands::{TOUCHED, capture, no_fault, no_fault_nor_motion, tare};
use crate::state::RESTARTED;
use crate::{Client, Error, table};
use fingertip::capture::CaptureState;
use fingertip::measure::{Ended, MeasureState, Task};
use fingertip::pressure::{GAIN_MAX, GAIN_ONE};
use fingertip::shipped::address;
use serde_json::json;
use solve::gains::Condition;
use solve::modulus::Modulus;
use solve::press::Press;
use solve::record::{self, Reason};
use std::time::{Duration, Instant};

/// Time between two looks at the motion.
const LOOK: Duration = Duration::from_millis(10);
/// Time between two reports of progress.
const REPORT: Duration = Duration::from_secs(1);
/// Longest time for a tare.
const TARE: Duration = Duration::from_secs(5);

/// Words for an early end: reason with its number, and what to do.
fn ended_early(task: Task, number: i64, value: i64) -> Error {
    let what = match task {
        Task::Stop => "motion",
        Task::Jog => "jog",
        Task::Strokes => "strokes",
        Task::Press => "press",
    };
    let reason = u8::try_from(number).ok().and_then(Reason::of);
    let why = reason.map_or_else(
        || table::meaning(address::MEASURE_ENDED, number),
        |reason| record::Ended { reason, value: value as i32 }.to_string(),
    );
    format!("{what} ended early: {why} (measure_ended {number}, value {value})").into()
}

/// Name of a press in the session, from 1 on.
pub fn press_name(number: u32) -> String {
    format!("press-{number}.fts")
}

impl Procedure<'_> {
    /// Fails if a motion cannot begin, with the reason.
    fn ready(&mut self) -> Result<(), Error> {
        no_fault_nor_motion(self.client)?;
        if self.client.number(address::TORQUE_ENABLE)? != 0 {
            return Err("torque is on: turn it off first, by `fingertip stop`".into());
        }
        Ok(())
    }

    /// Waits in the air with torque off, then tares.
    pub fn tare_after(&mut self, seconds: f64) -> Result<(), Error> {
        self.run.report(format_args!(
            "pause of {seconds} s in the air: after a press the sensor's creep needs that time to decay"
        ));
        self.run.interrupt.pause(Instant::now() + Duration::from_secs_f64(seconds));
        self.run.interrupt.check()?;
        self.tare()
    }

    /// Tares with torque off.
    pub fn tare(&mut self) -> Result<(), Error> {
        self.ready()?;
        self.run.report("tare: nothing may touch the tip");
        if tare::measure(TARE, self.client)?.touched { Err(TOUCHED.into()) } else { Ok(()) }
    }

    /// Carries out a motion. Whatever ends it, the finger is at rest with torque off afterwards. Returns the record, which a
    /// jog does not have.
    pub fn motion(&mut self, task: Task) -> Result<Vec<u8>, Error> {
        self.ready()?;
        self.run.interrupt.check()?;
        let count = self.client.number(address::CAPTURE_COUNT)?;
        let moving = Moving::begin(self.client, &self.run.interrupt)?;
        let ended = carry_out(task, &self.run, moving.client);
        moving.finish(ended)?;
        if task == Task::Jog {
            return Ok(Vec::new());
        }
        let kept = self.client.block(address::CAPTURE_STATE, address::CAPTURE_COUNT)?;
        let now = kept.number(address::CAPTURE_COUNT);
        if kept.number(address::CAPTURE_STATE) != CaptureState::Done as i64 || now == count {
            return Err(format!(
                "the controller has no record of the motion: {RESTARTED}, or another host began a capture"
            )
            .into());
        }
        capture::fetch(self.client, now, &|text| self.run.report(text))
    }

    /// Waits until the controller's chip has this temperature.
    pub fn warm(&mut self, chip_c: f64, within: Duration) -> Result<(), Error> {
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

    /// Presses once, unless the session has it: pause in the air, tare, press, release.
    pub fn press(&mut self, name: &str, question: &str, options: &Presses) -> Result<(), Error> {
        if self.session.records.contains_key(name) {
            return Ok(());
        }
        if !options.no_wait {
            self.run.enter(question, "--no-wait")?;
        }
        self.ready()?;
        self.tare_after(options.pause_s)?;
        self.run.report("press: takes about 10 s");
        let bytes = self.motion(Task::Press)?;
        // Damaged bytes are no step that is done.
        record::press(&bytes, &self.session.before.params).map_err(|why| why.to_string())?;
        self.session.recorded(name, bytes)
    }

    /// A press of the session.
    pub fn pressed(&self, name: &str) -> Result<Press, Error> {
        let bytes = self.session.records.get(name).ok_or_else(|| format!("the session has no {name}"))?;
        Ok(record::press(bytes, &self.session.before.params).map_err(|why| format!("{name}: {why}"))?)
    }

    /// Solves all presses together, and reports those that do not count, and taxels that are dead or odd. Where no press
    /// counts the session forgets them, so that the next run presses again.
    pub fn modulus(&mut self, count: u32) -> Result<Modulus, Error> {
        let presses = (1..=count).map(|number| self.pressed(&press_name(number))).collect::<Result<Vec<_>, _>>()?;
        self.run.report("solving modulus, poses and gains");
        let modulus = match solve::modulus(&presses) {
            Ok(modulus) => modulus,
            Err(why) => {
                self.session.forget("press-")?;
                let text = "Nothing was written; the next run presses again";
                return Err(format!("the presses give no modulus: {why}. {text}").into());
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
        Ok(modulus)
    }

    /// Finds the gains to write: those in force over what each taxel reads too much.
    pub fn find_gains(&mut self, modulus: &Modulus) {
        let (before, found) = (&self.session.before, &mut self.found);
        let (mut after, mut sigma) = (before.gains.clone(), Vec::new());
        let [least, most] = [f64::from(GAIN_ONE) / 2.0, f64::from(GAIN_MAX)];
        for (row, (gains, taxels)) in
            after.iter_mut().zip(modulus.gains.taxels.chunks(modulus.gains.columns)).enumerate()
        {
            let one = |(column, (gain, taxel)): (usize, (&mut u16, &solve::gains::Gain))| {
                let wanted = (f64::from(*gain) * taxel.factor(before.params.curve_permille)).round();
                if taxel.condition != Condition::Sound {
                    return None;
                }
                if !(least..=most).contains(&wanted) {
                    found.refused.push(format!(
                        "the taxel in row {row}, column {column} keeps its gain: {wanted} is outside of {least} to {most}"
                    ));
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
            return if state == MeasureState::None as i64 || of != task as i64 {
                Err(format!("the motion came to no end: {RESTARTED}").into())
            } else if state == MeasureState::Done as i64 || full {
                Ok(())
            } else {
                Err(ended_early(task, ended, value))
            };
        }
        if Instant::now() > until {
            return Err(
                format!("the motion takes longer than {within_s} s: it was stopped; --within-s allows more").into()
            );
        }
        if reported.elapsed() >= REPORT {
            reported = Instant::now();
            run.report(format_args!("{:3} % of the motion", block.number(address::MEASURE_PROGRESS)));
        }
        std::thread::sleep(LOOK);
    }
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
