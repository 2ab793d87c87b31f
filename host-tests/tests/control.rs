//! Unit tests of the force loop: gain schedule, drive, observer, profile, control law, and the references of each mode.

mod grip;

use crate::common::*;
use fingertip::config::{Config, GAIN_SETS};
use fingertip::control::{Drive, GainSchedule, Observer, Reference};
use std::ops::Deref;

/// The reference finger's.
fn config() -> Config {
    allowed(Params::DEFAULT).deref().clone()
}

fn mm(value: f64) -> Millimetres {
    Millimetres::from_bits((value * f64::from(1 << 24)).round() as i32)
}

// Slew, current and voltage, each by itself: duty, reported limits, and the load of a weak source.

/// The largest voltage of the tests, Q8 mm/s^2.
const MOST: i32 = 1 << 30;
/// The supply that makes it.
const SUPPLY_MV: u16 = 6_000;

/// Configuration in which only the largest voltage limits the drive.
fn free() -> Config {
    let config = Config { voltage_max_q8_mm_per_s2: MOST, ..config() };
    assert_eq!(config.params.voltage_max_mv, i32::from(SUPPLY_MV));
    Config { slew_max_q8_mm_per_s2: i32::MAX, current_max_q8_mm_per_s2: i32::MAX, ..config }
}

/// Duty that is passed on, and limits that are reported.
fn apply(drive: &mut Drive, wanted: i32, back_emf: i32, config: &Config) -> (i32, u16) {
    let mut limits = Limits::default();
    drive.apply(wanted, back_emf, SUPPLY_MV, config, &mut limits);
    assert_eq!(drive.acceleration(), drive.given() - back_emf);
    (drive.given(), limits.0)
}

/// Slew is limited around the last voltage, current (proportional to the voltage minus the back-EMF) around the back-EMF.
/// The voltage limit is the last.
#[test]
fn each_limit_that_cuts_is_told() {
    const LIMIT: i32 = 1 << 20;
    let (slew, current, voltage) = (Limits::SLEW, Limits::CURRENT, Limits::VOLTAGE);
    let by_slew = Config { slew_max_q8_mm_per_s2: 1_000, ..free() };
    let by_current = Config { current_max_q8_mm_per_s2: LIMIT, ..free() };
    let by_voltage = Config { voltage_max_q8_mm_per_s2: 10_000, ..free() };
    let by_all = Config { slew_max_q8_mm_per_s2: 40_000, current_max_q8_mm_per_s2: 1 << 14, ..by_voltage.clone() };
    let slews = [(1_000, 1_000, 0), (2_001, 2_000, slew), (MOST, 3_000, slew), (2_500, 2_500, 0), (-MOST, 1_500, slew)];
    let volts = [(10_000, 10_000, 0), (10_001, 10_000, voltage), (-10_001, -10_000, voltage)];
    let mut cases = vec![
        ("slew", &by_slew, 0, [&slews[..], &[(499, 500, slew)]].concat()),
        ("voltage", &by_voltage, 0, volts.to_vec()),
        ("all", &by_all, 0, vec![(50_000, 10_000, slew | current | voltage)]),
    ];
    for back_emf in [0, 5_000_000, -5_000_000] {
        let [most, least] = [back_emf + LIMIT, back_emf - LIMIT];
        let steps = [(most, most, 0), (least, least, 0), (most + 1, most, current), (least - 1, least, current)];
        cases.push(("current", &by_current, back_emf, steps.to_vec()));
    }
    for (name, config, back_emf, steps) in cases {
        let mut drive = Drive::new();
        for (wanted, given, flags) in steps {
            assert_eq!(apply(&mut drive, wanted, back_emf, config), (given, flags), "{name}: {wanted} at {back_emf}");
        }
    }
}

