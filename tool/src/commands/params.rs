//! `fingertip params`: what outlives a reset. A backup of it is TOML, a line each with its meaning.

use super::{Interrupt, answer, aside, say, say_json};
use crate::state::RESTARTED;
use crate::table::{self, name};
use crate::{Client, Error, whole};
use fingertip::link::settings::Saved;
use fingertip::link::table::Register;
use fingertip::params::Params;
use fingertip::pressure::GAIN_ONE;
use fingertip::shipped::{Config, Gains, address};
use fingertip::store::BAUD_RATES;
use serde_json::{Map, json};
use std::fs;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};
use toml_edit::Document;

const SAME: i64 = Saved::Same as i64;
const CHANGED: i64 = Saved::Changed as i64;
/// A save makes the core wait for the flash.
const SAVE_WITHIN: Duration = Duration::from_secs(5);

/// Actions on the parameters.
#[derive(Debug, clap::Subcommand)]
#[command(after_help = "Examples:\n  \
    fingertip params get modulus_pa force_max_mn\n  \
    fingertip params set modulus_pa=300000 --save\n  \
    fingertip params save\n  \
    fingertip params backup left-index.toml\n  \
    fingertip params diff left-index.toml\n  \
    fingertip params restore left-index.toml --save")]
pub enum Command {
    /// Show them, with range and meaning
    Get {
        /// Which; all without a name
        #[arg(value_name = "NAME", value_parser = table::find_number)]
        names: Vec<&'static Register>,
    },
    /// Change some, all of them or none
    Set {
        /// Which, and to what
        #[arg(required = true, value_name = "NAME=VALUE", value_parser = assignment)]
        values: Vec<Value>,
        /// Keep them over a reset
        #[arg(long)]
        save: bool,
    },
    /// Keep over a reset what is set now
    Save,
    /// Write all to a file
    Backup {
        /// Which file
        file: PathBuf,
        /// Write over a file that is there
        #[arg(long)]
        force: bool,
    },
    /// Set all that a file has, all of them or none; address and bus speed stay
    Restore {
        /// File that `backup` wrote
        file: PathBuf,
        /// Keep them over a reset
        #[arg(long)]
        save: bool,
    },
    /// Show what differs from a file, or from the defaults
    Diff {
        /// File that `backup` wrote; the defaults without it
        file: Option<PathBuf>,
    },
}

