//! A backup: TOML, a line each with its meaning.

use super::{Value, twice};
use crate::table::{self, name};
use crate::{Client, Error, whole};
use fingertip::shipped::{Gains, address};
use std::fmt::Write as _;
use std::fs;
use std::io::ErrorKind;
use std::path::Path;
use toml_edit::Document;

const TABLE: &str = "parameters";
/// The taxels', in rows.
const GAINS: &str = "gains";
/// Number of entries: a file that was cut has fewer, or a last line without an end.
const COUNT: &str = "entries";

/// Content of a backup.
pub(super) struct Kept {
    /// Values of registers with a name.
    pub values: Vec<Value>,
    /// The taxels' gains, in rows; `None` if the file has none.
    pub gains: Option<Vec<Vec<u16>>>,
}

/// Writes it, whole or not at all.
pub(super) fn write(path: &Path, force: bool, client: &mut Client, kept: &Kept) -> Result<(), Error> {
    let Kept { values, gains } = kept;
    let gains = gains.as_deref().unwrap_or_default();
    let information = client.number(address::MODEL_INFORMATION)?;
    let pong = client.ping()?;
    let mut text = format!(
        "# A fingertip's stored parameters, by `fingertip params backup`; `restore` sets them again.\n\
         # Units stand in the names; what is left out stays as it is.\nfirmware_version = {}\ntable_version = {}\n\
         {COUNT} = {}\n\n[{TABLE}]\n",
        pong.firmware,
        information >> 16,
        values.len() + gains.len()
    );
    for (register, value) in values {
        let doc = register.doc.trim();
        // Writing to a string does not fail.
        let _ = writeln!(text, "{} = {value}  # {doc} {} to {}.", name(register), register.min, register.max);
    }
    if !gains.is_empty() {
        let _ = writeln!(text, "\n# What each taxel's reading is multiplied by, in 16384ths.\n[{GAINS}]");
    }
    for (row, gains) in gains.iter().enumerate() {
        let _ = writeln!(text, "row_{row} = {gains:?}");
    }
    whole::write(path, force, text.as_bytes())
}

/// Reads it.
pub(super) fn read(path: &Path) -> Result<Kept, Error> {
    let text = fs::read_to_string(path).map_err(|why| match why.kind() {
        ErrorKind::InvalidData => Error::file("read", path, "it is no text"),
        _ => Error::file("read", path, why),
    })?;
    let document = Document::parse(text.as_str()).map_err(|why| Error::file("read", path, why))?;
    let table = document.get(TABLE).and_then(|item| item.as_table());
    let table = table.ok_or_else(|| Error::file("read", path, format_args!("it has no table [{TABLE}]")))?;
    let rows = document.get(GAINS).and_then(|item| item.as_table());
    let entries = table.len() + rows.map_or(0, |rows| rows.len());
    if let Some(count) = document.get(COUNT).and_then(|item| item.as_integer())
        && (count != entries as i64 || !text.ends_with('\n'))
    {
        let why = format!(
            "it was cut, or changed: it has {} of {count} entries, and its last line may not be whole. \
             Where that is meant, take out the line `{COUNT}`",
            entries
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
    let mut gains = rows.map(|_| Vec::new());
    for (row, key) in (0..).map(|row| (row, format!("row_{row}"))).take(rows.map_or(0, |rows| rows.len())) {
        let numbers = rows.and_then(|rows| rows.get(&key)).and_then(|item| item.as_array());
        let gain = |value: &toml_edit::Value| {
            value
                .as_integer()
                .and_then(|gain| u16::try_from(gain).ok())
                .filter(|gain| (Gains::MIN..=Gains::MAX).contains(gain))
        };
        match (numbers.map(|numbers| numbers.iter().map(gain).collect::<Option<Vec<u16>>>()), &mut gains) {
            (Some(Some(row)), Some(gains)) => gains.push(row),
            (None, _) => wrong.push(format!("[{GAINS}] lacks {key}: rows count from 0")),
            _ => wrong.push(format!(
                "[{GAINS}] row_{row}: a gain is a whole number from {} to {}",
                Gains::MIN,
                Gains::MAX
            )),
        }
    }
    if wrong.is_empty() { Ok(Kept { values, gains }) } else { Err(Error::file("read", path, wrong.join("; "))) }
}

// The taxels' gains, which outlive a reset beside the parameters.

/// All of them, in rows.
pub(in crate::commands) fn read_gains(client: &mut Client) -> Result<Vec<Vec<u16>>, Error> {
    let columns = (client.number(address::MODEL_INFORMATION)? >> 8 & 0xFF).max(1) as usize;
    let gains = client.block(address::GAINS, address::GAINS)?.numbers(address::GAINS);
    // The registers have 16 bits.
    Ok(gains.chunks(columns).map(|row| row.iter().map(|gain| *gain as u16).collect()).collect())
}

/// Sets them, all or none, with torque off. What they were, where that is something else: a tare is needed then.
pub(in crate::commands) fn set_gains(gains: &[Vec<u16>], client: &mut Client) -> Result<Option<Vec<Vec<u16>>>, Error> {
    let before = read_gains(client)?;
    let shape = |rows: &[Vec<u16>]| rows.iter().map(Vec::len).collect::<Vec<_>>();
    if shape(gains) != shape(&before) {
        let [rows, columns] = [before.len(), before.first().map_or(0, Vec::len)];
        return Err(
            format!("the array has {rows} rows of {columns} gains, the file others; nothing was changed").into()
        );
    }
    if before == gains {
        return Ok(None);
    }
    let bytes: Vec<u8> = gains.iter().flatten().flat_map(|gain| gain.to_le_bytes()).collect();
    client.again(|client| client.write(address::GAINS, &bytes))?;
    Ok(Some(before))
}
