//! The guard alone, against arbitrary frames, senses and duties: its promises hold whatever the loop, the array and the
//! host do.

use fastrand::Rng;
use fingertip::config::newtons;
use fingertip::params::Params;
use fingertip::safety::guard::{Guard, Seen};
use fingertip::shipped::Config;
use fingertip::state::{Fault, Limits};
use fingertip::units::{Duty, Newtons};

/// Steps over all cases of a test.
const STEPS: u32 = 10_000_000;

fn config(rng: &mut Rng) -> Config {
    let params = Params {
        approach_um_per_s: rng.i32(5_000..100_000),
        travel_max_um: rng.i32(5_000..60_000),
        clearance_um: rng.i32(0..3_000),
        encoder_counts_per_turn: 1 << rng.u32(6..13),
        settle_ns: [500, 2_400, 20_000][rng.usize(0..3)],
        inertia_ug_m2: rng.i32(40..120),
        ..Params::DEFAULT
    };
    Config::shipped(&params).expect("allowed")
}

fn started(encoder: i32, config: &Config) -> Guard {
    let mut guard = Guard::default();
    guard.start(encoder, encoder, config);
    guard
}

fn count_mm(config: &Config) -> f64 {
    config.count.0.to_num()
}

fn time_s(frames: u32, config: &Config) -> f64 {
    f64::from(frames) / f64::from(config.bounds.frames_per_s)
}

fn travel_mm(guard: &Guard) -> f64 {
    guard.travel().0.to_num()
}

/// Which of full duty forward and back are let through.
fn lets_through(guard: &Guard) -> [bool; 2] {
    [Duty::FULL, -Duty::FULL].map(|duty| {
        let mut limits = Limits::default();
        let allowed = guard.allow(Duty(duty), &mut limits);
        assert_eq!(allowed.0 != duty, limits.has(Limits::GUARD));
        assert!(allowed.0 == duty || allowed.0 == 0);
        allowed.0 == duty
    })
}

/// The rear end that promise 1 allows, from the frames alone. It moves back only behind a push: the mean force rises by the
/// least contact over an earlier frame, and the tip was not farther forward since that frame.
struct RearEnd {
    mm: f64,
    /// Mean force as the guard measures it, Q16 N.
    force: i32,
    /// Earlier frames at a larger travel than all later ones: travel, and smallest mean force up to that frame. The
    /// farthest comes first.
    earlier: Vec<(f64, i32)>,
    pushes: u32,
}

impl RearEnd {
    fn started(config: &Config) -> Self {
        Self { mm: -config.bounds.back.0.to_num::<f64>(), force: 0, earlier: vec![(0.0, 0)], pushes: 0 }
    }

    fn frame(&mut self, travel_mm: f64, force: Newtons, config: &Config) {
        self.force += (force.to_bits().max(0) - self.force) >> 4;
        while self.earlier.pop_if(|(earlier_mm, _)| *earlier_mm < travel_mm).is_some() {}
        let least = self.earlier.last().map_or(i32::MAX, |(_, least)| *least);
        if self.force > least.saturating_add(config.contact_on.to_bits()) {
            let depth_mm: f64 = config.tip.indentation(Newtons::from_bits(self.force)).0.to_num();
            self.mm = self.mm.min(travel_mm - depth_mm - config.clearance.0.to_num::<f64>() - 1.0);
            self.pushes += 1;
        }
        self.earlier.push((travel_mm, least.min(self.force)));
    }
}

