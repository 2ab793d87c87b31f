//! The end of a procedure: a table of what was found, and one write of all of it.

use super::{Run, Session, Settings, motion};
use crate::commands::params::{self, file};
use crate::commands::say;
use crate::{Client, Error, table};
use fingertip::pressure::GAIN_ONE;
use serde_json::{Map, Value, json};

/// A parameter that was measured.
pub struct Row {
    /// Name of the parameter, which ends with its unit.
    pub name: &'static str,
    /// Value to write.
    pub after: f64,
    /// Standard uncertainty in the same unit; none for what a person said.
    pub sigma: Option<f64>,
}

/// Gains that were measured.
pub struct GainRows {
    /// Gains to write, in 1/16384, row by row.
    pub after: Vec<Vec<u16>>,
    /// Relative standard uncertainties; none for taxels that keep their gain.
    pub sigma: Vec<Vec<Option<f64>>>,
}

/// Everything that a procedure found.
#[derive(Default)]
pub struct Found {
    /// Parameters.
    pub rows: Vec<Row>,
    /// Gains.
    pub gains: Option<GainRows>,
    /// Sentences: presses, numbers and taxels that do not count, each with its reason.
    pub refused: Vec<String>,
    /// True if a part that was requested has no result: nothing is written then.
    pub blocked: bool,
    /// Further entries of the JSON object: dead and odd taxels, remaining errors.
    pub more: Map<String, Value>,
    /// Sentences for people.
    pub notes: Vec<String>,
}

impl Found {
    /// Adds a parameter.
    pub fn row(&mut self, name: &'static str, after: f64, sigma: Option<f64>) {
        self.rows.push(Row { name, after, sigma });
    }

    /// Takes no result of a part: nothing is written.
    pub fn block(&mut self, why: String) {
        self.refused.push(why);
        self.blocked = true;
    }
}

/// Step of a session that lists what is being written.
const WRITTEN: &str = "written";

/// Fails where the controller's settings are neither those before the session nor those that it has written.
///
/// # Errors
/// See above.
pub fn same_settings(session: &Session, client: &mut Client) -> Result<(), Error> {
    let (now, before) = (Settings::read(client)?, &session.before);
    let written = session.step(WRITTEN);
    let differs = |name: &&str| {
        let written = written.and_then(|written| written["parameters"][*name].as_i64());
        now.get(name) != before.get(name) && now.get(name).map(i64::from) != written
    };
    let names = set_names().filter(|name| *name != "direction_confirmed");
    let mut names: Vec<&str> = names.filter(differs).collect();
    if now.gains != before.gains && !written.is_some_and(|written| written["gains"] == json!(now.gains)) {
        names.push("gains");
    }
    if names.is_empty() {
        return Ok(());
    }
    let names = names.join(", ");
    Err(format!("the controller's {names} changed since this session began: begin one in another folder").into())
}

fn set_names() -> impl Iterator<Item = &'static str> {
    fingertip::params::Params::RANGES.into_iter().map(|(name, ..)| name)
}

/// Shows the results, writes them if confirmed, and prints the JSON object.
///
/// # Errors
/// A part has no result, or the controller refused: then nothing was changed.
pub fn finish(found: &Found, session: &mut Session, run: &Run<'_>, client: &mut Client) -> Result<(), Error> {
    if !run.json {
        show(found, session);
    }
    let values: Vec<params::Value> = found
        .rows
        .iter()
        .map(|row| Ok((table::find(row.name)?, row.after.round() as i64)))
        .collect::<Result<_, String>>()?;
    let is_set = already(found, &values, client)?;
    let nothing = found.rows.is_empty() && found.gains.is_none();
    let wanted = !found.blocked
        && !nothing
        && (is_set
            || run.options.apply
            || !run.json && { run.ask.yes("write these values to the controller?", "--apply")? });
    run.interrupt.check()?;
    if wanted && !is_set {
        write(found, &values, session, client)?;
        run.report("written; `fingertip params save` or --save keeps them over a reset");
    }
    if wanted && !is_set && found.gains.is_some() {
        // The zeros of the old gains are wrong under new ones.
        motion::tare(run, client)
            .map_err(|why| format!("the values are written, but the tare that new gains need failed: {why}"))?;
    }
    let saved = wanted && run.options.save;
    if saved {
        params::save(client, run.json)?;
    }
    if run.json {
        say(as_json(found, session, wanted, saved));
    } else if !wanted {
        say("nothing was written");
    }
    if found.blocked { Err(format!("nothing was written: {}", found.refused.join("; ")).into()) } else { Ok(()) }
}

