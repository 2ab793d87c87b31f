//! The motor against its data sheet, friction, encoder and supply; the time-optimal bound against closed forms and
//! against the plant.

use super::{STEP_S, free, pressed, run};
use proptest::prelude::*;
use sim::mechanics::Bridge;
use sim::mechanics::rotor::{Reason, minimum_time_s, profile};
use sim::plant::{Plant, Setup};

const FULL: Bridge = Bridge::Driven { duty: 1.0 };
const RPM: f64 = 60.0 / std::f64::consts::TAU;

#[test]
fn the_motor_has_the_figures_of_its_data_sheet() {
    // A stiff supply and no bridge, as on the motor's test bench.
    let mut setup = free();
    (setup.supply.source_ohm, setup.supply.bridge_ohm) = (0.0, 0.0);
    let mut world = Plant::new(&setup);
    world.advance(0.0, FULL);
    let torque = (world.current_a() * setup.motor.torque_nm_per_a - setup.motor.friction_nm) * 1e3;
    assert!((11.15..11.25).contains(&torque), "{torque} mNm for 11.20");
    let start = world.clone();
    run(&mut world, 0.2, FULL);
    let (speed, current) = (world.shaft().speed_rad_per_s, world.current_a());
    assert!((10_550.0..10_650.0).contains(&(speed * RPM)), "{} rpm for 10,600", speed * RPM);
    assert!((0.0215..0.0225).contains(&current), "{current} A for 0.0220");
    let (mut world, mut time_s) = (start, 0.0);
    while world.shaft().speed_rad_per_s < speed * (1.0 - (-1.0f64).exp()) {
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
fn a_pushed_mass_takes_its_closed_form_and_friction_helps_the_brake() {
    let mut setup = double_integrator();
    for friction_nm in [0.0, 2e-3] {
        setup.motor.friction_nm = friction_nm;
        for (way_mm, current_a) in [(0.1, 2.0), (1.0, 2.0), (1.5, 1.0), (1.0, 0.5), (-2.0, 1.0)] {
            let torque_nm = setup.motor.torque_nm_per_a * current_a;
            let [speeding, braking] =
                [torque_nm - friction_nm, torque_nm + friction_nm].map(|nm| mm_per_s2(&setup, nm));
            let expected_s = (2.0 * f64::abs(way_mm) * (1.0 / speeding + 1.0 / braking)).sqrt();
            let got = profile(&setup, 3.0, 3.0 + way_mm, 1e9, current_a).unwrap();
            assert!((got.total_s / expected_s - 1.0).abs() < 1e-6, "{} s for {expected_s} s", got.total_s);
            assert!((got.switch_s * speeding - (got.total_s - got.switch_s) * braking).abs() < 1e-3);
        }
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
        for (seconds, duty) in [(best.switch_s, sign), (best.total_s - best.switch_s, -sign)] {
            let whole = (seconds / STEP_S).floor();
            for _ in 0..whole as usize {
                world.advance(STEP_S, Bridge::Driven { duty });
            }
            world.advance(seconds - whole * STEP_S, Bridge::Driven { duty });
        }
        assert!((world.indentation_mm() - to).abs() < 1e-5, "{} mm for {to} mm", world.indentation_mm());
        assert!(world.speed_mm_per_s().abs() < 0.05, "{} mm/s left", world.speed_mm_per_s());
    }
}

#[test]
fn no_other_single_switch_is_faster() {
    // With less drive or less brake, whoever stops at the target stops later.
    let setup = Setup::default();
    let time_s = |volts, amperes| minimum_time_s(&setup, 0.5, 1.6, volts, amperes).unwrap();
    assert!([6.0, 5.0, 4.0, 3.0].map(|volts| time_s(volts, NO_LIMIT)).is_sorted_by(|a, b| a < b));
    assert!([NO_LIMIT, 1.5, 1.0, 0.5].map(|amperes| time_s(6.0, amperes)).is_sorted_by(|a, b| a < b));
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
