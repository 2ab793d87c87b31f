//! Runs of a scene over values of its keys, over seeds, on all cores and on several machines.
//!
//! Runs are numbered by point, and within a point by seed. A shard takes each n-th run and writes only
//! `runs-1-of-4.csv`; each row names its sweep and the number of runs. Merged shards give the same files, byte for byte,
//! as a whole sweep: `runs.csv` with a row for each run, `summary.csv`, and a plot for each bounded metric.

mod summary;

pub use summary::Table;

use crate::cli;
use crate::effects::{self, NamedEffect, draws};
use crate::events::Event;
use crate::metrics::METRICS;
use crate::part::{Part, cannot_write, check, make_folder};
use crate::run::{Run, RunError, run};
use crate::scene::tables::Key;
use crate::scene::{Bound, Scene};
use crate::shards::{Shard, complete};
use csv::{Reader, ReaderBuilder};
use output::kept::Lock;
use output::say;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::str::FromStr;
use std::{fs, slice};

#[derive(Clone, Debug, clap::Args)]
pub struct Plan {
    /// The scene: a file, or a name out of the library
    pub scene: String,
    /// Varies a key over N values (5 where N is not given); may be given many times: all combinations are run
    #[arg(long, value_name = "TABLE.KEY=LO..HI[:N]", value_parser = Vary::from_str)]
    pub vary: Vec<Vary>,
    /// Replaces a value of the scene, in every run
    #[arg(long, value_name = "TABLE.KEY=VALUE")]
    pub set: Vec<String>,
    /// Seeds at each point, counted on from the scene's
    #[arg(long, value_name = "N", default_value_t = 1, value_parser = clap::value_parser!(u64).range(1..))]
    pub seeds: u64,
    /// Runs only the I-th of N shares, for merging
    #[arg(long, value_name = "I/N", default_value_t = Shard::WHOLE, hide_default_value = true)]
    pub shard: Shard,
    /// Folder for the results; by default a folder in target/sweep that is named after the sweep
    #[arg(long, value_name = "DIR")]
    pub out: Option<PathBuf>,
}

/// Folder of the sweeps without another one. Each sweep has a folder named by its scene and a digest of the plan.
pub const FOLDER: &str = "target/sweep";
/// Most points or runs: more would take weeks and too much memory, so they are probably a typing error.
const MOST: usize = 1_000_000;

/// Runs the sweep or the shard and writes its files. Returns their folder too. A sweep that was stopped continues.
pub fn sweep(plan: &Plan, board: Run) -> Result<(Table, PathBuf), RunError> {
    let seeds = usize::try_from(plan.seeds).unwrap_or(usize::MAX);
    let mut keys: Vec<&str> = plan.vary.iter().map(|vary| vary.key.as_str()).collect();
    keys.sort_unstable();
    if let Some([key, _]) = keys.array_windows().find(|[key, next]| key == next) {
        return Err(format!("--vary {key} is given twice").into());
    }
    let mut counts = plan.vary.iter().map(|vary| vary.values.len());
    let all = counts.try_fold(seeds, usize::checked_mul).filter(|all| *all <= MOST);
    let all = all.ok_or_else(|| format!("more than {MOST} runs: vary fewer keys, or give fewer values or seeds"))?;
    let points = points(plan)?;
    let first = &points.first().ok_or("there is nothing to run")?.1;
    if seeds > 1 && !points.iter().any(|(_, scene)| is_random(scene)) {
        let drawing: Vec<&str> = effects::all().filter(|effect| draws(effect)).map(|effect| effect.name).collect();
        return Err(format!(
            "nothing in {} is random: all {seeds} seeds would give the same run. Leave --seeds out, name the event `interference`, or an effect that draws: {}",
            first.name,
            drawing.join(", ")
        )
        .into());
    }
    let head = head(plan, first, all);
    let out = plan.out.clone().unwrap_or_else(|| Path::new(FOLDER).join(&head.id));
    let (mut part, done) = resume(plan, &out, &head)?;
    say::aside(match done.len() {
        0 => format!("the runs go to {}", out.display()),
        count => format!("goes on in {}, where {count} runs are done", out.display()),
    });
    let work = |number: usize| {
        let (values, scene) = &points[(number - 1) / seeds];
        let scene = Scene { seed: scene.seed + ((number - 1) % seeds) as u64, ..scene.clone() };
        row(&head, number, values, scene, board)
    };
    let keep = |row: &Vec<String>| part.add(String::from_utf8(summary::csv([row])?)?.trim_end());
    let rows = plan.shard.go_on(all, "runs", done, work, keep)?;
    let table = Table { head: head.columns, rows: rows.into_values().collect() };
    part.write(table.csv()?)?;
    if plan.shard.is_whole() {
        table.write_rest(&out, &part.lock)?;
    }
    part.done()?;
    Ok((table, out))
}

