//! Presses onto a hard plate, and what they give.

use super::result::{Found, GainRows};
use super::session::Session;
use super::{Presses, Run, motion};
use crate::{Client, Error};
use fingertip::measure::Task;
use fingertip::pressure::{GAIN_MAX, GAIN_ONE};
use serde_json::json;
use solve::gains::Condition;
use solve::modulus::Modulus;
use solve::press::Press;

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
    motion::ready(client)?;
    motion::tare_after(options.pause_s, run, client)?;
    run.report("press: takes about 10 s");
    let bytes = motion::motion(Task::Press, run, client)?;
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
