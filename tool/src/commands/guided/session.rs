//! A session: parameters and gains before it, and the steps that are done. With a folder it outlives the program.
//!
//! | file | content |
//! | --- | --- |
//! | `session.json` | command, device, parameters and gains before, and the steps by name |
//! | `press-1.fts`, `strokes.fts` | a motion's record, byte for byte as the controller delivered it |
//!
//! A file is written beside its place and renamed once it is whole. A record is listed in `session.json` after it was
//! written: a kill between the two repeats the motion.

use crate::commands::params::gains;
use crate::whole::Part;
use crate::{Client, Error, table};
use fingertip::params::Params;
use fingertip::shipped::address;
use serde_json::{Map, Value, json};
use std::collections::BTreeMap;
use std::fs;
use std::io::Write as _;
use std::path::{Path, PathBuf};

/// Version of `session.json`.
const VERSION: u64 = 1;

/// Parameters and gains of the controller at one time.
#[derive(Clone, Debug, PartialEq)]
pub struct Settings {
    /// The parameters.
    pub params: Params,
    /// Gains in 1/16384, row by row.
    pub gains: Vec<Vec<u16>>,
}

impl Settings {
    /// Reads them.
    ///
    /// # Errors
    /// See [`Error`].
    pub fn read(client: &mut Client) -> Result<Self, Error> {
        let bytes = client.again(|client| client.read(address::PARAMS, 4 * Params::COUNT as u16))?;
        let block = table::Block { first: address::PARAMS, bytes };
        let mut values = [0; Params::COUNT];
        for (index, value) in values.iter_mut().enumerate() {
            *value = block.number(address::PARAMS + 4 * index as u16) as i32;
        }
        Ok(Self { params: Params::from_array(&values), gains: gains::read(client)? })
    }

    /// Value of a parameter by its name.
    pub fn get(&self, name: &str) -> Option<i32> {
        let index = Params::RANGES.iter().position(|(known, ..)| *known == name)?;
        self.params.to_array().get(index).copied()
    }

    fn json(&self) -> Value {
        let names = Params::RANGES.iter().map(|(name, ..)| (*name).to_owned());
        let params: Map<_, _> = names.zip(self.params.to_array().map(Value::from)).collect();
        json!({ "params": params, "gains": self.gains })
    }

    fn of(value: &Value) -> Option<Self> {
        let mut values = [0; Params::COUNT];
        for (value_, (name, ..)) in values.iter_mut().zip(Params::RANGES) {
            *value_ = value["params"][name].as_i64()?.try_into().ok()?;
        }
        let row = |row: &Value| -> Option<Vec<u16>> {
            row.as_array()?.iter().map(|gain| gain.as_u64()?.try_into().ok()).collect()
        };
        let gains = value["gains"].as_array()?.iter().map(row).collect::<Option<_>>()?;
        Some(Self { params: Params::from_array(&values), gains })
    }
}

/// A session.
#[derive(Debug)]
pub struct Session {
    folder: Option<PathBuf>,
    command: &'static str,
    id: u8,
    /// Settings with which all records were made.
    pub before: Settings,
    steps: Map<String, Value>,
    records: BTreeMap<String, Vec<u8>>,
}

impl Session {
    /// Begins a session, or resumes the one in the folder.
    ///
    /// # Errors
    /// The folder cannot be read or written, or has a session of another command or device.
    pub fn open(folder: Option<&Path>, command: &'static str, client: &mut Client) -> Result<Self, Error> {
        let mut session = Self {
            folder: folder.map(Path::to_owned),
            command,
            id: client.id,
            before: Settings::read(client)?,
            steps: Map::new(),
            records: BTreeMap::new(),
        };
        let Some(folder) = folder else { return Ok(session) };
        fs::create_dir_all(folder).map_err(|why| Error::file("make the folder", folder, why))?;
        let file = folder.join("session.json");
        let text = match fs::read_to_string(&file) {
            Ok(text) => text,
            Err(why) if why.kind() == std::io::ErrorKind::NotFound => {
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
        session.before = Settings::of(&value["before"]).ok_or_else(|| not_one("the settings before are damaged"))?;
        session.steps = value["steps"].as_object().cloned().ok_or_else(|| not_one("the steps are damaged"))?;
        for name in session.steps.keys().filter(|name| name.ends_with(".fts")) {
            let file = folder.join(name);
            let bytes = fs::read(&file).map_err(|why| Error::file("read", &file, why))?;
            session.records.insert(name.clone(), bytes);
        }
        Ok(session)
    }

    /// The folder, for the result.
    pub fn folder(&self) -> Option<String> {
        self.folder.as_ref().map(|folder| folder.display().to_string())
    }

    /// A step that is done.
    pub fn step(&self, name: &str) -> Option<&Value> {
        self.steps.get(name)
    }

    /// A record that was read.
    pub fn record(&self, name: &str) -> Option<&[u8]> {
        self.records.get(name).map(Vec::as_slice)
    }

    /// Keeps a step.
    ///
    /// # Errors
    /// The folder cannot be written.
    pub fn done(&mut self, name: &str, value: Value) -> Result<(), Error> {
        self.steps.insert(name.into(), value);
        self.keep()
    }

    /// Keeps a record.
    ///
    /// # Errors
    /// The folder cannot be written.
    pub fn recorded(&mut self, name: &str, bytes: Vec<u8>) -> Result<(), Error> {
        if let Some(folder) = &self.folder {
            write(&folder.join(name), &bytes)?;
        }
        let length = bytes.len();
        self.records.insert(name.into(), bytes);
        self.done(name, json!({ "bytes": length }))
    }

    /// Forgets steps that begin with this, so that the next run repeats them.
    ///
    /// # Errors
    /// The folder cannot be written.
    pub fn forget(&mut self, begin: &str) -> Result<(), Error> {
        self.steps.retain(|name, _| !name.starts_with(begin));
        self.records.retain(|name, _| !name.starts_with(begin));
        self.keep()
    }

    fn keep(&self) -> Result<(), Error> {
        let Some(folder) = &self.folder else { return Ok(()) };
        let value = json!({
            "version": VERSION, "command": self.command, "id": self.id, "before": self.before.json(), "steps": self.steps,
        });
        write(&folder.join("session.json"), &serde_json::to_vec_pretty(&value).unwrap_or_default())
    }
}

fn write(place: &Path, bytes: &[u8]) -> Result<(), Error> {
    let part = Part::begin(place, true)?;
    part.file().and_then(|mut file| file.write_all(bytes)).map_err(|why| Error::file("write", place, why))?;
    part.place()
}
