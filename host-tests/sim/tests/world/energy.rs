//! No passive effect creates energy: a million random steps of each.

use crate::bench::world;
use host_tests::plant::Bridge;

/// Random lengths of step, kicks now and then, the bridge open or braking. Between kicks the energy of finger, contact and body never
/// rises, but for what a force forgotten gives back: of that the tip has no more than was pushed into it.
fn never_rises(text: &str, remembers: bool) {
    let mut world = world(&format!("[object]\ndistance_mm = 0.3\n{text}"));
    let mut random = fastrand::Rng::with_seed(11);
    let mass_kg = text.contains("object_mass").then_some(0.05);
    let energy = |world: &sim::world::World<sim::effects::set::Named>| {
        let body = world.body();
        let [x, y] = body.speed_mm_per_s;
        let body_mj =
            mass_kg.map_or(0.0, |kg: f64| 0.5 * kg * (x * x + y * y) * 1e-3 + kg * 9.80665 * body.place_mm[1]);
        let contact_mj = if remembers { 0.0 } else { world.contact_mj(0) };
        let along = world.fingers()[0].contact.along.stretch_mm;
        let along_mj = 0.5 * world.fingers()[0].contact.n_per_mm_along * along * along;
        world.fingers()[0].energy_mj() + contact_mj + body_mj + along_mj
    };
    let (mut budget_mj, mut scale_mj, mut touched) = (energy(&world), 0.0_f64, 0);
    let mut bridge = Bridge::Coast;
    for step in 0..1_000_000_u32 {
        if step % 500 == 0 {
            let before = energy(&world);
            let towards = if world.fingers()[0].flank_mm() > 0.0 && random.bool() { -1.0 } else { 1.0 };
            // Always from a place near the wall, so that most of the time there is contact.
            if world.fingers()[0].flank_mm().abs() > 5.0 || mass_kg.is_some() {
                let mut fresh = crate::bench::world(&format!("[object]\ndistance_mm = 0.3\n{text}"));
                core::mem::swap(&mut world, &mut fresh);
                budget_mj = 0.0;
            } else if remembers {
                budget_mj -= before;
            }
            world.fingers_mut()[0].launch(towards * (20.0 + 200.0 * random.f64()));
            let after = energy(&world);
            if remembers {
                budget_mj = (budget_mj + after).max(after)
            } else {
                budget_mj = after
            }
            scale_mj = scale_mj.max(after);
            bridge = if random.bool() { Bridge::Coast } else { Bridge::Driven { duty: 0.0 } };
        }
        let step_s = 1e-6 * (1.0 + 99.0 * random.f64());
        world.advance(0.0, step_s, &[bridge]);
        touched += u32::from(world.force_n(0) > 0.0);
        let now = energy(&world);
        assert!(now <= budget_mj + 2e-11 * scale_mj, "{text}: {now} after {budget_mj} mJ in step {step}");
        if !remembers {
            budget_mj = now;
        }
    }
    assert!(touched > 50_000, "{text}: touched for {touched} steps");
}

macro_rules! passive {
    ($($name:ident: $text:literal, $remembers:literal;)*) => { $(
        #[test]
        fn $name() {
            never_rises($text, $remembers);
        }
    )* };
}

passive! {
    bare: "", false;
    inductance: "[effects.winding_inductance]\n", false;
    dry_friction: "[effects.dry_friction]\n", false;
    stribeck: "[effects.stribeck]\n", false;
    viscous: "[effects.viscous_friction]\n", false;
    gear: "[effects.gear_efficiency]\n", false;
    cogging: "[effects.cogging]\n", false;
    backlash: "[effects.backlash]\n", false;
    thermal: "[effects.thermal_derating]\n", false;
    relaxation: "[effects.relaxation]\nshare = 0.5\ntau_s = 0.01\n", true;
    sphere: "[effects.sphere]\n", false;
    edge: "[effects.edge]\n", false;
    stiffness: "[effects.object_stiffness]\n", false;
    mass: "[effects.object_mass]\nmass_g = 50.0\n", false;
    mass_and_grip: "[effects.object_mass]\nmass_g = 50.0\n[effects.tangential]\n", false;
    breakable: "[effects.breakable_object]\n", false;
    all: "[effects.dry_friction]\n[effects.stribeck]\n[effects.gear_efficiency]\n[effects.cogging]\n[effects.winding_inductance]\n\
          [effects.sphere]\n[effects.object_stiffness]\n[effects.object_mass]\nmass_g = 50.0\n[effects.tangential]\n", false;
}