/// True if the controller has these values already, as after a session that is run once more.
fn already(found: &Found, values: &[params::Value], client: &mut Client) -> Result<bool, Error> {
    let now = Settings::read(client)?;
    let gains = found.gains.as_ref().is_none_or(|gains| gains.after == now.gains);
    Ok(gains && values.iter().all(|(register, value)| now.get(&table::name(register)).map(i64::from) == Some(*value)))
}

/// Writes gains and parameters: all of them or none.
fn write(found: &Found, values: &[params::Value], session: &mut Session, client: &mut Client) -> Result<(), Error> {
    let named: Map<_, _> = values.iter().map(|(register, value)| (table::name(register), json!(value))).collect();
    let all = found.gains.as_ref().map(|gains| &gains.after);
    session.done(WRITTEN, json!({ "parameters": named, "gains": all }))?;
    let before = all.map_or(Ok(None), |all| file::set_gains(all, client))?;
    params::set(values, client).map(drop).map_err(|why| match before.map(|before| file::set_gains(&before, client)) {
        None => why,
        Some(Ok(_)) => Error::Other(format!("{why}; the gains are put back")),
        Some(Err(second)) => Error::Other(format!("{why}; and the gains could not be put back: {second}")),
    })
}

fn show(found: &Found, session: &Session) {
    for sentence in found.notes.iter().chain(&found.refused) {
        say(sentence);
    }
    if !found.rows.is_empty() {
        say(format_args!("{:28} {:>10} {:>10} {:>12}", "parameter", "before", "after", "uncertainty"));
    }
    for row in &found.rows {
        let before = session.before.get(row.name).unwrap_or(0);
        let sigma = row.sigma.map_or("-".into(), |sigma| format!("{sigma:.3}"));
        say(format_args!("{:28} {before:>10} {:>10.0} {sigma:>12}", row.name, row.after));
    }
    let Some(gains) = &found.gains else { return };
    say("gains before -> after; - keeps its gain");
    for ((before, after), sigma) in session.before.gains.iter().zip(&gains.after).zip(&gains.sigma) {
        let one = |gain: &u16| f64::from(*gain) / f64::from(GAIN_ONE);
        let cells = before.iter().zip(after).zip(sigma).map(|((before, after), sigma)| match sigma {
            Some(_) => format!("{:.3}->{:.3}", one(before), one(after)),
            None => format!("{:>12}", "-"),
        });
        say(cells.collect::<Vec<_>>().join("  "));
    }
}

/// One object in one line, for programs.
fn as_json(found: &Found, session: &Session, applied: bool, saved: bool) -> Value {
    let rows = || found.rows.iter();
    let mut before: Map<_, _> = rows().map(|row| (row.name.to_owned(), json!(session.before.get(row.name)))).collect();
    let mut after: Map<_, _> = rows().map(|row| (row.name.to_owned(), json!(row.after.round() as i64))).collect();
    let mut sigma: Map<_, _> = rows().map(|row| (row.name.to_owned(), json!(row.sigma))).collect();
    if let Some(gains) = &found.gains {
        before.insert("gains".into(), json!(session.before.gains));
        after.insert("gains".into(), json!(gains.after));
        sigma.insert("gains".into(), json!(gains.sigma));
    }
    let mut all = json!({
        "before": before, "after": after, "sigma": sigma, "refused": found.refused, "applied": applied, "saved": saved,
        "session": session.folder(),
    });
    if let Some(all) = all.as_object_mut() {
        all.extend(found.more.clone());
    }
    all
}
