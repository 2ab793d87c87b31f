//! The examples for clusters, tried on this machine: Slurm with one node, GNU parallel, the shell of the Kubernetes job.

use crate::console::{self, Console};
use crate::host;
use crate::host::Program;
use crate::install::{self, Environment};
use anyhow::{Context, Result, bail};
use std::net::TcpListener;
use std::os::unix::fs::PermissionsExt;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::time::Duration;
use std::{fs, thread};

/// Shares and runs of the sweep, and its scene: one that draws, and breaks bounds in none of these.
const SHARES: &str = "3";
const SEEDS: &str = "12";
const SCENE: &str = "host-tests/sim/scenes/raspberry.toml";
/// Which Debian packages have what the examples need.
const PACKAGES: [&str; 5] = ["munge", "parallel", "slurm-client", "slurmctld", "slurmd"];
/// Script that summarises the runs, and reads the Kubernetes job.
const CLIENTS: Environment = Environment {
    folder: "venv-cluster",
    packages: &["duckdb==2.0.0", "pyyaml==6.0.3"],
    imports: "duckdb, yaml",
    does: "the summary of a sweep is tried by it",
};

/// Makes sure of the schedulers and of a Python with the rest, and returns its interpreter.
pub fn ensure(console: &mut Console) -> Result<PathBuf> {
    install::packages(&PACKAGES, "the test of the examples for clusters", console)?;
    install::environment(&CLIENTS, console)
}

/// Runs a sweep whole and by each example, and compares what they make byte by byte.
pub fn run(console: &mut Console) -> Result<()> {
    let python = ensure(console)?;
    Program::sim("sweep").build(console)?;
    let sweep = host::target().join(host::PROGRAMS).join("sweep");
    let folder = host::target().join("cluster");
    if folder.is_dir() {
        fs::remove_dir_all(&folder).with_context(|| format!("cannot empty {}", host::shown(&folder)))?;
    }
    let examples = host::root().join("examples/cluster");
    let scene = host::root().join(SCENE);
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
    fs::create_dir_all(&kubernetes).with_context(|| format!("cannot make {}", host::shown(&kubernetes)))?;
    for file in [&sweep, &scene] {
        let to = kubernetes.join(file.file_name().unwrap_or_default());
        fs::copy(file, &to).with_context(|| format!("cannot write {}", host::shown(&to)))?;
    }
    let check = host::root().join("xtask/src/cluster/check.py");
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
            host::shown(folder)
        );
    }
    Ok(())
}

// Slurm with one node, as long as a value of this lives.

/// Number of attempts to reach the controller, and the time between two of them.
const TRIES: u32 = 600;
const BETWEEN: Duration = Duration::from_millis(100);

/// The daemons, and the folder with all that is theirs. It is not in the build folder: the path of a socket is short.
pub struct Slurm {
    folder: PathBuf,
    daemons: Vec<Child>,
}

impl Slurm {
    /// Starts the daemons, and waits until the controller answers.
    pub fn start(console: &mut Console) -> Result<Self> {
        let folder = std::env::temp_dir().join(format!("fingertip-slurm-{}", std::process::id()));
        let mut slurm = Self { folder, daemons: Vec::new() };
        slurm.lay_out().context("cannot lay out a folder for Slurm")?;
        let folder = slurm.folder.clone();
        let mut munged = Command::new("munged");
        for (option, file) in
            [("key-file", "key"), ("socket", "socket"), ("pid-file", "pid"), ("log-file", "log"), ("seed-file", "seed")]
        {
            munged.arg(format!("--{option}={}", folder.join(format!("munge.{file}")).display()));
        }
        slurm.spawn(munged.args(["--foreground", "--force"]))?;
        slurm.spawn(Command::new("slurmctld").arg("-D").env("SLURM_CONF", folder.join("slurm.conf")))?;
        slurm.spawn(Command::new("slurmd").arg("-D").env("SLURM_CONF", folder.join("slurm.conf")))?;
        console.say("Started Slurm with one node.");
        for _ in 0..TRIES {
            let answer = slurm.command("sinfo").args(["--noheader", "--states=idle", "--format=%n"]).output();
            if answer.is_ok_and(|answer| answer.status.success() && !answer.stdout.is_empty()) {
                return Ok(slurm);
            }
            thread::sleep(BETWEEN);
        }
        let log = |name: &str| fs::read_to_string(slurm.folder.join(name)).unwrap_or_default();
        bail!("Slurm does not answer:\n{}\n{}", log("slurmctld.log"), log("slurmd.log"))
    }

