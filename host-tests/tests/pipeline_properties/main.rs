//! What holds of the pipeline for any frame, any sense and any command, in any order, under any parameters allowed.
//!
//! The tests run with overflow checks, so "does not panic" includes "does not overflow".

mod inputs;
mod params;
mod steps;

use proptest::test_runner::{Config, RngSeed};

/// The same cases on every run.
fn fixed(cases: u32) -> Config {
    Config { cases, rng_seed: RngSeed::Fixed(20_030_914), failure_persistence: None, ..Config::default() }
}
