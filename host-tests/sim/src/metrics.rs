//! What is measured in a run, and what a scene may ask of it.
//!
//! [`METRICS`] is the one table of them: the reader checks `[[expect]]` by it, the results are named by it, and the
//! reference page shows it. All figures are of what is simulated; times before 0, when the finger is tared, do not
//! count.

mod conduct;
mod finger;
mod response;
mod slips;
mod table;

pub use conduct::Hold;
pub use finger::Finger;
pub use finger::newtons;
pub use response::AtGoal;
pub use table::{BY_GOAL, METRICS};

use crate::scene::Bound;
use crate::watch::{Controller, Step, Watch};
use std::sync::LazyLock;

/// Fingers that a scene has at most.
const FINGERS: usize = 2;

/// Something measured.
#[derive(Clone, Copy)]
pub struct Metric {
    /// Its name, with its unit last.
    pub name: &'static str,
    /// What it is, and how it is worked out.
    pub about: &'static str,
    /// Which of several fingers' values is the scene's.
    pub of_several: Worst,
    /// Its value for a finger; none where the run has none.
    pub value: fn(&Finger) -> Option<f64>,
}

/// A metric that has a value for each goal.
#[derive(Clone, Copy)]
pub struct ByGoal {
    /// The metric's name.
    pub name: &'static str,
    /// Its values, in the metric's unit.
    pub values: fn(&Finger) -> Vec<AtGoal>,
}

/// Which of several values counts.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Worst {
    /// The largest.
    Largest,
    /// The least.
    Least,
    /// All of them together.
    Sum,
    /// That of the finger whose first fault came first.
    FirstFault,
}

/// Every name that `[[expect]]` may ask for: `peak_force_n` of the scene, `finger0.peak_force_n` of one finger.
pub fn names() -> Vec<&'static str> {
    static OF_FINGERS: LazyLock<Vec<String>> = LazyLock::new(|| {
        (0..FINGERS).flat_map(|n| METRICS.iter().map(move |metric| format!("finger{n}.{}", metric.name))).collect()
    });
    METRICS.iter().map(|metric| metric.name).chain(OF_FINGERS.iter().map(String::as_str)).collect()
}

/// Measures a run.
#[derive(Clone, Debug, Default)]
pub struct Meter(Vec<Finger>);

impl Meter {
    /// The results, after the run.
    pub fn measured(&self) -> Measured {
        let scene = METRICS.iter().map(|metric| (metric.name.to_owned(), self.scene(metric)));
        let several = if self.0.len() > 1 { &self.0[..] } else { &[] };
        let fingers = several.iter().enumerate().flat_map(|(number, finger)| {
            METRICS.iter().map(move |metric| (format!("finger{number}.{}", metric.name), (metric.value)(finger)))
        });
        Measured(scene.chain(fingers).collect())
    }

    /// Whether each bound is held.
    pub fn verdicts(&self, bounds: &[Bound]) -> Vec<Verdict> {
        let measured = self.measured();
        bounds.iter().map(|bound| self.verdict(&measured, bound)).collect()
    }

    fn verdict(&self, measured: &Measured, bound: &Bound) -> Verdict {
        let (mut value, mut max) = (measured.get(&bound.metric), bound.max);
        // A finger without a value leaves the scene without one.
        if let (Some(_), Some(base), Some(share)) = (value, bound.max, bound.max_per_goal_n) {
            // That of the goal at which it is farthest beyond what it may be, as a share of that.
            let allowed = |at: &AtGoal| base + share * at.goal_n;
            let used = |at: &AtGoal| if allowed(at) > 0.0 { at.value / allowed(at) } else { at.value - allowed(at) };
            let worst = self.by_goal(&bound.metric).into_iter().max_by(|a, b| used(a).total_cmp(&used(b)));
            if let Some(worst) = worst {
                (value, max) = (Some(worst.value), Some(allowed(&worst)));
            }
        }
        let within = |value: f64| bound.min.is_none_or(|min| value >= min) && max.is_none_or(|max| value <= max);
        Verdict { bound: bound.clone(), value, max, held: value.is_some_and(within) }
    }

