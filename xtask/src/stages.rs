//! The tests and checks, a stage each.

use crate::console::{Console, clear_line, cpu_s};
use anyhow::{Result, bail};
use std::time::Instant;

/// A sequence of checks, each a line with its cost; what failed is shown in full.
#[derive(Default)]
pub struct Stages {
    done: Vec<Stage>,
    failed: Vec<String>,
}

/// What a stage cost.
struct Stage {
    name: String,
    /// CPU time of compiling, s.
    built_s: f64,
    /// CPU time of all else, s.
    ran_s: f64,
    /// By the clock, s.
    clock_s: f64,
}

impl Stages {
    /// Runs a stage; `None` where it failed.
    ///
    /// Stages do not depend on each other's order: a stage that lacks what an earlier one failed to make fails too.
    pub fn stage<T>(&mut self, name: &str, work: impl FnOnce(&mut Console) -> Result<T>) -> Option<T> {
        println!("{name} ...");
        let mut console = Console::captured();
        let (start, before_s) = (Instant::now(), cpu_s());
        let result = work(&mut console);
        let (clock_s, built_s) = (start.elapsed().as_secs_f64(), console.built_s());
        let ran_s = cpu_s() - before_s - built_s;
        self.done.push(Stage { name: name.into(), built_s, ran_s, clock_s });
        clear_line();
        match result {
            Ok(value) => {
                for line in closing_lines(console.text()) {
                    println!("    {line}");
                }
                println!("ok     {clock_s:7.1} s  {name}");
                Some(value)
            }
            Err(error) => {
                println!("{}", console.text());
                // Again at the end, where one looks first.
                for line in console.text().lines().filter(|line| is_failed_test(line)) {
                    println!("    {line}");
                }
                println!("{error:#}");
                println!("FAILED {clock_s:7.1} s  {name}");
                self.failed.push(name.into());
                None
            }
        }
    }

    /// The verdict.
    pub fn finish(self, what: &str) -> Result<()> {
        println!("\n{:>10} {:>8} {:>8}  seconds of CPU time", "compiling", "running", "clock");
        let line = |built_s: f64, ran_s: f64, clock_s: f64, name: &str| {
            println!("{built_s:10.1} {ran_s:8.1} {clock_s:8.1}  {name}");
        };
        for Stage { name, built_s, ran_s, clock_s } in &self.done {
            line(*built_s, *ran_s, *clock_s, name);
        }
        let sum = |of: fn(&Stage) -> f64| self.done.iter().map(of).sum::<f64>();
        line(sum(|stage| stage.built_s), sum(|stage| stage.ran_s), sum(|stage| stage.clock_s), "all\n");
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
