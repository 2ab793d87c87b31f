//! Runs of a scene over values of its keys, over seeds, on all cores and on several machines.
//!
//! Runs are numbered by point, and within a point by seed. A shard takes each n-th run. Merged shards give the same
//! files, byte for byte, as a whole sweep.

pub mod files;
mod summary;

pub(crate) use files::complete;
pub use files::{Shard, merge};
pub use summary::Table;

use crate::effects::{self, NamedEffect, draws};
use crate::metrics::METRICS;
use crate::run::{Run, RunError, run};
use crate::scene::Scene;
use crate::{cli, cores};
use files::Rows;
use indicatif::{ProgressBar, ProgressStyle};
use output::say;
use std::path::{Path, PathBuf};

#[derive(Clone, Debug)]
pub struct Plan {
    /// Path of a scene, or its name in the library.
    pub scene: String,
    /// `TABLE.KEY=VALUE` for all runs.
    pub set: Vec<String>,
    pub vary: Vec<Vary>,
    /// Number of seeds at each point, counted from the seed of the scene.
    pub seeds: u64,
    pub shard: Shard,
    /// Folder of the results; none for its own folder in [`FOLDER`].
    pub out: Option<PathBuf>,
}

/// Folder of the sweeps without another one. Each sweep has a folder named by its scene and a digest of the plan.
pub const FOLDER: &str = "target/sweep";
/// Most points or runs: more would take weeks and too much memory, so they are probably a typing error.
const MOST: usize = 1_000_000;

/// Runs the sweep or the shard and writes its files. Returns their folder too. A sweep that was stopped continues.
pub fn sweep(plan: &Plan, board: Run) -> Result<(Table, PathBuf), RunError> {
    let seeds = usize::try_from(plan.seeds).unwrap_or(usize::MAX);
    let mut counts = plan.vary.iter().map(|vary| vary.values.len());
    let all = counts.try_fold(seeds, usize::checked_mul).filter(|all| *all <= MOST);
    let all = all.ok_or_else(|| format!("more than {MOST} runs: vary fewer keys, or give fewer values or seeds"))?;
    let points = points(plan)?;
    let first = &points.first().ok_or("there is nothing to run")?.1;
    if seeds > 1 && !points.iter().any(|(_, scene)| is_random(scene)) {
        let drawing: Vec<&str> = effects::all().filter(|effect| draws(effect)).map(|effect| effect.name).collect();
        return Err(format!(
            "nothing in {} is random: all {seeds} seeds would give the same run. Leave --seeds out, or name an effect that draws: {}",
            first.name,
            drawing.join(", ")
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
    let tasks: Vec<usize> = (0..all).filter(|run| plan.shard.has(*run) && !rows.has(run + 1)).collect();
    let progress = progress(tasks.len() + rows.count(), "runs")?.with_position(rows.count() as u64);
    let work = |run: &usize| {
        let (values, scene) = &points[run / seeds];
        row(run + 1, values, Scene { seed: scene.seed + (run % seeds) as u64, ..scene.clone() }, board)
    };
    let done = |run: &usize, row| {
        progress.inc(1);
        rows.add(run + 1, row)
    };
    cores::each(&tasks, work, done)?;
    progress.finish_and_clear();
    Ok((rows.finish(plan, &out)?, out))
}

pub fn progress(all: usize, things: &str) -> Result<ProgressBar, RunError> {
    let template = format!("{{bar:40}} {{pos}} of {{len}} {things}, {{eta}} to go");
    Ok(ProgressBar::new(all as u64).with_style(ProgressStyle::with_template(&template)?))
}

/// Row of a run after its number: values, seed, verdict, digest and metrics.
fn row(number: usize, values: &[String], scene: Scene, board: Run) -> Result<Vec<String>, RunError> {
    let seed = scene.seed;
    let outcome =
        run(&scene, board, &mut []).map_err(|error| format!("run {number} (seed {seed}, {values:?}): {error}"))?;
    let mut row = values.to_vec();
    row.extend([seed.to_string(), u8::from(outcome.passed()).to_string(), outcome.summary.digest.clone()]);
    // Infinite values are left out, as in JSON.
    let value = |name| outcome.measured.get(name).filter(|value| value.is_finite());
    row.extend(METRICS.iter().map(|metric| value(metric.name).map_or(String::new(), |value| value.to_string())));
    Ok(row)
}

/// Returns every combination of the values of the varied keys with its scene. The last key varies fastest.
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

#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Vary {
    pub key: String,
    /// Values from the first to the last.
    pub values: Vec<String>,
}

/// Number of values if none is given.
const VALUES: usize = 5;
/// Most values: more are probably a typing error.
const MOST_VALUES: usize = 100_000;

impl std::str::FromStr for Vary {
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
    scene.effects.iter().any(|NamedEffect { effect, values }| {
        let idle = |keys: &[(&str, f64)]| keys.iter().all(|(key, zero)| values.number(key) == *zero);
        let zero = if effect.name == "tangential" { &[("spread_percent", 0.0)] } else { effect.zero };
        draws(effect) && (zero.is_empty() || !idle(zero))
    })
}

#[cfg(test)]
mod tests {
    use super::*;

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
