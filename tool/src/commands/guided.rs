//! Common parts of the guided procedures (`commission`, `identify`, `calibrate`): options, questions, the session, and at the
//! end a table of what was found, with one write of all of it.

pub(super) mod motion;

use super::params::{self, Stored};
use super::{INTERRUPT_EVERY, Interrupt, aside, report, say};
use crate::{Client, Error, numbers, table, whole};
use base64::prelude::{BASE64_STANDARD, Engine as _};
use fingertip::pressure::GAIN_ONE;
use fingertip::shipped::address;
use rustix::event::{PollFd, PollFlags, Timespec, poll};
use rustix::io::{Errno, read};
use rustix::termios::{QueueSelector, tcflush};
use serde_json::{Map, Value, json};
use std::path::{Path, PathBuf};
use std::{fs, io};

#[derive(Debug, clap::Args)]
pub struct Options {
    /// Folder that keeps each record and step; the same folder resumes the procedure
    #[arg(long, value_name = "DIR")]
    session: Option<PathBuf>,
    /// Write the parameters without asking
    #[arg(long)]
    apply: bool,
    /// Keep the parameters over a reset, once they are written
    #[arg(long)]
    save: bool,
    /// Longest time for one motion
    #[arg(long, default_value_t = 120.0, value_parser = numbers::seconds)]
    within_s: f64,
}

#[derive(Debug, clap::Args)]
pub struct Presses {
    /// Pause in the air before each tare: creep of the press before would shift the zeros
    #[arg(long, default_value_t = 10.0, value_parser = numbers::seconds)]
    pub(super) pause_s: f64,
    /// Do not ask for Enter before a press
    #[arg(long)]
    pub(super) no_wait: bool,
}

impl Presses {
    /// Refuses questions that `--json` cannot ask.
    pub(super) fn check(&self, json: bool) -> Result<(), Error> {
        if !json || self.no_wait {
            return Ok(());
        }
        let why = "--json asks no questions: give --no-wait, with plate and finger in place";
        Err(Error::NotUnderstood(why.into()))
    }
}

/// A procedure under way: what it may do, the controller, what is kept of it and what it found.
pub(super) struct Procedure<'a> {
    pub run: Run<'a>,
    pub client: &'a mut Client,
    pub session: Session,
    pub found: Found,
}

impl<'a> Procedure<'a> {
    /// Catches signals from here on, and begins or resumes the session.
    pub fn begin(name: &'static str, options: &'a Options, json: bool, client: &'a mut Client) -> Result<Self, Error> {
        let run = Run { options, interrupt: Interrupt::catch()?, json };
        let session = Session::open(options.session.as_deref(), name, client)?;
        let mut procedure = Self { run, client, session, found: Found::default() };
        procedure.settings()?;
        Ok(procedure)
    }

    /// True if the session has this step, which is then not repeated: the user reads that.
    pub fn reuses(&self, step: &str) -> bool {
        let has = self.session.steps.contains_key(step);
        if has {
            aside(format_args!("the session has the step {step}: it is reused"));
        }
        has
    }
}

/// How a procedure runs: its options, and the way to the person at the terminal.
pub(super) struct Run<'a> {
    options: &'a Options,
    interrupt: Interrupt,
    pub json: bool,
}

/// Wrong answers to one question after which the procedure ends.
const TRIES: u32 = 3;

