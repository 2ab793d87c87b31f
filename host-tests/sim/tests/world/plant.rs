//! The plant against the paper, the data sheet and closed forms. It equals the finger of a scene with its parameters.

use crate::*;
use fingertip::config::newtons;
use fingertip::shipped::{self, Frame};
use fingertip::state::Mode;
use sim::mechanics::decay;
use sim::mechanics::pressures::Cell;
use sim::mechanics::rotor::{Unreachable, profile};
use sim::plant::{Plant, Setup};

/// The step that the tests vouch for.
const STEP_S: f64 = 10e-6;

/// The reference finger with the wall out of reach.
fn free() -> Setup {
    let mut setup = Setup::default();
    setup.wall.distance_mm = 1e9;
    setup
}

/// Holds the bridge for a time.
fn run(world: &mut Plant, seconds: f64, bridge: Bridge) {
    for _ in 0..(seconds / STEP_S).round() as usize {
        world.advance(STEP_S, bridge);
    }
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
    let mut named = Bench::new(&scene).expect("it runs");
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

// Pressures at a point, by the paper, and their means on the taxels. The readout: sag, settling, defects, codes.

const ORACLE: &str = include_str!("../../../oracle/park2003.csv");

#[test]
fn pressure_force_and_radius_are_the_papers() {
    let mut points = 0;
    for line in ORACLE.lines().skip(1) {
        let v: Vec<f64> = line.split(',').map(|field| field.parse().unwrap()).collect();
        let tip = Tip { radius_mm: v[0], modulus_kpa: v[1] };
        let (d, r, rc, p, f) = (v[2], v[3], v[4], v[6], v[7]);
        let flat = tip.flattened(d);
        let close = |ours: f64, oracle: f64| (ours - oracle).abs() <= 4e-15 * oracle.abs().max(1e-12);
        assert!(close(flat.contact_radius2_mm2.sqrt(), rc), "radius at {line}");
        // The rim: p goes to 0 with r_c^2 - r^2, of which only the sizes' rounding is left.
        let rounding = 4e-16 * tip.modulus_kpa * rc * rc / (tip.radius_mm - d).powi(2);
        assert!((flat.pressure_kpa(r * r) - p).abs() <= 4e-15 * p + 2.0 * rounding, "pressure at {line}");
        assert!(close(tip.force_n(d), f), "force at {line}");
        assert!((tip.indentation_mm(f) - d).abs() <= 1e-14 * d, "indentation at {line}");
        points += 1;
    }
    assert_eq!(points, 400);
}

#[test]
fn what_lies_beyond_the_array_is_lost() {
    // A share of 0.6 % at 4 mm, 4 % at 5 mm for this pitch, by the 40-digit reference of the model.
    assert!((0.004..0.008).contains(&-relative_error_of_sum(4.0, 0.0, 0.0)));
    assert!((0.030..0.045).contains(&-relative_error_of_sum(5.0, 0.0, 0.0)));
}

#[test]
fn any_contact_inside_the_array_is_wholly_felt() {
    let mut rng = fastrand::Rng::with_seed(2003);
    for _ in 0..4_096 {
        let d = 0.001 + 2.499 * rng.f64();
        let [x, y] = [(); 2].map(|()| 1.6 * rng.f64() - 0.8);
        let most = if d < 0.2 { 1e-4 } else { 1e-5 };
        assert!(relative_error_of_sum(d, x, y).abs() < most, "{d} mm at {x}, {y} mm");
    }
}

fn relative_error_of_sum(d: f64, x: f64, y: f64) -> f64 {
    let mut setup = Setup::default();
    setup.wall.centre_x_mm = x;
    setup.wall.centre_y_mm = y;
    let tip = setup.tip.flattened(d);
    let mut sum_kpa = 0.0;
    for row in 0..ROWS {
        sum_kpa += (0..COLUMNS).map(|column| Cell::of(&setup, row, column).mean_kpa(&tip)).sum::<f64>();
    }
    sum_kpa * 1e-3 * setup.array.pitch_mm * setup.array.pitch_mm / setup.tip.force_n(d) - 1.0
}

#[test]
fn the_decay_factor_is_the_exponential() {
    let mut worst = 0.0_f64;
    for n in 0..=40_000 {
        let x = f64::from(n) * 1e-3;
        worst = worst.max((decay(x) / (-x).exp() - 1.0).abs());
        if n == 12_000 {
            assert!(worst < 1e-12, "{worst:e} up to 12");
        }
    }
    assert!(worst < 1e-11, "{worst:e} up to 40");
    assert_eq!(decay(1e6), 0.0);
    assert_eq!(decay(0.0), 1.0);
}

#[test]
fn codes_are_rounded_down_and_cut() {
    let array = Setup::default().array;
    let lsb = 3.3 / 4096.0;
    assert_eq!(array.code(0.0), 0);
    assert_eq!(array.code(100.999 * lsb), 100);
    assert_eq!(array.code(101.001 * lsb), 101);
    assert_eq!((array.code(3.3), array.code(9.0), array.code(-1.0)), (4095, 4095, 0));
}

#[test]
fn a_frame_holds_every_slot() {
    let mut world = Plant::new(&Setup::default());
    world.place(world.finger().setup.wall.distance_mm + 1.0);
    let mut frame = Frame::EMPTY;
    world.fill_frame(&mut frame);
    world.fill_frame(&mut frame);
    assert_eq!(frame.sequence, 2);
    for slot in 0..SLOTS {
        for column in 0..COLUMNS {
            assert_eq!(frame.code(slot, column), world.slot_codes(slot)[column]);
        }
    }
    // 0.3 V of virtual ground is 372.36 codes; the preload of the undriven slot has settled away.
    assert_eq!(frame.code(ROWS, 5), 372);
    // The middle taxels' mean r^2 is 1.5 mm^2, where p is 23.3 kPa: 559 codes, 40 of preload, 0.4 % of sag, 372 of
    // ground.
    assert!((963..975).contains(&frame.code(5, 5)), "{}", frame.code(5, 5));
}

// The motor against its data sheet, friction, encoder and supply; the time-optimal bound against closed forms and
// against the plant.

const FULL: Bridge = Bridge::Driven { duty: 1.0 };
const RPM: f64 = 60.0 / TAU;

#[test]
fn the_motor_has_the_figures_of_its_data_sheet() {
    // A stiff supply and no bridge, as on the motor's test bench.
    let mut setup = free();
    (setup.supply.source_ohm, setup.supply.bridge_ohm) = (0.0, 0.0);
    let started = || {
        let mut world = Plant::new(&setup);
        world.advance(0.0, FULL);
        world
    };
    let mut world = started();
    let torque = (world.finger().current_a() * setup.motor.torque_nm_per_a - setup.motor.friction_nm) * 1e3;
    assert!((11.15..11.25).contains(&torque), "{torque} mNm for 11.20");
    run(&mut world, 0.2, FULL);
    let (speed, current) = (world.finger().now.shaft.speed_rad_per_s, world.finger().current_a());
    assert!((10_550.0..10_650.0).contains(&(speed * RPM)), "{} rpm for 10,600", speed * RPM);
    assert!((0.0215..0.0225).contains(&current), "{current} A for 0.0220");
    let (mut world, mut time_s) = (started(), 0.0);
    while world.finger().now.shaft.speed_rad_per_s < speed * (1.0 - (-1.0f64).exp()) {
        world.advance(STEP_S, FULL);
        time_s += STEP_S;
    }
    assert!((6.9e-3..7.1e-3).contains(&time_s), "{time_s} s for 7 ms");
}

#[test]
fn the_encoder_counts_down_to_the_lower_edge() {
    let mut world = Plant::new(&free());
    let counts_per_mm = 1600.0 * 43.0 / (TAU * 12.0);
    for travel in [0.0, 0.4 / counts_per_mm, 1.6 / counts_per_mm, 3.0, -0.4 / counts_per_mm, -2.0] {
        world.place(travel);
        assert_eq!(world.encoder_counts(), (travel * counts_per_mm).floor() as i32, "at {travel} mm");
    }
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
            let got = profile(&setup, [3.0, 3.0 + way_mm], 1e9, current_a).unwrap();
            assert!((got.total_s / expected_s - 1.0).abs() < 1e-6, "{} s for {expected_s} s", got.total_s);
            assert!((got.switch_s * speeding - (got.total_s - got.switch_s) * braking).abs() < 1e-3);
        }
    }
}