/// Beyond an end of the travel no duty drives the tip farther out, and 1 mm beyond it is stopped: for any counts, forces
/// and voltages, jumps included. The front end never moves outwards. The rear end moves back only behind an object that pushes,
/// at most by the indentation, the clearance and 1 mm behind the place of the push.
#[test]
fn no_input_opens_an_end() {
    let mut rng = Rng::with_seed(1);
    // Runs without and with a push, and frames behind a rear end that a push had moved.
    let (mut runs, mut behind) = ([0; 2], 0);
    for run in 0..1_000 {
        let config = config(&mut rng);
        let end: f64 = config.travel_max.0.to_num();
        let origin = rng.i32(..);
        let mut guard = started(origin, &config);
        let mut rear = RearEnd::started(&config);
        let (mut counts, mut pace) = (0_i32, 1);
        // No force, or a force that rises too little for a push; forces of a few newtons; anything.
        let most = [config.contact_on.to_bits(), 90_000, i32::MAX][run % 3];
        for _ in 0..STEPS / 1_000 {
            if rng.u8(..) == 0 {
                pace = 1 << rng.u32(0..10);
            }
            counts = if rng.u16(..) == 0 { rng.i32(..) } else { counts.saturating_add(rng.i32(-pace..=pace)) };
            let wild = most == i32::MAX && rng.u8(..) < 8;
            let seen = Seen {
                encoder: origin.wrapping_add(counts),
                force: Newtons::from_bits(if wild { rng.i32(..) } else { rng.i32(-9_000..most.min(90_000)) }),
                pressing: rng.bool(),
                goal: newtons(rng.i32(-1..8_000)),
                given_q8_mm_per_s2: rng.i32(..) >> rng.u32(0..8),
            };
            let fault = guard.check(&seen, true, &config);
            let [forward, backward] = lets_through(&guard);
            let travel = travel_mm(&guard);
            rear.frame(travel, seen.force, &config);
            assert!(travel <= end || !forward, "{travel} mm of {end}");
            assert!(travel >= rear.mm || !backward, "{travel} mm of {}, {} pushes", rear.mm, rear.pushes);
            if travel > end + 1.001 || travel < rear.mm - 1.001 {
                assert!(fault.is_some(), "{travel} mm");
            }
            behind += u32::from(rear.pushes > 0 && travel < rear.mm);
        }
        runs[usize::from(rear.pushes > 0)] += 1;
    }
    assert!(runs.iter().all(|count| *count > 300) && behind > 1_000, "{runs:?}, {behind} frames behind a moved end");
}

/// An object that pushes the tip back is released: the rear end moves to the clearance and 1 mm behind where it pushed
/// last. A force that only remains moves no end.
#[test]
fn only_a_push_takes_the_rear_end_along() {
    let config = Config::shipped(&Params::DEFAULT).expect("allowed");
    let back_mm: f64 = config.bounds.back.0.to_num();
    let behind_mm = config.clearance.0.to_num::<f64>() + 1.0;
    let from_mm = 0.5 - back_mm;
    for rises in [true, false] {
        let mut guard = started(0, &config);
        let mut at = |travel_mm: f64, force_mn: i32| {
            let force = newtons(force_mn);
            let encoder = counts(travel_mm, &config);
            let fault = guard.check(
                &Seen { encoder, force, pressing: false, goal: Newtons::ZERO, given_q8_mm_per_s2: 0 },
                true,
                &config,
            );
            (fault, lets_through(&guard)[1])
        };
        // The tip moves back slowly. The force appears once the tip is back, or is constant from the start.
        let mut travel_mm = 0.0;
        while travel_mm > from_mm {
            assert_eq!(at(travel_mm, if rises { 0 } else { 300 }), (None, true), "{travel_mm} mm");
            travel_mm -= 0.001;
        }
        let depth_mm: f64 = config.tip.indentation(newtons(300)).0.to_num();
        for _ in 0..1_000 {
            assert_eq!(at(travel_mm, 300).0, None);
        }
        // The constant force rose at 0 mm.
        let place_mm = if rises { travel_mm } else { 0.0 };
        let expected_mm = (place_mm - depth_mm - behind_mm).min(-back_mm);
        while at(travel_mm, 300).1 {
            travel_mm -= 0.001;
            assert!(travel_mm > expected_mm - 0.1, "open at {travel_mm} mm, {expected_mm} expected");
        }
        assert!((expected_mm - 0.01..expected_mm + 0.3).contains(&travel_mm), "{travel_mm} mm, {expected_mm} expected");
    }
}

/// Adversarial driver of the motor, which tries to break the envelope: full duty in either direction for random times.
struct Adversary {
    travel_mm: f64,
    speed_mm_per_s: f64,
    duty: i16,
    left: u32,
}

