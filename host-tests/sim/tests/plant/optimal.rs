//! The time-optimal bound against closed forms, and against the plant.

use super::STEP_S;
use sim::bridge::Bridge;
use sim::optimal::{Reason, minimum_time_s, profile};
use sim::plant::{Plant, Setup};

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
