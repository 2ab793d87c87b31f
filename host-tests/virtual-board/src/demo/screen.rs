//! What is seen while it runs: a live heat map where there is a terminal, a line for each phase elsewhere.

use fingertip::pipeline::Status;
use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};
use output::{heatmap, say};
use sim::demo::{Taxels, what};
use sim::scene::Scene;
use sim::watch::{Step, Watch};
use std::io::IsTerminal;

/// The brightest colour: a little above the peak at 5 N.
const FULL_KPA: f64 = 70.0;

/// The array is drawn this often, in the scene's time.
const DRAWN_MS: u64 = 50;

/// Display of the run: a progress bar on a terminal, plain lines otherwise.
pub struct Screen {
    scene: Scene,
    array: Taxels,
    /// Number of goals reported.
    told: usize,
    drawn_ms: u64,
    /// Progress bar; `None` without a terminal.
    bar: Option<ProgressBar>,
}

impl Screen {
    /// A screen for a run of this scene.
    pub fn new(scene: &Scene) -> Self {
        let bar = std::io::stdout().is_terminal().then(|| {
            let length_ms = (scene.duration_s * 1e3) as u64;
            let bar = ProgressBar::with_draw_target(Some(length_ms), ProgressDrawTarget::stdout());
            let style = ProgressStyle::with_template("{msg}\n{bar:60} {pos} of {len} ms, virtual");
            bar.set_style(style.unwrap_or_else(|_| ProgressStyle::default_bar()));
            bar
        });
        Self { scene: scene.clone(), array: Taxels::of(scene), told: 0, drawn_ms: 0, bar }
    }

    /// Reports the reason of a wait.
    pub fn waiting(&self, for_what: &str) {
        self.say(format!("waiting for {for_what}"));
    }

    fn say(&self, line: String) {
        match &self.bar {
            Some(bar) => bar.println(line),
            None => say::line(line),
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
    fn step(&mut self, step: &Step) {
        while let Some(event) = self.scene.script.get(self.told).filter(|event| event.at_s <= step.time_s) {
            self.say(format!("{:7.3} s  goal: {}", event.at_s, what(event.goal_n)));
            self.told += 1;
        }
        let now_ms = (step.time_s.max(0.0) * 1e3) as u64;
        let Some(bar) = self.bar.as_ref().filter(|_| now_ms >= self.drawn_ms + DRAWN_MS) else { return };
        self.drawn_ms = now_ms;
        bar.set_position(now_ms);
        bar.set_message(picture(&self.scene, &self.array, step, self.told));
    }
}

/// Heat map with the figures next to it.
fn picture(scene: &Scene, array: &Taxels, step: &Step, told: usize) -> String {
    let Status { mode, contact, .. } = step.status;
    let goal_n = told.checked_sub(1).map_or(0.0, |last| scene.script[last].goal_n);
    let number = |fixed: f64, unit: &str| format!("{fixed:6.3} {unit}");
    let beside = [
        String::new(),
        format!("mode         {}", format!("{mode:?}").to_lowercase()),
        format!("goal         {}", number(goal_n, "N")),
        format!("force        {}", number(contact.force.0.to_num(), "N")),
        format!("indentation  {}", number(contact.indentation.0.to_num(), "mm")),
        format!("radius       {}", number(contact.radius.0.to_num(), "mm")),
        format!("centre       {:6.3}, {:.3} mm", contact.centre_x.0, contact.centre_y.0),
        String::new(),
        heatmap::legend(FULL_KPA),
    ];
    let lines = heatmap::lines(&array.kilopascals(step.frame), FULL_KPA);
    let both = lines.iter().zip(beside.iter().map(String::as_str).chain(std::iter::repeat("")));
    both.map(|(cells, text)| format!("  {cells}   {text}\n")).collect()
}
