//! Response of the force to a goal, and slips of the contact, measured without a trace.

/// Error within which a step counts as settled, as a share of the goal or of the step, whichever is smaller.
const SETTLED_SHARE: f64 = 0.02;
/// Time after the change of the goal from which on the steady error counts.
const STEADY_AFTER_S: f64 = 0.1;

#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Response {
    from_n: f64,
    goal_n: f64,
    start_s: Option<f64>,
    before: Option<[f64; 2]>,
    tenth_s: Option<f64>,
    nine_tenths_s: Option<f64>,
    /// Largest force beyond the goal, in the direction of the step.
    pub beyond_n: f64,
    inside_since_s: Option<f64>,
    /// Largest steady error, the sum of the squares of these errors, and their number.
    pub steady_max_n: f64,
    pub steady_squares: f64,
    pub steady_samples: u64,
}

impl Response {
    /// Response to a goal from the force at its change; from 0 at the touch.
    pub fn new(from_n: f64, goal_n: f64) -> Self {
        Self { from_n, goal_n, ..Self::default() }
    }

    /// Adds the true force at a time. The first call is the start.
    pub fn add(&mut self, time_s: f64, force_n: f64) {
        self.start_s.get_or_insert(time_s);
        let way_n = self.goal_n - self.from_n;
        let share = (force_n - self.from_n) / way_n;
        let before = self.before.replace([time_s, share]);
        for (part, reached_s) in [(0.1, &mut self.tenth_s), (0.9, &mut self.nine_tenths_s)] {
            if reached_s.is_none() && share >= part {
                *reached_s = Some(crossing_s(before, [time_s, share], part));
            }
        }
        let error_n = force_n - self.goal_n;
        self.beyond_n = self.beyond_n.max(error_n * way_n.signum());
        if error_n.abs() > SETTLED_SHARE * self.unit_n() {
            self.inside_since_s = None;
        } else {
            self.inside_since_s.get_or_insert(time_s);
        }
        if self.is_steady(time_s) {
            self.steady_max_n = self.steady_max_n.max(error_n.abs());
            self.steady_squares += error_n * error_n;
            self.steady_samples += 1;
        }
    }

    /// Goal or step, whichever is smaller: the unit of overshoot and settling.
    pub fn unit_n(&self) -> f64 {
        (self.goal_n - self.from_n).abs().min(self.goal_n)
    }

    /// Time from 10 % to 90 % of the step; none if the force does not reach 90 %.
    pub fn rise_s(&self) -> Option<f64> {
        Some(self.nine_tenths_s? - self.tenth_s?)
    }

    /// Time from the start until the force stays within 2 % of [`Response::unit_n`]; none if it never does.
    pub fn settled_s(&self) -> Option<f64> {
        Some(self.inside_since_s? - self.start_s?)
    }

    /// True later than 100 ms after the start.
    pub fn is_steady(&self, time_s: f64) -> bool {
        self.start_s.is_some_and(|start_s| time_s >= start_s + STEADY_AFTER_S)
    }
}

/// Time at which a share was crossed, by linear interpolation between samples.
fn crossing_s(before: Option<[f64; 2]>, [after_s, after]: [f64; 2], part: f64) -> f64 {
    let Some([before_s, before]) = before else { return after_s };
    let (low, high) = (before - part, after - part);
    before_s + (after_s - before_s) * low / (low - high)
}

#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AtGoal {
    pub goal_n: f64,
    /// The value, in the metric's unit.
    pub value: f64,
}

/// Adds a value unless a smaller goal has a larger one, and removes those that it exceeds in this way.
pub fn note(kept: &mut Vec<AtGoal>, new: AtGoal) {
    let covers = |a: &AtGoal, b: &AtGoal| a.goal_n <= b.goal_n && a.value >= b.value;
    if !kept.iter().any(|known| covers(known, &new)) {
        kept.retain(|known| !covers(&new, known));
        kept.push(new);
    }
}

/// Shortest slip that counts. A shorter one is creep at rest.
const COUNTS_MM: f64 = 1e-3;
/// Time without motion after which a slip is over.
const OVER_S: f64 = 0.01;

#[derive(Clone, Copy, Debug, Default)]
pub struct Slips {
    under_way: Option<Slip>,
    last_mm: f64,
    pub count: u32,
    /// Number of slips that were over before the goal rose.
    pub unnoticed: u32,
    /// Longest time from the onset of a slip to the rise of the goal.
    pub noticed_after_s: Option<f64>,
}

#[derive(Clone, Copy, Debug)]
struct Slip {
    onset_s: f64,
    moved_s: f64,
    from_mm: f64,
    goal_n: f64,
    counted: bool,
    noticed: bool,
}

impl Slips {
    pub fn step(&mut self, time_s: f64, slip_mm: f64, goal_n: f64) {
        let moves = slip_mm > self.last_mm;
        let before_mm = core::mem::replace(&mut self.last_mm, slip_mm);
        if moves {
            let begun =
                Slip { onset_s: time_s, moved_s: time_s, from_mm: before_mm, goal_n, counted: false, noticed: false };
            let slip = self.under_way.get_or_insert(begun);
            slip.moved_s = time_s;
            if !slip.counted && slip_mm - slip.from_mm > COUNTS_MM {
                slip.counted = true;
                self.count += 1;
            }
        }
        let Some(slip) = &mut self.under_way else { return };
        if goal_n > slip.goal_n && !slip.noticed {
            slip.noticed = true;
            let after_s = time_s - slip.onset_s;
            self.noticed_after_s = Some(self.noticed_after_s.map_or(after_s, |longest| longest.max(after_s)));
        }
        if time_s - slip.moved_s > OVER_S {
            self.unnoticed += u32::from(slip.counted && !slip.noticed);
            self.under_way = None;
        }
    }

    /// Number of unnoticed slips, with one that the end of the run interrupted.
    pub fn unnoticed(&self) -> u32 {
        self.unnoticed + self.under_way.map_or(0, |slip| u32::from(slip.counted && !slip.noticed))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_slip_is_timed_from_its_onset_to_the_raised_goal() {
        let mut slips = Slips::default();
        for ms in 0..100 {
            let time_s = f64::from(ms) * 1e-3;
            // Slips from 20 ms on, until the force is raised at 26 ms; again from 60 to 70 ms without a reaction.
            let slip_mm = 0.1 * f64::from((ms - 19).clamp(0, 8) + (ms - 59).clamp(0, 11));
            slips.step(time_s, slip_mm, if ms < 26 { 1.0 } else { 1.5 });
        }
        assert_eq!((slips.count, slips.unnoticed()), (2, 1));
        assert!((slips.noticed_after_s.unwrap() - 6e-3).abs() < 1e-12, "{slips:?}");
    }
}
