//! What a run leaves behind: metrics, ledger, recording, report, sweep.

mod measured;
mod recorded;
mod reported;
mod swept;

use sim::cli;
use sim::scene::Scene;

/// A wall with one effect.
const SCENE: &str = concat!(env!("FINGERTIP_ROOT"), "/host-tests/sim/tests/left_behind/wall.toml");

fn wall() -> Scene {
    cli::load(SCENE, &[], None).unwrap()
}
