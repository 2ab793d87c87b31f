//! The motor against its data sheet, friction, energy, and the order of the step.
//!
//! The time-optimal bound against closed forms, and against the plant.

use crate::{STEP_S, free, pressed, run};
use proptest::prelude::*;
use sim::bridge::Bridge;
use sim::optimal::{Reason, minimum_time_s, profile};
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

const NO_LIMIT: f64 = f64::INFINITY;

/// No load, no losses, all voltage for the current: a mass that is pushed.
fn double_integrator() -> Setup {
    let mut setup = Setup::default();
    setup.tip.modulus_kpa = 0.0;
    setup.motor.friction_nm = 0.0;
    setup.supply.source_v = 1e9;
    setup.supply.source_ohm = 0.0;
    setup
}

/// Acceleration of the tip for a torque at the motor.
fn mm_per_s2(setup: &Setup, torque_nm: f64) -> f64 {
    torque_nm / setup.motor.inertia_kg_m2 * setup.transmission.drum_radius_mm / setup.transmission.ratio
}

#[test]
fn a_pushed_mass_takes_twice_the_root_of_way_over_acceleration() {
    let setup = double_integrator();
    for (way, current) in [(0.1, 2.0), (1.0, 2.0), (1.0, 0.5), (-2.0, 1.0)] {
        let a = mm_per_s2(&setup, setup.motor.torque_nm_per_a * current);
        let expected = 2.0 * (f64::abs(way) / a).sqrt();
        let got = minimum_time_s(&setup, 3.0, 3.0 + way, 1e9, current).unwrap();
        assert!((got / expected - 1.0).abs() < 1e-6, "{got} s for {expected} s over {way} mm");
    }
}

#[test]
fn friction_helps_the_brake() {
    let mut setup = double_integrator();
    setup.motor.friction_nm = 2e-3;
    let torque = setup.motor.torque_nm_per_a * 1.0;
    let (speeding, braking) = (mm_per_s2(&setup, torque - 2e-3), mm_per_s2(&setup, torque + 2e-3));
    let expected = (2.0 * 1.5 * (1.0 / speeding + 1.0 / braking)).sqrt();
    let got = profile(&setup, 0.5, 2.0, 1e9, 1.0).unwrap();
    assert!((got.total_s / expected - 1.0).abs() < 1e-6, "{} s for {expected} s", got.total_s);
    assert!((got.switch_s * speeding - (got.total_s - got.switch_s) * braking).abs() < 1e-3);
}

#[test]
fn a_motor_on_a_voltage_follows_its_exponential() {
    let mut setup = double_integrator();
    setup.supply.source_v = 6.0;
    setup.supply.bridge_ohm = 0.0;
    let motor = setup.motor;
    let tau = motor.resistance_ohm * motor.inertia_kg_m2 / motor.torque_nm_per_a.powi(2);
    let top = 6.0 / motor.torque_nm_per_a * setup.transmission.drum_radius_mm / setup.transmission.ratio;
    for drive_s in [1e-3, 5e-3, 20e-3] {
        let speed = top * (1.0 - f64::exp(-drive_s / tau));
        let brake_s = tau * (speed / top).ln_1p();
        let way = (top * drive_s - tau * speed) + (tau * speed - top * brake_s);
        let got = profile(&setup, 0.0, way, 6.0, NO_LIMIT).unwrap();
        assert!((got.switch_s / drive_s - 1.0).abs() < 1e-5, "{} s for {drive_s} s", got.switch_s);
        assert!((got.total_s / (drive_s + brake_s) - 1.0).abs() < 1e-5);
    }
}

#[test]
fn the_world_driven_so_arrives_at_rest() {
    let setup = Setup::default();
    for (from, to) in [(0.5, 1.6), (1.6, 2.5), (2.5, 1.1), (0.0, 3.0)] {
        let best = profile(&setup, from, to, 6.0, NO_LIMIT).unwrap();
        let mut world = Plant::new(&setup);
        world.place(setup.wall.distance_mm + from);
        let sign = f64::signum(to - from);
        let whole = (best.switch_s / STEP_S).floor();
        for _ in 0..whole as usize {
            world.advance(STEP_S, Bridge::Driven { duty: sign });
        }
        world.advance(best.switch_s - whole * STEP_S, Bridge::Driven { duty: sign });
        let brake_s = best.total_s - best.switch_s;
        let whole = (brake_s / STEP_S).floor();
        for _ in 0..whole as usize {
            world.advance(STEP_S, Bridge::Driven { duty: -sign });
        }
        world.advance(brake_s - whole * STEP_S, Bridge::Driven { duty: -sign });
        assert!((world.indentation_mm() - to).abs() < 1e-5, "{} mm for {to} mm", world.indentation_mm());
        assert!(world.speed_mm_per_s().abs() < 0.05, "{} mm/s left", world.speed_mm_per_s());
    }
}

#[test]
fn no_other_single_switch_is_faster() {
    // With less drive or less brake, whoever stops at the target stops later.
    let setup = Setup::default();
    let best = minimum_time_s(&setup, 0.5, 1.6, 6.0, NO_LIMIT).unwrap();
    let mut last = best;
    for limit in [5.0, 4.0, 3.0] {
        let slower = minimum_time_s(&setup, 0.5, 1.6, limit, NO_LIMIT).unwrap();
        assert!(slower > last);
        last = slower;
    }
    let mut last = best;
    for limit in [1.5, 1.0, 0.5] {
        let slower = minimum_time_s(&setup, 0.5, 1.6, 6.0, limit).unwrap();
        assert!(slower > last);
        last = slower;
    }
}

#[test]
fn what_the_motor_cannot_do_is_said() {
    let setup = Setup::default();
    let weak = minimum_time_s(&setup, 0.5, 3.0, 6.0, 0.1).unwrap_err();
    assert_eq!((weak.reason, weak.to_mm), (Reason::TooWeak, 3.0));
    assert!(weak.to_string().contains("allow more voltage or current"), "{weak}");
    let mut slick = Setup::default();
    slick.transmission.efficiency = 1.0;
    slick.motor.friction_nm = 0.0;
    assert_eq!(minimum_time_s(&slick, 3.0, 2.0, 6.0, 0.05).unwrap_err().reason, Reason::RunsAway);
    assert_eq!(minimum_time_s(&setup, 2.0, 2.0, 6.0, 1.0), Ok(0.0));
}

#[test]
fn the_steps_of_the_reference_finger_take_milliseconds() {
    let setup = Setup::default();
    let d = |force_n| setup.tip.indentation_mm(force_n);
    let times = [(0.2, 2.0), (2.0, 5.0), (5.0, 1.0)]
        .map(|(from, to)| minimum_time_s(&setup, d(from), d(to), 6.0, NO_LIMIT).unwrap());
    println!("0.2 -> 2 -> 5 -> 1 N: {times:?} s");
    assert!(times.iter().all(|time| (1e-3..20e-3).contains(time)), "{times:?}");
}
