//! Run of a scene with its watchers, its results, and the cost and benefit of each effect.

use crate::metrics::{Hold, Measured, Meter, Verdict, shown};
use crate::scene::Scene;
use crate::watch::{Controller, Cost, Step, Summary, Watch};
#[cfg(feature = "files")]
use serde_json::{Value, json};
use std::error::Error;
use std::fmt::Write as _;

/// Reason why a run, or something made from it, failed.
pub type RunError = Box<dyn Error + Send + Sync>;

/// Board that runs a scene.
pub type Run<'a> = &'a (dyn Fn(&Scene, &mut dyn Watch) -> Result<Summary, RunError> + Sync);

#[derive(Clone, Debug)]
pub struct Outcome {
    pub measured: Measured,
    /// Comparison of the results with the bounds.
    pub verdicts: Vec<Verdict>,
    pub holds: Vec<Hold>,
    pub summary: Summary,
}

/// Runs a scene, measures it, and passes it to these watchers too.
pub fn run(scene: &Scene, board: Run, watchers: &mut [&mut dyn Watch]) -> Result<Outcome, RunError> {
    let mut meter = Meter::default();
    let mut all: Vec<&mut dyn Watch> = vec![&mut meter];
    all.extend(watchers.iter_mut().map(|watch| &mut **watch as &mut dyn Watch));
    let summary = board(scene, &mut all)?;
    let measured = meter.measured();
    Ok(Outcome { verdicts: meter.verdicts(&measured, &scene.bounds), holds: meter.holds(), measured, summary })
}

impl Outcome {
    pub fn passed(&self) -> bool {
        self.verdicts.iter().all(|verdict| verdict.held)
    }

    /// Returns the result for scripts. The keys are stable; `null` is a missing value, or a side without a bound.
    #[cfg(feature = "files")]
    pub fn json(&self, scene: &Scene, board: &str, ablated: &[Without]) -> Value {
        let ablated =
            ablated.iter().map(|without| json!({ "effect": without.effect, "metrics": without.measured.json() }));
        // Without the rest of the run.
        let cost = |(effect, evaluations, wall_s, share_percent): (_, Option<u64>, _, _)| {
            Some(
                json!({ "effect": effect, "evaluations": evaluations?, "wall_s": wall_s, "share_percent": share_percent }),
            )
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
            "metrics": self.measured.json(),
            "bounds": self.verdicts,
            "ledger": ledger_rows(&self.summary).into_iter().filter_map(cost).collect::<Vec<_>>(),
            "without": ablated.collect::<Vec<_>>(),
        })
    }

    /// Returns the result for people: bounds, metrics, ledger.
    pub fn text(&self) -> String {
        let Summary { virtual_s, set_up_s, wall_s, digest, .. } = &self.summary;
        let mut text = String::new();
        let width = self.measured.0.iter().map(|(name, _)| name.len()).max().unwrap_or(0);
        for (name, value) in &self.measured.0 {
            let _ = writeln!(text, "  {name:width$}  {:>10}{}", shown(*value), self.bound_of(name, *value));
        }
        let _ = writeln!(text, "\n  {:24} {:>12} {:>10} {:>8}", "effect", "evaluations", "time, s", "share");
        for (effect, evaluations, seconds, percent) in ledger_rows(&self.summary) {
            let evaluations = evaluations.map_or(String::new(), |count| count.to_string());
            let _ = writeln!(text, "  {effect:24} {evaluations:>12} {seconds:>10.4} {percent:>6.1} %");
        }
        text.push('\n');
        let ratio = if *wall_s > 0.0 { virtual_s / wall_s } else { f64::INFINITY };
        let _ = writeln!(
            text,
            "{virtual_s:.3} s simulated in {wall_s:.3} s: {ratio:.2} times real time (and {set_up_s:.3} s to power up and tare)"
        );
        let _ = writeln!(text, "digest {digest}");
        let broken: Vec<_> = self.verdicts.iter().filter(|verdict| !verdict.held).collect();
        for verdict in &broken {
            let (metric, asked) = (&verdict.metric, asked(verdict.min, verdict.max));
            let _ = writeln!(text, "BROKEN {metric}: {}, {asked} asked", shown(verdict.value));
        }
        let held = self.verdicts.len() - broken.len();
        let _ = writeln!(text, "{held} of {} bounds held", self.verdicts.len());
        text
    }

    fn bound_of(&self, name: &str, value: Option<f64>) -> String {
        let verdict = self.verdicts.iter().find(|verdict| verdict.metric == name);
        verdict.map_or(String::new(), |verdict| {
            let asked = asked(verdict.min, verdict.max);
            // The goal that is closest to its limit may not be the one with the largest value.
            let at_goal = (verdict.value != value).then(|| format!("{}, ", shown(verdict.value)));
            format!("  {}{asked} asked: {}", at_goal.unwrap_or_default(), if verdict.held { "held" } else { "BROKEN" })
        })
    }
}

