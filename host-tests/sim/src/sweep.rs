//! Many runs of a scene: over values of its keys, over seeds, over all cores and over machines.
//!
//! Runs are numbered point by point and, within a point, seed by seed. A shard takes every n-th of them; what is merged from
//! shards is the same, byte for byte, as one whole sweep.

pub mod cores;
pub mod files;
mod plots;
mod shard;
mod summary;
mod vary;

pub use files::{Table, merge};
pub use shard::Shard;
pub use vary::Vary;

use crate::cli;
use crate::metrics::METRICS;
use crate::run::{Run, RunError, run};
use crate::scene::Scene;
use files::Part;
use indicatif::{ProgressBar, ProgressStyle};
use std::path::PathBuf;

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
    /// Where the results go.
    pub out: PathBuf,
}

/// A run of the sweep.
struct Task<'a> {
    number: usize,
    values: &'a [String],
    scene: &'a Scene,
    seed: u64,
}

/// Runs the sweep, or the shard, and writes its files. A sweep that was stopped goes on where it stood.
///
/// # Errors
/// The scene is none at a point, a run fails, or a file cannot be written.
pub fn sweep(plan: &Plan, board: Run) -> Result<Table, RunError> {
    let points = points(plan)?;
    let all = points.len() * plan.seeds as usize;
    let first = &points.first().ok_or("there is nothing to run")?.1;
    let head = files::head(plan, first, all);
    let mut part = Part::open(plan, head)?;
    let task = |number: usize| {
        let (values, scene) = &points[number / plan.seeds as usize];
        Task { number, values, scene, seed: scene.seed + (number % plan.seeds as usize) as u64 }
    };
    let mine = (0..all).filter(|number| plan.shard.has(*number));
    let tasks: Vec<Task> = mine.filter(|number| !part.has(number + 1)).map(task).collect();
    let progress = progress(tasks.len() + part.rows(), "runs")?.with_position(part.rows() as u64);
    let done = |task: &Task, row| {
        progress.inc(1);
        part.add(task.number + 1, row)
    };
    cores::each(&tasks, |task| row(task, board), done)?;
    progress.finish_and_clear();
    part.finish(plan)
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
    row.extend(METRICS.iter().map(|metric| outcome.measured.get(metric.name).map_or(String::new(), |v| v.to_string())));
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
