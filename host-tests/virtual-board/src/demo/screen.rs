//! What is seen while it runs: a live heat map where there is a terminal, a line for each phase elsewhere.

use super::bus::Poll;
use super::play::Watch;
use host_tests::demo::Phase;
use host_tests::heatmap::{self, Pressures};
use host_tests::say;
use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};
use std::io::IsTerminal;

/// The brightest colour: a little above the peak at 5 N.
const FULL_KPA: f64 = 70.0;

/// The terminal, or what stands in for it.
#[derive(Debug)]
pub struct Screen {
    /// None where there is no terminal.
    bar: Option<ProgressBar>,
}

/// Nobody watches.
#[derive(Clone, Copy, Debug)]
pub struct Nobody;

impl Screen {
    /// A screen for a run of this virtual time.
    pub fn new(length_ms: u64) -> Self {
        let bar = std::io::stdout().is_terminal().then(|| {
            let bar = ProgressBar::with_draw_target(Some(length_ms), ProgressDrawTarget::stdout());
            let style = ProgressStyle::with_template("{msg}\n{bar:60} {pos} of {len} ms, virtual");
            bar.set_style(style.unwrap_or_else(|_| ProgressStyle::default_bar()));
            bar
        });
        Self { bar }
    }

    /// Says what is waited for.
    pub fn waiting(&self, what: &str) {
        match &self.bar {
            Some(bar) => bar.println(format!("waiting for {what}")),
            None => say::line(format_args!("waiting for {what}")),
        }
    }

    /// Leaves the terminal as it was.
    pub fn finish(&self) {
        if let Some(bar) = &self.bar {
            bar.finish_and_clear();
        }
    }
}

impl Watch for Screen {
    fn phase(&mut self, at_ms: u64, phase: Phase) {
        let line = format!("{:7.3} s  goal: {}", at_ms as f64 * 1e-3, phase.what());
        match &self.bar {
            Some(bar) => bar.println(line),
            None => say::line(line),
        }
    }

    fn news(&mut self, at_ms: u64, phase: Phase, poll: &Poll, pressures: Option<&Pressures>) {
        let Some(bar) = &self.bar else { return };
        bar.set_position(at_ms);
        if let Some(pressures) = pressures {
            bar.set_message(picture(phase, poll, pressures));
        }
    }
}

impl Watch for Nobody {
    fn phase(&mut self, _: u64, _: Phase) {}

    fn news(&mut self, _: u64, _: Phase, _: &Poll, _: Option<&Pressures>) {}
}

/// The heat map with the figures beside it.
fn picture(phase: Phase, poll: &Poll, pressures: &Pressures) -> String {
    let beside = [
        String::new(),
        format!("mode         {}", format!("{:?}", poll.mode).to_lowercase()),
        format!("goal         {:6.3} N", phase.goal_n()),
        format!("force        {:6.3} N", poll.force_n),
        format!("indentation  {:6.3} mm", poll.indentation_mm),
        format!("radius       {:6.3} mm", poll.radius_mm),
        format!("centre       {:6.3}, {:.3} mm", poll.centre_mm[0], poll.centre_mm[1]),
        String::new(),
        heatmap::legend(FULL_KPA),
    ];
    let lines = heatmap::lines(pressures, FULL_KPA);
    let both = lines.iter().zip(beside.iter().map(String::as_str).chain(std::iter::repeat("")));
    both.map(|(cells, text)| format!("  {cells}   {text}\n")).collect()
}
