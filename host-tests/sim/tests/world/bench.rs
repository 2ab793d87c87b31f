//! A world moved by hand.

pub use crate::common::{Last, scene};
use sim::bridge::Bridge;
use sim::effects::set::{Named, Set};
use sim::mechanics::body::Surroundings;
use sim::scene::controller;
use sim::world::World;

/// The world of a scene, to be moved by hand.
pub fn world(text: &str) -> World<Named> {
    let scene = scene(&format!("duration_s = 1.0\n{text}"));
    let fingers = 0..scene.table("hand").whole("fingers") as usize;
    let effects = fingers.map(|finger| Named::of(&scene, finger)).map(|parts| (parts.drive, parts.contact)).collect();
    World::new(&controller::setup(&scene), &Surroundings::of(&scene), effects)
}

/// Moves it on under one duty.
pub fn run(world: &mut World<Named>, step_s: f64, steps: u64, bridge: Bridge) {
    for step in 0..steps {
        world.advance(step as f64 * step_s, step_s, &[bridge; 2]);
    }
}

/// Asserts that two numbers are within a share of the second, and not both 0.
#[track_caller]
pub fn close(value: f64, expected: f64, share: f64) {
    assert!((value - expected).abs() <= share * expected.abs() && expected != 0.0, "{value} for {expected}");
}