#[test]
fn a_supply_below_the_motors_voltage_makes_as_much_less() {
    let config = free();
    for (supply_mv, share) in [(7_000, 1.0), (6_000, 1.0), (5_999, 5_999.0 / 6e3), (3_000, 0.5), (600, 0.1), (0, 0.0)] {
        let mut drive = Drive::new();
        drive.apply(MOST, 0, supply_mv, &config, &mut Limits::default());
        let applied = f64::from(drive.given()) / f64::from(MOST);
        assert!((applied - share).abs() < 2e-6, "{applied} at {supply_mv} mV");
    }
}

/// Halved in each frame down to a sixteenth, and back by 1/128 in each.
#[test]
fn a_weak_source_is_given_less_current_at_once_and_more_again_slowly() {
    let config = Config { current_max_q8_mm_per_s2: 1 << 20, ..free() };
    let share_q8 = |drive: &mut Drive, supply_mv: i32| {
        drive.apply(MOST, 0, supply_mv as u16, &config, &mut Limits::default());
        drive.given() >> 12
    };
    let weak_mv = config.supply_weak_mv;
    let mut drive = Drive::new();
    assert_eq!(share_q8(&mut drive, weak_mv), 256, "all of it is there at the start");
    let less = [(); 6].map(|()| share_q8(&mut drive, weak_mv - 1));
    assert_eq!(less, [128, 64, 32, 16, 16, 16]);
    for frame in 1..=120 {
        assert_eq!(share_q8(&mut drive, weak_mv), 16 + 2 * frame);
    }
    assert_eq!(share_q8(&mut drive, weak_mv), 256, "never more than all");
}

#[test]
fn the_duty_is_the_voltages_share_of_the_supply() {
    let config = Config { voltage_max_q8_mm_per_s2: config().voltage_max_q8_mm_per_s2, ..free() };
    for supply_mv in [6_000_u16, 8_000, 12_000, 24_000] {
        for share in [1.0, 0.5, 0.01, -0.25, -1.0] {
            let mut drive = Drive::new();
            let wanted = (share * f64::from(config.voltage_max_q8_mm_per_s2)) as i32;
            drive.apply(wanted, 0, supply_mv, &config, &mut Limits::default());
            let expected = 32_767.0 * share * 6_000.0 / f64::from(supply_mv);
            let duty = f64::from(drive.duty(supply_mv, &config).0);
            assert!((duty - expected).abs() < 2.0, "{duty}, {expected} expected");
            // The same voltage from hardly any supply is all that there is.
            for none_mv in [0, 1, 2, 40] {
                let full = if share > 0.0 { i16::MAX } else { i16::MIN };
                assert_eq!(drive.duty(none_mv, &config), Duty(full), "{share} from {none_mv} mV");
            }
        }
    }
}

#[test]
fn a_blocked_drive_loses_its_voltage_and_keeps_the_back_emf() {
    let config = free();
    let mut drive = Drive::new();
    for (wanted, back_emf) in [(5_000, 300), (-2_000, -70), (40, 0)] {
        apply(&mut drive, wanted, back_emf, &config);
        drive.block();
        assert_eq!((drive.given(), drive.acceleration()), (0, -back_emf));
        drive.block();
        assert_eq!((drive.given(), drive.acceleration()), (0, -back_emf), "once is enough");
    }
    assert_eq!(drive.duty(SUPPLY_MV, &config), Duty::ZERO);
}

