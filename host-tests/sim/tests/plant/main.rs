//! The simulated board against the paper, the data sheet and closed forms.

mod cells;
mod drive;
mod electrics;
mod optimal;
mod same;

use proptest::test_runner::{Config, RngSeed};
use sim::bridge::Bridge;
use sim::plant::{Plant, Setup};

/// The step that the tests vouch for.
const STEP_S: f64 = 10e-6;

/// The reference finger with the wall out of reach.
fn free() -> Setup {
    let mut setup = Setup::default();
    setup.wall.distance_mm = 1e9;
    setup
}

/// The reference finger pressed in this far, at rest.
fn pressed(d_mm: f64) -> Plant {
    let mut world = Plant::new(&Setup::default());
    world.place(world.setup().wall.distance_mm + d_mm);
    world
}

/// Holds the bridge for a time.
fn run(world: &mut Plant, seconds: f64, bridge: Bridge) {
    for _ in 0..(seconds / STEP_S).round() as usize {
        world.advance(STEP_S, bridge);
    }
}

/// So many cases of a property, the same on every run.
fn cases(cases: u32) -> Config {
    Config { cases, rng_seed: RngSeed::Fixed(2003), failure_persistence: None, ..Config::default() }
}