impl Run<'_> {
    pub fn report(&self, text: impl std::fmt::Display) {
        report(text, self.json);
    }

    /// Asks until the answer can be parsed, three times at most. `idle` runs every 50 ms meanwhile. `option` gives the answer
    /// without a question, which `--json` demands. Keys that were pressed before the question do not answer it.
    fn parsed<T>(
        &self,
        question: &str,
        option: &str,
        parse: impl Fn(&str) -> Result<T, String>,
        idle: &mut dyn FnMut() -> Result<(), Error>,
    ) -> Result<T, Error> {
        if self.json {
            return Err(Error::NotUnderstood(format!("--json asks no questions: give {option} (\"{question}\")")));
        }
        let mut why = String::new();
        for _ in 0..TRIES {
            // Drops keys pressed before the question. Without a terminal this fails, and a pipe keeps its lines.
            let _ = tcflush(io::stdin(), QueueSelector::IFlush);
            aside(question);
            let line = self.line(option, idle)?;
            match parse(line.trim()) {
                Ok(answer) => return Ok(answer),
                Err(wrong) => why = format!("`{}`: {wrong}", line.trim()),
            }
            aside(&why);
        }
        Err(format!("{why}. {TRIES} answers to \"{question}\" were not understood; {option} gives the answer").into())
    }

    pub fn yes(&self, question: &str, option: &str) -> Result<bool, Error> {
        self.parsed(&format!("{question} [yes/no]"), option, yes_or_no, &mut || Ok(()))
    }

    pub fn enter(&self, question: &str, option: &str) -> Result<(), Error> {
        self.parsed(&format!("{question}; then press Enter"), option, |_| Ok(()), &mut || Ok(()))
    }

    fn line(&self, option: &str, idle: &mut dyn FnMut() -> Result<(), Error>) -> Result<String, Error> {
        let (input, wait) = (io::stdin(), Timespec { tv_sec: 0, tv_nsec: INTERRUPT_EVERY.subsec_nanos().into() });
        // A read of one byte never waits for the rest of a line. Bytes behind the line stay for the next question.
        let (mut line, mut byte) = (Vec::new(), [0]);
        loop {
            self.interrupt.check()?;
            idle()?;
            let ready = poll(&mut [PollFd::new(&input, PollFlags::IN)], Some(&wait));
            match ready.and_then(|ready| if ready == 0 { Err(Errno::AGAIN) } else { read(&input, &mut byte) }) {
                Ok(0) if line.is_empty() => return Err(format!("nobody answers: give {option}").into()),
                Ok(1) if byte != *b"\n" => line.extend(byte),
                Ok(_) => return Ok(String::from_utf8_lossy(&line).into_owned()),
                Err(Errno::AGAIN | Errno::INTR) => {}
                Err(why) => return Err(format!("cannot read an answer: {why}").into()),
            }
        }
    }
}

pub fn yes_or_no(text: &str) -> Result<bool, String> {
    match text.to_lowercase().as_str() {
        "y" | "yes" => Ok(true),
        "n" | "no" => Ok(false),
        _ => Err("yes or no is expected".into()),
    }
}

// A session: parameters and gains before it, and the steps that are done. With a folder it outlives the program:
// `session.json` has command, device, parameters and gains before, and the steps by name. The record of a motion is such a
// step, byte for byte as the controller delivered it, in base64.

const VERSION: u64 = 5;

pub(super) struct Session {
    folder: Option<PathBuf>,
    command: &'static str,
    id: u8,
    chip_id: i64,
    /// Parameters and gains with which all records were made.
    pub before: Stored,
    pub steps: Map<String, Value>,
}

impl Session {
    /// Begins a session, or resumes the one in the folder, which must be of the same command and device.
    fn open(folder: Option<&Path>, command: &'static str, client: &mut Client) -> Result<Self, Error> {
        let mut session = Self {
            folder: folder.map(Path::to_owned),
            command,
            id: client.id,
            chip_id: client.number(address::CHIP_ID)?,
            before: Stored::settings(client)?,
            steps: Map::new(),
        };
        let Some(folder) = folder else { return Ok(session) };
        fs::create_dir_all(folder).map_err(|why| Error::file("make the folder", folder, why))?;
        let file = folder.join("session.json");
        let text = match fs::read_to_string(&file) {
            Ok(text) => text,
            Err(why) if why.kind() == io::ErrorKind::NotFound => {
                session.keep()?;
                return Ok(session);
            }
            Err(why) => return Err(Error::file("read", &file, why)),
        };
        let not_one = |why: &str| Error::Other(format!("{}: {why}; name another folder", file.display()));
        let value: Value = serde_json::from_str(&text).map_err(|why| not_one(&why.to_string()))?;
        if value["version"].as_u64() != Some(VERSION) {
            return Err(not_one("not a session that this version knows"));
        }
        if value["command"] != command || value["id"] != client.id {
            let (command, id) = (&value["command"], &value["id"]);
            return Err(not_one(&format!("a session of the command {command} with ID {id}")));
        }
        let (before, now) = (&value["chip_id"], session.chip_id);
        if *before != now {
            return Err(not_one(&format!("a session of the finger with chip_id {before}; this one has {now}")));
        }
        session.before = Stored::of(&value["before"]).ok_or_else(|| not_one("the settings before are damaged"))?;
        session.steps = value["steps"].as_object().cloned().ok_or_else(|| not_one("the steps are damaged"))?;
        Ok(session)
    }

