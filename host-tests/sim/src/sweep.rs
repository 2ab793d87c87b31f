//! Many runs of a scene: over values of its keys, over seeds, over all cores and over machines.
//!
//! Runs are numbered point by point and, within a point, seed by seed. A shard takes every n-th of them; what is merged
//! from shards is the same, byte for byte, as one whole sweep.

pub mod files;
mod merge;
mod plots;
mod random;
mod shard;
mod summary;
mod table;
mod vary;

pub use files::merge;
pub use shard::Shard;
pub(crate) use shard::first_missing;
pub use table::Table;
pub use vary::Vary;

use crate::cli;
use crate::cores;
use crate::metrics::METRICS;
use crate::run::{Run, RunError, run};
use crate::scene::Scene;
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
    if seeds > 1 && !points.iter().any(|(_, scene)| random::is(scene)) {
        return Err(format!(
            "nothing in {} is random: all {seeds} seeds would give the same run. Leave --seeds out, or name an effect that draws: {}",
            first.name,
            random::EFFECTS.join(", ")
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
///
/// # Errors
/// None: the template is one.
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
