//! Texts that are read and files that are written: scenes and populations, the library, reports, recordings, sweeps.

mod interrupted;
mod library;
mod metrics;
mod population;
mod reader;
mod report;
mod swept;

use fingertip::command::Command;
use fingertip::config::newtons;
use fingertip::frame::Sense;
use fingertip::params::Params;
use fingertip::pipeline::Status;
use fingertip::shipped::Frame;
use fingertip::state::Fault;
use serde_json::Value;
use sim::metrics::{Meter, Verdict};
use sim::native;
use sim::scene::Scene;
use sim::watch::{Step, Truth, Watch};
use std::collections::{BTreeMap, BTreeSet};
use std::fs::{self, File};
use std::ops::Range;
use std::path::{Path, PathBuf};

/// A wall with one effect.
const WALL: &str = concat!(env!("FINGERTIP_ROOT"), "/host-tests/sim/tests/files/wall.toml");

/// Reads a scene: a file, or a name of the library.
fn scene(name: &str, keys: &[&str], seed: Option<u64>) -> Scene {
    let keys: Vec<String> = keys.iter().map(|key| (*key).into()).collect();
    sim::cli::load(name, &keys, seed).unwrap_or_else(|error| panic!("{error}"))
}

fn folder(name: &str) -> PathBuf {
    let folder = PathBuf::from(env!("CARGO_TARGET_TMPDIR")).join(name);
    let _ = fs::remove_dir_all(&folder);
    fs::create_dir_all(&folder).unwrap();
    folder
}

fn wall() -> Scene {
    scene(WALL, &[], None)
}

/// Adds a step of a constructed finger to a meter.
fn observe(meter: &mut Meter, finger: usize, time_s: f64, command: &Command, status: &Status, truth: &Truth) {
    let (frame, sense) = (&Frame::EMPTY, &Sense::default());
    meter.step(&Step { finger, time_s, frame, sense, command, status, truth });
}

/// CRC of the files that are written.
const CRC: crc::Crc<u64> = crc::Crc::<u64>::new(&crc::CRC_64_XZ);
