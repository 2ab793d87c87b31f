//! Numbers on the command line. Invalid times and rates are refused: no command waits for ever or panics.

use std::ops::RangeInclusive;

/// A time, s: up to more than thirty years.
pub fn seconds(text: &str) -> Result<f64, String> {
    within(text, &(0.0..=1e9))
}

/// Time under a weight, s: what the solver needs, and a second until the first reading counts.
pub fn creep_s(text: &str) -> Result<f64, String> {
    within(text, &(solve::scale::CREEP_LEAST_S + 1.0..=1e9))
}

/// A rate, Hz: from one state in a quarter of an hour to more states than there are frames.
pub fn rate_hz(text: &str) -> Result<f64, String> {
    within(text, &(0.001..=1e6))
}

/// A rate in Hz, or 0 for as fast as it goes.
pub fn rate_hz_or_all(text: &str) -> Result<f64, String> {
    if text.parse() == Ok(0.0) { Ok(0.0) } else { rate_hz(text).map_err(|why| format!("{why}, or 0")) }
}

pub fn percent(text: &str) -> Result<f64, String> {
    within(text, &(0.0..=100.0))
}

/// Goal force in mN of a number in N. The controller has a narrower limit, `force_max_mn`.
pub fn goal_mn(text: &str) -> Result<i64, String> {
    within(text, &(0.001..=150.0)).map(|newtons| (newtons * 1e3).round() as i64)
}

/// Force that a scale shows, N, to a mN.
pub fn shown_n(text: &str) -> Result<f64, String> {
    within(text, &(0.0..=150.0)).map(|newtons| (newtons * 1e3).round() * 1e-3)
}

pub fn ohm(text: &str) -> Result<f64, String> {
    within(text, &(0.05..=200.0))
}

fn within(text: &str, range: &RangeInclusive<f64>) -> Result<f64, String> {
    let number = text.parse().ok().filter(|number| range.contains(number));
    number.ok_or_else(|| format!("a number from {} to {} is asked for", range.start(), range.end()))
}
