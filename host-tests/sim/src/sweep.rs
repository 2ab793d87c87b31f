//! Many runs of a scene: over values of its keys, over seeds, over all cores and over machines.
//!
//! Runs are numbered point by point and, within a point, seed by seed. A shard takes every n-th of them; what is merged
//! from shards is the same, byte for byte, as one whole sweep.

pub mod files;
mod summary;

pub(crate) use files::first_missing;
pub use files::{Shard, merge};
pub use summary::Table;

use crate::metrics::METRICS;
use crate::registry::Named;
use crate::run::{Run, RunError, run};
use crate::scene::Scene;
use crate::{cli, cores};
use files::Rows;
use indicatif::{ProgressBar, ProgressStyle};
use output::say;
use std::path::{Path, PathBuf};

/// What is asked for.
#[derive(Clone, Debug)]
pub struct Plan {
    /// A scene's path, or its name in the library.
    pub scene: String,
    /// `TABLE.KEY=VALUE`, for all runs.
    pub set: Vec<String>,
    /// The keys that vary.
    pub vary: Vec<Vary>,
    /// Seeds at each point, counted on from the scene's.
    pub seeds: u64,
    /// Which of the runs.
    pub shard: Shard,
    /// Where the results go; none: a folder of its own in [`FOLDER`].
    pub out: Option<PathBuf>,
}

/// Where sweeps lie that are not told where to go, each in a folder named by its scene and a digest of all that makes
/// it what it is.
pub const FOLDER: &str = "target/sweep";
/// More points or runs than this are a slip of the keyboard: they would take weeks, and more memory than there is.
const MOST: usize = 1_000_000;

/// A run of the sweep.
struct Task<'a> {
    number: usize,
    values: &'a [String],
    scene: &'a Scene,
    seed: u64,
}

/// Runs the sweep, or the shard, and writes its files; also tells their folder. A sweep that was stopped goes on where
/// it stood.
///
/// # Errors
/// The scene is none at a point, a run fails, a file cannot be written, or another process writes it.
pub fn sweep(plan: &Plan, board: Run) -> Result<(Table, PathBuf), RunError> {
    let seeds = usize::try_from(plan.seeds).unwrap_or(usize::MAX);
    let mut counts = plan.vary.iter().map(|vary| vary.values.len());
    let all = counts.try_fold(seeds, usize::checked_mul).filter(|all| *all <= MOST);
    let all = all.ok_or_else(|| format!("more than {MOST} runs: vary fewer keys, or give fewer values or seeds"))?;
    let points = points(plan)?;
    let first = &points.first().ok_or("there is nothing to run")?.1;
    if seeds > 1 && !points.iter().any(|(_, scene)| is(scene)) {
        return Err(format!(
            "nothing in {} is random: all {seeds} seeds would give the same run. Leave --seeds out, or name an effect that draws: {}",
            first.name,
            EFFECTS.join(", ")
        )
        .into());
    }
    let head = files::head(plan, first, all);
    let out = plan.out.clone().unwrap_or_else(|| Path::new(FOLDER).join(&head.id));
    let mut rows = Rows::open(plan, &out, head)?;
    say::aside(match rows.count() {
        0 => format!("the runs go to {}", out.display()),
        count => format!("goes on in {}, where {count} runs are done", out.display()),
    });
    let task = |number: usize| {
        let (values, scene) = &points[number / seeds];
        Task { number, values, scene, seed: scene.seed + (number % seeds) as u64 }
    };
    let mine = (0..all).filter(|number| plan.shard.has(*number));
    let tasks: Vec<Task> = mine.filter(|number| !rows.has(number + 1)).map(task).collect();
    let progress = progress(tasks.len() + rows.count(), "runs")?.with_position(rows.count() as u64);
    let done = |task: &Task, row| {
        progress.inc(1);
        rows.add(task.number + 1, row)
    };
    cores::each(&tasks, |task| row(task, board), done)?;
    progress.finish_and_clear();
    Ok((rows.finish(plan, &out)?, out))
}

/// A bar on the terminal.
pub fn progress(all: usize, things: &str) -> Result<ProgressBar, RunError> {
    let template = format!("{{bar:40}} {{pos}} of {{len}} {things}, {{eta}} to go");
    Ok(ProgressBar::new(all as u64).with_style(ProgressStyle::with_template(&template)?))
}