    /// Numbers of a step that is done; none of one that is not.
    pub fn numbers(&self, step: &str) -> &[Value] {
        self.steps.get(step).and_then(Value::as_array).map(Vec::as_slice).unwrap_or_default()
    }

    pub fn done(&mut self, name: &str, value: Value) -> Result<(), Error> {
        self.steps.insert(name.into(), value);
        self.keep()
    }

    pub fn recorded(&mut self, name: &str, bytes: &[u8]) -> Result<(), Error> {
        self.done(name, BASE64_STANDARD.encode(bytes).into())
    }

    /// Bytes of a record; none of a step that is not done.
    pub fn record(&self, name: &str) -> Result<Vec<u8>, Error> {
        let text = self.steps.get(name).and_then(Value::as_str).unwrap_or_default();
        BASE64_STANDARD.decode(text).map_err(|why| format!("the session's record {name} is damaged: {why}").into())
    }

    /// Forgets steps that begin with this, so that the next run repeats them.
    pub fn forget(&mut self, begin: &str) -> Result<(), Error> {
        self.steps.retain(|name, _| !name.starts_with(begin));
        self.keep()
    }

    fn keep(&self) -> Result<(), Error> {
        let Some(folder) = &self.folder else { return Ok(()) };
        let value = json!({
            "version": VERSION, "command": self.command, "id": self.id, "chip_id": self.chip_id,
            "before": self.before.json(), "steps": self.steps,
        });
        whole::write(&folder.join("session.json"), true, &serde_json::to_vec_pretty(&value).unwrap_or_default())
    }
}

pub struct Row {
    /// Name of the parameter, which ends with its unit.
    name: &'static str,
    after: f64,
    /// Standard uncertainty in the same unit; none for what a person said.
    sigma: Option<f64>,
}

pub struct GainRows {
    /// Gains to write, in 1/16384, row by row.
    pub after: Vec<Vec<u16>>,
    /// Relative standard uncertainties; none for taxels that keep their gain.
    pub sigma: Vec<Vec<Option<f64>>>,
}

#[derive(Default)]
pub struct Found {
    rows: Vec<Row>,
    pub gains: Option<GainRows>,
    /// Sentences: presses, numbers and taxels that do not count, each with its reason.
    pub refused: Vec<String>,
    /// True if a part that was requested has no result: nothing is written then.
    blocked: bool,
    /// True if the controller has the values at the end, and if its flash has them.
    applied: bool,
    saved: bool,
    /// Further entries of the JSON object: dead and odd taxels, remaining errors.
    pub more: Map<String, Value>,
    /// Remarks for the user, one sentence each.
    pub notes: Vec<String>,
}

impl Found {
    pub fn row(&mut self, name: &'static str, after: f64, sigma: Option<f64>) {
        self.rows.push(Row { name, after, sigma });
    }

    /// Records why a part has no result. The procedure then writes no parameter.
    pub fn refuse(&mut self, why: String) {
        self.refused.push(why);
        self.blocked = true;
    }
}

/// Not compared: the jog changes it.
pub(super) const DIRECTION: &str = "direction_confirmed";
/// Name of the step that lists all settings sent to the controller, also those of which the write failed.
const WRITTEN: &str = "written";

impl Session {
    /// Names of parameters, and `gains`, that have neither the value before the session nor, with `written`, one that the
    /// session sent.
    fn changed(&self, now: &Stored, written: bool) -> Vec<String> {
        let written = if written { self.numbers(WRITTEN) } else { &[] };
        let sent: Vec<Stored> = written.iter().filter_map(Stored::of).chain([self.before.clone()]).collect();
        let names = now.values.iter().map(|(register, value)| (table::name(register), *value));
        let differs =
            |(name, value): &(String, i64)| name != DIRECTION && sent.iter().all(|sent| sent.get(name) != Some(*value));
        let gains = sent.iter().all(|sent| sent.gains != now.gains).then(|| "gains".into());
        names.filter(differs).map(|(name, _)| name).chain(gains).collect()
    }
}

