//! How far a build is: crates done, and about how many minutes are left. In a terminal one line that changes; in a log
//! a line a minute.

use crate::console::{say_line, show_short};
use std::{
    collections::BTreeMap,
    io::{self, IsTerminal as _},
    time::{Duration, Instant},
};

/// Crates of a build that take longer than a second, with about how many: what is left is told by them. Their ratios
/// matter, not their size.
pub type Slow = &'static [(&'static str, f64)];
/// What runs on this machine, without the emulator.
pub const HOST: Slow = &[("fixed", 5.0), ("clap_builder", 5.0), ("fingertip", 4.0), ("sim", 10.0)];
/// The emulated board.
pub const EMULATOR: Slow = &[
    ("cranelift-codegen", 90.0),
    ("rigless", 100.0),
    ("virtual-board", 45.0),
    ("sim", 10.0),
    ("cranelift-assembler-x64", 8.0),
    ("gimli", 4.0),
];
/// Images for the microcontroller.
pub const IMAGE: Slow = &[("embassy-stm32", 10.0), ("stm32-metapac", 7.0), ("fixed", 8.0), ("fingertip", 8.0)];
/// Between two lines of a log.
const LOG_EVERY: Duration = Duration::from_secs(60);

/// A build under way.
pub struct Progress {
    what: String,
    terminal: bool,
    begun: Instant,
    said: Instant,
    done: usize,
    total: usize,
    /// Crates compiled in this run, and the seconds that they count for.
    compiled: f64,
    /// Slow crates that are not done yet: seconds, and since when they are under way.
    slow: BTreeMap<&'static str, (f64, Option<Instant>)>,
}

impl Progress {
    /// Of a build.
    pub fn new(what: &str, slow: Slow) -> Self {
        let now = Instant::now();
        let slow = slow.iter().map(|(name, seconds)| (*name, (*seconds, None))).collect();
        let terminal = io::stderr().is_terminal();
        Self { what: what.into(), terminal, begun: now, said: now, done: 0, total: 0, compiled: 0.0, slow }
    }

    /// A line of cargo's standard error. Tells whether it was only news of how far the build is.
    pub fn hear(&mut self, line: &str) -> bool {
        let line = line.trim();
        let Some((done, total, names)) = line.strip_prefix("Building [").and_then(read_bar) else {
            return line.starts_with("Updating") || line.starts_with("Download") || line.starts_with("Compiling");
        };
        (self.done, self.total) = (done, total);
        for name in names {
            if let Some((_, since)) = self.slow.get_mut(name) {
                since.get_or_insert_with(Instant::now);
            }
        }
        self.show();
        true
    }

    /// A message of cargo's, as JSON: a crate is done.
    pub fn done(&mut self, message: &str) {
        let Some((_, id)) = message.split_once("\"package_id\":\"") else { return };
        let id = id.split('"').next().unwrap_or_default();
        let name = package(id);
        let seconds = self.slow.remove(name).map_or(1.0, |(seconds, _)| seconds);
        if message.contains("\"fresh\":false") {
            self.compiled += seconds;
        }
    }

    /// The build ended.
    pub fn finish(&self) {
        if self.compiled > 0.0 && self.total > 0 {
            let seconds = self.begun.elapsed().as_secs();
            let (crates, minutes, seconds) = (self.total, seconds / 60, seconds % 60);
            say_line(format_args!("built    {}: {crates} crates in {minutes} min {seconds:02} s", self.what));
        }
    }

    fn show(&mut self) {
        let line = format!("{}: {} of {} crates{}", self.what, self.done, self.total, self.left());
        if self.terminal {
            show_short(format_args!("    building {line:.100}"));
        } else if self.said.elapsed() >= LOG_EVERY {
            self.said = Instant::now();
            say_line(format_args!("building {line}"));
        }
    }

    /// How long it still takes, by how long what is done has taken; nothing before that can be told.
    fn left(&self) -> String {
        let elapsed = self.begun.elapsed().as_secs_f64();
        let pace = self.compiled / elapsed;
        if elapsed < 10.0 || self.compiled < 10.0 {
            return String::new();
        }
        let slow_left = self.slow.values().map(|(seconds, since)| {
            let spent = since.map_or(0.0, |since| since.elapsed().as_secs_f64() * pace / 2.0);
            (seconds - spent).max(0.1 * seconds)
        });
        let waiting: f64 = slow_left.sum::<f64>();
        let quick = self.total.saturating_sub(self.done + self.slow.len()) as f64;
        match ((waiting + quick) / pace / 60.0).ceil() {
            minutes if minutes <= 1.0 => ", less than a minute left".into(),
            minutes => format!(", about {minutes} minutes left"),
        }
    }
}

/// Crates done and in all, and which are under way: `=====>   ] 45/261: gimli, syn(build)`.
fn read_bar(bar: &str) -> Option<(usize, usize, impl Iterator<Item = &str>)> {
    let (counts, names) = bar.split_once("] ")?.1.split_once(':')?;
    let (done, total) = counts.split_once('/')?;
    let names = names.split(',').map(|name| name.trim().split('(').next().unwrap_or_default());
    Some((done.trim().parse().ok()?, total.trim().parse().ok()?, names))
}

/// The package's name in an ID: `registry+https://...#gimli@0.33.0`, or `path+file:///.../host-tests/sim#0.1.0`.
fn package(id: &str) -> &str {
    let (place, of) = id.split_once('#').unwrap_or((id, id));
    of.split_once('@').map_or_else(|| place.rsplit('/').next().unwrap_or(place), |(name, _)| name)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn cargos_bar_is_read() {
        let bar = "Building [=======>          ] 45/261: gimli, cranelift-codegen, syn(build)   ";
        let (done, total, names) = read_bar(bar.strip_prefix("Building [").unwrap()).unwrap();
        assert_eq!((done, total), (45, 261));
        assert_eq!(names.collect::<Vec<_>>(), ["gimli", "cranelift-codegen", "syn"]);
        assert!(read_bar("Downloading 3 crates").is_none());
    }

    #[test]
    fn a_package_is_named_by_its_id() {
        assert_eq!(package("registry+https://github.com/rust-lang/crates.io-index#gimli@0.33.0"), "gimli");
        assert_eq!(package("path+file:///home/me/fingertip/host-tests/sim#0.1.0"), "sim");
        assert_eq!(package("path+file:///home/me/other#fingertip@0.1.0"), "fingertip");
    }

    #[test]
    fn what_is_left_follows_from_what_is_done() {
        let mut progress = Progress::new("it", &[("rigless", 60.0)]);
        progress.begun = Instant::now().checked_sub(Duration::from_secs(60)).unwrap();
        assert!(progress.hear("    Building [===>  ] 60/71: syn, rigless"));
        assert_eq!(progress.left(), "");
        for _ in 0..60 {
            progress.done("{\"package_id\":\"registry+x#syn@2.0.0\",\"fresh\":false}");
        }
        // 60 s of rigless and 10 crates of 1 s each, at a second a second.
        assert_eq!(progress.left(), ", about 2 minutes left");
        progress.done("{\"package_id\":\"registry+x#rigless@0.4.0\",\"fresh\":true}");
        assert_eq!((progress.compiled, progress.left().as_str()), (60.0, ", less than a minute left"));
    }
}
