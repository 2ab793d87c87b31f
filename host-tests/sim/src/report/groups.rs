//! The metrics by what they are about.

use crate::metrics::{METRICS, Metric, Verdict};

/// A group's title, and what the names of its metrics begin with.
const GROUPS: [(&str, &[&str]); 6] = [
    ("Force", &["peak_force", "overshoot", "rise", "settling", "steady_error", "over_force", "stop_force", "hold_"]),
    ("Motion and touch", &["touch", "approach", "travel", "indentation", "runaway", "air_speed", "rest_travel"]),
    ("Faults and limits", &["fault", "limit_", "missed_frames"]),
    ("Sensing", &["force_error", "centre_error", "confidence"]),
    ("Slip and object", &["slip", "object_"]),
    ("Motor and energy", &["duty", "rest_duty", "energy", "current", "winding"]),
];
/// Of what belongs to none of them.
const REST: &str = "More";

/// Metrics under a title.
pub struct Group {
    /// The title.
    pub title: &'static str,
    /// Its metrics, in the order of the table.
    pub metrics: Vec<&'static Metric>,
    /// How many bounds on them are broken.
    pub broken: usize,
}

/// All metrics; groups in which a bound is broken come first.
pub fn groups(verdicts: &[Verdict]) -> Vec<Group> {
    let titles = GROUPS.iter().map(|(title, _)| *title).chain([REST]);
    let group = |title| {
        let metrics: Vec<&Metric> = METRICS.iter().filter(|metric| title_of(metric.name) == title).collect();
        let of_it = |verdict: &&Verdict| title_of(short(&verdict.bound.metric)) == title;
        let broken = verdicts.iter().filter(of_it).filter(|verdict| !verdict.held).count();
        Group { title, metrics, broken }
    };
    let mut groups: Vec<Group> = titles.map(group).filter(|group| !group.metrics.is_empty()).collect();
    groups.sort_by_key(|group| group.broken == 0);
    groups
}

fn title_of(metric: &str) -> &'static str {
    let of = |(_, begins): &&(&str, &[&str])| begins.iter().any(|begin| metric.starts_with(begin));
    GROUPS.iter().find(of).map_or(REST, |(title, _)| title)
}

/// A metric's name without the finger before it.
fn short(metric: &str) -> &str {
    metric.split_once('.').map_or(metric, |(_, name)| name)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::Bound;

    fn bound(metric: &str, held: bool) -> Verdict {
        let bound = Bound { metric: metric.into(), min: None, max: Some(1.0), max_per_goal_n: None };
        Verdict { bound, value: Some(2.0), max: Some(1.0), held }
    }

    #[test]
    fn each_metric_is_in_one_group_and_broken_ones_come_first() {
        let verdicts = [bound("peak_force_n", true), bound("finger1.energy_j", false), bound("energy_j", false)];
        let groups = groups(&verdicts);
        let mut names: Vec<_> = groups.iter().flat_map(|group| &group.metrics).map(|metric| metric.name).collect();
        assert_eq!(names.len(), METRICS.len());
        names.sort_unstable();
        names.dedup();
        assert_eq!(names.len(), METRICS.len());
        assert_eq!((groups[0].title, groups[0].broken), ("Motor and energy", 2));
        assert!(groups[1..].iter().all(|group| group.broken == 0));
        assert_eq!(groups[1].title, "Force");
    }
}
