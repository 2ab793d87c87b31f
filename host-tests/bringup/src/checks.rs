//! All checks: figure, expected range, reason, and advice if the figure is outside.

use crate::script::{Bench, COUNTS_PER_RAD, FORCE_PER_MM2, MM_PER_RAD};
use fingertip::control::Winding;
use fingertip::params::Params;
use fingertip::pipeline::AcknowledgedRequests;
use fingertip::shipped::{Config, Pipeline};
use serde_json::Value;
use std::sync::OnceLock;

/// A figure of the image's report, with its expected range.
pub struct Check {
    pub name: String,
    pub what: String,
    pub unit: &'static str,
    /// Range of expected values.
    pub within: [f64; 2],
    /// Source of the range.
    pub source: &'static str,
    /// Advice if the figure is outside.
    pub then: &'static str,
    /// Reason why the emulated board cannot show this figure.
    pub unseen: Option<&'static str>,
}

/// All checks but those of [`steps`]. A check begins with a line `name | least | most | unit | description`; a range without
/// numbers is computed. Indented lines follow: source of the range, advice, and, if the emulated board cannot show the
/// figure, the reason.
const TABLE: &str = include_str!("checks.txt");

/// Figures of the loop on the simulated finger, computed once.
fn loop_bits() -> u32 {
    static BITS: OnceLock<u32> = OnceLock::new();
    *BITS.get_or_init(|| {
        let config = Config::shipped(&images::CONFIRMED);
        let config = config.expect("the defaults make a configuration: a test of the core holds that");
        let mut bench = Bench::at_rest();
        bench.finger.make_table();
        let mut pipeline = Pipeline::new(&config);
        // As the image does behind its other checks.
        pipeline.renew(AcknowledgedRequests::default(), 0, Winding::new());
        bench.digest(&mut pipeline)
    })
}

/// All checks, in the report's order.
pub fn checks() -> Vec<Check> {
    let mut checks = Vec::new();
    let frame_ns = Config::shipped(&Params::DEFAULT).map_or(f64::NAN, |config| f64::from(config.timing.frame_ns));
    let mut lines = TABLE.lines().peekable();
    while let Some(head) = lines.next() {
        let mut reasons = std::iter::from_fn(|| lines.next_if(|line| line.starts_with(' '))).map(str::trim);
        let (source, then, unseen) = (reasons.next(), reasons.next(), reasons.next());
        let row: Vec<&'static str> = head.splitn(5, '|').map(str::trim).collect();
        let bound = |place: usize| row[place].parse().unwrap_or_else(|why| panic!("{head}: {why}"));
        checks.push(Check {
            name: row[0].into(),
            what: row[4].into(),
            unit: row[3],
            within: match row[0] {
                "frame_ns" => [frame_ns - 2.0, frame_ns + 2.0],
                "loop_bits" => [f64::from(loop_bits()); 2],
                _ => [bound(1), bound(2)],
            },
            source: source.expect("each check has a source"),
            then: then.expect("each check has advice"),
            unseen,
        });
    }
    checks.extend(steps());
    checks
}

// The steps of the simulated finger against the demonstration's.

const DEMO: &str = include_str!("../../../docs/demo.json");
/// Name in the report, its unit, name in the demonstration, description, and unit there.
const FIGURES: [(&str, &str, &str, &str, &str); 3] = [
    ("rise", "ms", "rise_ms", "rise, 10 to 90 %", "ms"),
    ("overshoot", "percent", "overshoot_percent", "overshoot", "%"),
    ("settled", "ms", "settling_ms", "settled to 2 %", "ms"),
];
/// Allowed relative difference to the demonstration.
const SHARE: f64 = 0.1;

/// The force of two counts of the encoder at the goal, in percent of the step, as an overshoot is reported: where
/// within a count a step ends is chance, here and in the demonstration, whose images of other timing drew 0.00 to 0.48
/// % at the same step. Therefore an overshoot has no lower bound: none is as good as a small one.
fn two_counts_percent(from_n: f64, to_n: f64) -> f64 {
    let count_mm = f64::from(MM_PER_RAD) / f64::from(COUNTS_PER_RAD);
    let stiffness_n_per_mm = 2.0 * (f64::from(FORCE_PER_MM2) * to_n).sqrt();
    let unit_n = f64::min((to_n - from_n).abs(), to_n);
    100.0 * 2.0 * count_mm * stiffness_n_per_mm / unit_n
}

pub fn steps() -> Vec<Check> {
    let demo: Value = serde_json::from_str(DEMO).expect("docs/demo.json is JSON");
    let steps = demo["steps"].as_array().expect("docs/demo.json has steps");
    let mut checks = Vec::new();
    for (place, step) in steps.iter().enumerate() {
        let number = |name: &str| step[name].as_f64().unwrap_or_else(|| panic!("docs/demo.json has {name}"));
        let [from_n, to_n] = ["from_n", "to_n"].map(number);
        for (figure, ends, theirs, words, unit) in FIGURES {
            let expected = number(theirs);
            let counts = if unit == "%" { two_counts_percent(from_n, to_n) } else { 0.0 };
            let allowed = f64::max(expected * SHARE, counts);
            let least = if unit == "%" { 0.0 } else { expected - allowed };
            checks.push(Check {
                name: format!("{figure}_{}_{ends}", place + 1),
                what: format!("simulated finger, {from_n:.1} to {to_n:.1} N: {words}"),
                unit,
                within: [least, expected + allowed],
                source: "docs/demo.json, within a tenth, an overshoot at most two counts of the encoder more",
                then: "the step computes something else than on the emulated board: tell us, with the JSON file",
                unseen: None,
            });
        }
    }
    checks
}
