//! Runs the examples for clusters on this machine, without a cluster: each task of Slurm and each pod of Kubernetes runs
//! with the environment variables that it would get there.

use crate::console;
use crate::host::{self, Program};
use crate::install::{self, Environment};
use anyhow::{Context, Result};
use std::fs;
use std::path::Path;
use std::process::Command;

/// Shares and runs of the sweep, and its scene: one that draws, and breaks bounds in none of these.
const SHARES: u32 = 3;
const SEEDS: &str = "12";
const SCENE: &str = "host-tests/sim/scenes/raspberry.toml";
/// Script that summarises the runs, and reads the Kubernetes job.
const CLIENTS: Environment = Environment {
    folder: "venv-cluster",
    packages: &["duckdb==2.0.0", "pyyaml==6.0.3"],
    imports: "duckdb, yaml",
    does: "the summary of a sweep is tried by it",
};

/// Runs a sweep whole and by each example, and compares what they make byte by byte.
pub fn run() -> Result<()> {
    install::packages(&["parallel"], "the test of the examples for clusters")?;
    let python = install::environment(&CLIENTS)?;
    Program::sim("sweep").build()?;
    let sweep = host::target().join(host::PROGRAMS).join("sweep");
    let folder = host::target().join("cluster");
    host::emptied(&folder)?;
    let examples = host::root().join("examples/cluster");
    let scene = host::root().join(SCENE);
    let swept = |what: &str, command: &mut Command, out: &Path| {
        tried(what, command.arg(&scene).args(["--seeds", SEEDS, "--out"]).arg(out).env("SWEEP", &sweep))
    };

    let whole = folder.join("whole");
    swept("one sweep", &mut Command::new(&sweep), &whole)?;

    let shared = folder.join("slurm");
    for task in 1..=SHARES {
        swept("a task of a Slurm array", &mut slurm_task([task, 1, SHARES, SHARES]), &shared)?;
    }
    same(&sweep, &whole, &shared)?;

    let parallel = folder.join("parallel");
    swept("GNU parallel", Command::new(examples.join("parallel.sh")).arg(SHARES.to_string()), &parallel)?;
    same(&sweep, &whole, &parallel)?;

    // The job's folder has the program and the scene in it.
    let kubernetes = folder.join("kubernetes");
    host::emptied(&kubernetes)?;
    for file in [&sweep, &scene] {
        let to = kubernetes.join(file.file_name().unwrap_or_default());
        fs::copy(file, &to).with_context(|| format!("cannot write {}", host::shown(&to)))?;
    }
    let check = host::root().join("xtask/src/cluster/check.py");
    let mut command = Command::new(&python);
    command.arg(&check).arg("kubernetes").arg(examples.join("kubernetes.yaml")).arg(&kubernetes);
    command.args([SEEDS, &SHARES.to_string()]);
    tried("the shell of the Kubernetes job", &mut command)?;
    same(&sweep, &whole, &kubernetes)?;

    let mut command = Command::new(&python);
    command.arg(&check).arg("summary").arg(examples.join("summary.sql")).arg(&whole);
    tried("the summary by DuckDB", &mut command)?;
    console::say("All of them make the same bytes as one sweep.");
    Ok(())
}

fn tried(what: &str, command: &mut Command) -> Result<()> {
    console::output(command)?;
    console::say(&format!("done     {what}"));
    Ok(())
}

/// Puts a folder's shares together, and compares them with the whole sweep's.
fn same(sweep: &Path, whole: &Path, folder: &Path) -> Result<()> {
    let mut merge = Command::new(sweep);
    let share = |number: u32| folder.join(format!("runs-{number}-of-{SHARES}.csv"));
    merge.arg("merge").args((1..=SHARES).map(share)).arg("--out").arg(folder);
    console::output(&mut merge)?;
    for file in ["runs.csv", "summary.csv"] {
        let read = |folder: &Path| fs::read(folder.join(file)).with_context(|| format!("cannot read {file}"));
        let same = read(whole)? == read(folder)?;
        anyhow::ensure!(same, "{file} of {} is not that of the whole sweep", host::shown(folder));
    }
    Ok(())
}

/// A task of a Slurm array: its number, the least and the largest number of the array, and how many there are.
fn slurm_task(task: [u32; 4]) -> Command {
    let mut command = Command::new("sh");
    command.arg(host::root().join("examples/cluster/slurm.sh")).env_remove("SHARES");
    let names = ["ID", "MIN", "MAX", "COUNT"].map(|name| format!("SLURM_ARRAY_TASK_{name}"));
    command.envs(names.iter().zip(task.map(|number| number.to_string())));
    command
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Command that a task of an array would run; `None` if it refuses.
    fn task(of: [u32; 4], shares: Option<&str>) -> Option<String> {
        let mut command = slurm_task(of);
        command.arg("scene").env("SWEEP", "echo").envs(shares.map(|shares| ("SHARES", shares)));
        let output = command.output().expect("sh starts");
        output.status.success().then(|| String::from_utf8_lossy(&output.stdout).trim().into())
    }

    #[test]
    fn an_array_with_gaps_runs_no_other_share() {
        assert_eq!(task([3, 1, 64, 64], None).as_deref(), Some("scene --shard 3/64"));
        // Some of an array given again: 1 of 1 would be the whole sweep, and 1 of 2 a half.
        for array in [[1, 1, 9, 2], [5, 5, 5, 1], [0, 0, 63, 64]] {
            assert_eq!(task(array, None), None, "{array:?}");
        }
        assert_eq!(task([5, 5, 9, 2], Some("64")).as_deref(), Some("scene --shard 5/64"));
    }
}
