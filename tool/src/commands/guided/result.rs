//! The end of a procedure: a table of what was found, and one write of all of it.

use super::{Procedure, Session, Settings};
use crate::commands::{params, say};
use crate::{Client, Error, table};
use fingertip::params::Params;
use fingertip::pressure::GAIN_ONE;
use serde_json::{Map, Value, json};

/// A parameter that was measured.
pub struct Row {
    /// Name of the parameter, which ends with its unit.
    name: &'static str,
    /// Value to write.
    after: f64,
    /// Standard uncertainty in the same unit; none for what a person said.
    sigma: Option<f64>,
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
    rows: Vec<Row>,
    pub gains: Option<GainRows>,
    /// Sentences: presses, numbers and taxels that do not count, each with its reason.
    pub refused: Vec<String>,
    /// True if a part that was requested has no result: nothing is written then.
    blocked: bool,
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
pub fn same_settings(session: &Session, client: &mut Client) -> Result<(), Error> {
    let (now, before) = (Settings::read(client)?, &session.before);
    let written = session.steps.get(WRITTEN);
    let differs = |name: &&str| {
        let written = written.and_then(|written| written["parameters"][*name].as_i64());
        now.get(name) != before.get(name) && now.get(name).map(i64::from) != written
    };
    let names = Params::RANGES.into_iter().map(|(name, ..)| name).filter(|name| *name != "direction_confirmed");
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

impl Procedure<'_> {
    /// Shows the results, writes them if confirmed, and prints the JSON object. Fails if a part has no result, or the
    /// controller refuses: then nothing was changed.
    pub fn finish(mut self) -> Result<(), Error> {
        if !self.run.json {
            self.show();
        }
        let value = |row: &Row| Ok((table::find(row.name)?, row.after.round() as i64));
        let values: Vec<params::Value> = self.found.rows.iter().map(value).collect::<Result<_, String>>()?;
        // As after a session that is run once more.
        let now = Settings::read(self.client)?;
        let is_set = self.found.gains.as_ref().is_none_or(|gains| gains.after == now.gains)
            && values.iter().all(|(register, value)| now.get(&table::name(register)).map(i64::from) == Some(*value));
        let nothing = self.found.rows.is_empty() && self.found.gains.is_none();
        let wanted = !self.found.blocked
            && !nothing
            && (is_set
                || self.run.options.apply
                || !self.run.json && { self.run.yes("write these values to the controller?", "--apply")? });
        self.run.interrupt.check()?;
        if wanted && !is_set {
            self.write(&values)?;
            self.run.report("written; `fingertip params save` or --save keeps them over a reset");
            if self.found.gains.is_some() {
                // The zeros of the old gains are wrong under new ones.
                self.tare()
                    .map_err(|why| format!("the values are written, but the tare that new gains need failed: {why}"))?;
            }
        }
        let saved = wanted && self.run.options.save;
        if saved {
            params::save(self.client, self.run.json)?;
        }
        if self.run.json {
            say(self.as_json(wanted, saved));
        } else if !wanted {
            say("nothing was written");
        }
        let Found { blocked, refused, .. } = self.found;
        if blocked { Err(format!("nothing was written: {}", refused.join("; ")).into()) } else { Ok(()) }
    }

    /// Writes gains and parameters: all of them or none.
    fn write(&mut self, values: &[params::Value]) -> Result<(), Error> {
        let named: Map<_, _> = values.iter().map(|(register, value)| (table::name(register), json!(value))).collect();
        let gains = self.found.gains.as_ref().map(|gains| gains.after.as_slice());
        self.session.done(WRITTEN, json!({ "parameters": named, "gains": gains }))?;
        params::with_gains(gains, self.client, |client, _| params::set(values, client).map(drop))
    }

    fn show(&self) {
        let (found, before) = (&self.found, &self.session.before);
        for sentence in found.notes.iter().chain(&found.refused) {
            say(sentence);
        }
        if !found.rows.is_empty() {
            say(format_args!("{:28} {:>10} {:>10} {:>12}", "parameter", "before", "after", "uncertainty"));
        }
        for row in &found.rows {
            let before = before.get(row.name).unwrap_or(0);
            let sigma = row.sigma.map_or("-".into(), |sigma| format!("{sigma:.3}"));
            say(format_args!("{:28} {before:>10} {:>10.0} {sigma:>12}", row.name, row.after));
        }
        let Some(gains) = &found.gains else { return };
        say("gains before -> after; - keeps its gain");
        for ((before, after), sigma) in before.gains.iter().zip(&gains.after).zip(&gains.sigma) {
            let one = |gain: &u16| f64::from(*gain) / f64::from(GAIN_ONE);
            let cells = before.iter().zip(after).zip(sigma).map(|((before, after), sigma)| match sigma {
                Some(_) => format!("{:.3}->{:.3}", one(before), one(after)),
                None => format!("{:>12}", "-"),
            });
            say(cells.collect::<Vec<_>>().join("  "));
        }
    }

    /// One object in one line, for programs.
    fn as_json(&self, applied: bool, saved: bool) -> Value {
        let (found, settings) = (&self.found, &self.session.before);
        let [mut before, mut after, mut sigma] = [(); 3].map(|()| Map::new());
        for row in &found.rows {
            before.insert(row.name.into(), json!(settings.get(row.name)));
            after.insert(row.name.into(), json!(row.after.round() as i64));
            sigma.insert(row.name.into(), json!(row.sigma));
        }
        if let Some(gains) = &found.gains {
            before.insert("gains".into(), json!(settings.gains));
            after.insert("gains".into(), json!(gains.after));
            sigma.insert("gains".into(), json!(gains.sigma));
        }
        let mut all = json!({
            "before": before, "after": after, "sigma": sigma, "refused": found.refused, "applied": applied, "saved": saved,
            "session": self.session.folder,
        });
        if let Some(all) = all.as_object_mut() {
            all.extend(found.more.clone());
        }
        all
    }
}
