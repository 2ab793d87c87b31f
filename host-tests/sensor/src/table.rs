//! A recording: rows of a CSV file, found by the names of their columns and checked one by one.

use std::fmt::{self, Display};
use std::path::Path;

/// What cannot be used, where, and what to do.
#[derive(Debug, PartialEq)]
pub struct Refusal(pub String);

impl Display for Refusal {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.0)
    }
}

/// Columns of a characteristic's recording.
pub const CYCLES: [&str; 4] = ["set", "sample", "force_N", "conductance_mS"];
/// Columns of a recording of held weights.
pub const HOLDS: [&str; 4] = ["run", "weight_kg", "t_s", "conductance_mS"];
/// No load cell, weight, clock or taxel shows more than this.
const LARGEST: f64 = 1e7;

/// A row: whose it is, and its three numbers in the order of the columns above.
#[derive(Clone, Debug)]
pub struct Row {
    /// The set or the run.
    pub of: String,
    /// The other columns.
    pub numbers: [f64; 3],
    /// Its line in the file.
    pub line: u64,
}

/// What a file is a recording of, told by its columns.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    /// See [`CYCLES`].
    Cycles,
    /// See [`HOLDS`].
    Holds,
}

/// A file's rows.
#[derive(Debug)]
pub struct Table {
    /// The file, as it was named.
    pub file: String,
    /// What it is.
    pub kind: Kind,
    /// At least one.
    pub rows: Vec<Row>,
}

impl Table {
    /// Reads a file. A byte order mark and any ends of lines are taken.
    ///
    /// # Errors
    /// Says what is wrong, in which line, and what to do.
    pub fn read(path: &Path) -> Result<Self, Refusal> {
        Self::parse(&path.display().to_string(), &bytes(path)?)
    }

    /// Reads what a file holds.
    ///
    /// # Errors
    /// As [`Table::read`].
    pub fn parse(file: &str, bytes: &[u8]) -> Result<Self, Refusal> {
        let row = |(kind, places): &(Kind, [usize; 4]), record: &csv::StringRecord, line| {
            let names = if *kind == Kind::Cycles { CYCLES } else { HOLDS };
            let field = |at: usize| record.get(places[at]).unwrap_or_default();
            let mut numbers = [0.0; 3];
            for (at, number) in numbers.iter_mut().enumerate() {
                *number = value(names[at + 1], field(at + 1))?;
            }
            if field(0).is_empty() {
                return Err(format!("{} is empty: name what the row belongs to", names[0]));
            }
            Ok(Row { of: field(0).into(), numbers, line })
        };
        let ((kind, _), rows) = rows(file, bytes, columns, row)?;
        Ok(Self { file: file.into(), kind, rows })
    }

    /// Refuses a line of this file.
    pub fn refuse(&self, line: u64, why: impl Display) -> Refusal {
        Refusal(format!("{}, line {line}: {why}", self.file))
    }
}

/// What the header says, and every row by it; at least one.
pub(crate) fn rows<H, R>(
    file: &str,
    bytes: &[u8],
    header: impl Fn(&csv::StringRecord) -> Result<H, String>,
    row: impl Fn(&H, &csv::StringRecord, u64) -> Result<R, String>,
) -> Result<(H, Vec<R>), Refusal> {
    let bytes = bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(bytes);
    let refuse = |line: u64, why: String| Refusal(format!("{file}, line {line}: {why}"));
    let mut reader = csv::ReaderBuilder::new().trim(csv::Trim::All).from_reader(bytes);
    let names = reader.headers();
    let names = names.map_err(|_| refuse(1, "this is not text: save the recording as CSV in UTF-8".into()))?;
    let header = header(names).map_err(|why| refuse(1, why))?;
    let mut rows = Vec::new();
    for record in reader.records() {
        let record = record.map_err(|error| {
            let line = error.position().map_or(0, csv::Position::line);
            let why = match error.kind() {
                csv::ErrorKind::UnequalLengths { expected_len, len, .. } => {
                    format!("{len} fields where the header has {expected_len}: complete the line or take it out")
                }
                _ => "not text in UTF-8: save the recording as CSV in UTF-8".into(),
            };
            refuse(line, why)
        })?;
        let line = record.position().map_or(0, csv::Position::line);
        rows.push(row(&header, &record, line).map_err(|why| refuse(line, why))?);
    }
    if rows.is_empty() {
        return Err(refuse(2, "no rows after the header: give a recording".into()));
    }
    Ok((header, rows))
}

/// What a file holds.
pub(crate) fn bytes(path: &Path) -> Result<Vec<u8>, Refusal> {
    let refuse = |error| format!("{}: cannot be read ({error}): name a CSV file that exists", path.display());
    std::fs::read(path).map_err(|error| Refusal(refuse(error)))
}

/// What the header is of, and where its columns are; others may stand beside them.
fn columns(header: &csv::StringRecord) -> Result<(Kind, [usize; 4]), String> {
    let lacks = |names: [&str; 4]| names.map(|name| header.iter().filter(|column| *column == name).count());
    for (kind, names) in [(Kind::Cycles, CYCLES), (Kind::Holds, HOLDS)] {
        if lacks(names) == [1; 4] {
            return Ok((kind, names.map(|name| header.iter().position(|column| column == name).unwrap_or_default())));
        }
    }
    let all = CYCLES.into_iter().chain(HOLDS);
    if let Some(twice) = all.clone().find(|name| header.iter().filter(|column| column == name).count() > 1) {
        return Err(format!("the column {twice} stands here twice: leave one"));
    }
    // Of which there is more is what was meant.
    let there = |names: [&str; 4]| lacks(names).iter().sum::<usize>();
    let meant = if there(HOLDS) > there(CYCLES) { HOLDS } else { CYCLES };
    let missing: Vec<_> = meant.into_iter().filter(|name| !header.iter().any(|column| column == *name)).collect();
    if header.len() == 1
        && let Some(mark) = [';', '\t'].into_iter().find(|mark| header.iter().any(|column| column.contains(*mark)))
    {
        let comma = "save the recording with commas between the columns and decimal points in the numbers";
        return Err(format!("columns parted by {mark:?}: {comma}"));
    }
    Err(format!(
        "the header lacks {}: name the columns {} (characteristic) or {} (held weights)",
        missing.join(", "),
        CYCLES.join(","),
        HOLDS.join(","),
    ))
}

pub(crate) fn value(name: &str, text: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(value) if !value.is_finite() => Err(format!("{name} is {text}: take the row out")),
        Ok(value) if value.abs() > LARGEST => {
            Err(format!("{name} is {text}, which no recording shows: check its unit"))
        }
        Ok(value) => Ok(value),
        Err(_) if text.is_empty() => Err(format!("{name} is empty: fill it in or take the row out")),
        Err(_) => Err(format!("{name} is \"{text}\", not a number: write it with a decimal point")),
    }
}
