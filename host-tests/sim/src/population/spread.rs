//! Median, 95 % and worst of many values.

use serde_json::{Value, json};

/// How values are spread.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Spread {
    /// How many.
    pub count: usize,
    /// Half of them are below this.
    pub median: Option<f64>,
    /// 95 % of them are at or below this.
    pub most: Option<f64>,
    /// The largest.
    pub worst: Option<f64>,
}

impl Spread {
    /// Of values in any order.
    pub fn of(mut values: Vec<f64>) -> Self {
        values.sort_by(f64::total_cmp);
        let rank = |share: f64| values.get(((values.len() as f64 * share).ceil() as usize).max(1) - 1).copied();
        Self { count: values.len(), median: rank(0.5), most: rank(0.95), worst: values.last().copied() }
    }

    /// For scripts.
    pub fn json(&self) -> Value {
        json!({ "count": self.count, "median": self.median, "percentile_95": self.most, "worst": self.worst })
    }
}
