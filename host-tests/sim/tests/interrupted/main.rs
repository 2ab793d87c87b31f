//! Runs, sweeps and populations that something ends before they are done, and what becomes of their files.
//!
//! A short campaign runs with the other tests; the whole one is asked for by name, as docs/runs.md says.

mod jobs;
mod refused;
mod strike;

use std::fs;
use std::path::PathBuf;

const SIM: &str = env!("CARGO_BIN_EXE_sim");
const SWEEP: &str = env!("CARGO_BIN_EXE_sweep");
const POPULATION: &str = env!("CARGO_BIN_EXE_population");

/// A wall with one effect.
const SCENE: &str = concat!(env!("FINGERTIP_ROOT"), "/host-tests/sim/tests/left_behind/wall.toml");

/// An empty folder.
fn folder(name: &str) -> PathBuf {
    let folder = PathBuf::from(env!("CARGO_TARGET_TMPDIR")).join("interrupted").join(name);
    let _ = fs::remove_dir_all(&folder);
    fs::create_dir_all(&folder).unwrap();
    folder
}
