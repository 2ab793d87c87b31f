//! Effects of motor and gear.

use crate::{close, part, run, world};
use core::f64::consts::TAU;
use sim::effects::drive::{Circuit, Friction};
use sim::effects::{Named, Part};
use sim::mechanics::Bridge;
use sim::world::World;

const FAR: &str = "[object]\ndistance_mm = 100.0\n";
const FULL: Bridge = Bridge::Driven { duty: 1.0 };
const STEPS_S: [f64; 4] = [1e-6, 10e-6, 50e-6, 200e-6];

fn speed(world: &World<Named>) -> f64 {
    world.fingers()[0].shaft().speed_rad_per_s
}

#[test]
fn the_current_rises_with_l_over_r_at_any_step() {
    for step_s in STEPS_S {
        let mut world =
            world("[effects.winding_inductance]\ninductance_uh = 1000.0\n[effects.dry_friction]\ntorque_mnm = 20.0\n");
        let (end_a, tau_s) = (6.0 / 3.53, 1e-3 / 3.53);
        for step in 1..=10 {
            run(&mut world, step_s, 1, FULL);
            close(world.fingers()[0].current_a(), end_a * (1.0 - (-step_s * f64::from(step) / tau_s).exp()), 1e-9);
        }
    }
}

#[test]
fn viscous_friction_stops_a_coasting_rotor_exponentially() {
    for (step_s, share) in [(10e-6, 1e-7), (1e-3, 1e-3)] {
        let mut world = world(&format!("{FAR}[effects.viscous_friction]\ntorque_unm_s = 1.0\n"));
        world.fingers_mut()[0].launch(100.0);
        let start = speed(&world);
        run(&mut world, step_s, (0.05 / step_s) as u64, Bridge::Coast);
        close(speed(&world), start * (-0.05 * 1e-6 / 0.71e-7_f64).exp(), share);
    }
}

#[test]
fn inertia_adds_up() {
    let mut world = world(&format!("{FAR}[effects.inertia]\ngear_g_cm2 = 0.29\nfinger_g = 50.0\n"));
    let m_per_rad = 12e-3_f64 / 43.0;
    close(world.fingers_mut()[0].inertia_kg_m2(), 1.0e-7 + 0.05 * m_per_rad * m_per_rad, 1e-12);
}

#[test]
fn dry_friction_takes_speed_away_evenly_and_then_holds() {
    let mut world = world(&format!("{FAR}[effects.dry_friction]\ntorque_mnm = 0.12\n"));
    world.fingers_mut()[0].launch(100.0);
    let start = speed(&world);
    run(&mut world, 10e-6, 5_000, Bridge::Coast);
    close(speed(&world), start - 0.05 * 0.12e-3 / 0.71e-7, 1e-9);
    run(&mut world, 10e-6, 50_000, Bridge::Coast);
    assert_eq!(speed(&world), 0.0);
    // 1/2 J w^2 = T a.
    close(world.fingers()[0].shaft().angle_rad, 0.5 * 0.71e-7 * start * start / 0.12e-3, 1e-9);
}

#[test]
fn stribeck_friction_breaks_away_higher_than_it_slides() {
    let breakaway_v = |text: &str| {
        let (mut low, mut high) = (0.0, 2.0);
        for _ in 0..40 {
            let volts = 0.5 * (low + high);
            let mut world = world(&format!("{FAR}{text}"));
            run(&mut world, 10e-6, 1, Bridge::Driven { duty: volts / 6.0 });
            if speed(&world) > 0.0 { high = volts } else { low = volts }
        }
        high
    };
    let dry = "[effects.dry_friction]\ntorque_mnm = 0.12\n";
    let both = format!("{dry}[effects.stribeck]\ntorque_mnm = 0.06\nspeed_rad_per_s = 5.0\n");
    close(breakaway_v(dry), 0.12 / 5.35 * 3.53, 1e-9);
    close(breakaway_v(&both), 0.18 / 5.35 * 3.53, 1e-9);
    let Part::Resist(mut part) = part("[effects.stribeck]\ntorque_mnm = 0.06\nspeed_rad_per_s = 5.0\n", 1) else {
        panic!()
    };
    for (speed, share) in [(0.0, 1.0), (5.0, 0.5), (-5.0, 0.5), (50.0, 1.0 / 101.0)] {
        let mut friction = Friction::default();
        part(speed, &mut friction);
        close(friction.sliding_nm, 0.06e-3 * share, 1e-12);
    }
}