// The law and the profile against their formulas in f64.

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
        // Far from the goal also the fastest speeds of the type.
        let reach = if way.abs() > 5.0 && case % 2 == 0 { 65_535.0 } else { 500.0 };
        let now = (rng.f64() - 0.5) * reach;
        let reference = Reference::towards(mm(way), speed(now), acceleration(brake), gains);
        let line = brake / (2.0 * slope * slope);
        near += usize::from(way.abs() < line);
        let (expected_speed, expected_acceleration) = if way.abs() <= line {
            (f64::from(gains.slope_per_s) * way, -f64::from(gains.slope_per_s) * now)
        } else {
            let root = (2.0 * brake * way.abs()).sqrt();
            // At most 1.25 times the deceleration of the brake.
            ((root - brake / (2.0 * slope)).copysign(way), -(brake * (now / root).clamp(-1.25, 1.25)))
        };
        let name = format!("{way} mm, {now} mm/s, {brake} mm/s^2, k {slope}");
        let found: f64 = reference.speed.0.to_num();
        let unsure = 3e-3 * expected_speed.abs() + 0.02;
        assert!((found - expected_speed).abs() <= unsure, "{found}, {expected_speed}: {name}");
        let found: f64 = reference.acceleration.0.to_num();
        let unsure = 0.01 * expected_acceleration.abs() + 0.001 * brake + 1.0;
        assert!((found - expected_acceleration).abs() <= unsure, "{found}, {expected_acceleration}: {name}");
    }
    assert!((5_000..15_000).contains(&near), "{near} near the goal");
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
    let config = free();
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
        let voltage = f64::from(motion.drive.given()) / 256.0;
        assert!((voltage - expected).abs() < 1.0, "{voltage}, {expected} expected");
        let net = f64::from(motion.drive.acceleration()) / 256.0;
        assert!((net - (expected - damping * now)).abs() < 1.0, "{net}");
        assert_eq!((limits, duty), (Limits::default(), motion.drive.duty(6_000, &config)));
    }
}

/// The brake includes 85 % of the contact force, within a quarter and twice the motor's own deceleration.
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