/// Row of a run: numbers, values, seed, verdict, digest, metrics and bounds.
fn row(head: &Head, number: usize, values: &[String], scene: Scene, board: Run) -> Result<Vec<String>, RunError> {
    let seed = scene.seed;
    let outcome =
        run(&scene, board, &mut []).map_err(|error| format!("run {number} (seed {seed}, {values:?}): {error}"))?;
    let mut row = vec![head.id.clone(), number.to_string(), head.runs.to_string()];
    row.extend_from_slice(values);
    row.extend([seed.to_string(), u8::from(outcome.passed()).to_string(), outcome.summary.digest.clone()]);
    // Infinite values are left out, as in JSON.
    let value = |name| outcome.measured.get(name).filter(|value| value.is_finite());
    row.extend(METRICS.iter().map(|metric| value(metric.name).map_or(String::new(), |value| value.to_string())));
    row.extend_from_slice(&head.expected);
    Ok(row)
}

/// Returns every combination of the values of the varied keys with its scene. The last key varies fastest.
fn points(plan: &Plan) -> Result<Vec<(Vec<String>, Scene)>, RunError> {
    let mut combinations = vec![Vec::new()];
    for vary in &plan.vary {
        let longer =
            |values: Vec<String>| vary.values.iter().map(move |value| [&values[..], slice::from_ref(value)].concat());
        combinations = combinations.into_iter().flat_map(longer).collect();
    }
    let point = |values: Vec<String>| {
        let varied = plan.vary.iter().zip(&values).map(|(vary, value)| format!("{}={value}", vary.key));
        let set: Vec<String> = plan.set.iter().cloned().chain(varied).collect();
        Ok((values, cli::load(&plan.scene, &set, None)?))
    };
    combinations.into_iter().map(point).collect()
}

#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Vary {
    pub key: String,
    pub values: Vec<String>,
}

const VALUES: usize = 5;
/// Most values: more are probably a typing error.
const MOST_VALUES: usize = 100_000;

impl FromStr for Vary {
    type Err = String;

    /// Parses `table.key=lo..hi` or `table.key=lo..hi:n`. Between whole ends the values are whole if possible.
    fn from_str(text: &str) -> Result<Self, String> {
        let wrong = || format!("--vary {text}: needs table.key=lo..hi or table.key=lo..hi:n");
        let (key, range) = text.split_once('=').ok_or_else(wrong)?;
        let (range, count) = match range.split_once(':') {
            Some((range, count)) => (range, count.trim().parse().map_err(|_| wrong())?),
            None => (range, VALUES),
        };
        let (low, high) = range.split_once("..").ok_or_else(wrong)?;
        let end = |text: &str| text.trim().parse::<f64>().ok().filter(|end| end.is_finite()).ok_or_else(wrong);
        let (low_end, high_end) = (end(low)?, end(high)?);
        if count > MOST_VALUES {
            return Err(format!("--vary {text}: {count} values, at most {MOST_VALUES} are allowed"));
        }
        if key.trim().is_empty() || count == 0 || (count == 1 && low_end != high_end) {
            return Err(wrong());
        }
        let whole = [low, high].iter().all(|end| end.trim().parse::<i64>().is_ok());
        let value = |n: usize| {
            let share = if count > 1 { n as f64 / (count - 1) as f64 } else { 0.0 };
            let value = low_end + (high_end - low_end) * share;
            // Removes the rounding error of sums of decimal fractions.
            let value = format!("{value:.12e}").parse().unwrap_or(value);
            if whole && value.fract() == 0.0 { format!("{value}") } else { format!("{value:?}") }
        };
        Ok(Self { key: key.trim().into(), values: (0..count).map(value).collect() })
    }
}

/// True if another seed may give another run.
fn is_random(scene: &Scene) -> bool {
    let effect_draws = |NamedEffect { effect, values }: &NamedEffect| {
        let idle = |key: &Key| key.idle.is_none_or(|idle| values.number(key.name) == idle);
        draws(effect)
            && match effect.name {
                "tangential" => values.number("spread_percent") > 0.0,
                _ => !effect.keys.iter().all(idle),
            }
    };
    scene.effects.iter().any(effect_draws) || scene.events.iter().any(Event::is_random)
}

