//! The motor against its data sheet, friction, energy, and the order of the step.

use super::{STEP_S, free, pressed, run};
use proptest::prelude::*;
use sim::bridge::Bridge;
use sim::plant::{Plant, Setup};

const FULL: Bridge = Bridge::Driven { duty: 1.0 };
const RPM: f64 = 60.0 / std::f64::consts::TAU;

/// A stiff supply and no bridge, as on the motor's test bench.
fn bench(mut setup: Setup) -> Setup {
    setup.supply.source_ohm = 0.0;
    setup.supply.bridge_ohm = 0.0;
    setup
}

#[test]
fn no_load_speed_and_current_are_the_data_sheets() {
    let mut world = Plant::new(&bench(free()));
    run(&mut world, 0.2, FULL);
    let rpm = world.shaft().speed_rad_per_s * RPM;
    assert!((10_550.0..10_650.0).contains(&rpm), "{rpm} rpm for 10,600");
    let current = world.current_a();
    assert!((0.0215..0.0225).contains(&current), "{current} A for 0.0220");
}

#[test]
fn stall_torque_and_time_constant_are_the_data_sheets() {
    let setup = bench(free());
    let mut world = Plant::new(&setup);
    let end = {
        let mut world = world.clone();
        run(&mut world, 0.2, FULL);
        world.shaft().speed_rad_per_s
    };
    world.advance(0.0, FULL);
    let torque = (world.current_a() * setup.motor.torque_nm_per_a - setup.motor.friction_nm) * 1e3;
    assert!((11.15..11.25).contains(&torque), "{torque} mNm for 11.20");
    let mut time_s = 0.0;
    while world.shaft().speed_rad_per_s < end * (1.0 - (-1.0f64).exp()) {
        world.advance(STEP_S, FULL);
        time_s += STEP_S;
    }
    assert!((6.9e-3..7.1e-3).contains(&time_s), "{time_s} s for 7 ms");
}

#[test]
fn the_gear_presses_with_its_efficiency_and_gives_back_less() {
    // Slowly in and slowly out: the force is the motor's net torque times n/r, times 0.7 or over 2 - 1/0.7.
    let mut world = pressed(0.0);
    let setup = world.setup().clone();
    let per_nm = setup.transmission.ratio / (setup.transmission.drum_radius_mm * 1e-3);
    let steps = 500_000;
    for (from, to, share, sign) in [(0.0, 0.3, 0.7, 1.0), (0.3, 0.05, 1.0 / (2.0 - 1.0 / 0.7), -1.0)] {
        for n in 0..steps {
            let duty = from + (to - from) * f64::from(n) / f64::from(steps);
            world.advance(STEP_S, Bridge::Driven { duty });
        }
        assert!(world.speed_mm_per_s() * sign > 0.0);
        let motor_nm = world.current_a() * setup.motor.torque_nm_per_a - sign * setup.motor.friction_nm;
        let expected_n = motor_nm * per_nm * share;
        assert!((world.force_n() / expected_n - 1.0).abs() < 1e-3, "{} N for {expected_n} N", world.force_n());
    }
}

#[test]
fn friction_holds_inside_its_band_and_not_outside() {
    for d in [0.0, 0.5, 1.0, 2.0, 3.0] {
        let world = pressed(d);
        let setup = world.setup().clone();
        let arm_m = setup.transmission.drum_radius_mm * 1e-3 / setup.transmission.ratio;
        let load = world.force_n() * arm_m;
        let band = setup.motor.friction_nm + load * (1.0 / setup.transmission.efficiency - 1.0);
        for (torque, holds) in [
            (load + 0.99 * band, true),
            (load - 0.99 * band, true),
            (load + 1.01 * band, false),
            (load - 1.01 * band, false),
        ] {
            // u V / (R + u^2 R_s) = i, to first order in the small sag, then refined.
            let current = torque / setup.motor.torque_nm_per_a;
            let mut duty = 0.0;
            for _ in 0..20 {
                let ohms = setup.supply.circuit_ohm(&setup.motor, duty);
                duty = current * ohms / setup.supply.source_v;
            }
            let mut world = world.clone();
            let angle = world.shaft().angle_rad;
            run(&mut world, 0.01, Bridge::Driven { duty });
            assert_eq!(world.shaft().angle_rad == angle, holds, "d {d} mm, {torque} N m");
        }
    }
}

