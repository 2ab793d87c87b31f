//! Ordinary fingers: noise, warmth, coarse encoders, contacts off the middle, weak sources. What each once did wrong is
//! asked for here, by what is true of the simulated finger, and so are its neighbours. Every run is held to the
//! envelope of the population `ordinary`.

mod force;
mod letting_go;
mod motor;

use sim::metrics::Hold;
use sim::native;
use sim::population;
use sim::run::{Outcome, run};
use sim::scene::{Bound, Scene, read};
use sim::watch::{Step, Truth, Watch};
use std::sync::OnceLock;

/// How a finger went.
#[derive(Debug)]
struct Ran {
    outcome: Outcome,
    /// What was true at the end.
    end: Truth,
    /// Where the tip first touched.
    touch_mm: Option<f64>,
}

/// The promises of `ordinary`.
fn envelope() -> &'static [Bound] {
    static ENVELOPE: OnceLock<Vec<Bound>> = OnceLock::new();
    ENVELOPE.get_or_init(|| {
        let ordinary = population::load("ordinary").unwrap_or_else(|error| panic!("{error}"));
        ordinary.finger(1, 0).unwrap_or_else(|errors| panic!("{errors}")).scene.bounds
    })
}

/// Asks for these forces, from these times on, of a finger of these tables.
fn asks(script: &[(f64, f64)], duration_s: f64, tables: &str) -> Ran {
    let script: String =
        script.iter().map(|(at_s, goal_n)| format!("[[script]]\nat_s = {at_s:?}\ngoal_n = {goal_n:?}\n")).collect();
    let text = format!("about = \"a finger\"\nduration_s = {duration_s:?}\n{tables}\n{script}");
    let scene = Scene {
        bounds: envelope().to_vec(),
        ..read("test.toml", &text, &[]).unwrap_or_else(|errors| panic!("{errors}\n{text}"))
    };
    let mut last = Last::default();
    let outcome = run(&scene, &native::board, &mut [&mut last]).expect("it runs");
    Ran { outcome, end: last.end, touch_mm: last.touch_mm }
}

/// Touches, holds, and lets go.
fn holds(goal_n: f64, tables: &str) -> Ran {
    asks(&[(0.0, goal_n), (0.7, 0.0)], 1.3, tables)
}

impl Ran {
    /// A metric.
    fn of(&self, metric: &str) -> f64 {
        self.outcome.measured.get(metric).unwrap_or_else(|| panic!("no {metric}"))
    }

    /// Every promise is kept, but for these metrics.
    fn keeps_all_but(self, spared: &[&str], finger: &str) -> Self {
        let broken: Vec<_> = self.outcome.verdicts.iter().filter(|verdict| !verdict.held).collect();
        let broken: Vec<_> = broken.iter().filter(|verdict| !spared.contains(&verdict.bound.metric.as_str())).collect();
        assert!(broken.is_empty(), "{finger}: {broken:#?}");
        self
    }

    /// Every promise is kept.
    fn keeps_all(self, finger: &str) -> Self {
        self.keeps_all_but(&[], finger)
    }

    /// The first force that was held.
    fn first_hold(&self) -> Hold {
        self.outcome.holds[0]
    }

    /// It let go, and stands so far behind where it touched.
    fn stands_clear(&self, clearance_mm: f64, finger: &str) {
        let behind_mm = self.touch_mm.expect("it touched") - self.end.travel_mm;
        assert_eq!(self.end.force_n, 0.0, "{finger}: lets go");
        assert!((0.75 * clearance_mm..1.25 * clearance_mm).contains(&behind_mm), "{finger}: {behind_mm} mm behind");
    }
}

#[derive(Default)]
struct Last {
    end: Truth,
    touch_mm: Option<f64>,
}

impl Watch for Last {
    fn step(&mut self, step: &Step) {
        self.end = *step.truth;
        if step.truth.force_n > 0.0 {
            self.touch_mm.get_or_insert(step.truth.travel_mm);
        }
    }
}