/// The fastest gain set corrects every position error, the calmest one only the part of it beyond the slack.
#[test]
fn a_calm_loop_ignores_an_error_within_the_slack() {
    let config = config();
    let slack = mm(0.004);
    let speed_over = |motion: SpeedLoop, way: f64, slack: Millimetres| {
        let (reference, limited) = { motion }.towards(mm(way), slack, config.speed_max, &config);
        assert!(!limited);
        reference.speed
    };
    let quick = SpeedLoop::new();
    let mut calm = quick;
    for _ in 0..10 * config.settled_frames {
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

// The observer against its equations in f64.

/// Gains of the observer for a speed gain: its poles are 2.5 times as fast as the speed loop.
fn observer_gains(speed_gain: f64, frame_s: f64) -> [f64; 3] {
    let half = 0.5 * 2.5 * speed_gain * frame_s;
    let beta = (1.0 - half) / (1.0 + half);
    let gap = 1.0 - beta;
    [1.0 - beta.powi(3), 1.5 * gap * gap * (1.0 + beta) / frame_s, gap.powi(3) / (frame_s * frame_s)]
}

/// Observer by the equations of its documentation.
struct Ideal {
    gains: [f64; 3],
    frame_s: f64,
    travel: f64,
    speed: f64,
    disturbance: f64,
}

impl Ideal {
    fn new(gain_set: usize, config: &Config) -> Self {
        let frame_s = f64::from(config.frame_s_q37) / 2_f64.powi(37);
        let speed_gain = f64::from(config.gain_sets[gain_set].speed_q18_per_s) / 2_f64.powi(18);
        Self { gains: observer_gains(speed_gain, frame_s), frame_s, travel: 0.0, speed: 0.0, disturbance: 0.0 }
    }

    fn update(&mut self, measured: f64, driven: f64) {
        let Self { gains: [l1, l2, l3], frame_s: t, .. } = *self;
        let acceleration = driven + self.disturbance;
        self.travel += self.speed * t + acceleration * t * t / 2.0;
        self.speed += acceleration * t;
        let error = measured - self.travel;
        self.travel += l1 * error;
        self.speed += l2 * error;
        self.disturbance += l3 * error;
    }
}

#[test]
fn it_follows_its_equations_with_each_gain_set() {
    let config = config();
    let count_mm = config.mm_per_count_q40 as f64 / 2_f64.powi(40);
    let mut rng = fastrand::Rng::with_seed(5);
    for gain_set in 0..config.gain_sets.len() {
        let (mut observer, mut reference) = (Observer::new(), Ideal::new(gain_set, &config));
        let (mut counts, mut fastest, mut hardest) = (0, 0.0_f64, 0.0_f64);
        for frame in 0..2_000 {
            if frame % 50 == 0 {
                counts += rng.i32(-40..=40);
            }
            counts += rng.i32(-2..=2);
            let driven = rng.i32(-100_000..=100_000);
            observer.update(counts, driven * 256, &config.gain_sets[gain_set], &config);
            reference.update(f64::from(counts) * count_mm, driven.into());
            (fastest, hardest) = (fastest.max(reference.speed.abs()), hardest.max(reference.disturbance.abs()));
            for (name, found, expected, bound) in [
                ("mm", observer.travel.0.to_num::<f64>(), reference.travel, 1e-5),
                ("mm/s", observer.speed.0.to_num(), reference.speed, 1e-2),
                ("mm/s^2", observer.disturbance.0.to_num(), reference.disturbance, 20.0),
            ] {
                let off = (found - expected).abs();
                assert!(off < bound, "{off} {name} off in frame {frame} of gain set {gain_set}");
            }
        }
        assert!(fastest > 5.0 && hardest > 500.0, "{fastest} mm/s and {hardest} mm/s^2 prove little");
    }
}

#[test]
fn what_no_motion_makes_is_a_jump_to_rest_at_the_new_place() {
    for counts in [500, -500, 100_000, i32::MIN] {
        let config = config();
        let way = config.travel(counts);
        // At rest the observer expects no motion: the error is the whole jump.
        let error = way.to_bits().unsigned_abs();
        for (jump, jumps) in [(error, false), (error - 1, true)] {
            let config = Config { jump, ..config.clone() };
            let mut observer = Observer::zeroed_at(77);
            observer.update(77_i32.wrapping_add(counts), 0, &config.gain_sets[0], &config);
            let rests = observer.speed == MillimetresPerSecond::ZERO;
            assert_eq!((rests, observer.disturbance == MillimetresPerSecond2::ZERO), (jumps, jumps), "{counts}");
            if jumps {
                assert_eq!(observer.travel, way);
            }
            assert_eq!(observer.measured(77, &config), Millimetres::ZERO, "zero stays where it was");
        }
    }
}

/// Schedule by its documentation, raw bits.
#[derive(Default)]
struct IdealSchedule {
    number: usize,
    /// Mean error. It moves by 1/8 of its distance to the error, which counts as 16 bands at most.
    mean: i32,
    /// Frames for which a calmer gain set was enough. Each set lasts twice as long as the one before.
    calm: u32,
}

impl IdealSchedule {
    fn note(&mut self, error: i32, config: &Config) {
        let band = config.settled_band.to_bits();
        self.mean += (error.clamp(-16 * band, 16 * band) - self.mean).div_euclid(8);
        // The largest mean error of a set: two bands for the calmest, twice as much for each faster one.
        let largest = |number: usize| if number == 0 { i32::MAX } else { band << (GAIN_SETS - number) };
        let kept = (0..=self.number).rfind(|number| self.mean.abs() <= largest(*number)).expect("the fastest");
        if kept < self.number {
            (self.number, self.calm) = (kept, 0);
        }
        let calm = self.number < GAIN_SETS - 1 && 2 * self.mean.abs() <= largest(self.number + 1);
        self.calm = if calm { self.calm + 1 } else { 0 };
        if self.calm > config.settled_frames << self.number {
            (self.number, self.calm) = (self.number + 1, 0);
        }
    }
}

/// Constant errors, most of them within a few units of a limit of a gain set, for a few frames or until the calmest set.
#[test]
fn the_schedule_is_the_documented_one() {
    let config = config();
    let band = config.settled_band.to_bits();
    let mut rng = fastrand::Rng::with_seed(9);
    let (mut schedule, mut ideal) = (GainSchedule::QUICK, IdealSchedule::default());
    let mut changes = BTreeSet::new();
    for _ in 0..2_000 {
        let size = rng.choice([0, 1, 2, 4, 8]).expect("some") * band + rng.i32(-9..=9);
        let error = rng.choice([0, i32::MAX, i32::MIN, size, size, -size, -size, -size]).expect("some");
        let frames = rng.choice([1, 3, 10, config.settled_frames, 10 * config.settled_frames]).expect("some");
        for _ in 0..frames {
            let before = ideal.number;
            schedule.note(Millimetres::from_bits(error), &config);
            ideal.note(error, &config);
            changes.insert((before, ideal.number));
            assert_eq!(schedule.gains(&config), &config.gain_sets[ideal.number], "{error} of {band}");
            assert_eq!(schedule.settled(), ideal.number > 0);
        }
    }
    // Each set to each neighbour, and each kept.
    assert!(
        (1..GAIN_SETS).all(|set| [(set, set), (set - 1, set), (set, set - 1)].iter().all(|it| changes.contains(it)))
    );
}

/// Checks that all gains of a set follow from this speed gain k_v.
fn is_made_for(speed_gain: f64, gain_set: usize, config: &Config) {
    let gains = &config.gain_sets[gain_set];
    let frame_s = f64::from(config.frame_s_q37) / 2_f64.powi(37);
    let slope = speed_gain / 3.0;
    let [l1, l2, l3] = gains.observer.map(f64::from);
    let exact = observer_gains(speed_gain, frame_s);
    for (name, found, expected) in [
        ("l1", l1 / 2_f64.powi(31), exact[0]),
        ("l2", l2 / 65_536.0, exact[1]),
        ("l3", l3, exact[2]),
        ("k_v", f64::from(gains.speed_q18_per_s) / 262_144.0, speed_gain),
        ("1/2k", f64::from(gains.half_over_slope_q32) / 2_f64.powi(32), 0.5 / slope),
        ("1/2k^2", f64::from(gains.half_over_slope2_q40) / 2_f64.powi(40), 0.5 / (slope * slope)),
    ] {
        assert!((found / expected - 1.0).abs() < 1e-3, "{name} of gain set {gain_set}: {found}, {expected} expected");
    }
    assert_eq!(gains.slope_per_s, slope as i32, "gain set {gain_set}");
}

/// The speed gain of the fastest set is halved for each calmer one, down to 60 /s. It is limited by:
/// - the frame time T: at most 1 / (5 T). This limits a loop with a fine encoder.
/// - the voltage of one count q, at most three quarters of the maximum: 5.8 k_v^2 q = 0.75 g V_max. This limits a loop
///   with a coarse encoder.
/// - the speed of one count, at most 60 mm/s in an observer that is 2.5 times as fast as the speed loop. This limits a
///   motor that drives the tip almost directly.
#[test]
fn frame_time_and_encoder_set_the_gains() {
    let default = Params::DEFAULT;
    for (limit, params, least) in [
        (0, Params { encoder_counts_per_turn: 65_536, ..default }, 0.0),
        (1, Params { encoder_counts_per_turn: 16, ..default }, 120.0),
        (2, Params { reduction_mrad_per_mm: 150, ..default }, 480.0),
    ] {
        let config = allowed(params);
        let q_mm = config.mm_per_count_q40 as f64 / 2_f64.powi(40);
        let voltage_max = f64::from(config.voltage_max_q8_mm_per_s2) / 256.0;
        let by_frames = 0.2 * 2_f64.powi(37) / f64::from(config.frame_s_q37);
        let quickest = [by_frames, (0.75 * voltage_max / (5.8 * q_mm)).sqrt(), 60.0 / (2.5 * q_mm)];
        let limits = quickest.iter().all(|other| *other >= quickest[limit]);
        assert!(limits && quickest[limit] > least, "{quickest:?}");
        for gain_set in 0..config.gain_sets.len() {
            is_made_for((quickest[limit] / f64::from(1 << gain_set)).max(60.0), gain_set, &config);
        }
    }
}