#[test]
fn coasting_gives_back_force_only_against_friction() {
    // Above 0.12 mNm / (0.279 mm (2 - 1/0.7)) = 0.75 N the tip pushes itself out, below it stays.
    let mut held = pressed(0.95);
    let before = held.force_n();
    run(&mut held, 0.2, Bridge::Coast);
    assert_eq!(held.force_n(), before);
    let mut released = pressed(2.0);
    run(&mut released, 0.2, Bridge::Coast);
    assert!(released.force_n() < 0.8, "{} N", released.force_n());
    assert_eq!(released.speed_mm_per_s(), 0.0);
}

fn energy_j(world: &Plant) -> f64 {
    let setup = world.setup();
    let d = world.indentation_mm();
    let tip = setup.tip.force_per_mm2() * d * d * d / 3.0 * 1e-3;
    let shaft = world.shaft().speed_rad_per_s;
    tip + 0.5 * setup.motor.inertia_kg_m2 * shaft * shaft
}

#[test]
fn without_friction_a_coasting_motor_keeps_its_energy() {
    let mut setup = Setup::default();
    setup.motor.friction_nm = 0.0;
    setup.transmission.efficiency = 1.0;
    // The fixed point is cut after three rounds: exact to rounding at 10 us, to 1e-7 at 1 ms.
    for (step_s, bound) in [(STEP_S, 1e-10), (1e-3, 1e-7)] {
        let mut world = Plant::new(&setup);
        world.place(setup.wall.distance_mm + 3.0);
        let start = energy_j(&world);
        while world.travel_mm() > 0.0 {
            world.advance(step_s, Bridge::Coast);
            let error = energy_j(&world) / start - 1.0;
            assert!(error.abs() < bound, "{error:e} at a step of {step_s} s");
        }
    }
}

proptest! {
    #![proptest_config(super::cases(256))]

    #[test]
    fn a_snapshot_restores_every_bit(d in 0.0..4.0f64, duty in -1.0..1.0f64) {
        let mut world = pressed(d);
        run(&mut world, 1e-3, Bridge::Driven { duty });
        world.pressure_kpa(5, 5);
        let bytes = postcard::to_stdvec(&world).unwrap();
        let mut restored: Plant = postcard::from_bytes(&bytes).unwrap();
        prop_assert_eq!(&postcard::to_stdvec(&restored).unwrap(), &bytes);
        for _ in 0..100 {
            for side in [&mut world, &mut restored] {
                side.advance(STEP_S, Bridge::Driven { duty: -duty });
            }
            prop_assert_eq!(world.shaft(), restored.shaft());
            prop_assert_eq!(world.slot_codes(5), restored.slot_codes(5));
        }
    }
}

#[test]
fn the_encoder_counts_down_to_the_lower_edge() {
    let mut world = Plant::new(&free());
    let counts_per_mm = 1600.0 * 43.0 / (std::f64::consts::TAU * 12.0);
    for travel in [0.0, 0.4 / counts_per_mm, 1.6 / counts_per_mm, 3.0, -0.4 / counts_per_mm, -2.0] {
        world.place(travel);
        assert_eq!(world.encoder_counts(), (travel * counts_per_mm).floor() as i32, "at {travel} mm");
    }
}

#[test]
fn a_frozen_encoder_stands_still_and_catches_up() {
    let mut world = Plant::new(&free());
    run(&mut world, 0.01, FULL);
    let before = world.encoder_counts();
    world.faults.encoder_frozen = true;
    run(&mut world, 0.01, FULL);
    assert_eq!(world.encoder_counts(), before);
    world.faults.encoder_frozen = false;
    run(&mut world, STEP_S, FULL);
    assert!(world.encoder_counts() > before + 100);
}

#[test]
fn a_supply_that_drops_is_sensed() {
    let mut world = Plant::new(&free());
    world.faults.supply_drop_v = 2.0;
    world.advance(0.0, Bridge::Coast);
    assert_eq!(world.supply_v(), 4.0);
    assert_eq!(world.sense(3).supply_mv, 4_000);
    assert_eq!(world.sense(3).bus_silent_ms, 3);
}
