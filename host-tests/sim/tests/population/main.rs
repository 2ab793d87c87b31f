//! Populations: what is drawn, what is refused, what the envelope finds, and what comes of shards.

mod draws;
mod promises;
mod refused;
mod whole;

use sim::population::{self, Population};

/// A population of this text, with what every scene needs before it.
fn population(lines: &str) -> Population {
    let text = format!("about = \"a test\"\nduration_s = 0.06\n{lines}");
    population::read("test.toml", &text).unwrap_or_else(|errors| panic!("{errors}"))
}