/// What a run writes after its number: values, seed, verdict, digest and metrics.
fn row(task: &Task, board: Run) -> Result<Vec<String>, RunError> {
    let scene = Scene { seed: task.seed, ..task.scene.clone() };
    let outcome = run(&scene, board, &mut [])
        .map_err(|error| format!("run {} (seed {}, {:?}): {error}", task.number + 1, task.seed, task.values))?;
    let mut row = task.values.to_vec();
    row.extend([task.seed.to_string(), u8::from(outcome.passed()).to_string(), outcome.summary.digest.clone()]);
    // As in JSON, what is no number is left out.
    let value = |name| outcome.measured.get(name).filter(|value| value.is_finite());
    row.extend(METRICS.iter().map(|metric| value(metric.name).map_or(String::new(), |value| value.to_string())));
    Ok(row)
}

/// Every combination of the varied keys' values, the last key the quickest, with its scene.
fn points(plan: &Plan) -> Result<Vec<(Vec<String>, Scene)>, RunError> {
    let mut combinations = vec![Vec::new()];
    for vary in &plan.vary {
        let longer = |values: &Vec<String>| {
            let values = values.clone();
            vary.values.iter().map(move |value| [values.clone(), vec![value.clone()]].concat()).collect::<Vec<_>>()
        };
        combinations = combinations.iter().flat_map(longer).collect();
    }
    let point = |values: Vec<String>| {
        let varied = plan.vary.iter().zip(&values).map(|(vary, value)| format!("{}={value}", vary.key));
        let set: Vec<String> = plan.set.iter().cloned().chain(varied).collect();
        Ok((values, cli::load(&plan.scene, &set, None)?))
    };
    combinations.into_iter().map(point).collect()
}

/// A key and its values, as a scene's text has them.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Vary {
    /// `table.key`.
    pub key: String,
    /// From the first to the last.
    pub values: Vec<String>,
}

/// Values where none are asked for.
const VALUES: usize = 5;
/// More are a slip of the keyboard.
const MOST_VALUES: usize = 100_000;

impl std::str::FromStr for Vary {
    type Err = String;

    /// Reads `table.key=lo..hi` or `table.key=lo..hi:n`. Between whole ends the values are whole where they come out
    /// so.
    fn from_str(text: &str) -> Result<Self, String> {
        let wrong = || format!("--vary {text}: table.key=lo..hi or table.key=lo..hi:n is asked for");
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
            // Sums of tenths and the like come out as they are meant.
            let value = format!("{value:.12e}").parse().unwrap_or(value);
            if whole && value.fract() == 0.0 { format!("{value}") } else { format!("{value:?}") }
        };
        Ok(Self { key: key.trim().into(), values: (0..count).map(value).collect() })
    }
}

/// The effects that draw random numbers.
pub const EFFECTS: [&str; 8] =
    ["noise", "offset", "gain_spread", "tangential", "host_jitter", "lost_packets", "corrupted_packets", "burst"];

/// Whether another seed may give another run.
pub fn is(scene: &Scene) -> bool {
    scene.effects.iter().any(draws)
}

/// Whether an effect draws, and not by a deviation of nothing.
fn draws(named: &Named) -> bool {
    let Named { effect, values } = named;
    let idle = |keys: &[(&str, f64)]| keys.iter().all(|(key, zero)| values.number(key) == *zero);
    EFFECTS.contains(&effect.name)
        && match effect.name {
            "tangential" => !idle(&[("spread_percent", 0.0)]),
            _ => effect.zero.is_empty() || !idle(effect.zero),
        }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::registry;
    use std::fs;

    /// What an effect takes its random numbers from.
    const DRAWN_FROM: &str = "build.seed";

    #[test]
    fn those_that_draw_are_listed() {
        for effect in registry::all() {
            let folder = format!("{}/host-tests/sim/src/effects/{}", env!("FINGERTIP_ROOT"), effect.family.name());
            let files = fs::read_dir(&folder).unwrap_or_else(|error| panic!("{folder}: {error}"));
            let text: String = files.map(|file| fs::read_to_string(file.unwrap().path()).unwrap()).collect();
            let (_, text) = text.split_once(&format!("const {}: Description", effect.name.to_uppercase())).unwrap();
            let text = text.split(": Description").next().unwrap();
            assert_eq!(text.contains(DRAWN_FROM), EFFECTS.contains(&effect.name), "{}", effect.name);
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
