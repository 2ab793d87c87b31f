//! The examples for clusters, tried on this machine: Slurm with one node, GNU parallel, the shell of the Kubernetes job.

mod slurm;

use crate::{
    apt,
    console::{self, Console},
    host::Program,
    paths,
    python::{self, Environment},
};
use anyhow::{Context, Result};
use slurm::Slurm;
use std::{
    fs,
    path::{Path, PathBuf},
    process::Command,
};

/// Shares and runs of the sweep, and its scene: one that draws, and breaks bounds in none of these.
const SHARES: &str = "3";
const SEEDS: &str = "12";
const SCENE: &str = "host-tests/sim/scenes/raspberry.toml";
/// Which Debian packages have what the examples need.
const PACKAGES: [&str; 5] = ["munge", "parallel", "slurm-client", "slurmctld", "slurmd"];
/// What summarises the runs, and reads the Kubernetes job.
const CLIENTS: Environment = Environment {
    folder: "venv-cluster",
    packages: &["duckdb==2.0.0", "pyyaml==6.0.3"],
    imports: "duckdb, yaml",
    does: "the summary of a sweep is tried by it",
};

/// Makes sure of the schedulers and of a Python with the rest, and returns its interpreter.
pub fn ensure(console: &mut Console) -> Result<PathBuf> {
    apt::ensure(&PACKAGES, "the test of the examples for clusters", console)?;
    python::environment(&CLIENTS, console)
}

/// Runs a sweep whole and by each example, and compares what they make byte by byte.
pub fn run(console: &mut Console) -> Result<()> {
    let python = ensure(console)?;
    Program::sim("sweep").build(console)?;
    let sweep = paths::target().join("host").join("sweep");
    let folder = paths::target().join("cluster");
    if folder.is_dir() {
        fs::remove_dir_all(&folder).with_context(|| format!("cannot empty {}", paths::shown(&folder)))?;
    }
    let examples = paths::root().join("examples/cluster");
    let scene = paths::root().join(SCENE);
    let given = |command: &mut Command, out: &Path| {
        command.arg(&scene).args(["--seeds", SEEDS, "--out"]).arg(out).env("SWEEP", &sweep);
    };

    let whole = folder.join("whole");
    let mut command = Command::new(&sweep);
    given(&mut command, &whole);
    tried("one sweep", &mut command, console)?;

    let shared = folder.join("slurm");
    let slurm = Slurm::start(console)?;
    let mut command = slurm.command("sbatch");
    command.args(["--wait", "--output=/dev/null"]).arg(format!("--array=1-{SHARES}")).arg(examples.join("slurm.sh"));
    given(&mut command, &shared);
    tried("an array job of Slurm", &mut command, console)?;
    drop(slurm);
    same(&sweep, &whole, &shared)?;

    let parallel = folder.join("parallel");
    let mut command = Command::new(examples.join("parallel.sh"));
    given(command.arg(SHARES), &parallel);
    tried("GNU parallel", &mut command, console)?;
    same(&sweep, &whole, &parallel)?;

    // The job's folder has the program and the scene in it.
    let kubernetes = folder.join("kubernetes");
    fs::create_dir_all(&kubernetes).with_context(|| format!("cannot make {}", paths::shown(&kubernetes)))?;
    for file in [&sweep, &scene] {
        let to = kubernetes.join(file.file_name().unwrap_or_default());
        fs::copy(file, &to).with_context(|| format!("cannot write {}", paths::shown(&to)))?;
    }
    let check = paths::root().join("xtask/src/cluster/check.py");
    let mut command = Command::new(&python);
    command.arg(&check).arg("kubernetes").arg(examples.join("kubernetes.yaml")).arg(&kubernetes).args([SEEDS, SHARES]);
    tried("the shell of the Kubernetes job", &mut command, console)?;
    same(&sweep, &whole, &kubernetes)?;

    let mut command = Command::new(&python);
    command.arg(&check).arg("summary").arg(examples.join("summary.sql")).arg(&whole);
    tried("the summary by DuckDB", &mut command, console)?;
    console.say("All of them make the same bytes as one sweep.");
    Ok(())
}

/// Runs an example; its errors are shown.
fn tried(what: &str, command: &mut Command, console: &Console) -> Result<()> {
    console::output(command)?;
    console.say(&format!("done     {what}"));
    Ok(())
}

/// Puts a folder's shares together, and compares them with the whole sweep's.
fn same(sweep: &Path, whole: &Path, folder: &Path) -> Result<()> {
    let mut merge = Command::new(sweep);
    let share = |number: u32| folder.join(format!("runs-{number}-of-{SHARES}.csv"));
    let shares = SHARES.parse().unwrap_or(0);
    merge.arg("merge").args((1..=shares).map(share)).arg("--out").arg(folder);
    console::output(&mut merge)?;
    for file in ["runs.csv", "summary.csv"] {
        let read = |folder: &Path| fs::read(folder.join(file)).with_context(|| format!("cannot read {file}"));
        anyhow::ensure!(
            read(whole)? == read(folder)?,
            "{file} of {} is not that of the whole sweep",
            paths::shown(folder)
        );
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    /// What a task of an array would run; none where it refuses.
    fn task([id, min, max, count]: [u32; 4], shares: Option<&str>) -> Option<String> {
        let mut command = Command::new("sh");
        command.arg(paths::root().join("examples/cluster/slurm.sh")).arg("scene").env("SWEEP", "echo");
        let names = ["ID", "MIN", "MAX", "COUNT"].map(|name| format!("SLURM_ARRAY_TASK_{name}"));
        command.envs(names.iter().zip([id, min, max, count].map(|number| number.to_string())));
        command.env_remove("SHARES").envs(shares.map(|shares| ("SHARES", shares)));
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