/// Columns before the varied keys.
pub(super) const ID: &str = "sweep";
pub(super) const RUN: &str = "run";
pub(super) const RUNS: &str = "of_runs";
/// Columns after the varied keys; then come the metrics and their bounds.
pub(super) const SEED: &str = "seed";
pub(super) const PASSED: &str = "passed";
pub(super) const DIGEST: &str = "digest";
pub(super) const EXPECT: &str = "expect ";

/// Columns, and the values at the beginning and the end of every row.
struct Head {
    columns: Vec<String>,
    /// Digest of the sweep, and the name of its folder without another one.
    id: String,
    runs: usize,
    expected: Vec<String>,
}

fn head(plan: &Plan, scene: &Scene, runs: usize) -> Head {
    let mut columns: Vec<String> = [ID, RUN, RUNS].map(String::from).into();
    columns.extend(plan.vary.iter().map(|vary| vary.key.clone()));
    columns.extend([SEED, PASSED, DIGEST].map(String::from));
    columns.extend(METRICS.iter().map(|metric| metric.name.to_owned()));
    columns.extend(scene.bounds.iter().map(|bound| format!("{EXPECT}{}", bound.metric)));
    let side = |side: Option<f64>| side.map_or(String::new(), |side| side.to_string());
    // A limit that grows with the goal is no single number.
    let max = |bound: &Bound| bound.max.filter(|_| bound.max_per_goal_n.is_none());
    let expected = scene.bounds.iter().map(|bound| format!("{}..{}", side(bound.min), side(max(bound)))).collect();
    let said = format!("{} {:?} {}\n{}", env!("CARGO_PKG_VERSION"), plan.vary, plan.seeds, scene.text);
    Head { columns, id: format!("{}-{}", scene.name, check(&said)), runs, expected }
}

/// Resumes from the rows of an earlier try of the same sweep, by the number of their run, from 1.
fn resume(plan: &Plan, out: &Path, head: &Head) -> Result<(Part, BTreeMap<usize, Vec<String>>), RunError> {
    let Shard { number, of } = plan.shard;
    let whole = plan.shard.is_whole();
    let file = out.join(if whole { "runs.csv".into() } else { format!("runs-{number}-of-{of}.csv") });
    refuse_others(&file, &head.id)?;
    let (part, lines) = Part::open(&file, &format!("the sweep {} of {} runs", head.id, head.runs))?;
    let mut rows = BTreeMap::new();
    for line in lines {
        let mut reader = ReaderBuilder::new().has_headers(false).from_reader(line.as_bytes());
        let row: Vec<String> = reader.deserialize().next().ok_or("an empty row")??;
        let number = row.get(1).and_then(|number| number.parse().ok());
        // Every line is complete, so another form means another version.
        let number = number.filter(|number| row.len() == head.columns.len() && (1..=head.runs).contains(number));
        let number = number.ok_or_else(|| format!("{}.part has a row of another form: remove it", file.display()))?;
        rows.insert(number, row);
    }
    Ok((part, rows))
}

/// Refuses to replace the runs of another sweep.
fn refuse_others(file: &Path, id: &str) -> Result<(), RunError> {
    let Ok(bytes) = fs::read(file) else { return Ok(()) };
    let mut reader = ReaderBuilder::new().flexible(true).from_reader(&bytes[..]);
    let first = reader.records().next().and_then(Result::ok);
    match first.as_ref().and_then(|row| row.get(0)) {
        Some(found) if found == id => Ok(()),
        found => {
            let whose = found.map_or("something else".into(), |found| format!("the sweep {found}"));
            Err(format!("{} holds {whose}, not {id}: move it away, or name another folder with --out", file.display())
                .into())
        }
    }
}

pub fn merge(files: &[PathBuf], out: &Path) -> Result<Table, RunError> {
    let table = table(files)?;
    make_folder(out)?;
    let file = out.join("runs.csv");
    let lock = Lock::take(&file).map_err(|error| cannot_write(&file, &error))?;
    refuse_others(&file, &table.rows[0][0])?;
    lock.write(table.csv()?).map_err(|error| cannot_write(&file, &error))?;
    table.write_rest(out, &lock)?;
    Ok(table)
}