    fn by_goal(&self, metric: &str) -> Vec<AtGoal> {
        let numbered =
            (0..FINGERS).find_map(|number| Some((number, metric.strip_prefix(&format!("finger{number}."))?)));
        let (fingers, name) = match numbered {
            Some((number, name)) => (self.0.get(number..=number).unwrap_or_default(), name),
            None => (&self.0[..], metric),
        };
        let known = BY_GOAL.iter().find(|known| known.name == name);
        known.map_or(Vec::new(), |known| fingers.iter().flat_map(known.values).collect())
    }

    /// The forces that were held.
    pub fn holds(&self) -> Vec<Hold> {
        self.0.iter().flat_map(|finger| finger.conduct.ended().holds).collect()
    }

    /// None where a finger has none: a finger that never settles is not made up for by one that does.
    fn scene(&self, metric: &Metric) -> Option<f64> {
        let values: Option<Vec<f64>> = self.0.iter().map(metric.value).collect();
        let fold: fn(f64, f64) -> f64 = match metric.of_several {
            Worst::Largest => f64::max,
            Worst::Least => f64::min,
            Worst::Sum => core::ops::Add::add,
            Worst::FirstFault => {
                let faulty = self.0.iter().filter_map(|finger| Some((finger, finger.first_fault?.1)));
                let first = faulty.min_by(|(_, a_s), (_, b_s)| a_s.total_cmp(b_s)).map(|(finger, _)| finger);
                return (metric.value)(first.or(self.0.first())?);
            }
        };
        values?.into_iter().reduce(fold)
    }
}

impl Watch for Meter {
    fn begin(&mut self, controllers: &[Controller]) {
        self.0 = controllers.iter().map(Finger::of).collect();
    }

    fn step(&mut self, step: &Step) {
        if self.0.len() <= step.finger {
            self.0.resize_with(step.finger + 1, Finger::default);
        }
        self.0[step.finger].step(step);
    }
}

/// The results of a run: each metric, in the order of the table; with several fingers, each finger's after them.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Measured(pub Vec<(String, Option<f64>)>);

impl Measured {
    /// A result by its name; `finger0.` may stand before it with a single finger too.
    pub fn get(&self, name: &str) -> Option<f64> {
        let of = |name: &str| self.0.iter().find(|(known, _)| known == name).map(|(_, value)| *value);
        of(name).or_else(|| of(name.strip_prefix("finger0.")?)).flatten()
    }
}

/// What became of a bound.
#[derive(Clone, Debug, PartialEq)]
pub struct Verdict {
    /// What was asked.
    pub bound: Bound,
    /// What was measured; a metric that the run does not have holds no bound.
    pub value: Option<f64>,
    /// The largest that was allowed, where what is allowed grows with the goal; else that of the bound.
    pub max: Option<f64>,
    /// Whether it is held.
    pub held: bool,
}

/// The table as Markdown.
pub fn page() -> String {
    let mut page =
        String::from("| metric | what it is, and how it is worked out | of several fingers |\n| --- | --- | --- |\n");
    for Metric { name, about, of_several, .. } in METRICS {
        let several = match of_several {
            Worst::Largest => "the largest",
            Worst::Least => "the least",
            Worst::Sum => "the sum",
            Worst::FirstFault => "the first in time",
        };
        page += &format!("| `{name}` | {about} | {several} |\n");
    }
    page
}

/// A value for people: at most six digits that count, and a word where there is none.
pub fn shown(value: Option<f64>) -> String {
    let Some(value) = value else { return "none".into() };
    let whole_digits = if value == 0.0 { 1 } else { value.abs().log10().floor() as i32 + 1 };
    let places = (5 - whole_digits).clamp(0, 9) as usize;
    let text = format!("{value:.places$}");
    if text.contains('.') { text.trim_end_matches('0').trim_end_matches('.').to_owned() } else { text }
}
