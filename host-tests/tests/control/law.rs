//! The law and the profile against their formulas in f64.

use crate::{config, mm};
use fingertip::config::Config;
use fingertip::control::{Reference, SpeedLoop};
use fingertip::state::Limits;
use fingertip::units::{Millimetres, MillimetresPerSecond, MillimetresPerSecond2};

fn speed(value: f64) -> MillimetresPerSecond {
    MillimetresPerSecond::from_bits((value * 65_536.0).round() as i32)
}

fn acceleration(value: f64) -> MillimetresPerSecond2 {
    MillimetresPerSecond2::from_bits((value * 256.0).round() as i32)
}

#[test]
fn the_profile_is_the_line_near_the_goal_and_the_root_beyond() {
    let config = config();
    let mut rng = fastrand::Rng::with_seed(6);
    let mut near = 0;
    for case in 0..20_000 {
        let gains = &config.gain_sets[case % config.gain_sets.len()];
        let slope = f64::from(gains.speed_q18_per_s) / 2_f64.powi(18) / 3.0;
        let brake = 10_f64.powf(rng.f64() * 2.0 + 3.5);
        let way = (rng.f64() - 0.5) * 10_f64.powf(rng.f64() * 4.0 - 2.5);
        let now = (rng.f64() - 0.5) * 500.0;
        let reference = Reference::towards(mm(way), speed(now), acceleration(brake), gains);
        let line = brake / (2.0 * slope * slope);
        near += usize::from(way.abs() < line);
        let (expected_speed, expected_acceleration) = if way.abs() <= line {
            (f64::from(gains.slope_per_s) * way, -f64::from(gains.slope_per_s) * now)
        } else {
            let root = (2.0 * brake * way.abs()).sqrt();
            // Never more than what braking makes, and a quarter.
            ((root - brake / (2.0 * slope)).copysign(way), -(brake * (now / root).clamp(-1.25, 1.25)))
        };
        let name = format!("{way} mm, {now} mm/s, {brake} mm/s^2, k {slope}");
        let found: f64 = reference.speed.0.to_num();
        assert!(
            (found - expected_speed).abs() <= 3e-3 * expected_speed.abs() + 0.02,
            "{found}, {expected_speed}: {name}"
        );
        let found: f64 = reference.acceleration.0.to_num();
        let unsure = 0.01 * expected_acceleration.abs() + 0.001 * brake + 1.0;
        assert!((found - expected_acceleration).abs() <= unsure, "{found}, {expected_acceleration}: {name}");
    }
    assert!((5_000..15_000).contains(&near), "{near} near the goal");
}

/// However fast it goes, the curve asks for a quarter more than the brake at most.
#[test]
fn no_speed_asks_for_more_than_a_quarter_beyond_the_brake() {
    let config = config();
    for (bits, sign) in [(i32::MAX, -1.0), (1 << 29, -1.0), (-1 << 29, 1.0), (i32::MIN, 1.0)] {
        for way in [mm(5.0), mm(-5.0)] {
            let now = MillimetresPerSecond::from_bits(bits);
            let reference = Reference::towards(way, now, acceleration(10_000.0), &config.gain_sets[0]);
            let found: f64 = reference.acceleration.0.to_num();
            assert!((found - sign * 12_500.0).abs() < 10.0, "{found} at {now:?}");
        }
    }
}

#[test]
fn beyond_the_limit_there_is_no_curve_to_stay_on() {
    let reference = Reference { speed: speed(30.0), acceleration: acceleration(-700.0) };
    assert_eq!(reference.limited(speed(30.0)), reference);
    let held = Reference { speed: speed(29.0), acceleration: MillimetresPerSecond2::ZERO };
    assert_eq!(reference.limited(speed(29.0)), held);
    let back = Reference { speed: speed(-30.0), ..reference };
    assert_eq!(back.limited(speed(30.0)), back);
    assert_eq!(back.limited(speed(29.0)), Reference { speed: speed(-29.0), ..held });
}

