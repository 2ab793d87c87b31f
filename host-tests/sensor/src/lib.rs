//! Fits what the firmware knows of a real sensor, its characteristic and its creep, to recordings, and judges that on
//! other recordings.

pub mod characteristic;
pub mod creep;
pub mod cycles;
pub mod forms;
pub mod gains;
pub mod holds;
pub mod presses;
pub mod report;
pub mod squares;
pub mod table;

use characteristic::Characteristics;
use creep::Creep;
use serde::Serialize;
use std::path::Path;
use table::{Kind, Refusal, Table};

/// What a recording says.
#[derive(Debug, Serialize)]
pub struct Answer {
    /// What was fitted to.
    pub fitted: String,
    /// What it was judged on.
    pub judged_on: Option<String>,
    /// What was found.
    #[serde(flatten)]
    pub found: Found,
}

/// What was found, by the recording's kind.
#[derive(Debug, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Found {
    /// Force over conductance.
    Characteristic(Characteristics),
    /// Conductance under a held weight over time.
    Creep(Creep),
}

/// Fits to one file, and judges on another.
///
/// # Errors
/// Says which file and line cannot be used, why, and what to do.
pub fn fit(fit: &Path, judge: Option<&Path>) -> Result<Answer, Refusal> {
    let table = Table::read(fit)?;
    let other = judge.map(Table::read).transpose()?;
    if let Some(other) = &other
        && other.kind != table.kind
    {
        let why = format!("its columns are not those of {}: judge on a recording of the same kind", table.file);
        return Err(other.refuse(1, why));
    }
    let found = match table.kind {
        Kind::Cycles => {
            let mut found = Characteristics::fit(&table)?;
            other.as_ref().map_or(Ok(()), |other| found.judge(other))?;
            Found::Characteristic(found)
        }
        Kind::Holds => {
            let mut found = Creep::fit(&table)?;
            other.as_ref().map_or(Ok(()), |other| found.judge(other))?;
            Found::Creep(found)
        }
    };
    Ok(Answer { fitted: table.file, judged_on: other.map(|other| other.file), found })
}