pub type Value = (&'static Register, i64);

/// Does it; nothing is half done without a word.
pub fn run(command: &Command, client: &mut Client, json: bool) -> Result<(), Error> {
    match command {
        Command::Get { names } => get(names, client, json),
        Command::Set { values, save } => conclude(&set(values, None, client)?, *save, client, json),
        Command::Save => {
            save(&Stored::read(client)?, client, json)?;
            if json {
                say_json(&json!({ "saved": true }));
            }
            Ok(())
        }
        Command::Backup { file, force } => {
            let stored = Stored::read(client)?;
            write_backup(file, *force, client, &stored)?;
            let count = stored.values.len();
            let text = format_args!("{count} parameters and the taxels' gains in {}", file.display());
            answer(json, &as_json(&stored.values), text);
            Ok(())
        }
        Command::Restore { file, save } => {
            let (mut values, gains) = read_backup(file, Some(client.number(address::CHIP_ID)?))?;
            // Who moves a device to another address or speed means it, and says so by `set`.
            values.retain(|(register, _)| !is_bus(register));
            conclude(&set(&values, gains, client)?, *save, client, json)
        }
        Command::Diff { file } => diff(file.as_deref(), client, json),
    }
}

fn get(wanted: &[&'static Register], client: &mut Client, json: bool) -> Result<(), Error> {
    let one = |register: &&'static Register| Ok((*register, client.number(register.address)?));
    let values: Vec<Value> =
        if wanted.is_empty() { read_all(client)? } else { wanted.iter().map(one).collect::<Result<_, Error>>()? };
    if json {
        say_json(&as_json(&values));
        return Ok(());
    }
    for (register, value) in &values {
        let default = register.default.filter(|default| default != value);
        let default = default.map_or(String::new(), |default| format!(" (default {default})"));
        let (name, doc, min, max) = (name(register), register.doc.trim(), register.min, register.max);
        say(format_args!("{name:26} {value:>9}{default}  {min} to {max}  {doc}"));
    }
    Ok(())
}

fn read_all(client: &mut Client) -> Result<Vec<Value>, Error> {
    let params = client.read(address::PARAMS, 4 * Params::COUNT as u16)?;
    let block = table::Block { first: address::PARAMS, bytes: params };
    let read = |register: &'static Register| {
        let value =
            if is_param(register) { block.number(register.address) } else { client.number(register.address)? };
        Ok((register, value))
    };
    table::stored().map(read).collect()
}

/// Reports the changes, and saves them on request.
fn conclude(set: &Set, save_too: bool, client: &mut Client, json: bool) -> Result<(), Error> {
    let changed = || set.before.values.iter().zip(&set.meant.values).filter(|(from, to)| from != to);
    let gains = (set.before.gains != set.meant.gains).then(|| "the taxels' gains are others now: tare".into());
    let lines = changed().map(|((register, from), (_, to))| format!("{}: {from} -> {to}", name(register)));
    let lines: Vec<String> = lines.chain(gains).collect();
    let now: Vec<Value> = changed().map(|(_, to)| *to).collect();
    let what = if lines.is_empty() { "nothing differs: nothing was changed".into() } else { lines.join("\n") };
    answer(json, &as_json(&now), what);
    if save_too {
        set.interrupt.check()?;
        save(&set.meant, client, json)?;
    } else if !json && !lines.is_empty() {
        say("set until the next reset; `fingertip params save` keeps it");
    }
    set.interrupt.check()
}

/// Saves what the controller has. Fails where that is not what was meant: it restarted since.
pub(super) fn save(meant: &Stored, client: &mut Client, json: bool) -> Result<(), Error> {
    let lost = |why| Error::Other(format!("not saved: {why}"));
    meant.check(client).map_err(lost)?;
    client.set(address::SAVE_PARAMETERS, 1)?;
    // The core halts while the flash is written, and may stay silent for that long.
    let timeout = std::mem::replace(&mut client.timeout, SAVE_WITHIN);
    let begun = Instant::now();
    let saved = loop {
        match client.number(address::SAVED_STATE) {
            Ok(CHANGED) if begun.elapsed() < SAVE_WITHIN => std::thread::sleep(Duration::from_millis(5)),
            other => break other,
        }
    };
    client.timeout = timeout;
    match saved? {
        SAME => {
            // A controller that restarted has the values of the flash, and reports no difference.
            meant.check(client).map_err(lost)?;
            if !json {
                say("saved: a reset keeps them");
            }
            Ok(())
        }
        CHANGED => Err("not saved within 5 s: the flash still holds what it did".into()),
        _ => Err("the save failed: the flash still holds what it did. Torque must be off; try again".into()),
    }
}

fn diff(file: Option<&Path>, client: &mut Client, json: bool) -> Result<(), Error> {
    let Stored { values: now, gains: gains_now } = Stored::read(client)?;
    let (other, other_gains, what) = match file {
        Some(path) => {
            let (values, gains) = read_backup(path, None)?;
            (values, gains, path.display().to_string())
        }
        None => {
            let ones = gains_now.iter().map(|row| vec![GAIN_ONE; row.len()]).collect();
            (table::stored().filter_map(|r| Some((r, r.default?))).collect(), Some(ones), "the defaults".into())
        }
    };
    let gains_differ = other_gains.filter(|other| *other != gains_now);
    let in_other =
        |register: &Register| other.iter().find(|(r, _)| r.address == register.address).map(|(_, value)| *value);
    let differing: Vec<(&Register, i64, Option<i64>)> = now
        .iter()
        .map(|(r, value)| (*r, *value, in_other(r)))
        .filter(|(_, value, other)| *other != Some(*value))
        .collect();
    if json {
        let line = |(r, now, other): &(&Register, i64, Option<i64>)| (name(r), json!({ "now": now, "other": other }));
        let gains = gains_differ.iter().map(|other| ("gains".to_owned(), json!({ "now": gains_now, "other": other })));
        say_json(&json!(differing.iter().map(line).chain(gains).collect::<Map<_, _>>()));
        return Ok(());
    }
    for (register, value, other) in &differing {
        let other = other.map_or("not there".into(), |other| other.to_string());
        say(format_args!("{:26} {value:>9}  in {what}: {other}", name(register)));
    }
    if let Some(other) = gains_differ {
        let pairs = || gains_now.iter().flatten().zip(other.iter().flatten());
        let count = pairs().filter(|(now, other)| now != other).count();
        say(format_args!("the gains of {count} of {} taxels differ from {what}", pairs().count()));
    }
    say(format_args!("{} of {} differ from {what}", differing.len(), now.len()));
    Ok(())
}

fn assignment(text: &str) -> Result<Value, String> {
    let (wanted, value) = text.split_once('=').ok_or_else(|| format!("`{text}`: NAME=VALUE is asked for"))?;
    let register = table::find(wanted.trim())?;
    let value = value
        .trim()
        .parse()
        .map_err(|_| format!("{}: `{}` is no whole number; its unit is in its name", name(register), value.trim()))?;
    Ok((register, value))
}

/// Returns what is wrong with a list that has a register twice: it is ambiguous which value is meant.
fn twice(values: &[Value]) -> Option<String> {
    let again = |at: usize| values[..at].iter().any(|(register, _)| register.address == values[at].0.address);
    (0..values.len()).find(|at| again(*at)).map(|at| format!("{} is there twice", name(values[at].0)))
}

fn is_param(register: &Register) -> bool {
    (address::PARAMS..address::PARAMS + 4 * Params::COUNT as u16).contains(&register.address)
}

fn is_bus(register: &Register) -> bool {
    [address::ID, address::BAUD_RATE].contains(&register.address)
}

fn as_json(values: &[Value]) -> serde_json::Value {
    json!(values.iter().map(|(register, value)| (name(register), json!(value))).collect::<Map<_, _>>())
}

// Sets what is stored, all of it or nothing.
//
// The gains have a packet, and the parameters another one: the controller takes each whole or not at all. The few other
// registers have a packet each. If a packet is refused, the earlier ones are undone.

/// Registers and gains that a save keeps over a reset.
#[derive(Clone, PartialEq)]
pub(super) struct Stored {
    pub values: Vec<Value>,
    /// Gains in 1/16384, row by row.
    pub gains: Vec<Vec<u16>>,
}

impl Stored {
    pub fn read(client: &mut Client) -> Result<Self, Error> {
        let values = read_all(client)?;
        let columns = (client.number(address::MODEL_INFORMATION)? >> 8 & 0xFF).max(1) as usize;
        let gains = client.block(address::GAINS, address::GAINS)?.numbers(address::GAINS);
        // The registers have 16 bits.
        let gains = gains.chunks(columns).map(|row| row.iter().map(|gain| *gain as u16).collect()).collect();
        Ok(Self { values, gains })
    }

    /// Parameters and gains alone: registers beside the parameters have nothing to do with what is measured.
    pub fn settings(client: &mut Client) -> Result<Self, Error> {
        let mut stored = client.again(Self::read)?;
        stored.values.retain(|(register, _)| is_param(register));
        Ok(stored)
    }

    /// Inverse of [`Stored::json`]; none if a parameter is missing or of another type.
    pub fn of(value: &serde_json::Value) -> Option<Self> {
        let one = |register| Some((register, value["params"][name(register)].as_i64()?));
        let values = table::stored().filter(|register| is_param(register)).map(one).collect::<Option<_>>()?;
        Some(Self { values, gains: serde_json::from_value(value["gains"].clone()).ok()? })
    }

    pub fn json(&self) -> serde_json::Value {
        json!({ "params": as_json(&self.values), "gains": self.gains })
    }

    pub fn get(&self, wanted: &str) -> Option<i64> {
        self.values.iter().find_map(|(register, value)| (name(register) == wanted).then_some(*value))
    }

    pub fn check(&self, client: &mut Client) -> Result<(), Error> {
        let unsure = "Whether all is set is not known: `fingertip params get` shows it";
        let now = client.again(Self::read).map_err(|why| Error::Other(format!("{why}. {unsure}")))?;
        let differs = self.values.iter().zip(&now.values).filter(|(meant, now)| meant != now);
        let names = differs.map(|((register, _), _)| name(register));
        let names: Vec<String> = names.chain((self.gains != now.gains).then(|| GAINS.into())).collect();
        if names.is_empty() {
            return Ok(());
        }
        Err(format!("{RESTARTED}, or was set by another host: {} changed. Set them again", names.join(", ")).into())
    }

    fn bytes(&self) -> Vec<u8> {
        let params = self.values.iter().filter(|(register, _)| is_param(register));
        params.flat_map(|(register, value)| table::encode(register, *value)).collect()
    }

    pub fn params(&self) -> Params {
        let mut values = [0; Params::COUNT];
        let params = self.values.iter().filter(|(register, _)| is_param(register));
        values.iter_mut().zip(params).for_each(|(to, (_, value))| *to = *value as i32);
        Params::from_array(&values)
    }
}

pub(super) struct Set {
    before: Stored,
    pub meant: Stored,
    /// A signal since the first packet: it waits until all is set, and prevents a save that has not begun.
    interrupt: Interrupt,
}

/// A packet that sets a part of what is stored.
enum Packet {
    Gains,
    Params,
    One(usize),
}

impl Packet {
    fn send(&self, to: &Stored, client: &mut Client) -> Result<(), Error> {
        match self {
            Self::Gains => {
                let bytes: Vec<u8> = to.gains.iter().flatten().flat_map(|gain| gain.to_le_bytes()).collect();
                client.again(|client| client.write(address::GAINS, &bytes))
            }
            Self::Params => client.again(|client| client.write(address::PARAMS, &to.bytes())),
            Self::One(at) => set_one(to.values[*at], client),
        }
    }

    fn name(&self, of: &Stored) -> String {
        match self {
            Self::Gains => "the taxels' gains".into(),
            Self::Params => "the parameters".into(),
            Self::One(at) => name(of.values[*at].0),
        }
    }
}

/// Sets these values, and the taxels' gains if they are given. Where one is wrong or torque is on, nothing was changed; where
/// the controller refused, the error says what was changed nevertheless.
pub(super) fn set(values: &[Value], gains: Option<Vec<Vec<u16>>>, client: &mut Client) -> Result<Set, Error> {
    let wrong: Vec<String> = values.iter().filter_map(wrong).chain(twice(values)).collect();
    if !wrong.is_empty() {
        return Err(format!("{}; nothing was changed", wrong.join("; ")).into());
    }
    let before = Stored::read(client)?;
    let mut meant = before.clone();
    for (register, value) in values {
        let same = |(known, _): &&mut Value| known.address == register.address;
        meant.values.iter_mut().filter(same).for_each(|(_, meant)| *meant = *value);
    }
    meant.gains = gains.unwrap_or(meant.gains);
    let shape = |stored: &Stored| stored.gains.iter().map(Vec::len).collect::<Vec<_>>();
    if shape(&meant) != shape(&before) {
        let [rows, columns] = [before.gains.len(), before.gains.first().map_or(0, Vec::len)];
        let why = format!("the array has {rows} rows of {columns} gains, the file others; nothing was changed");
        return Err(why.into());
    }
    // Parameters that contradict each other are refused by the core's own check.
    let config = Config::shipped(&meant.params());
    let config = config.map_err(|why| format!("these do not go together: {why}; nothing was changed"))?;
    config.warnings(|warning| aside(format_args!("warning: {warning}")));
    let changed = before.values.iter().zip(&meant.values).enumerate().filter(|(_, (from, to))| from != to);
    let (params, mut others): (Vec<_>, Vec<_>) =
        changed.map(|(at, (_, to))| (at, *to)).partition(|(_, (register, _))| is_param(register));
    for (_, (_, id)) in others.iter().filter(|(_, (register, _))| register.address == address::ID) {
        if client.is_taken(*id as u8)? {
            let why = "two with one ID cannot be told apart, nor set apart again";
            return Err(format!("another device has the ID {id}: {why}. Nothing was changed").into());
        }
    }
    // Those of the bus come last: behind them the controller is found elsewhere.
    others.sort_by_key(|(_, (register, _))| is_bus(register));
    let gains = (meant.gains != before.gains).then_some(Packet::Gains);
    let params = (!params.is_empty()).then_some(Packet::Params);
    let others = others.into_iter().map(|(at, _)| Packet::One(at));
    let packets: Vec<Packet> = gains.into_iter().chain(params).chain(others).collect();
    if !packets.is_empty() && client.number(address::TORQUE_ENABLE)? != 0 {
        return Err("torque is on: parameters are set with torque off. Nothing was changed".into());
    }
    let interrupt = Interrupt::catch()?;
    for (at, packet) in packets.iter().enumerate() {
        if let Err(why) = packet.send(&meant, client) {
            // What a packet sets may be set also where its answer was lost.
            let sent = if matches!(why, Error::Refused(..)) { at } else { at + 1 };
            return Err(put_back(&before, &packets[..sent], client, &why));
        }
    }
    if !packets.is_empty() {
        meant.check(client)?;
    }
    Ok(Set { before, meant, interrupt })
}

fn set_one((register, value): Value, client: &mut Client) -> Result<(), Error> {
    client.set(register.address, value)?;
    match register.address {
        address::ID => client.id = value as u8,
        address::BAUD_RATE => {
            let baud = BAUD_RATES.get(value as usize).copied();
            client.set_baud(baud.ok_or_else(|| format!("baud_rate of {value}: no such code"))?)?;
        }
        _ => {}
    }
    Ok(())
}

fn wrong((register, value): &Value) -> Option<String> {
    let (min, max) = (register.min, register.max);
    if !table::is_stored(register) {
        return Some(format!("{} is no parameter: it is not stored", name(register)));
    }
    (!(min..=max).contains(value)).then(|| format!("{} of {value}: {min} to {max} are allowed", name(register)))
}

pub fn named(params: &Params) -> Map<String, serde_json::Value> {
    let names = Params::RANGES.iter().map(|(name, ..)| (*name).to_owned());
    names.zip(params.to_array().map(serde_json::Value::from)).collect()
}

/// Undoes what packets set, each of them also after an error of another one; the error has the result.
fn put_back(before: &Stored, packets: &[Packet], client: &mut Client, why: &Error) -> Error {
    let undo = |packet: &Packet| Some((packet.name(before), packet.send(before, client).err()?));
    let failed: Vec<(String, Error)> = packets.iter().rev().filter_map(undo).collect();
    let Some((_, second)) = failed.first() else {
        let back = if packets.is_empty() { "" } else { "what was set before is put back: " };
        let tare = if packets.iter().any(|packet| matches!(packet, Packet::Gains)) { "; tare again" } else { "" };
        return Error::Other(format!("{why}; {back}nothing was changed{tare}"));
    };
    let left = failed.iter().map(|(name, _)| name.as_str()).collect::<Vec<_>>().join(", ");
    Error::Other(format!("{why}; and putting back failed: {second}. A reset brings back the saved values of {left}"))
}

const PARAMETERS: &str = "parameters";
/// The taxels', in rows.
const GAINS: &str = "gains";
/// Number of entries: a file that was cut has fewer, or a last line without an end.
const ENTRIES: &str = "entries";
/// Key of the `chip_id` of the controller that the backup was read from.
const CHIP: &str = "chip_id";

/// Values of registers, and the taxels' gains in rows; `None` if the file has none.
type Backup = (Vec<Value>, Option<Vec<Vec<u16>>>);

/// Writes it, whole or not at all.
fn write_backup(path: &Path, force: bool, client: &mut Client, stored: &Stored) -> Result<(), Error> {
    let Stored { values, gains } = stored;
    let chip = client.number(address::CHIP_ID)?;
    let mut text = format!(
        "# A fingertip's stored parameters, by `fingertip params backup`; `restore` sets them again.\n\
         # Units stand in the names; what is left out stays as it is.\n\
         {CHIP} = {chip}\n{ENTRIES} = {}\n\n[{PARAMETERS}]\n",
        values.len() + gains.len()
    );
    for (register, value) in values {
        let doc = register.doc.trim();
        text += &format!("{} = {value}  # {doc} {} to {}.\n", name(register), register.min, register.max);
    }
    text += &format!("\n# What each taxel's reading is multiplied by, in 16384ths.\n[{GAINS}]\n");
    for (row, gains) in gains.iter().enumerate() {
        text += &format!("row_{row} = {gains:?}\n");
    }
    whole::write(path, force, text.as_bytes())
}

/// Reads it. With the number of a controller, it fails where the backup is of another one.
fn read_backup(path: &Path, chip: Option<i64>) -> Result<Backup, Error> {
    let text = fs::read_to_string(path).map_err(|why| Error::file("read", path, why))?;
    let document = Document::parse(text.as_str()).map_err(|why| Error::file("read", path, why))?;
    let table = document.get(PARAMETERS).and_then(|item| item.as_table());
    let table = table.ok_or_else(|| Error::file("read", path, format_args!("it has no table [{PARAMETERS}]")))?;
    let rows = document.get(GAINS).and_then(|item| item.as_table());
    let entries = table.len() + rows.map_or(0, |rows| rows.len());
    let number = |name: &str| document.get(name).and_then(|item| item.as_integer());
    if let (Some(of), Some(chip)) = (number(CHIP), chip)
        && of != chip
    {
        let why = format!(
            "it is of the controller {CHIP} {of}, and this one has {chip}. Where that is meant, take out the line `{CHIP}`"
        );
        return Err(Error::file("read", path, why));
    }
    if let Some(count) = number(ENTRIES)
        && (count != entries as i64 || !text.ends_with('\n'))
    {
        let why = format!(
            "it was cut, or changed: it has {entries} of {count} entries, and its last line may not be whole. \
             Where that is meant, take out the line `{ENTRIES}`"
        );
        return Err(Error::file("read", path, why));
    }
    let (mut values, mut wrong) = (Vec::new(), Vec::new());
    for (key, item) in table.iter() {
        match (table::find(key), item.as_integer()) {
            (Ok(register), Some(value)) => values.push((register, value)),
            (Ok(_), None) => wrong.push(format!("{key} is no whole number")),
            (Err(why), _) => wrong.push(why),
        }
    }
    wrong.extend(twice(&values));
    let gain = |value: &toml_edit::Value| {
        let gain = value.as_integer().and_then(|gain| u16::try_from(gain).ok());
        gain.filter(|gain| (Gains::MIN..=Gains::MAX).contains(gain))
    };
    let gains = rows.map(|rows| {
        let mut gains = Vec::new();
        for key in (0..rows.len()).map(|row| format!("row_{row}")) {
            let numbers = rows.get(&key).and_then(|item| item.as_array());
            match numbers.map(|numbers| numbers.iter().map(gain).collect::<Option<Vec<u16>>>()) {
                Some(Some(row)) => gains.push(row),
                None => wrong.push(format!("[{GAINS}] lacks {key}: rows count from 0")),
                Some(None) => {
                    let (min, max) = (Gains::MIN, Gains::MAX);
                    wrong.push(format!("[{GAINS}] {key}: a gain is a whole number from {min} to {max}"));
                }
            }
        }
        gains
    });
    if wrong.is_empty() { Ok((values, gains)) } else { Err(Error::file("read", path, wrong.join("; "))) }
}
