//! A run with everything that watches it, and what it leaves behind.

use crate::ledger;
use crate::metrics::{Hold, Measured, Meter, Verdict, shown};
use crate::scene::Scene;
use crate::watch::{Controller, Step, Summary, Watch};
#[cfg(feature = "files")]
use serde_json::{Map, Value, json};
use std::error::Error;
use std::fmt::Write as _;

/// Why a run, or what is made of it, failed.
pub type RunError = Box<dyn Error + Send + Sync>;

/// What runs a scene: a board.
pub type Run<'a> = &'a (dyn Fn(&Scene, &mut dyn Watch) -> Result<Summary, RunError> + Sync);

/// How a scene went.
#[derive(Clone, Debug)]
pub struct Outcome {
    /// What was measured.
    pub measured: Measured,
    /// Whether it held what the scene asks for.
    pub verdicts: Vec<Verdict>,
    /// The forces that were held.
    pub holds: Vec<Hold>,
    /// Times, costs and digest.
    pub summary: Summary,
}

/// Runs a scene, measured, and watched by these too.
pub fn run(scene: &Scene, board: Run, watchers: &mut [&mut dyn Watch]) -> Result<Outcome, RunError> {
    let mut meter = Meter::default();
    let summary = board(scene, &mut All { meter: &mut meter, others: watchers })?;
    let measured = meter.measured();
    Ok(Outcome { verdicts: meter.verdicts(&scene.bounds), holds: meter.holds(), measured, summary })
}

impl Outcome {
    /// Whether every bound is held.
    pub fn passed(&self) -> bool {
        self.verdicts.iter().all(|verdict| verdict.held)
    }

    /// For scripts. The keys are stable; `null` is a metric that the run does not have, or a side that is not bounded.
    #[cfg(feature = "files")]
    pub fn json(&self, scene: &Scene, board: &str, ablated: &[ledger::Without]) -> Value {
        let values = |measured: &Measured| -> Map<String, Value> {
            measured.0.iter().map(|(name, value)| (name.clone(), json!(value))).collect()
        };
        let ablated =
            ablated.iter().map(|without| json!({ "effect": without.effect, "metrics": values(&without.measured) }));

        let bound = |verdict: &Verdict| {
            let bound = &verdict.bound;
            json!({
                "metric": bound.metric, "min": bound.min, "max": verdict.max, "value": verdict.value, "held": verdict.held,
            })
        };
        json!({
            "scene": scene.name,
            "about": scene.about,
            "board": board,
            "simulated": true,
            "seed": scene.seed,
            "virtual_s": self.summary.virtual_s,
            "set_up_wall_s": self.summary.set_up_s,
            "wall_s": self.summary.wall_s,
            "digest": self.summary.digest,
            "passed": self.passed(),
            "metrics": values(&self.measured),
            "bounds": self.verdicts.iter().map(bound).collect::<Vec<_>>(),
            "ledger": ledger::json(&self.summary),
            "without": ablated.collect::<Vec<_>>(),
        })
    }

    /// For people: the bounds, every metric, the ledger.
    pub fn text(&self) -> String {
        let Summary { virtual_s, set_up_s, wall_s, digest, .. } = &self.summary;
        let mut text = String::new();
        let width = self.measured.0.iter().map(|(name, _)| name.len()).max().unwrap_or(0);
        for (name, value) in &self.measured.0 {
            // Writing to a string does not fail.
            let _ = writeln!(text, "  {name:width$}  {:>10}{}", shown(*value), self.bound_of(name));
        }
        let _ = writeln!(text, "\n{}", ledger::text(&self.summary));
        let ratio = if *wall_s > 0.0 { virtual_s / wall_s } else { f64::INFINITY };
        let _ = writeln!(
            text,
            "{virtual_s:.3} s simulated in {wall_s:.3} s: {ratio:.2} times real time (and {set_up_s:.3} s to power up and tare)"
        );
        let _ = writeln!(text, "digest {digest}");
        let broken: Vec<_> = self.verdicts.iter().filter(|verdict| !verdict.held).collect();
        for verdict in &broken {
            let (metric, asked) = (&verdict.bound.metric, asked(verdict.bound.min, verdict.max));
            let _ = writeln!(text, "BROKEN {metric}: {}, {asked} asked", shown(verdict.value));
        }
        let held = self.verdicts.len() - broken.len();
        let _ = writeln!(text, "{held} of {} bounds held", self.verdicts.len());
        text
    }

    fn bound_of(&self, name: &str) -> String {
        let verdict = self.verdicts.iter().find(|verdict| verdict.bound.metric == name);
        verdict.map_or(String::new(), |verdict| {
            let asked = asked(verdict.bound.min, verdict.max);
            format!("  {asked} asked: {}", if verdict.held { "held" } else { "BROKEN" })
        })
    }
}

/// What a bound asks for, for people.
pub fn asked(min: Option<f64>, max: Option<f64>) -> String {
    let [least, most] = [min, max].map(shown);
    match (min, max) {
        (Some(_), Some(_)) => format!("{least} to {most}"),
        (Some(_), None) => format!("{least} or more"),
        (None, Some(_)) => format!("{most} or less"),
        (None, None) => "nothing".into(),
    }
}

/// The meter and whoever else watches.
struct All<'a, 'b> {
    meter: &'a mut Meter,
    others: &'a mut [&'b mut dyn Watch],
}

impl Watch for All<'_, '_> {
    fn begin(&mut self, controllers: &[Controller]) {
        self.meter.begin(controllers);
        self.others.iter_mut().for_each(|watch| watch.begin(controllers));
    }

    fn wants_pressures(&mut self, finger: usize, time_s: f64) -> bool {
        // All are asked: who wants them may count what it asked for.
        self.others.iter_mut().fold(false, |wanted, watch| watch.wants_pressures(finger, time_s) | wanted)
    }

    fn wants_every_frame(&self) -> bool {
        self.others.iter().any(|watch| watch.wants_every_frame())
    }

    fn step(&mut self, step: &Step) {
        self.meter.step(step);
        self.others.iter_mut().for_each(|watch| watch.step(step));
    }
}