/// Largest number in a file. Metrics and keys are far smaller, and sums and differences of such numbers are finite.
const LARGEST: f64 = 1e15;

/// Reads all runs of a sweep from the files of its shards.
pub fn table(files: &[PathBuf]) -> Result<Table, RunError> {
    let mut known: Option<Table> = None;
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
        check_head(&head).map_err(|why| format!("{name} is no shard of a sweep: {why}"))?;
        let table = known.get_or_insert_with(|| Table { head: head.clone(), rows: Vec::new() });
        if table.head != head {
            return Err(format!("{name} is no shard of the same sweep: its columns are others").into());
        }
        for row in reader.records() {
            let row = words(&row.map_err(|error| format!("{name}: {error}"))?);
            let (number, runs) = check_row(table, &row).map_err(|why| format!("{name}: {why}"))?;
            let (id, all) = sweep.get_or_insert_with(|| (row[0].clone(), runs));
            if *id != row[0] || *all != runs {
                return Err(format!("{name} is of the sweep {} of {runs} runs and not of {id} of {all}", row[0]).into());
            }
            if rows.insert(number, row).is_some() {
                return Err(format!("run {number} is there twice: in {name} again").into());
            }
        }
    }
    let ((_, all), Table { head, .. }) = sweep.zip(known).ok_or("there are no runs in these files")?;
    Ok(Table { head, rows: complete(rows, all, "run")? })
}

fn check_head(head: &[String]) -> Result<(), String> {
    let fixed = head.windows(3).any(|columns| columns == [SEED, PASSED, DIGEST]);
    if fixed && head.starts_with(&[ID, RUN, RUNS].map(String::from)) {
        return Ok(());
    }
    Err(format!("its first line has to begin with {ID},{RUN},{RUNS} and to have {SEED},{PASSED},{DIGEST}"))
}

/// Returns the number of the run and the count of runs of a row. Refuses numbers that cannot be drawn.
fn check_row(table: &Table, row: &[String]) -> Result<(usize, usize), String> {
    let is_drawn = |text: &str| text.is_empty() || text.parse::<f64>().is_ok_and(|value| value.abs() <= LARGEST);
    let mut columns = table.varied().chain(table.metrics().start..row.len());
    if let Some(column) = columns.find(|column| !row[*column].split("..").all(is_drawn)) {
        return Err(format!("run {}: `{}` under {} is no number", row[1], row[column], table.head[column]));
    }
    let count = |column: usize| row[column].parse::<usize>().ok();
    let numbered = count(1).zip(count(2)).filter(|(number, runs)| (1..=*runs).contains(number));
    numbered.ok_or_else(|| format!("`{}` is no run's number of `{}`", row[1], row[2]))
}

fn words(row: &csv::StringRecord) -> Vec<String> {
    row.iter().map(str::to_owned).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn interference_is_random() {
        let interference = |for_s| format!("[[event]]\nat_s = 0.1\nkind = \"interference\"\nfor_s = {for_s}\n");
        let silence = "[[event]]\nat_s = 0.1\nkind = \"host_silent\"\nfor_s = 0.2\n".to_owned();
        for (table, random) in [(interference("0.2"), true), (interference("0"), false), (silence, false)] {
            let text = format!("about = \"a test\"\nduration_s = 1.0\n{table}");
            assert_eq!(is_random(&crate::scene::read("test.toml", &text).unwrap()), random, "{table}");
        }
    }

    #[test]
    fn ranges_are_read() {
        let values = |text: &str| text.parse::<Vary>().map(|vary| vary.values.join(" "));
        assert_eq!(values("tip.radius_mm=8..12"), Ok("8 9 10 11 12".into()));
        assert_eq!(values("tip.radius_mm=0.1..0.3:3"), Ok("0.1 0.2 0.3".into()));
        assert_eq!(values("tip.radius_mm=1..2:3"), Ok("1 1.5 2".into()));
        assert_eq!(values("a.b=-1..1:2"), Ok("-1 1".into()));
        assert_eq!(values("a.b=7..7:1"), Ok("7".into()));
        for wrong in
            ["a.b", "a.b=1", "a.b=1..x", "=1..2", "a.b=1..2:0", "a.b=1..2:1", "a.b=1..inf", "a.b=1..2:1000000000000"]
        {
            assert!(values(wrong).is_err(), "{wrong}");
        }
    }
}
