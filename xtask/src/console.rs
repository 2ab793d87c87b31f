//! Running programs and saying what goes on: straight to the terminal, or captured for a stage of the tests.

use crate::host;
use anyhow::{Context, Result, bail};
use std::ffi::OsStr;
use std::fmt::{Arguments, Write as _};
use std::io::{self, BufReader, IsTerminal, Read, Write as _};
use std::process::{Child, Command, Stdio};
use std::sync::mpsc;
use std::time::{Duration, Instant};
use std::{env, fs, thread};

/// Destination of the programs' output.
#[derive(Default)]
pub struct Console {
    /// Output of a stage's programs so far; `None` writes straight to the terminal.
    captured: Option<String>,
    /// CPU time that went into compiling.
    pub built_s: f64,
}

impl Console {
    /// Programs are heard, and shown where something fails.
    pub fn captured() -> Self {
        Self { captured: Some(String::new()), ..Self::default() }
    }

    /// Reports progress on standard error: standard output is for results, which may go to a file.
    pub fn say(&self, text: &str) {
        self.lines(io::stderr(), text);
    }

    pub fn print(&self, text: &str) {
        self.lines(io::stdout(), text);
    }

    /// A reader that went away (`| head`) does not end the command.
    fn lines(&self, mut to: impl io::Write, text: &str) {
        clear_line();
        for line in text.lines() {
            let _ = writeln!(to, "{}{line}", if self.captured.is_some() { "    " } else { "" });
        }
    }

    /// Runs a program that prepares a command, an installer for example: what it writes is progress.
    pub fn prepare(&mut self, command: &mut Command) -> Result<()> {
        self.run(command.stdout(io::stderr()))
    }

    pub fn run(&mut self, command: &mut Command) -> Result<()> {
        command.current_dir(host::root());
        let shown = show(command);
        let Some(text) = &mut self.captured else {
            let _ = writeln!(io::stderr(), "$ {shown}");
            let status = command.status().with_context(|| missing(command))?;
            return if status.success() { Ok(()) } else { bail!("{status}: {shown}") };
        };
        let _ = writeln!(text, "$ {shown}");
        let mut child = heard(command)?;
        for (line, _) in lines(&mut child) {
            let short: String = line.chars().filter(|letter| !letter.is_control()).take(76).collect();
            show_short(format_args!("    {short}"));
            let _ = writeln!(text, "{line}");
        }
        let status = child.wait()?;
        clear_line();
        if status.success() { Ok(()) } else { bail!("{status}: {shown}") }
    }

    /// Runs a command of cargo's that only compiles, and shows its progress. Cargo's output is shown if it fails.
    pub fn build(&mut self, command: &mut Command, what: &str) -> Result<()> {
        let before_s = cpu_s();
        let shown = show(command);
        command.args(["--message-format", "json-render-diagnostics"]).current_dir(host::root());
        command.env("CARGO_TERM_PROGRESS_WHEN", "always").env("CARGO_TERM_PROGRESS_WIDTH", "400");
        let mut child = heard(command)?;
        let mut progress = Progress::new(what);
        let mut said = format!("$ {shown}\n");
        for (text, error) in lines(&mut child) {
            if !error {
                progress.compiled |= text.contains("\"fresh\":false");
            } else if !progress.hear(&text) {
                let _ = writeln!(said, "{text}");
            }
        }
        let status = child.wait()?;
        clear_line();
        progress.finish();
        self.built_s += cpu_s() - before_s;
        match &mut self.captured {
            Some(captured) => captured.push_str(&said),
            None if !status.success() => drop(io::stderr().write_all(said.as_bytes())),
            None => {}
        }
        if status.success() { Ok(()) } else { bail!("{status}: {shown}") }
    }

    /// Runs a program that is expected to fail, and returns what it wrote.
    pub fn run_to_failure(&mut self, command: &mut Command) -> Result<String> {
        command.current_dir(host::root());
        let output = command.output().with_context(|| missing(command))?;
        let text = String::from_utf8_lossy(&output.stdout) + String::from_utf8_lossy(&output.stderr);
        if let Some(captured) = &mut self.captured {
            let _ = writeln!(captured, "$ {}\n{text}", show(command));
        }
        if output.status.success() {
            bail!("expected to fail, but succeeded: {}", show(command))
        }
        Ok(text.into_owned())
    }

    pub fn text(&self) -> &str {
        self.captured.as_deref().unwrap_or_default()
    }
}

