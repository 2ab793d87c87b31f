//! Running programs and saying what goes on: straight to the terminal, or captured for a stage of the tests.

use crate::paths;
use anyhow::{Context, Result, bail};
use std::{
    env,
    ffi::OsStr,
    fmt::Write as _,
    io::{self, BufRead, BufReader, IsTerminal, Read, Write as _},
    process::{Command, Stdio},
    sync::mpsc,
    thread,
    time::Instant,
};

/// Where programs write to.
pub struct Console {
    /// What the programs of a stage wrote so far; `None` writes straight to the terminal.
    captured: Option<String>,
}

impl Console {
    /// Programs write to the terminal.
    pub fn terminal() -> Self {
        Self { captured: None }
    }

    /// A line for the user.
    pub fn say(&self, text: &str) {
        clear_progress();
        for line in text.lines() {
            println!("{}{line}", if self.captured.is_some() { "    " } else { "" });
        }
    }

    /// Runs a program to its end.
    ///
    /// # Errors
    /// It is missing, or ends with anything but success.
    pub fn run(&mut self, command: &mut Command) -> Result<()> {
        command.current_dir(paths::root());
        let shown = show(command);
        let Some(text) = &mut self.captured else {
            eprintln!("$ {shown}");
            let status = command.status().with_context(|| missing(command))?;
            return if status.success() { Ok(()) } else { bail!("{status}: {shown}") };
        };
        let _ = writeln!(text, "$ {shown}");
        let mut child = command
            .stdin(Stdio::null())
            .stdout(Stdio::piped())
            .stderr(Stdio::piped())
            .spawn()
            .with_context(|| missing(command))?;
        let (sender, lines) = mpsc::channel();
        for stream in [child.stdout.take().map(boxed), child.stderr.take().map(boxed)].into_iter().flatten() {
            let sender = sender.clone();
            thread::spawn(move || {
                for line in BufReader::new(stream).split(b'\n').map_while(io::Result::ok) {
                    let _ = sender.send(String::from_utf8_lossy(&line).into_owned());
                }
            });
        }
        drop(sender);
        for line in lines {
            show_progress(&line);
            let _ = writeln!(text, "{line}");
        }
        let status = child.wait()?;
        clear_progress();
        if status.success() { Ok(()) } else { bail!("{status}: {shown}") }
    }

    /// Runs a program that is expected to fail, and returns what it wrote.
    ///
    /// # Errors
    /// It is missing, or succeeds.
    pub fn run_to_failure(&mut self, command: &mut Command) -> Result<String> {
        command.current_dir(paths::root());
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

    /// What the programs of a stage wrote so far.
    pub fn captured(&self) -> &str {
        self.captured.as_deref().unwrap_or_default()
    }
}

fn boxed(stream: impl Read + Send + 'static) -> Box<dyn Read + Send> {
    Box::new(stream)
}

/// What a program writes to its standard output; its errors go to the terminal.
///
/// # Errors
/// It is missing, ends with anything but success, or writes no text.
pub fn output(command: &mut Command) -> Result<String> {
    let output =
        command.current_dir(paths::root()).stderr(Stdio::inherit()).output().with_context(|| missing(command))?;
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
    let program = paths::shown(command.get_program().as_ref());
    let program =
        if command.get_program() == env::var_os("CARGO").unwrap_or_default() { "cargo".into() } else { program };
    let variables = command.get_envs().filter_map(|(key, value)| Some(format!("{}={}", name(key), name(value?))));
    variables.chain([program]).chain(command.get_args().map(name)).collect::<Vec<_>>().join(" ")
}

fn missing(command: &Command) -> String {
    let path = env::var("PATH").unwrap_or_default();
    format!("cannot start {}; looked in PATH={path}", command.get_program().to_string_lossy())
}

fn show_progress(line: &str) {
    if io::stdout().is_terminal() {
        let short: String = line.chars().filter(|letter| !letter.is_control()).take(76).collect();
        print!("\r\x1b[2K    {short}");
        let _ = io::stdout().flush();
    }
}

fn clear_progress() {
    if io::stdout().is_terminal() {
        print!("\r\x1b[2K");
        let _ = io::stdout().flush();
    }
}

/// A sequence of checks, each a line with its duration; what failed is shown in full.
#[derive(Default)]
pub struct Stages {
    failed: Vec<String>,
}

impl Stages {
    /// Runs a stage; `None` where it failed.
    ///
    /// Stages do not depend on each other's order: a stage that lacks what an earlier one failed to make fails too.
    pub fn stage<T>(&mut self, name: &str, work: impl FnOnce(&mut Console) -> Result<T>) -> Option<T> {
        println!("{name} ...");
        let mut console = Console { captured: Some(String::new()) };
        let start = Instant::now();
        let result = work(&mut console);
        let seconds = start.elapsed().as_secs_f64();
        clear_progress();
        match result {
            Ok(value) => {
                for line in closing_lines(console.captured()) {
                    println!("    {line}");
                }
                println!("ok     {seconds:7.1} s  {name}");
                Some(value)
            }
            Err(error) => {
                println!("{}", console.captured());
                // Again at the end, where one looks first.
                for line in console.captured().lines().filter(|line| is_failed_test(line)) {
                    println!("    {line}");
                }
                println!("{error:#}");
                println!("FAILED {seconds:7.1} s  {name}");
                self.failed.push(name.into());
                None
            }
        }
    }

    /// The verdict.
    ///
    /// # Errors
    /// Names the stages that failed.
    pub fn finish(self, what: &str) -> Result<()> {
        if !self.failed.is_empty() {
            bail!("{} failed: {}", what, self.failed.join("; "));
        }
        println!("{what}: all passed");
        Ok(())
    }
}

/// Cargo's line of a test that failed.
fn is_failed_test(line: &str) -> bool {
    line.starts_with("test ") && line.ends_with(" ... FAILED")
}

/// Cargo's closing line of each test binary that ran a test.
fn closing_lines(text: &str) -> impl Iterator<Item = &str> {
    text.lines().filter(|line| line.starts_with("test result:") && !line.contains(" 0 passed; 0 failed; 0 ignored"))
}