#[test]
fn the_world_driven_so_arrives_at_rest() {
    let setup = Setup::default();
    for (from, to) in [(0.5, 1.6), (1.6, 2.5), (2.5, 1.1), (0.0, 3.0)] {
        let best = profile(&setup, [from, to], 6.0, NO_LIMIT).unwrap();
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
        assert!(world.finger().speed_mm_per_s().abs() < 0.05, "{} mm/s left", world.finger().speed_mm_per_s());
    }
}

#[test]
fn no_other_single_switch_is_faster() {
    // With less drive or less brake, whoever stops at the target stops later.
    let setup = Setup::default();
    let time_s = |volts, amperes| profile(&setup, [0.5, 1.6], volts, amperes).unwrap().total_s;
    assert!([6.0, 5.0, 4.0, 3.0].map(|volts| time_s(volts, NO_LIMIT)).is_sorted_by(|a, b| a < b));
    assert!([NO_LIMIT, 1.5, 1.0, 0.5].map(|amperes| time_s(6.0, amperes)).is_sorted_by(|a, b| a < b));
}

#[test]
fn what_the_motor_cannot_do_is_said() {
    let setup = Setup::default();
    let weak = profile(&setup, [0.5, 3.0], 6.0, 0.1).unwrap_err();
    assert_eq!(weak, Unreachable::TooWeak);
    assert!(weak.to_string().contains("allow more voltage or current"), "{weak}");
    let mut slick = Setup::default();
    slick.transmission.efficiency = 1.0;
    slick.motor.friction_nm = 0.0;
    assert_eq!(profile(&slick, [3.0, 2.0], 6.0, 0.05).unwrap_err(), Unreachable::RunsAway);
    assert_eq!(profile(&setup, [2.0, 2.0], 6.0, 1.0).unwrap().total_s, 0.0);
}
