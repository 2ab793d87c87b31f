//! Shards put together. What they hold may come from another machine or out of an editor: all of it is checked.

use super::files::{DIGEST, EXPECT, ID, PASSED, RUN, RUNS, SEED};
use super::shard::first_missing;
use super::table::Table;
use crate::run::RunError;
use csv::Reader;
use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::PathBuf;

/// No metric and no key comes near; sums and differences of these stay numbers.
const LARGEST: f64 = 1e15;

/// All runs of a sweep out of its shards' files.
pub fn table(files: &[PathBuf]) -> Result<Table, RunError> {
    let mut known: Option<Columns> = None;
    let mut rows = BTreeMap::new();
    let mut sweep: Option<(String, usize)> = None;
    for file in files {
        let name = file.display();
        let bytes = fs::read(file).map_err(|error| format!("cannot read {name}: {error}"))?;
        if !bytes.ends_with(b"\n") {
            return Err(format!("{name} is cut off in its last line: copy it again").into());
        }
        let mut reader = Reader::from_reader(&bytes[..]);
        let head = words(reader.headers().map_err(|error| format!("{name}: {error}"))?);
        let columns = Columns::of(head).map_err(|why| format!("{name} is no shard of a sweep: {why}"))?;
        let columns = match &known {
            Some(known) if *known == columns => known,
            Some(_) => return Err(format!("{name} is no shard of the same sweep: its columns are others").into()),
            None => known.insert(columns),
        };
        for row in reader.records() {
            let row = words(&row.map_err(|error| format!("{name}: {error}"))?);
            let (number, runs) = columns.check(&row).map_err(|why| format!("{name}: {why}"))?;
            let (id, all) = sweep.get_or_insert_with(|| (row[0].clone(), runs));
            if *id != row[0] || *all != runs {
                return Err(format!("{name} is of the sweep {} of {runs} runs and not of {id} of {all}", row[0]).into());
            }
            if rows.insert(number, row).is_some() {
                return Err(format!("run {number} is there twice: in {name} again").into());
            }
        }
    }
    let (_, all) = sweep.ok_or("there are no runs in these files")?;
    if let Some(first) = first_missing(rows.keys(), all) {
        let missing = all - rows.len();
        return Err(format!("{missing} of {all} runs are missing, run {first} the first: is a shard missing?").into());
    }
    Ok(Table { head: known.map(|columns| columns.head).unwrap_or_default(), rows: rows.into_values().collect() })
}

/// The columns of a sweep, and where they stand.
#[derive(PartialEq)]
struct Columns {
    head: Vec<String>,
    seed: usize,
    expected: usize,
}

impl Columns {
    fn of(head: Vec<String>) -> Result<Self, String> {
        let place = |name: &str| head.iter().position(|column| column == name);
        let seed = place(SEED).filter(|_| head.starts_with(&[ID, RUN, RUNS].map(String::from)));
        let seed = seed.filter(|seed| head[*seed..].starts_with(&[SEED, PASSED, DIGEST].map(String::from)));
        let seed = seed.ok_or_else(|| {
            format!("its first line has to begin with {ID},{RUN},{RUNS} and to have {SEED},{PASSED},{DIGEST}")
        })?;
        let expected = head.iter().position(|name| name.starts_with(EXPECT)).unwrap_or(head.len());
        if expected < seed || head[expected..].iter().any(|name| !name.starts_with(EXPECT)) {
            return Err(format!("its columns `{EXPECT}...` have to be the last"));
        }
        if head.iter().collect::<BTreeSet<_>>().len() < head.len() {
            return Err("two of its columns have the same name".into());
        }
        Ok(Self { seed, expected, head })
    }

    /// The run's number and the sweep's count of runs, of a row in which everything is what its column says.
    fn check(&self, row: &[String]) -> Result<(usize, usize), String> {
        let wrong = |column: usize, what: &str| {
            format!("run {}: `{}` under {} is no {what}", row[1], row[column], self.head[column])
        };
        let count = |column: usize| row[column].parse::<usize>().ok().filter(|count| *count > 0);
        let number = count(1).ok_or_else(|| wrong(1, "run's number"))?;
        let runs = count(2).filter(|runs| number <= *runs).ok_or_else(|| wrong(2, "count of runs"))?;
        let numeric = |text: &str| text.parse::<f64>().is_ok_and(|value| value.abs() <= LARGEST);
        let any = |text: &str| text.is_empty() || numeric(text);
        if let Some(column) = (3..self.seed).find(|column| !numeric(&row[*column])) {
            return Err(wrong(column, "number"));
        }
        row[self.seed].parse::<u64>().map_err(|_| wrong(self.seed, "seed"))?;
        if !["0", "1"].contains(&row[self.seed + 1].as_str()) {
            return Err(wrong(self.seed + 1, "verdict (0 or 1)"));
        }
        if let Some(column) = (self.seed + 3..self.expected).find(|column| !any(&row[*column])) {
            return Err(wrong(column, "number, and not empty"));
        }
        let sides = |text: &str| text.split_once("..").is_some_and(|(min, max)| any(min) && any(max));
        match (self.expected..row.len()).find(|column| !sides(&row[*column])) {
            Some(column) => Err(wrong(column, "range LEAST..LARGEST")),
            None => Ok((number, runs)),
        }
    }
}

fn words(row: &csv::StringRecord) -> Vec<String> {
    row.iter().map(str::to_owned).collect()
}