#[test]
fn cogging_swings_at_its_own_frequency_and_keeps_its_energy() {
    let mut world = world(&format!("{FAR}[effects.cogging]\ntorque_mnm = 0.05\nteeth = 12\n"));
    let still = (0.05e-3 * 12.0 / 0.71e-7_f64).sqrt();
    world.fingers_mut()[0].launch(0.005);
    let start = world.fingers()[0].energy_mj();
    let (mut crossings, mut last_s, mut before) = (0, 0.0, 0.0);
    for step in 1..=500_000_u32 {
        run(&mut world, 10e-6, 1, Bridge::Coast);
        close(world.fingers()[0].energy_mj(), start, 1e-9);
        let now = world.fingers()[0].shaft().angle_rad;
        if before > 0.0 && now <= 0.0 {
            crossings += 1;
            last_s = f64::from(step) * 10e-6;
        }
        before = now;
    }
    // The first crossing downwards is half a period after the start.
    close((f64::from(crossings) - 0.5) / last_s * TAU, still, 1e-4);
}

#[test]
fn the_play_is_as_wide_as_it_says() {
    for play_um in [50.0, 300.0] {
        let mut world = world(&format!("{FAR}[effects.backlash]\nplay_um = {play_um:?}\n[effects.dry_friction]\n"));
        run(&mut world, 10e-6, 3_000, FULL);
        let turned_mm = world.fingers()[0].flank_mm();
        assert_eq!(world.fingers()[0].tip_mm(), turned_mm);
        let mut highest = turned_mm;
        while world.fingers()[0].flank_mm() > turned_mm - 1.0 {
            run(&mut world, 10e-6, 1, Bridge::Driven { duty: -1.0 });
            highest = f64::max(highest, world.fingers()[0].flank_mm());
            let expected = f64::min(highest, world.fingers()[0].flank_mm() + play_um * 1e-3);
            assert!((world.fingers()[0].tip_mm() - expected).abs() < 1e-12);
        }
        close(world.fingers()[0].tip_mm() - world.fingers()[0].flank_mm(), play_um * 1e-3, 1e-9);
    }
}

#[test]
fn the_winding_warms_up_like_its_closed_form() {
    let text = "[effects.thermal_derating]\nk_per_w = 46.0\ntau_s = 10.0\nambient_c = 30.0\nmagnet_per_k = -0.001\n";
    for step_s in [1e-4, 0.1, 3.0] {
        let Part::Electric(mut part) = part(text, 1) else { panic!() };
        let cold = Circuit {
            source_v: 6.0,
            source_ohm: 0.0,
            duty: 1.0,
            winding_ohm: 2.83,
            bridge_ohm: 0.7,
            henry: 0.0,
            torque_nm_per_a: 5.35e-3,
        };
        let current_a = 0.4_f64;
        for _ in 0..(15.0 / step_s) as u32 {
            let mut circuit = cold;
            part.apply(&mut circuit);
            part.after(step_s, &circuit, current_a * current_a * step_s);
        }
        let time_s = f64::from((15.0 / step_s) as u32) * step_s;
        // tau dT/dt = K (1 + 0.0039 (T - 25)) - (T - 30), K = i^2 R R_th.
        let k = current_a * current_a * 2.83 * 46.0;
        let rate = (1.0 - 0.0039 * k) / 10.0;
        let end = (k * (1.0 - 0.0039 * 25.0) + 30.0) / (1.0 - 0.0039 * k);
        let mut truth = sim::watch::Truth::default();
        part.tell(&mut truth);
        close(truth.winding_c, end + (30.0 - end) * (-rate * time_s).exp(), 1e-8);
        let mut circuit = cold;
        part.apply(&mut circuit);
        close(circuit.winding_ohm, 2.83 * (1.0 + 0.0039 * (truth.winding_c - 25.0)), 1e-12);
        close(circuit.torque_nm_per_a, 5.35e-3 * (1.0 - 0.001 * (truth.winding_c - 25.0)), 1e-12);
    }
}

#[test]
fn the_supply_gives_way_by_the_share_of_the_current_that_it_gives() {
    let mut world = world(&format!("{FAR}[effects.supply_sag]\nsource_ohm = 0.5\n"));
    for duty in [1.0, -1.0, 0.5] {
        world.fingers_mut()[0].place(0.0);
        run(&mut world, 0.0, 1, Bridge::Driven { duty });
        let current = duty * 6.0 / (3.53 + duty * duty * 0.5);
        close(world.fingers()[0].current_a(), current, 1e-12);
        close(world.fingers()[0].supply_v(), 6.0 - 0.5 * duty * current, 1e-12);
    }
}

#[test]
fn a_coarse_encoder_jumps() {
    let mut fine = world(FAR);
    let mut coarse = world(&format!("{FAR}[effects.encoder_resolution]\nstep_counts = 16\n"));
    for duty in [0.5, -0.9] {
        for _ in 0..2_000 {
            for world in [&mut fine, &mut coarse] {
                run(world, 10e-6, 1, Bridge::Driven { duty });
            }
            assert_eq!(coarse.sense(0, 0).encoder, fine.sense(0, 0).encoder.div_euclid(16) * 16);
        }
    }
}
