//! A served finger, for the tests of the program.
#![allow(dead_code, reason = "each test takes what it needs")]

use std::io::{BufRead as _, BufReader, Read as _, Write as _};
use std::process::{Child, ChildStdin, Command, Stdio};

pub fn program(arguments: &[&str]) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_serve"));
    command.args(arguments);
    command
}

/// A process with all programs in its terminal, ended when dropped.
pub struct Killed(pub Child);

impl Drop for Killed {
    fn drop(&mut self) {
        // One that has ended already needs no more.
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}

/// A served finger, stopped when dropped.
pub struct Served {
    pub child: Killed,
    pub name: String,
    pub side: Option<ChildStdin>,
    said: BufReader<std::process::ChildStdout>,
}

impl Served {
    /// One that complains there.
    pub fn begin(complaints: Stdio, arguments: &[&str]) -> Self {
        let mut command = program(arguments);
        command.stdin(Stdio::piped()).stdout(Stdio::piped()).stderr(complaints);
        let mut child = command.spawn().expect("it starts");
        let (side, said) = (child.stdin.take(), BufReader::new(child.stdout.take().expect("it was asked for")));
        let mut served = Self { child: Killed(child), name: String::new(), side, said };
        let line = served.line();
        served.name = line.split_whitespace().nth(1).unwrap_or_else(|| panic!("says where it is: {line:?}")).to_owned();
        assert!(served.line().starts_with("scene    "));
        served
    }

    pub fn pid(&self) -> rustix::process::Pid {
        rustix::process::Pid::from_child(&self.child.0)
    }

    pub fn line(&mut self) -> String {
        let mut line = String::new();
        self.said.read_line(&mut line).expect("a line");
        line
    }

    /// Has a command carried out, and hears of it.
    pub fn ask(&mut self, command: &str) -> String {
        writeln!(self.side.as_mut().expect("it was asked for"), "{command}").expect("it listens");
        self.line()
    }

    /// Sends Ctrl-C; returns success, the last output, and standard error.
    pub fn interrupt(mut self) -> (bool, String, String) {
        rustix::process::kill_process(self.pid(), rustix::process::Signal::INT).expect("it runs");
        let (mut last, mut complained) = (String::new(), String::new());
        self.said.read_to_string(&mut last).expect("words");
        let stderr = self.child.0.stderr.as_mut().expect("it was asked for");
        stderr.read_to_string(&mut complained).expect("words");
        (self.child.0.wait().expect("it ends").success(), last, complained)
    }
}
