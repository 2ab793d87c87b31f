//! Running programs and saying what goes on.

use crate::host;
use anyhow::{Context, Result, ensure};
use std::ffi::OsStr;
use std::io::{self, Write as _};
use std::process::{Command, Stdio};
use std::sync::atomic::{AtomicU64, Ordering};
use std::{env, fs};

/// Reports progress on standard error: standard output is for results, which may go to a file.
pub fn say(text: &str) {
    let _ = writeln!(io::stderr(), "{text}");
}

/// Prints a result. A reader that went away (`| head`) does not end the command.
pub fn print(text: &str) {
    let _ = writeln!(io::stdout(), "{}", text.trim_end());
}

/// Runs a program that prepares a command, a compiler or an installer for example: what it writes is progress.
pub fn prepare(command: &mut Command) -> Result<()> {
    let before = ticks();
    let prepared = finish(command.stdout(io::stderr()));
    PREPARED.fetch_add(ticks() - before, Ordering::Relaxed);
    prepared
}

/// CPU time of all programs of [`prepare`], in ticks.
static PREPARED: AtomicU64 = AtomicU64::new(0);

/// CPU time of all programs that have ended, in ticks; 0 where the system does not tell.
fn ticks() -> u64 {
    let stat = fs::read_to_string("/proc/self/stat").unwrap_or_default();
    let fields = stat.rsplit(')').next().unwrap_or_default().split_whitespace();
    fields.skip(13).take(2).filter_map(|ticks| ticks.parse::<u64>().ok()).sum()
}

/// CPU time of the programs that have ended, s: those of [`prepare`], and the others.
pub fn cpu_s() -> [f64; 2] {
    let prepared = PREPARED.load(Ordering::Relaxed);
    // The clock of these counts ticks a hundred times a second on every Linux.
    [prepared, ticks() - prepared].map(|ticks| ticks as f64 / 100.0)
}

pub fn run(command: &mut Command) -> Result<()> {
    say(&format!("$ {}", show(command)));
    finish(command)
}

fn finish(command: &mut Command) -> Result<()> {
    let status = command.current_dir(host::root()).status().with_context(|| missing(command))?;
    ensure!(status.success(), "{status}: {}", show(command));
    Ok(())
}

/// Returns a program's standard output; its errors go to the terminal.
pub fn output(command: &mut Command) -> Result<String> {
    let output =
        command.current_dir(host::root()).stderr(Stdio::inherit()).output().with_context(|| missing(command))?;
    ensure!(output.status.success(), "{}: {}", output.status, show(command));
    String::from_utf8(output.stdout).with_context(|| format!("{} wrote no UTF-8", show(command)))
}

/// The cargo that runs this program.
pub fn cargo(subcommand: &str) -> Command {
    let mut command = Command::new(env::var_os("CARGO").unwrap_or_else(|| "cargo".into()));
    command.arg(subcommand);
    command
}

/// The command as one would type it.
pub fn show(command: &Command) -> String {
    let name = |word: &OsStr| word.to_string_lossy().into_owned();
    let is_cargo = command.get_program() == env::var_os("CARGO").unwrap_or_default();
    let program = if is_cargo { "cargo".into() } else { host::shown(command.get_program().as_ref()) };
    let variables = command.get_envs().filter_map(|(key, value)| Some(format!("{}={}", name(key), name(value?))));
    variables.chain([program]).chain(command.get_args().map(name)).collect::<Vec<_>>().join(" ")
}

fn missing(command: &Command) -> String {
    let path = env::var("PATH").unwrap_or_default();
    format!("cannot start {}; looked in PATH={path}", command.get_program().to_string_lossy())
}
