//! Objects that can move, one finger and two.

use crate::bench::{Last, close, run, scene, world};
use fingertip::state::Mode;
use sim::bridge::Bridge;
use sim::watch::{Step, Watch};

#[test]
fn a_collision_keeps_momentum_and_energy() {
    let mut world = world("[object]\ndistance_mm = 1.0\n[effects.object_mass]\nmass_g = 300.0\n");
    world.fingers_mut()[0].launch(200.0);
    let finger_kg = world.fingers()[0].mass_kg();
    let momentum = finger_kg * 200.0;
    let energy_mj = 0.5 * finger_kg * 200.0 * 200.0 * 1e-3;
    let mut squeezed_mm = 0.0_f64;
    for _ in 0..20_000 {
        run(&mut world, 20e-6, 1, Bridge::Coast);
        let body_mm_per_s = world.body().speed_mm_per_s[0];
        close(finger_kg * world.fingers()[0].speed_mm_per_s() + 0.3 * body_mm_per_s, momentum, 1e-9);
        let body_mj = 0.5 * 0.3 * body_mm_per_s * body_mm_per_s * 1e-3;
        close(world.fingers()[0].energy_mj() + body_mj + world.contact_mj(0), energy_mj, 1e-9);
        squeezed_mm = squeezed_mm.max(world.truth(0, false).indentation_mm);
    }
    assert!(squeezed_mm > 1.0, "{squeezed_mm} mm");
    assert_eq!(world.force_n(0), 0.0);
    // The elastic collision's closed form.
    let total = finger_kg + 0.3;
    close(world.fingers()[0].speed_mm_per_s(), 200.0 * (finger_kg - 0.3) / total, 1e-9);
    close(world.body().speed_mm_per_s[0], 200.0 * 2.0 * finger_kg / total, 1e-9);
}

#[test]
fn without_fingers_it_falls_once_the_floor_is_gone() {
    let mut world = world(
        "[object]\nfloor_until_s = 0.1\nshake_g = 2.0\nshake_at_s = 0.2\nshake_ms = 50.0\n[effects.object_mass]\n",
    );
    run(&mut world, 1e-4, 1_000, Bridge::Coast);
    assert_eq!(world.body().place_mm, [0.0, 0.0]);
    for step in 1_000..3_000_u32 {
        world.advance(f64::from(step) * 1e-4, 1e-4, &[Bridge::Coast]);
    }
    close(world.body().speed_mm_per_s[1], -9806.65 * (0.2 + 2.0 * 0.05), 1e-9);
}

/// A grasp by two fingers.
const GRASP: &str = "[hand]\nfingers = 2\nlift_mm = 20.0\nlift_at_s = 0.6\nlift_s = 0.4\n[object]\ndistance_mm = 3.0\nshake_g = 2.0\n\
    shake_at_s = 1.2\nshake_ms = 20.0\n[[script]]\nat_s = 0.0\ngoal_n = 2.0\n[effects.object_mass]\nmass_g = 50.0\n\
    [effects.tangential]\n[effects.relaxation]\n[effects.dry_friction]\n[effects.gear_efficiency]\n";

#[derive(Default)]
struct Grasp {
    last: [Last; 2],
    steps: Vec<usize>,
}

impl Watch for Grasp {
    fn step(&mut self, step: &Step) {
        self.steps.push(step.finger);
        self.last[step.finger].step(step);
    }
}

#[test]
fn two_fingers_lift_an_object_and_hold_it_when_it_is_shaken() {
    let mut grasp = Grasp::default();
    sim::simulate(&scene(&format!("duration_s = 1.5\n{GRASP}")), &mut grasp).unwrap();
    for last in &grasp.last {
        println!("{:?} {:?}", last.mode, last.truth);
        assert_eq!(last.mode, Some(Mode::Force));
        close(last.truth.force_n, 2.0, 0.05);
        // Each carries half of the weight.
        close(last.truth.tangential_n, 0.5 * 0.05 * 9.80665, 0.05);
        assert!(last.truth.slip_mm < 0.01, "{} mm", last.truth.slip_mm);
        close(last.truth.object_mm[1], 20.0 - 0.5 * 0.05 * 9.80665, 0.01);
    }
    assert!(grasp.steps.chunks(2).all(|pair| pair == [0, 1]));
}

#[test]
fn what_is_held_too_loosely_slips_out() {
    let mut grasp = Grasp::default();
    let text = format!("duration_s = 1.2\n{}", GRASP.replace("goal_n = 2.0", "goal_n = 0.2"));
    sim::simulate(&scene(&text), &mut grasp).unwrap();
    assert!(grasp.last[0].truth.slip_mm > 5.0, "{} mm", grasp.last[0].truth.slip_mm);
}
