//! The plant and the scenes' world are one.

use fingertip::shipped::{ROWS, SLOTS};
use host_tests::plant::World as Plant;
use sim::bridge::Bridge;
use sim::effects::sensor::Readout;
use sim::effects::set::{Named, Set as _};
use sim::mechanics::body::Surroundings;
use sim::scene::{controller, read};
use sim::setup::Setup;
use sim::world::World;

fn world(text: &str) -> World<Named> {
    let scene = read("test.toml", &format!("about = \"\"\nduration_s = 1.0\n{text}"), &[]).unwrap();
    let parts = Named::of(&scene, 0);
    World::new(&controller::setup(&scene), &Surroundings::of(&scene), vec![(parts.drive, parts.contact)])
}

#[test]
fn a_scene_that_names_what_the_plant_holds_moves_like_it() {
    let text = "[effects.dry_friction]\ntorque_mnm = 0.12\n[effects.gear_efficiency]\nefficiency = 0.7\n\
                [effects.supply_sag]\nsource_ohm = 0.1\n[effects.row_sag]\n[effects.settling]\n";
    let mut ours = world(text);
    let mut plant = Plant::new(&Setup::default());
    let mut random = fastrand::Rng::with_seed(5);
    let (mut pressed, mut reversed) = (0, 0);
    for step in 0..200_000_u32 {
        let forth = if step % 40_000 < 22_000 { 0.3 } else { -0.35 };
        let duty = forth + 0.4 * (random.f64() - 0.5);
        let bridge = if step % 9_000 > 8_500 { Bridge::Coast } else { Bridge::Driven { duty } };
        ours.advance(0.0, 10e-6, &[bridge]);
        plant.advance(10e-6, bridge);
        let (travel, expected) = (ours.fingers()[0].tip_mm(), plant.travel_mm());
        assert!((travel - expected).abs() < 1e-9, "step {step}: {travel} for {expected} mm");
        assert!((ours.force_n(0) - plant.force_n()).abs() < 1e-9);
        assert!((ours.fingers()[0].supply_v() - plant.supply_v()).abs() < 1e-9);
        assert_eq!(ours.sense(0, 0).encoder, plant.encoder_counts());
        pressed += u32::from(plant.force_n() > 0.5);
        reversed += u32::from(plant.speed_mm_per_s() < 0.0);
    }
    assert!(pressed > 20_000 && reversed > 20_000, "{pressed} steps pressed, {reversed} backwards");
}

#[test]
fn the_ideal_readout_is_the_plants() {
    let mut setup = Setup::default();
    setup.array.row_ohm = 0.0;
    let mut world = Plant::new(&setup);
    world.place(6.0);
    let mut readout = Readout::new(&setup.array);
    for slot in 0..SLOTS {
        let kpa = core::array::from_fn(|column| if slot < ROWS { world.pressure_kpa(slot, column) } else { 0.0 });
        assert_eq!(readout.codes(&mut (), slot, 0.0, &kpa), world.slot_codes(slot));
    }
}
