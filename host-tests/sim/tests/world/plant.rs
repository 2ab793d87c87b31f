//! The plant against the paper, the data sheet and closed forms. It equals the finger of a scene with its parameters.

mod array;
mod drive;

use crate::scene;
use fingertip::config::newtons;
use fingertip::shipped;
use fingertip::state::Mode;
use proptest::test_runner::{Config, RngSeed};
use sim::effects::Named;
use sim::mechanics::Bridge;
use sim::native::bench::Bench;
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

/// Configuration for a number of cases of a property, the same cases on every run.
fn cases(cases: u32) -> Config {
    Config { cases, rng_seed: RngSeed::Fixed(2003), failure_persistence: None, ..Config::default() }
}

const SCENE: &str = "duration_s = 1.0\n[world]\nstep_us = 10.0\n\
    [object]\ndistance_mm = 0.5\n[effects.dry_friction]\ntorque_mnm = 0.12\n\
    [effects.gear_efficiency]\nefficiency = 0.7\n[effects.supply_sag]\nsource_ohm = 0.1\n\
    [effects.row_sag]\nswitch_ohm = 30.0\n[effects.settling]\ntau_us = 0.2\nafter_us = 2.4\n";

/// To the bit, from a tare over a touch to a change of the force and back off the object.
#[test]
fn a_scene_that_names_what_the_plant_holds_is_the_same_to_the_bit() {
    let scene = scene(SCENE);
    let mut setup = Setup::default();
    setup.wall.distance_mm = 0.5;
    // As the scene has it: in g cm^2, which rounds otherwise.
    setup.motor.inertia_kg_m2 = 0.71 * 1e-7;
    let mut named = Bench::<Named>::new(&scene).expect("it runs");
    let mut plant = Bench::of(&setup, &shipped::Config::shipped(&scene.params()).unwrap());
    named.tare();
    plant.tare();
    for goal_mn in [1_000, 4_000, 500, 0] {
        (named.command().goal, plant.command().goal) = (newtons(goal_mn), newtons(goal_mn));
        for frame in 0..1_000 {
            assert_eq!(named.step(), plant.step(), "{goal_mn} mN, frame {frame}");
            assert_eq!(named.frame(), plant.frame(), "{goal_mn} mN, frame {frame}");
            assert_eq!(named.truth().force_n, plant.truth().force_n, "{goal_mn} mN, frame {frame}");
        }
        assert_eq!(plant.status().mode, if goal_mn > 0 { Mode::Force } else { Mode::Release });
    }
}