/// Formats the limits of a bound for people.
pub fn asked(min: Option<f64>, max: Option<f64>) -> String {
    let [least, most] = [min, max].map(shown);
    match (min, max) {
        (Some(_), Some(_)) => format!("{least} to {most}"),
        (Some(_), None) => format!("{least} or more"),
        (None, Some(_)) => format!("{most} or less"),
        (None, None) => "nothing".into(),
    }
}

impl Watch for Vec<&mut dyn Watch> {
    fn begin(&mut self, controllers: &[Controller]) {
        self.iter_mut().for_each(|watch| watch.begin(controllers));
    }

    fn wants_pressures(&mut self, finger: usize, time_s: f64) -> bool {
        // All watchers are called, as they may count their requests.
        self.iter_mut().fold(false, |wanted, watch| watch.wants_pressures(finger, time_s) | wanted)
    }

    fn wants_every_frame(&self) -> bool {
        self.iter().any(|watch| watch.wants_every_frame())
    }

    fn step(&mut self, step: &Step) {
        self.iter_mut().for_each(|watch| watch.step(step));
    }
}

/// Returns the cost of each effect in the order of the scene, over all fingers and stages.
pub fn by_effect(scene: &Scene, all: &[Cost]) -> Vec<Cost> {
    let of = |effect| {
        let mut sum = Cost { effect, evaluations: 0, seconds: 0.0 };
        for cost in all.iter().filter(|cost| cost.effect == effect) {
            sum.evaluations += cost.evaluations;
            sum.seconds += cost.seconds;
        }
        sum
    };
    scene.effects.iter().map(|named| of(named.effect.name)).collect()
}

/// Returns each effect with its calls, time and share of the run in percent, then the rest of the run.
pub fn ledger_rows(summary: &Summary) -> Vec<(&'static str, Option<u64>, f64, f64)> {
    let percent = |seconds: f64| if summary.wall_s > 0.0 { 100.0 * seconds / summary.wall_s } else { 0.0 };
    let effects = summary.ledger.iter();
    let effects = effects.map(|cost| (cost.effect, Some(cost.evaluations), cost.seconds, percent(cost.seconds)));
    let rest_s = (summary.wall_s - summary.ledger.iter().map(|cost| cost.seconds).sum::<f64>()).max(0.0);
    effects.chain([("everything else", None, rest_s, percent(rest_s))]).collect()
}

/// Metrics without an effect.
#[derive(Clone, Debug)]
pub struct Without {
    pub effect: &'static str,
    pub measured: Measured,
}

/// Runs the scene once without each of its effects.
pub fn ablate(scene: &Scene, board: Run) -> Result<Vec<Without>, RunError> {
    let without = |left_out: usize| {
        let mut fewer = scene.clone();
        let effect = fewer.effects.remove(left_out).effect.name;
        let measured = run(&fewer, board, &mut []).map_err(|error| format!("without {effect}: {error}"))?.measured;
        Ok(Without { effect, measured })
    };
    (0..scene.effects.len()).map(without).collect()
}

/// Name of a metric, its value with all effects, and without each of them.
pub type Difference<'a> = (&'a str, Option<f64>, Vec<Option<f64>>);

/// Returns the metrics that an effect changes.
pub fn differences<'a>(whole: &'a Measured, ablated: &[Without]) -> Vec<Difference<'a>> {
    let rows = whole.0.iter().map(|(name, value)| {
        (name.as_str(), *value, ablated.iter().map(|without| without.measured.get(name)).collect::<Vec<_>>())
    });
    rows.filter(|(_, value, without)| without.iter().any(|other| other != value)).collect()
}

/// Formats the changes by each effect: one metric per line, one effect per column.
pub fn ablation_text(whole: &Measured, ablated: &[Without]) -> String {
    let rows = differences(whole, ablated);
    let width = rows.iter().map(|(name, ..)| name.len()).max().unwrap_or(0).max("metric".len());
    let columns: Vec<usize> = ablated.iter().map(|without| without.effect.len().max(10)).collect();
    let mut text = format!("  {:width$} {:>10}", "metric", "all");
    for (without, column) in ablated.iter().zip(&columns) {
        let _ = write!(text, "  {:>column$}", without.effect);
    }
    text.push('\n');
    for (name, value, others) in rows {
        let _ = write!(text, "  {name:width$} {:>10}", shown(value));
        for (other, column) in others.iter().zip(&columns) {
            let _ = write!(text, "  {:>column$}", difference(value, *other));
        }
        text.push('\n');
    }
    text
}

/// Formats the change of a metric by an effect.
pub fn difference(with: Option<f64>, without: Option<f64>) -> String {
    match (with, without) {
        (Some(with), Some(without)) if with == without => "0".into(),
        (Some(with), Some(without)) => {
            let sign = if with > without { "+" } else { "" };
            format!("{sign}{}", shown(Some(with - without)))
        }
        (None, None) => "0".into(),
        (Some(_), None) => "none without".into(),
        (None, Some(_)) => "none with".into(),
    }
}