/// Starts a program whose output is read.
fn heard(command: &mut Command) -> Result<Child> {
    let child = command.stdin(Stdio::null()).stdout(Stdio::piped()).stderr(Stdio::piped()).spawn();
    child.with_context(|| missing(command))
}

/// Reads a program's output until it closes both of its streams: lines, and whether each is of the standard error.
fn lines(child: &mut Child) -> mpsc::Receiver<(String, bool)> {
    let (sender, lines) = mpsc::channel();
    let output = child.stdout.take().map(|stream| Box::new(stream) as Box<dyn Read + Send>);
    let errors = child.stderr.take().map(|stream| Box::new(stream) as _);
    for (stream, error) in [(output, false), (errors, true)] {
        let Some(stream) = stream else { continue };
        let sender = sender.clone();
        thread::spawn(move || {
            let mut stream = BufReader::new(stream);
            let mut line = Vec::new();
            while let Some(byte) = stream.by_ref().bytes().next().and_then(io::Result::ok) {
                // Cargo ends its bar of progress with a carriage return.
                if byte != b'\n' && byte != b'\r' {
                    line.push(byte);
                    continue;
                }
                let _ = sender.send((String::from_utf8_lossy(&line).into_owned(), error));
                line.clear();
            }
        });
    }
    lines
}

/// CPU time of all programs that were run to their end, s; 0 where the system does not tell.
pub fn cpu_s() -> f64 {
    // The clock of these counts ticks a hundred times a second on every Linux.
    let stat = fs::read_to_string("/proc/self/stat").unwrap_or_default();
    let fields = stat.rsplit(')').next().unwrap_or_default().split_whitespace();
    fields.skip(13).take(2).filter_map(|ticks| ticks.parse::<f64>().ok()).sum::<f64>() / 100.0
}

/// Returns a program's standard output; its errors go to the terminal.
pub fn output(command: &mut Command) -> Result<String> {
    let output =
        command.current_dir(host::root()).stderr(Stdio::inherit()).output().with_context(|| missing(command))?;
    if !output.status.success() {
        bail!("{}: {}", output.status, show(command));
    }
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

/// Shows a line of progress that the next one replaces, in a terminal only.
fn show_short(line: Arguments) {
    if io::stderr().is_terminal() {
        let _ = write!(io::stderr(), "\r\x1b[2K{line}");
    }
}

/// Takes the line of progress away.
pub fn clear_line() {
    show_short(format_args!(""));
}

// How far a build is: in a terminal one line that changes, in a log a line a minute.

/// Between two lines of a log.
const LOG_EVERY: Duration = Duration::from_secs(60);

pub struct Progress {
    what: String,
    begun: Instant,
    said: Instant,
    total: usize,
    /// True if a crate was compiled in this run.
    compiled: bool,
}

impl Progress {
    pub fn new(what: &str) -> Self {
        let now = Instant::now();
        Self { what: what.into(), begun: now, said: now, total: 0, compiled: false }
    }

    /// Takes a line of cargo's standard error; true if it was only progress of the build.
    pub fn hear(&mut self, line: &str) -> bool {
        let line = line.trim();
        let Some((done, total)) = line.strip_prefix("Building [").and_then(read_bar) else {
            return line.starts_with("Updating") || line.starts_with("Download") || line.starts_with("Compiling");
        };
        self.total = total;
        let line = format!("building {}: {done} of {total} crates", self.what);
        if io::stderr().is_terminal() {
            show_short(format_args!("    {line:.100}"));
        } else if self.said.elapsed() >= LOG_EVERY {
            self.said = Instant::now();
            let _ = writeln!(io::stderr(), "{line}");
        }
        true
    }

    pub fn finish(&self) {
        if self.compiled && self.total > 0 {
            let seconds = self.begun.elapsed().as_secs();
            let (crates, minutes, seconds) = (self.total, seconds / 60, seconds % 60);
            let what = &self.what;
            let _ = writeln!(io::stderr(), "built    {what}: {crates} crates in {minutes} min {seconds:02} s");
        }
    }
}

/// Crates done and in all: `=====>   ] 45/261: gimli, syn(build)`.
fn read_bar(bar: &str) -> Option<(usize, usize)> {
    let (counts, _) = bar.split_once("] ")?.1.split_once(':')?;
    let (done, total) = counts.split_once('/')?;
    Some((done.trim().parse().ok()?, total.trim().parse().ok()?))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn cargos_bar_is_read() {
        let bar = "[=======>          ] 45/261: gimli, cranelift-codegen, syn(build)   ";
        assert_eq!(read_bar(bar), Some((45, 261)));
        assert!(read_bar("Downloading 3 crates").is_none());
    }
}
