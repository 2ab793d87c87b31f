//! Slurm with one node, as long as a value of this lives.

use crate::console::Console;
use anyhow::{Context, Result, bail};
use std::{
    fs,
    net::TcpListener,
    os::unix::fs::PermissionsExt,
    path::{Path, PathBuf},
    process::{Child, Command, Stdio},
    thread,
    time::Duration,
};

/// So often it is asked whether the controller answers, with so long between.
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

/// Bytes that nobody can guess.
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