impl Adversary {
    fn frame(&mut self, guard: &Guard, config: &Config, strength: f64, push_mm_per_s2: f64, rng: &mut Rng) -> i32 {
        if self.left == 0 {
            self.duty = [Duty::FULL, -Duty::FULL, 0, rng.i16(..)][rng.usize(0..4)];
            self.left = rng.u32(1..600);
        }
        self.left -= 1;
        let duty = guard.allow(Duty(self.duty), &mut Limits::default());
        let voltage = i64::from(duty.0) * i64::from(config.voltage_max_q8_mm_per_s2) / i64::from(Duty::FULL);
        let frame_s = 1.0 / f64::from(config.bounds.frames_per_s);
        let damping = f64::from(config.damping_q17_per_s) / 131_072.0;
        let push = strength * voltage as f64 / 256.0 - push_mm_per_s2;
        self.speed_mm_per_s += (push - strength * damping * self.speed_mm_per_s) * frame_s;
        self.travel_mm += self.speed_mm_per_s * frame_s;
        voltage as i32
    }
}

/// Without contact, a tip that is fast 20 ms after the last contact is stopped within 30 ms more, whatever
/// duty is requested, and whatever the array reads in the air: noise, a wrong baseline, anything.
#[test]
fn no_duty_makes_it_fast_in_the_air() {
    let mut rng = Rng::with_seed(2);
    let (mut fast, mut stopped) = (0_u32, 0);
    for _ in 0..1_000 {
        let config = config(&mut rng);
        let (strength, offset_mn) = (rng.f64() * 0.6 + 0.7, [0, 10, 200, 2_000][rng.usize(0..4)]);
        let mut guard = started(0, &config);
        let mut finger = Adversary { travel_mm: 0.0, speed_mm_per_s: 0.0, duty: 0, left: 0 };
        let limit = 1.5 * f64::from(config.params.approach_um_per_s) * 1e-3;
        let (mut voltage, mut air, mut since, mut forward) = (0, 0, 0, false);
        for _ in 0..STEPS / 1_000 {
            let encoder = (finger.travel_mm / count_mm(&config)).floor() as i32;
            let force = newtons(offset_mn).max(newtons(rng.i32(-20..20)));
            let seen = Seen { encoder, force, pressing: rng.bool(), goal: Newtons::ZERO, given_q8_mm_per_s2: voltage };
            if guard.check(&seen, true, &config).is_some() {
                stopped += 1;
                break;
            }
            air = if guard.presses() { 0 } else { air + 1 };
            let loose = time_s(air, &config) > 0.02;
            // The counts tell the speed no better than this.
            let unsure = 16.0 * count_mm(&config) / 0.005;
            let speed = finger.speed_mm_per_s;
            since = if loose && speed.abs() > limit + unsure && (speed > 0.0) == forward { since + 1 } else { 0 };
            forward = speed > 0.0;
            fast = fast.max(since);
            assert!(time_s(since, &config) <= 0.03, "{speed} mm/s, {limit} asked");
            voltage = finger.frame(&guard, &config, strength, 0.0, &mut rng);
        }
    }
    assert!(fast > 0 && stopped > 100, "the adversary never tried");
}

/// A finger that is as strong as its parameters say, give or take 30 %, with friction and contacts, is never taken for
/// a broken one.
#[test]
fn a_sound_finger_is_never_stopped_for_its_direction() {
    let mut rng = Rng::with_seed(3);
    for _ in 0..1_000 {
        let config = config(&mut rng);
        let strength = rng.f64() * 0.6 + 0.7;
        let wall_mm = rng.f64() * 8.0;
        let per_n = f64::from(config.bounds.acceleration_per_n) / 256.0;
        let mut guard = started(0, &config);
        let mut finger = Adversary { travel_mm: 0.0, speed_mm_per_s: 0.0, duty: 0, left: 0 };
        let mut voltage = 0;
        for _ in 0..STEPS / 1_000 {
            let depth = (finger.travel_mm - wall_mm).max(0.0);
            let force_n = 0.785 * depth * depth;
            if force_n > 9.0 {
                // More than that stops it for another reason.
                break;
            }
            let sensed = force_n * (0.8 + 0.4 * strength / 1.3) + rng.f64() * 0.01;
            let encoder = (finger.travel_mm / count_mm(&config)).floor() as i32;
            let seen = Seen {
                encoder,
                force: newtons((1e3 * sensed) as i32),
                pressing: true,
                goal: Newtons::ZERO,
                given_q8_mm_per_s2: voltage,
            };
            match guard.check(&seen, true, &config) {
                Some(Fault::Runaway) => break,
                None => {}
                fault => panic!("{fault:?} at {} mm, {} mm/s", finger.travel_mm, finger.speed_mm_per_s),
            }
            let friction = 500.0 * finger.speed_mm_per_s.signum();
            voltage = finger.frame(&guard, &config, strength, force_n * per_n + friction, &mut rng);
        }
    }
}

