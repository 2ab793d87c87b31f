//! Numbers on the command line: a value that is no valid time or rate is refused, so no command waits for ever or
//! panics.

use std::ops::RangeInclusive;

/// Range of times, s: up to more than thirty years.
const SECONDS: RangeInclusive<f64> = 0.0..=1e9;
/// Range of rates, Hz: from one in a quarter of an hour to more than there are frames.
const RATES_HZ: RangeInclusive<f64> = 0.001..=1e6;

pub fn seconds(text: &str) -> Result<f64, String> {
    within(text, &SECONDS)
}

pub fn rate_hz(text: &str) -> Result<f64, String> {
    within(text, &RATES_HZ)
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

fn within(text: &str, range: &RangeInclusive<f64>) -> Result<f64, String> {
    let number = text.parse().ok().filter(|number| range.contains(number));
    number.ok_or_else(|| format!("a number from {} to {} is asked for", range.start(), range.end()))
}
