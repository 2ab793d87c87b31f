//! Motions that measure: begins one, waits for its end, and reads its record.

use super::result::{Found, GainRows};
use super::{Presses, Run, Session};
use crate::commands::moving::Moving;
use crate::commands::{TOUCHED, capture, no_fault, tare};
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
pub fn ended_early(task: Task, number: i64, value: i64) -> Error {
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

/// Fails if a motion cannot begin, with the reason.
pub fn ready(client: &mut Client) -> Result<(), Error> {
    no_fault(client)?;
    alone(client)?;
    if client.number(address::TORQUE_ENABLE)? != 0 {
        return Err("torque is on: turn it off first, by `fingertip stop`".into());
    }
    Ok(())
}

/// Fails while a measuring motion runs, which a tare would end.
pub fn alone(client: &mut Client) -> Result<(), Error> {
    if client.number(address::MEASURE_STATE)? == MeasureState::Running as i64 {
        return Err("another motion that measures is under way: wait for its end, or `fingertip stop`".into());
    }
    Ok(())
}

/// Waits in the air with torque off, then tares.
pub fn tare_after(seconds: f64, run: &Run<'_>, client: &mut Client) -> Result<(), Error> {
    run.report(format_args!(
        "pause of {seconds} s in the air: after a press the sensor's creep needs that time to decay"
    ));
    run.interrupt.pause(Instant::now() + Duration::from_secs_f64(seconds));
    run.interrupt.check()?;
    tare(run, client)
}

/// Tares with torque off.
pub fn tare(run: &Run<'_>, client: &mut Client) -> Result<(), Error> {
    ready(client)?;
    run.report("tare: nothing may touch the tip");
    if tare::measure(TARE, client)?.touched { Err(TOUCHED.into()) } else { Ok(()) }
}

/// Carries out a motion. Whatever ends it, the finger is at rest with torque off afterwards. Returns the record, which a
/// jog does not have.
pub fn motion(task: Task, run: &Run<'_>, client: &mut Client) -> Result<Vec<u8>, Error> {
    ready(client)?;
    run.interrupt.check()?;
    let count = client.number(address::CAPTURE_COUNT)?;
    let moving = Moving::begin(client, &run.interrupt)?;
    let ended = carry_out(task, run, moving.client);
    moving.finish(ended)?;
    if task == Task::Jog {
        return Ok(Vec::new());
    }
    let kept = client.block(address::CAPTURE_STATE, address::CAPTURE_COUNT)?;
    let now = kept.number(address::CAPTURE_COUNT);
    if kept.number(address::CAPTURE_STATE) != CaptureState::Done as i64 || now == count {
        return Err(format!(
            "the controller has no record of the motion: {RESTARTED}, or another host began a capture"
        )
        .into());
    }
    capture::fetch(client, now, &|text| run.report(text))
}

fn carry_out(task: Task, run: &Run<'_>, client: &mut Client) -> Result<(), Error> {
    if task == Task::Press {
        client.set(address::TORQUE_ENABLE, 1)?;
    }
    if let Err(why) = client.set(address::MEASURE, task as i64) {
        no_fault(client)?;
        return Err(Error::Other(format!("{why}: is a capture under way?")));
    }
    let (until, mut reported) = (Instant::now() + Duration::from_secs_f64(run.options.within_s), Instant::now());
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
            let within_s = run.options.within_s;
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

/// Waits until the controller's chip has this temperature.
pub fn warm(chip_c: f64, within: Duration, run: &Run<'_>, client: &mut Client) -> Result<(), Error> {
    let (until, mut reported) = (Instant::now() + within, None);
    loop {
        let now_c = client.again(|client| client.number(address::CHIP_MC))? as f64 * 1e-3;
        if now_c >= chip_c {
            return Ok(());
        }
        run.interrupt.check()?;
        if Instant::now() > until {
            return Err(format!(
                "the controller has {now_c:.1} C, {chip_c:.1} C are needed: --warm-within-s waits longer"
            )
            .into());
        }
        if reported.is_none_or(|at: Instant| at.elapsed() >= 10 * REPORT) {
            reported = Some(Instant::now());
            run.report(format_args!("warm the finger: the controller has {now_c:.1} C, {chip_c:.1} C are needed"));
        }
        run.interrupt.pause(Instant::now() + REPORT);
    }
}

// Presses onto a hard plate, and what they give.

/// Name of a press in the session, from 1 on.
pub fn name(number: u32) -> String {
    format!("press-{number}.fts")
}

/// Presses until the session has this number of presses. Moving finger or plate between presses reaches other taxels.
pub fn all(
    count: u32,
    options: &Presses,
    session: &mut Session,
    run: &Run<'_>,
    client: &mut Client,
) -> Result<(), Error> {
    for number in (1..=count).filter(|number| session.record(&name(*number)).is_none()).collect::<Vec<_>>() {
        let question = if number == 1 {
            "put a hard flat plate under the finger, a few mm away, and hold both fast".to_owned()
        } else {
            format!("press {number} of {count}: move finger or plate by 1 to 3 mm, or tilt the plate by a degree")
        };
        one(&name(number), &question, options, session, run, client)?;
    }
    Ok(())
}

/// Presses once: pause in the air, tare, press, release.
pub fn one(
    name: &str,
    question: &str,
    options: &Presses,
    session: &mut Session,
    run: &Run<'_>,
    client: &mut Client,
) -> Result<(), Error> {
    if session.record(name).is_some() {
        return Ok(());
    }
    if !options.no_wait {
        run.ask.enter(question, "--no-wait")?;
    }
    ready(client)?;
    tare_after(options.pause_s, run, client)?;
    run.report("press: takes about 10 s");
    let bytes = motion(Task::Press, run, client)?;
    // Damaged bytes are no step that is done.
    solve::record::press(&bytes, &session.before.params).map_err(|why| why.to_string())?;
    session.recorded(name, bytes)
}

/// A press of the session.
pub fn read(name: &str, session: &Session) -> Result<Press, Error> {
    let bytes = session.record(name).ok_or_else(|| format!("the session has no {name}"))?;
    Ok(solve::record::press(bytes, &session.before.params).map_err(|why| format!("{name}: {why}"))?)
}

/// Solves all presses together. Where none counts the session forgets them, so that the next run presses again.
pub fn solved(count: u32, session: &mut Session, run: &Run<'_>) -> Result<Modulus, Error> {
    let presses = (1..=count).map(|number| read(&name(number), session)).collect::<Result<Vec<_>, _>>()?;
    run.report("solving modulus, poses and gains");
    match solve::modulus(&presses) {
        Ok(modulus) => Ok(modulus),
        Err(why) => {
            session.forget("press-")?;
            Err(format!("the presses give no modulus: {why}. Nothing was written; the next run presses again").into())
        }
    }
}

/// Reports presses that do not count, and taxels that are dead or odd.
pub fn report(modulus: &Modulus, found: &mut Found) {
    let gains = &modulus.gains;
    for (press, why) in &gains.left_out {
        found.refused.push(format!("press {} does not count: {why}", press + 1));
    }
    let places = |condition| {
        let taxels = gains.taxels.iter().enumerate().filter(move |(_, taxel)| taxel.condition == condition);
        taxels.map(|(taxel, _)| json!([taxel / gains.columns, taxel % gains.columns])).collect::<Vec<_>>()
    };
    found.more.insert("dead".into(), json!(places(Condition::Dead)));
    found.more.insert("odd".into(), json!(places(Condition::Odd)));
    found.notes.push(modulus.to_string());
}

/// Gains to write: those in force over what each taxel reads too much.
pub fn gains(modulus: &Modulus, session: &Session, found: &mut Found) {
    let columns = modulus.gains.columns;
    let (mut after, mut sigma) = (session.before.gains.clone(), Vec::new());
    let [least, most] = [f64::from(GAIN_ONE) / 2.0, f64::from(GAIN_MAX)];
    for (row, (gains, taxels)) in after.iter_mut().zip(modulus.gains.taxels.chunks(columns)).enumerate() {
        let one = |(column, (gain, taxel)): (usize, (&mut u16, &solve::gains::Gain))| {
            let wanted = (f64::from(*gain) * taxel.factor(session.before.params.curve_permille)).round();
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
