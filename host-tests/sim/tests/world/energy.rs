//! No passive effect creates energy: a million random steps of each.

use crate::bench::world;
use host_tests::plant::Bridge;
use sim::effects::set::Named;
use sim::world::World;

const WALL_MM: f64 = 0.3;

/// Random lengths of step, kicks now and then, the bridge open or braking. Between kicks the energy of finger, contact and body never
/// rises. `share` is that of the relaxation named.
fn never_rises(text: &str, share: f64) {
    let scene = format!("[object]\ndistance_mm = {WALL_MM:?}\n{text}");
    let mut moving = world(&scene);
    let mut random = fastrand::Rng::with_seed(11);
    let mass_kg = text.contains("object_mass").then_some(0.05);
    let energy = |world: &World<Named>| {
        let finger = &world.fingers()[0];
        let [x, y] = world.body().speed_mm_per_s;
        let body_mj = mass_kg.map_or(0.0, |kg: f64| 0.5 * kg * (x * x + y * y) * 1e-3);
        let stretch_mm = finger.contact.along.stretch_mm;
        let along_mj = 0.5 * finger.contact.n_per_mm_along * stretch_mm * stretch_mm;
        let contact_mj = if share > 0.0 { relaxing_mj(world, share) } else { world.contact_mj(0) };
        finger.energy_mj() + contact_mj + body_mj + along_mj
    };
    let (mut before, mut scale_mj, mut touched) = (0.0, 0.0_f64, 0);
    let mut bridge = Bridge::Coast;
    for step in 0..1_000_000_u32 {
        if step % 500 == 0 {
            // Always from a place near the wall, so that most of the time there is contact.
            if moving.fingers()[0].flank_mm().abs() > 5.0 || mass_kg.is_some() {
                moving = world(&scene);
            }
            let towards = if moving.fingers()[0].flank_mm() > 0.0 && random.bool() { -1.0 } else { 1.0 };
            moving.fingers_mut()[0].launch(towards * (20.0 + 200.0 * random.f64()));
            before = energy(&moving);
            scale_mj = scale_mj.max(before);
            bridge = if random.bool() { Bridge::Coast } else { Bridge::Driven { duty: 0.0 } };
        }
        moving.advance(0.0, 1e-6 * (1.0 + 99.0 * random.f64()), &[bridge]);
        touched += u32::from(moving.force_n(0) > 0.0);
        let now = energy(&moving);
        assert!(now <= before + 2e-11 * scale_mj, "{text}: {now} after {before} mJ in step {step}");
        before = now;
    }
    assert!(touched > 50_000, "{text}: touched for {touched} steps");
}

/// Energy of a tip on a plane that remembers q, mJ: E(d) - g q d + g (q d_q - E(d_q)), F_e(d_q) = q, at the indentation or, off the
/// object, at that of its shape.
fn relaxing_mj(world: &World<Named>, share: f64) -> f64 {
    let finger = &world.fingers()[0];
    let forgotten_n = finger.contact.law().forgotten_n;
    let n_per_mm2 = finger.setup().tip.force_per_mm2();
    let elastic_mj = |d: f64| n_per_mm2 * d * d * d / 3.0;
    let d_mm = (finger.flank_mm() - WALL_MM).max((forgotten_n / n_per_mm2).sqrt());
    let remembered_n = forgotten_n / share;
    let remembered_mm = (remembered_n / n_per_mm2).sqrt();
    elastic_mj(d_mm) - forgotten_n * d_mm + share * (remembered_n * remembered_mm - elastic_mj(remembered_mm))
}

macro_rules! passive {
    ($($name:ident: $text:literal, $share:literal;)*) => { $(
        #[test]
        fn $name() {
            never_rises($text, $share);
        }
    )* };
}

passive! {
    bare: "", 0.0;
    inductance: "[effects.winding_inductance]\n", 0.0;
    dry_friction: "[effects.dry_friction]\n", 0.0;
    stribeck: "[effects.stribeck]\n", 0.0;
    viscous: "[effects.viscous_friction]\n", 0.0;
    gear: "[effects.gear_efficiency]\n", 0.0;
    cogging: "[effects.cogging]\n", 0.0;
    backlash: "[effects.backlash]\n", 0.0;
    thermal: "[effects.thermal_derating]\n", 0.0;
    relaxation: "[effects.relaxation]\nshare = 0.5\ntau_s = 0.01\n", 0.5;
    sphere: "[effects.sphere]\n", 0.0;
    edge: "[effects.edge]\n", 0.0;
    stiffness: "[effects.object_stiffness]\n", 0.0;
    mass: "[effects.object_mass]\nmass_g = 50.0\n", 0.0;
    mass_and_grip: "[effects.object_mass]\nmass_g = 50.0\n[effects.tangential]\n", 0.0;
    breakable: "[effects.breakable_object]\n", 0.0;
    all: "[effects.dry_friction]\n[effects.stribeck]\n[effects.gear_efficiency]\n[effects.cogging]\n[effects.winding_inductance]\n\
          [effects.sphere]\n[effects.object_stiffness]\n[effects.object_mass]\nmass_g = 50.0\n[effects.tangential]\n", 0.0;
}
