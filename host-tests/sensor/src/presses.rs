//! Presses under a load cell: the force, and the code of every taxel.

use crate::table::{self, Refusal};
use std::path::Path;

/// A reading at the converter's end tells nothing.
const CODE_MAX: f64 = 4_095.0;
/// Below this share of the largest force nothing is pressed.
const FREE: f64 = 0.002;
/// Rows without a force that the tare is the mean of, at least.
const FREE_ROWS: usize = 3;
/// Rows with a force, at least.
const PRESSED_ROWS: usize = 30;
/// Of a whole number of them.
const PARTS: usize = 5;

/// A row of a file.
struct Row {
    press: String,
    force: f64,
    codes: Vec<f64>,
    line: u64,
}

/// Where a header has the force, the taxels row by row, and the press where it has one.
struct Columns {
    press: Option<usize>,
    force: usize,
    taxels: Vec<usize>,
    rows: usize,
}

/// What was pressed with, and what the taxels read more than without.
#[derive(Clone, Debug)]
pub struct Sample {
    /// N.
    pub force: f64,
    /// Codes above tare, row by row.
    pub codes: Vec<f64>,
    /// Which part of the recording it belongs to: each is left out in turn.
    pub part: usize,
}

/// A file of them.
#[derive(Clone, Debug)]
pub struct Presses {
    /// As it was named.
    pub file: String,
    /// Rows of taxels.
    pub rows: usize,
    /// Columns of taxels.
    pub columns: usize,
    /// At least `PRESSED_ROWS`.
    pub samples: Vec<Sample>,
    /// Parts of the recording: presses where they are named, fifths where not.
    pub parts: usize,
    /// Rows left out: a taxel at the converter's end.
    pub left_out: usize,
}

impl Presses {
    /// Reads a file.
    ///
    /// # Errors
    /// Says what is wrong, in which line, and what to do.
    pub fn read(path: &Path) -> Result<Self, Refusal> {
        Self::parse(&path.display().to_string(), &table::bytes(path)?)
    }

    /// Reads what a file holds.
    ///
    /// # Errors
    /// As [`Presses::read`].
    pub fn parse(file: &str, bytes: &[u8]) -> Result<Self, Refusal> {
        let (columns, rows) = table::rows(file, bytes, columns, row)?;
        let refuse = |line: u64, why: String| Refusal(format!("{file}, line {line}: {why}"));
        let largest = rows.iter().map(|row| row.force).fold(0.0, f64::max);
        if let Some(row) = rows.iter().find(|row| row.force < -0.02 * largest - 0.02) {
            let why = "zero the load cell free of the tip, pushing is above 0";
            return Err(refuse(row.line, format!("force_N is {}: {why}", row.force)));
        }
        let free: Vec<&Row> = rows.iter().filter(|row| row.force <= FREE * largest).collect();
        if free.len() < FREE_ROWS {
            let why =
                format!("{} rows without a force: begin with at least {FREE_ROWS}, they give the tare", free.len());
            return Err(refuse(1, why));
        }
        let taxels = columns.taxels.len();
        let mean = |at: usize| free.iter().map(|row| row.codes[at]).sum::<f64>() / free.len() as f64;
        let tare: Vec<f64> = (0..taxels).map(mean).collect();
        let pressed: Vec<&Row> = rows.iter().filter(|row| row.force > FREE * largest).collect();
        let whole: Vec<&Row> =
            pressed.iter().copied().filter(|row| row.codes.iter().all(|code| *code < CODE_MAX)).collect();
        if whole.len() < PRESSED_ROWS {
            let why = "press at several places, with up to the force that is to be held";
            return Err(refuse(1, format!("{} rows with a force, {PRESSED_ROWS} are needed: {why}", whole.len())));
        }
        let mut names: Vec<&str> = Vec::new();
        let samples = whole.iter().enumerate().map(|(at, row)| {
            let named = names.iter().position(|name| *name == row.press);
            let press = named.unwrap_or_else(|| {
                names.push(&row.press);
                names.len() - 1
            });
            let part = if columns.press.is_some() { press } else { at * PARTS / whole.len() };
            let codes = row.codes.iter().zip(&tare).map(|(code, tare)| code - tare).collect();
            Sample { force: row.force, codes, part }
        });
        let samples: Vec<Sample> = samples.collect();
        let parts = if columns.press.is_some() { names.len() } else { PARTS };
        if parts < 3 {
            return Err(refuse(1, format!("{parts} presses: three at different places are the least")));
        }
        let left_out = pressed.len() - whole.len();
        Ok(Self { file: file.into(), rows: columns.rows, columns: taxels / columns.rows, samples, parts, left_out })
    }
}

/// `r0c0` and so on, any order; all of a rectangle.
fn columns(header: &csv::StringRecord) -> Result<Columns, String> {
    let place = |name: &str| -> Option<(usize, usize)> {
        let (row, column) = name.strip_prefix('r')?.split_once('c')?;
        Some((row.parse().ok()?, column.parse().ok()?))
    };
    let one = |name: &str| match header.iter().filter(|column| *column == name).count() {
        0 => Ok(None),
        1 => Ok(header.iter().position(|column| column == name)),
        _ => Err(format!("the column {name} stands here twice: leave one")),
    };
    let force = one("force_N")?.ok_or("the header lacks force_N: name the columns force_N,r0c0,r0c1 and so on")?;
    let taxels: Vec<(usize, usize)> = header.iter().filter_map(place).collect();
    let rows = taxels.iter().map(|(row, _)| row + 1).max().unwrap_or(0);
    let across = taxels.iter().map(|(_, column)| column + 1).max().unwrap_or(0);
    if !(3..=16).contains(&rows) || !(3..=32).contains(&across) {
        return Err(format!("taxels of {rows} rows and {across} columns: r0c0 to r9c9, say; 3 x 3 to 16 x 32 fit"));
    }
    let mut places = Vec::new();
    for (row, column) in (0..rows).flat_map(|row| (0..across).map(move |column| (row, column))) {
        let name = format!("r{row}c{column}");
        places.push(one(&name)?.ok_or_else(|| format!("the header lacks {name}: give every taxel a column"))?);
    }
    Ok(Columns { press: one("press")?, force, taxels: places, rows })
}

fn row(columns: &Columns, record: &csv::StringRecord, line: u64) -> Result<Row, String> {
    let field = |at: usize| record.get(at).unwrap_or_default();
    let force = table::value("force_N", field(columns.force))?;
    let mut codes = Vec::with_capacity(columns.taxels.len());
    for at in &columns.taxels {
        let code = table::value("a taxel's code", field(*at))?;
        if !(0.0..=CODE_MAX).contains(&code) {
            return Err(format!("a taxel's code is {code}: the converter gives 0 to 4095"));
        }
        codes.push(code);
    }
    Ok(Row { press: columns.press.map_or_else(String::new, |at| field(at).into()), force, codes, line })
}
