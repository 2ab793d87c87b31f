//! How a force answers to a goal, judged sample by sample: no trace has to be kept.

/// A step counts as settled inside this share of the goal or of the step, whichever is smaller.
const SETTLED_SHARE: f64 = 0.02;
/// The steady error is judged from this long after the goal changed.
const STEADY_AFTER_S: f64 = 0.1;

/// The answer to one goal so far.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Response {
    from_n: f64,
    goal_n: f64,
    start_s: Option<f64>,
    before: Option<[f64; 2]>,
    tenth_s: Option<f64>,
    nine_tenths_s: Option<f64>,
    beyond_n: f64,
    inside_since_s: Option<f64>,
    steady_max_n: f64,
    steady_squares: f64,
    steady_samples: u64,
}

impl Response {
    /// To a goal, from the force at which it was set; from 0 at the touch.
    pub fn new(from_n: f64, goal_n: f64) -> Self {
        Self {
            from_n,
            goal_n,
            start_s: None,
            before: None,
            tenth_s: None,
            nine_tenths_s: None,
            beyond_n: 0.0,
            inside_since_s: None,
            steady_max_n: 0.0,
            steady_squares: 0.0,
            steady_samples: 0,
        }
    }

    /// The true force at a time; the first counts as the start.
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

    /// The goal or the step, whichever is smaller: what overshoot and settling are measured by.
    pub fn unit_n(&self) -> f64 {
        (self.goal_n - self.from_n).abs().min(self.goal_n)
    }

    /// From 10 % to 90 % of the way; none where the force does not get there.
    pub fn rise_s(&self) -> Option<f64> {
        Some(self.nine_tenths_s? - self.tenth_s?)
    }

    /// Largest force beyond the goal, seen from where it came.
    pub fn beyond_n(&self) -> f64 {
        self.beyond_n
    }

    /// From the start until the force stays within 2 % of [`Response::unit_n`]; none where it does not.
    pub fn settled_s(&self) -> Option<f64> {
        Some(self.inside_since_s? - self.start_s?)
    }

    /// Whether 100 ms have passed since the start.
    pub fn is_steady(&self, time_s: f64) -> bool {
        self.start_s.is_some_and(|start_s| time_s >= start_s + STEADY_AFTER_S)
    }

    /// Largest error from 100 ms after the start on; 0 where there was no such time.
    pub fn steady_max_n(&self) -> f64 {
        self.steady_max_n
    }

    /// Sum of the squares of these errors, and how many they are.
    pub fn steady_squares(&self) -> (f64, u64) {
        (self.steady_squares, self.steady_samples)
    }
}

/// When a share was crossed, on the straight line between the samples around it.
fn crossing_s(before: Option<[f64; 2]>, [after_s, after]: [f64; 2], part: f64) -> f64 {
    let Some([before_s, before]) = before else { return after_s };
    let (low, high) = (before - part, after - part);
    before_s + (after_s - before_s) * low / (low - high)
}

/// A value at a goal.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AtGoal {
    /// The force asked for.
    pub goal_n: f64,
    /// The value, in the metric's unit.
    pub value: f64,
}

impl AtGoal {
    /// With the value in another unit.
    pub fn times(self, factor: f64) -> Self {
        Self { value: self.value * factor, ..self }
    }
}

/// Takes a value in, and keeps those only that are not made up for by another: a larger one at a goal as small. So a
/// long run keeps few.
pub fn note(kept: &mut Vec<AtGoal>, new: AtGoal) {
    let covers = |a: &AtGoal, b: &AtGoal| a.goal_n <= b.goal_n && a.value >= b.value;
    if !kept.iter().any(|known| covers(known, &new)) {
        kept.retain(|known| !covers(&new, known));
        kept.push(new);
    }
}