impl Procedure<'_> {
    /// Reads parameters and gains. Fails if one is neither as before the session nor as the session sent it.
    fn settings(&mut self) -> Result<Stored, Error> {
        let now = Stored::settings(self.client)?;
        let names = self.session.changed(&now, true).join(", ");
        if names.is_empty() {
            return Ok(now);
        }
        let why = format!("the controller's {names} changed since this session began (did it restart?)");
        Err(format!("{why}: begin another one").into())
    }

    /// Fails unless the settings are those before the session: all motions of a session are made and solved with them.
    pub fn unchanged(&mut self) -> Result<(), Error> {
        let now = self.settings()?;
        if self.session.changed(&now, false).is_empty() {
            return Ok(());
        }
        Err("this session's values are written: begin another one, as a motion needs the settings before".into())
    }

    /// Refuses a part, and drops its step: the next run repeats it.
    pub fn without(&mut self, step: &str, why: String) -> Result<(), Error> {
        self.found.refuse(why);
        self.session.forget(step)
    }

    /// Shows the results, writes them if confirmed, and prints the JSON object, also where that fails. Fails if a part has
    /// no result, or the controller refuses: then nothing was changed.
    pub fn finish(mut self) -> Result<(), Error> {
        if !self.run.json {
            self.show();
        }
        let mut after = None;
        if !self.found.blocked && (!self.found.rows.is_empty() || self.found.gains.is_some()) {
            let now = self.settings()?;
            let wanted = self.after(&now);
            // As after a session that is run once more.
            let is_set = wanted == now;
            if is_set
                || self.run.options.apply
                || !self.run.json && self.run.yes("write these values to the controller?", "--apply")?
            {
                after = Some((wanted, is_set));
            }
        }
        self.run.interrupt.check()?;
        let done = after.as_ref().map_or(Ok(()), |(after, is_set)| self.write(after, *is_set));
        if self.run.json {
            say(self.as_json());
        } else if after.is_none() {
            say("no result was written");
        }
        let Found { blocked, refused, .. } = self.found;
        if blocked { Err(format!("no result was written: {}", refused.join("; ")).into()) } else { done }
    }

    /// Settings before the session with what it found: nothing else that an earlier run of it wrote is left.
    fn after(&self, now: &Stored) -> Stored {
        let mut after = self.session.before.clone();
        for (register, value) in &mut after.values {
            let name = table::name(register);
            if let Some(row) = self.found.rows.iter().find(|row| row.name == name) {
                *value = row.after.round() as i64;
            } else if name == DIRECTION {
                *value = now.get(DIRECTION).unwrap_or(*value);
            }
        }
        if let Some(gains) = &self.found.gains {
            after.gains.clone_from(&gains.after);
        }
        after
    }

    /// Writes gains and parameters, all of them or none; tares if new gains need that, and saves.
    fn write(&mut self, after: &Stored, is_set: bool) -> Result<(), Error> {
        if !is_set {
            // The controller may have restarted while the question waited.
            self.settings()?;
            let mut written = self.session.numbers(WRITTEN).to_vec();
            written.push(after.json());
            self.session.done(WRITTEN, written.into())?;
        }
        // Only commissioning confirms the direction.
        let confirms = self.found.rows.iter().any(|row| row.name == DIRECTION);
        let values =
            after.values.iter().copied().filter(|(register, _)| confirms || table::name(register) != DIRECTION);
        let values: Vec<params::Value> = values.collect();
        let meant = params::set(&values, Some(after.gains.clone()), self.client)?.meant;
        if !is_set {
            self.run.report("written; `fingertip params save` or --save keeps them over a reset");
        }
        // The zeros of the old gains are wrong under new ones: the controller asks for a tare.
        let mut failed = Vec::new();
        if self.found.gains.is_some() && !self.is_tared()? {
            let why = |why| format!("the values are written, but the tare that new gains need failed: {why}");
            failed.extend(self.zeros().err().map(why));
        }
        if self.run.options.save {
            let saved = params::save(&meant, self.client, self.run.json);
            self.found.saved = saved.is_ok();
            failed.extend(saved.err().map(|why| why.to_string()));
        }
        meant.check(self.client)?;
        self.found.applied = true;
        if failed.is_empty() { Ok(()) } else { Err(failed.join("; ").into()) }
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

    fn as_json(&self) -> Value {
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
            "before": before, "after": after, "sigma": sigma, "refused": found.refused, "applied": found.applied,
            "saved": found.saved, "session": self.session.folder,
        });
        if let Some(all) = all.as_object_mut() {
            all.extend(found.more.clone());
        }
        all
    }
}
