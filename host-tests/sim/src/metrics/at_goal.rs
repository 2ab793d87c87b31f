//! Values that belong to a goal: what is allowed of them may grow with it.

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