    /// One of Slurm's programs.
    pub fn command(&self, program: &str) -> Command {
        let mut command = Command::new(program);
        command.env("SLURM_CONF", self.folder.join("slurm.conf"));
        command
    }

    fn spawn(&mut self, daemon: &mut Command) -> Result<()> {
        let started = daemon.stdin(Stdio::null()).stdout(Stdio::null()).stderr(Stdio::null()).spawn();
        self.daemons.push(started.with_context(|| format!("cannot start {}", daemon.get_program().display()))?);
        Ok(())
    }

    fn lay_out(&self) -> Result<()> {
        let folder = &self.folder;
        for name in ["state", "spool"] {
            fs::create_dir_all(folder.join(name))?;
        }
        // Whoever reads it may give this machine's Slurm jobs; it dies with it.
        let key = folder.join("munge.key");
        fs::write(&key, random(128)?)?;
        fs::set_permissions(&key, fs::Permissions::from_mode(0o400))?;
        fs::write(folder.join("slurm.conf"), self.conf()?)?;
        Ok(())
    }

    fn conf(&self) -> Result<String> {
        let folder = self.folder.display();
        let name = fs::read_to_string("/proc/sys/kernel/hostname")?;
        let host = name.trim().split('.').next().unwrap_or("localhost");
        // Both at once, so that they differ.
        let free = [TcpListener::bind("127.0.0.1:0")?, TcpListener::bind("127.0.0.1:0")?];
        let [controller, node] = [free[0].local_addr()?.port(), free[1].local_addr()?.port()];
        Ok(format!(
            "ClusterName=one
SlurmctldHost={host}(127.0.0.1)
SlurmctldPort={controller}
SlurmdPort={node}
SlurmUser=root
AuthInfo=socket={folder}/munge.socket
StateSaveLocation={folder}/state
SlurmdSpoolDir={folder}/spool
SlurmctldPidFile={folder}/slurmctld.pid
SlurmdPidFile={folder}/slurmd.pid
SlurmctldLogFile={folder}/slurmctld.log
SlurmdLogFile={folder}/slurmd.log
ProctrackType=proctrack/linuxproc
TaskPlugin=task/none
SelectType=select/cons_tres
SelectTypeParameters=CR_CPU
MpiDefault=none
ReturnToService=2
NodeName={host} NodeAddr=127.0.0.1 CPUs={cpus} State=UNKNOWN
PartitionName=all Nodes=ALL Default=YES MaxTime=INFINITE State=UP
",
            cpus = thread::available_parallelism().map_or(1, usize::from)
        ))
    }
}

/// Returns random bytes.
fn random(count: u64) -> Result<Vec<u8>> {
    use std::io::Read;
    let mut bytes = Vec::new();
    fs::File::open(Path::new("/dev/urandom"))?.take(count).read_to_end(&mut bytes)?;
    Ok(bytes)
}

impl Drop for Slurm {
    fn drop(&mut self) {
        for daemon in self.daemons.iter_mut().rev() {
            // Whoever has ended is no loss.
            let _ = daemon.kill();
            let _ = daemon.wait();
        }
        let _ = fs::remove_dir_all(&self.folder);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Command that a task of an array would run; `None` if it refuses.
    fn task([id, min, max, count]: [u32; 4], shares: Option<&str>) -> Option<String> {
        let mut command = Command::new("sh");
        command.arg(host::root().join("examples/cluster/slurm.sh")).arg("scene").env("SWEEP", "echo");
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