/// Swapped channels or leads: stopped within 5 ms and 0.5 mm of full drive, in either direction. A blocked motor or a
/// dead encoder too.
#[test]
fn the_wrong_way_ends_within_half_a_millimetre() {
    let config = Config::shipped(&Params::DEFAULT).expect("the defaults are allowed");
    for (turns, expected) in [(-1.0, Fault::Reversed), (0.0, Fault::EncoderFrozen)] {
        for duty in [Duty::FULL, -Duty::FULL] {
            let mut guard = started(0, &config);
            let mut finger = Adversary { travel_mm: 0.0, speed_mm_per_s: 0.0, duty, left: u32::MAX };
            let mut rng = Rng::with_seed(4);
            let mut voltage = 0;
            let frames = (1..200).find(|_| {
                let encoder = (turns * finger.travel_mm / count_mm(&config)).floor() as i32;
                let fault = guard.check(
                    &Seen {
                        encoder,
                        force: Newtons::ZERO,
                        pressing: true,
                        goal: Newtons::ZERO,
                        given_q8_mm_per_s2: voltage,
                    },
                    true,
                    &config,
                );
                voltage = finger.frame(&guard, &config, 1.0, 0.0, &mut rng);
                assert!(fault.is_none_or(|fault| fault == expected), "{fault:?}");
                fault.is_some()
            });
            let frames = frames.expect("a fault");
            assert!(time_s(frames, &config) <= 0.005, "{frames} frames");
            assert!(finger.travel_mm.abs() <= 0.5, "{} mm", finger.travel_mm);
        }
    }
}

/// Counts that make a travel.
fn counts(travel_mm: f64, config: &Config) -> i32 {
    (travel_mm / count_mm(config)).round() as i32
}

/// After a touch the tip retreats at most to the clearance plus 1 mm behind the surface. A reading that only looks like
/// a touch moves nothing while the host requests none.
#[test]
fn a_touch_bounds_the_retreat() {
    let config = Config::shipped(&Params { clearance_um: 2_000, ..Params::DEFAULT }).expect("allowed");
    for (pressing, floor_mm) in [(true, 10.0 - 2.0 - 1.0), (false, -f64::from(config.bounds.back.0.to_num::<f32>()))] {
        let mut guard = started(0, &config);
        let at = |travel_mm: f64, force: Newtons, guard: &mut Guard| {
            let seen = Seen {
                encoder: counts(travel_mm, &config),
                force,
                pressing,
                goal: Newtons::ZERO,
                given_q8_mm_per_s2: 0,
            };
            guard.check(&seen, true, &config)
        };
        // Forward slowly, then 1 N at 10 mm and its indentation, then back into the air.
        let depth_mm: f64 = config.tip.indentation(newtons(1_000)).0.to_num();
        for step in 0..10_000 {
            let travel_mm = (10.0 + depth_mm) * f64::from(step) / 1e4;
            let force = newtons(((travel_mm - 10.0).max(0.0).powi(2) * 785.0) as i32);
            assert_eq!(at(travel_mm, force, &mut guard), None);
        }
        let mut travel_mm = 10.0 + depth_mm;
        let mut cut_mm = None;
        let fault = loop {
            travel_mm -= 0.002;
            let fault = at(travel_mm, Newtons::ZERO, &mut guard);
            let [_, backward] = lets_through(&guard);
            if !backward && cut_mm.is_none() {
                cut_mm = Some(travel_mm);
            }
            if fault.is_some() {
                break fault;
            }
        };
        assert_eq!(fault, Some(Fault::Runaway));
        // The touch is noticed at 0.04 N, some frames late; the guard looks 1/256 s ahead.
        let cut_mm = cut_mm.expect("cut before it is stopped");
        assert!((floor_mm - 0.05..floor_mm + 0.3).contains(&cut_mm), "{cut_mm} mm, {floor_mm} asked");
        assert!((floor_mm - 1.05..floor_mm - 0.8).contains(&travel_mm), "{travel_mm} mm");
    }
}
