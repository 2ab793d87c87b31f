//! `fingertip params`: what outlives a reset.

mod file;
pub(super) mod gains;
pub(super) mod set;

use super::{say, say_json};
use crate::state::ANEW;
use crate::table::{self, name};
use crate::{Client, Error};
use fingertip::link::table::Register;
use fingertip::params::Params;
use fingertip::pressure::GAIN_ONE;
use fingertip::shipped::address;
use serde_json::{Map, json};
use std::path::PathBuf;
use std::time::{Duration, Instant};

/// Of `SAVED_STATE`.
const SAME: i64 = 0;
const CHANGED: i64 = 1;
/// A save makes the core wait for the flash.
const SAVE_WITHIN: Duration = Duration::from_secs(5);

/// What to do with them.
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
        /// What `backup` wrote
        file: PathBuf,
        /// Keep them over a reset
        #[arg(long)]
        save: bool,
    },
    /// Show what differs from a file, or from the defaults
    Diff {
        /// What `backup` wrote; the defaults without it
        file: Option<PathBuf>,
    },
}

/// A stored register and its value.
pub type Value = (&'static Register, i64);

/// Does it.
///
/// # Errors
/// See [`Error`]; nothing is half done without a word.
pub fn run(command: &Command, client: &mut Client, json: bool) -> Result<(), Error> {
    match command {
        Command::Get { names } => get(names, client, json),
        Command::Set { values, save } => change(values, *save, client, json),
        Command::Save => {
            save(client, json)?;
            if json {
                say_json(&json!({ "saved": true }));
            }
            Ok(())
        }
        Command::Backup { file, force } => {
            let kept = file::Kept { values: read_all(client)?, gains: Some(gains::read(client)?) };
            file::write(file, *force, client, &kept)?;
            let count = kept.values.len();
            told(json, &kept.values, &format!("{count} parameters and the taxels' gains in {}", file.display()));
            Ok(())
        }
        Command::Restore { file, save } => {
            let file::Kept { mut values, gains } = file::read(file)?;
            // Who moves a device to another address or speed means it, and says so by `set`.
            values.retain(|(register, _)| !is_bus(register));
            restore(&values, gains.as_deref(), *save, client, json)
        }
        Command::Diff { file } => diff(file.as_deref(), client, json),
    }
}

fn get(wanted: &[&'static Register], client: &mut Client, json: bool) -> Result<(), Error> {
    let values = if wanted.is_empty() {
        read_all(client)?
    } else {
        wanted.iter().map(|register| Ok((*register, client.number(register.address)?))).collect::<Result<_, Error>>()?
    };
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

/// Every stored register.
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

/// As [`change`], with the taxels' gains.
fn restore(
    values: &[Value],
    gains: Option<&[Vec<u16>]>,
    save: bool,
    client: &mut Client,
    json: bool,
) -> Result<(), Error> {
    if client.number(address::TORQUE_ENABLE)? != 0 {
        return Err("torque is on: parameters are set with torque off. Nothing was changed".into());
    }
    let before = gains.map_or(Ok(None), |gains| gains::set(gains, client))?;
    if before.is_some() && !json {
        say("the taxels' gains are others now: tare");
    }
    change(values, save, client, json).map_err(|why| match before.map(|before| gains::set(&before, client)) {
        None => why,
        Some(Ok(_)) => Error::Other(format!("{why}; the taxels' gains are put back")),
        Some(Err(second)) => Error::Other(format!("{why}; and the taxels' gains could not be put back: {second}")),
    })
}

/// Sets them, saves them where that is asked for, and says what changed.
fn change(values: &[Value], save_too: bool, client: &mut Client, json: bool) -> Result<(), Error> {
    let changed = set::set(values, client)?;
    let lines: Vec<String> =
        changed.iter().map(|(register, from, to)| format!("{}: {from} -> {to}", name(register))).collect();
    let now: Vec<Value> = changed.iter().map(|(register, _, to)| (*register, *to)).collect();
    let what = if lines.is_empty() { "nothing differs: nothing was changed".into() } else { lines.join("\n") };
    told(json, &now, &what);
    if save_too {
        save(client, json)?;
    }
    if !save_too && !json && !changed.is_empty() {
        say("set until the next reset; `fingertip params save` keeps it");
    }
    Ok(())
}

pub(super) fn save(client: &mut Client, json: bool) -> Result<(), Error> {
    let meant = read_all(client)?;
    client.set(address::SAVE_PARAMETERS, 1)?;
    // The core stands while the flash is written, and may stay silent for that long.
    let timeout = client.set_timeout(SAVE_WITHIN);
    let begun = Instant::now();
    let saved = loop {
        match client.number(address::SAVED_STATE) {
            Ok(CHANGED) if begun.elapsed() < SAVE_WITHIN => std::thread::sleep(Duration::from_millis(5)),
            other => break other,
        }
    };
    client.set_timeout(timeout);
    let saved = saved?;
    // One that started anew has what the flash had, and calls that the same.
    if saved == SAME && read_all(client)? != meant {
        return Err(format!("not saved: {ANEW}, and has what the flash holds. Set them again").into());
    }
    match saved {
        SAME if json => Ok(()),
        SAME => {
            say("saved: a reset keeps them");
            Ok(())
        }
        CHANGED => Err("not saved within 5 s: the flash still holds what it did".into()),
        _ => Err("the save failed: the flash still holds what it did. Torque must be off; try again".into()),
    }
}

fn diff(file: Option<&std::path::Path>, client: &mut Client, json: bool) -> Result<(), Error> {
    let (now, gains_now) = (read_all(client)?, gains::read(client)?);
    let (other, other_gains, what) = match file {
        Some(path) => {
            let file::Kept { values, gains } = file::read(path)?;
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

/// `NAME=VALUE`.
fn assignment(text: &str) -> Result<Value, String> {
    let (wanted, value) = text.split_once('=').ok_or_else(|| format!("`{text}`: NAME=VALUE is asked for"))?;
    let register = table::find(wanted.trim())?;
    let value = value.trim().parse().map_err(|_| {
        format!("{}: `{}` is no whole number; its unit stands in its name", name(register), value.trim())
    })?;
    Ok((register, value))
}

/// What is wrong with a list in which a register stands twice: which of its values is meant, nobody knows.
fn twice(values: &[Value]) -> Option<String> {
    let again = |at: usize| values[..at].iter().any(|(register, _)| register.address == values[at].0.address);
    (0..values.len()).find(|at| again(*at)).map(|at| format!("{} stands there twice", name(values[at].0)))
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

fn told(json: bool, values: &[Value], text: &str) {
    if json { say_json(&as_json(values)) } else { say(text) }
}