/// g V = k_v (v_ref - v) + a_ref + c v - w.
#[test]
fn the_law_is_the_documented_one() {
    let config = Config { slew_limit: i32::MAX, current_limit: i32::MAX, voltage_limit: 1 << 30, ..config() };
    let gain = f64::from(config.gain_sets[0].speed_q18_per_s) / 2_f64.powi(18);
    let damping = f64::from(config.damping_q17_per_s) / 2_f64.powi(17);
    let mut rng = fastrand::Rng::with_seed(7);
    for _ in 0..10_000 {
        let mut any = |reach: f64| (rng.f64() - 0.5) * 2.0 * reach;
        let (wanted, now, feed, disturbance) = (any(250.0), any(250.0), any(50_000.0), any(50_000.0));
        let mut motion = SpeedLoop::new();
        motion.observer.speed = speed(now);
        motion.observer.disturbance = acceleration(disturbance);
        let reference = Reference { speed: speed(wanted), acceleration: acceleration(feed) };
        let mut limits = Limits::default();
        let duty = motion.follow(reference, 6_000, &config, &mut limits);
        let expected = gain * (wanted - now) + feed + damping * now - disturbance;
        let voltage = f64::from(motion.drive.voltage()) / 256.0;
        assert!((voltage - expected).abs() < 1.0, "{voltage}, {expected} expected");
        let net = f64::from(motion.drive.acceleration()) / 256.0;
        assert!((net - (expected - damping * now)).abs() < 1.0, "{net}");
        assert_eq!((limits, duty), (Limits::default(), motion.drive.duty(6_000, &config)));
    }
}

/// A force that pushes back helps to stop where it presses, and drives where it lets go: 85 % of it is counted on,
/// between a quarter and twice of what the motor can.
#[test]
fn the_brake_counts_on_the_force_where_it_helps() {
    let config = config();
    let [least, usual, most] = config.brake.map(|bits| f64::from(bits) / 256.0);
    assert!((least * 4.0 / usual - 1.0).abs() < 1e-3 && (most / usual / 2.0 - 1.0).abs() < 1e-3);
    for (disturbance, forward, back) in [
        (0.0, usual, usual),
        (-10_000.0, usual + 8_515.6, usual - 8_515.6),
        (10_000.0, usual - 8_515.6, usual + 8_515.6),
        (-4.0 * usual, most, least),
        (4.0 * usual, least, most),
    ] {
        let mut motion = SpeedLoop::new();
        motion.observer.disturbance = acceleration(disturbance);
        for (way, expected) in [(mm(1.0), forward), (Millimetres::ZERO, forward), (mm(-1.0), back)] {
            let brake: f64 = motion.brake(way, &config).0.to_num();
            assert!((brake - expected).abs() < 2.0, "{brake}, {expected} expected with {disturbance}");
        }
    }
}

/// While the loop is quick every way counts; once it is calm, one within the slack is none, and of a longer one what is
/// beyond it.
#[test]
fn a_calm_loop_leaves_a_way_within_the_slack() {
    let config = config();
    let slack = mm(0.004);
    let speed_over = |motion: SpeedLoop, way: f64, slack: Millimetres| {
        let (reference, limited) = { motion }.towards(mm(way), slack, config.speed_max, &config);
        assert!(!limited);
        reference.speed
    };
    let quick = SpeedLoop::new();
    let mut calm = quick;
    for _ in 0..10 * config.calm_frames {
        calm.schedule.note(Millimetres::ZERO, &config);
    }
    assert!(speed_over(quick, 0.004, slack) > MillimetresPerSecond::ZERO);
    for way in [0.004, 0.001, 0.0, -0.004] {
        assert_eq!(speed_over(calm, way, slack), MillimetresPerSecond::ZERO, "{way} mm");
    }
    for way in [0.010, -0.010] {
        assert_eq!(speed_over(calm, way, slack), speed_over(calm, 0.6 * way, Millimetres::ZERO), "{way} mm");
        assert_ne!(speed_over(calm, way, slack), MillimetresPerSecond::ZERO);
    }
}
