//! The guard alone, against arbitrary inputs: its promises hold whatever the loop, the array and the host do. Then the
//! limits at which it begins to hold back, each from both sides.

use crate::common::*;
use fingertip::safety::guard::{Guard, Seen};

/// Steps over all cases of a test.
const STEPS: u32 = 10_000_000;

fn config(rng: &mut Rng) -> Config {
    let params = Params {
        approach_um_per_s: rng.i32(5_000..100_000),
        travel_max_um: rng.i32(5_000..60_000),
        clearance_um: rng.i32(500..3_000),
        encoder_counts_per_turn: 1 << rng.u32(6..13),
        settle_ns: [500, 2_400, 20_000][rng.usize(0..3)],
        inertia_ug_m2: rng.i32(40..120),
        ..Params::DEFAULT
    };
    allowed(params)
}

/// Inputs of the guard while the host requests no force.
fn seen(encoder: i32, force: Newtons, pressing: bool, given_q8_mm_per_s2: i32) -> Seen {
    Seen { encoder, force, pressing, goal: Newtons::ZERO, given_q8_mm_per_s2 }
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

/// Which of forward and back are let through, at full duty and at the least one; no duty always is.
fn lets_through(guard: &Guard) -> [bool; 2] {
    let permitted = |duty: i16| {
        let mut limits = Limits::default();
        let allowed = guard.permit(Duty(duty), &mut limits);
        assert_eq!(allowed.0 != duty, limits.has(Limits::GUARD));
        assert!(allowed.0 == duty || allowed.0 == 0);
        allowed.0 == duty
    };
    let [full, least] = [[Duty::FULL, -Duty::FULL], [1, -1]].map(|ways| ways.map(permitted));
    assert!(full == least && permitted(0));
    full
}

/// The rear end that promise 1 allows, from the frames alone. It moves back only behind a push: the mean force rises by
/// the least contact over an earlier frame, and the tip was not farther forward since that frame.
struct RearEnd {
    mm: f64,
    /// Mean force as the guard measures it, Q16 N.
    force: i32,
    /// Frames at a larger travel than all later ones, farthest first: travel, and smallest mean force up to that frame.
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

/// For any input no duty drives the tip farther beyond an end of the travel, and 1 mm beyond it is stopped. The rear
/// end moves back only behind an object that pushes: to the indentation, the clearance and 1 mm behind the place of the
/// push.
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

/// The rear end moves to the clearance and 1 mm behind the last push. A force that only remains moves no end.
#[test]
fn only_a_push_takes_the_rear_end_along() {
    let config = allowed(Params::DEFAULT);
    let back_mm: f64 = config.bounds.back.0.to_num();
    let behind_mm = config.clearance.0.to_num::<f64>() + 1.0;
    let from_mm = 0.5 - back_mm;
    for rises in [true, false] {
        let mut guard = started(0, &config);
        let mut at = |travel_mm: f64, force_mn: i32| {
            let seen = seen(counts(travel_mm, &config), newtons(force_mn), false, 0);
            (guard.check(&seen, true, &config), lets_through(&guard)[1])
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
        let duty = guard.permit(Duty(self.duty), &mut Limits::default());
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
            if guard.check(&seen(encoder, force, rng.bool(), voltage), true, &config).is_some() {
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
            match guard.check(&seen(encoder, newtons((1e3 * sensed) as i32), true, voltage), true, &config) {
                Some(Fault::Runaway) => break,
                None => {}
                fault => panic!("{fault:?} at {} mm, {} mm/s", finger.travel_mm, finger.speed_mm_per_s),
            }
            let friction = 500.0 * finger.speed_mm_per_s.signum();
            voltage = finger.frame(&guard, &config, strength, force_n * per_n + friction, &mut rng);
        }
    }
}

/// Swapped leads, a blocked motor or a dead encoder: stopped within 5 ms and 0.5 mm of full drive, in either direction.
#[test]
fn the_wrong_way_ends_within_half_a_millimetre() {
    let config = allowed(Params::DEFAULT);
    for (turns, expected) in [(-1.0, Fault::Reversed), (0.0, Fault::EncoderFrozen)] {
        for duty in [Duty::FULL, -Duty::FULL] {
            let mut guard = started(0, &config);
            let mut finger = Adversary { travel_mm: 0.0, speed_mm_per_s: 0.0, duty, left: u32::MAX };
            let mut rng = Rng::with_seed(4);
            let mut voltage = 0;
            let frames = (1..200).find(|_| {
                let encoder = (turns * finger.travel_mm / count_mm(&config)).floor() as i32;
                let fault = guard.check(&seen(encoder, Newtons::ZERO, true, voltage), true, &config);
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

fn counts(travel_mm: f64, config: &Config) -> i32 {
    (travel_mm / count_mm(config)).round() as i32
}

/// After a touch the tip retreats at most to the clearance plus 1 mm behind the surface. A reading that only looks like
/// a touch moves nothing while the host requests none.
#[test]
fn a_touch_bounds_the_retreat() {
    let config = allowed(Params { clearance_um: 2_000, ..Params::DEFAULT });
    for (pressing, floor_mm) in [(true, 10.0 - 2.0 - 1.0), (false, -f64::from(config.bounds.back.0.to_num::<f32>()))] {
        let mut guard = started(0, &config);
        let mut at = |travel_mm: f64, force: Newtons| {
            let fault = guard.check(&seen(counts(travel_mm, &config), force, pressing, 0), true, &config);
            (fault, lets_through(&guard)[1])
        };
        // Forward slowly, then 1 N at 10 mm and its indentation, then back into the air.
        let depth_mm: f64 = config.tip.indentation(newtons(1_000)).0.to_num();
        for step in 0..10_000 {
            let travel_mm = (10.0 + depth_mm) * f64::from(step) / 1e4;
            let force = newtons(((travel_mm - 10.0).max(0.0).powi(2) * 785.0) as i32);
            assert_eq!(at(travel_mm, force).0, None);
        }
        let mut travel_mm = 10.0 + depth_mm;
        let mut cut_mm = None;
        let fault = loop {
            travel_mm -= 0.002;
            let (fault, backward) = at(travel_mm, Newtons::ZERO);
            cut_mm = cut_mm.or((!backward).then_some(travel_mm));
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

/// A guard and where the tip is, moved as a motor would that just makes the speed.
struct Finger {
    guard: Guard,
    config: Config,
    travel_mm: f64,
    speed_mm_per_s: f64,
    force: Newtons,
}

impl Finger {
    /// With counts so fine that they tell the speed.
    fn new() -> Self {
        let config = allowed(Params { encoder_counts_per_turn: 65_536, clearance_um: 10_000, ..Params::DEFAULT });
        Self { guard: started(0, &config), config, travel_mm: 0.0, speed_mm_per_s: 0.0, force: Newtons::ZERO }
    }

    fn encoder(&self) -> i32 {
        (self.travel_mm * 2_f64.powi(40) / self.config.mm_per_count_q40 as f64).round() as i32
    }

    fn frame_s(&self) -> f64 {
        1.0 / f64::from(self.config.bounds.frames_per_s)
    }

    /// Advances the guard by a frame in which the g V given exceeds the back-EMF by `beyond`; both in Q8 mm/s^2.
    fn pushed(&mut self, beyond: i32) -> Option<Fault> {
        self.travel_mm += self.speed_mm_per_s * self.frame_s();
        let damping = f64::from(self.config.damping_q17_per_s) / 131_072.0;
        let voltage = (damping * self.speed_mm_per_s * 256.0) as i32 + beyond;
        self.guard.check(&seen(self.encoder(), self.force, true, voltage), true, &self.config)
    }

    fn frame(&mut self) -> Option<Fault> {
        self.pushed(0)
    }

    fn frames(&mut self, count: u32) {
        assert_eq!((0..count).find_map(|_| self.frame()), None);
    }

    /// Accelerates over 50 ms, so no change of speed is large, and moves on. Returns the first fault and its time.
    fn goes(&mut self, speed_mm_per_s: f64, seconds: f64) -> Option<(Fault, f64)> {
        let from = self.speed_mm_per_s;
        let frames = (seconds / self.frame_s()) as u32;
        (0..frames).find_map(|frame| {
            let time_s = f64::from(frame) * self.frame_s();
            self.speed_mm_per_s = from + (speed_mm_per_s - from) * (time_s / 0.05).min(1.0);
            self.frame().map(|fault| (fault, time_s))
        })
    }

    /// To a travel, at rest there.
    fn placed(&mut self, travel_mm: f64) -> Option<Fault> {
        let way = travel_mm - self.travel_mm;
        self.speed_mm_per_s = 10.0_f64.copysign(way);
        let frames = (way.abs() / 10.0 / self.frame_s()) as u32;
        let fault = (0..frames).find_map(|_| self.frame());
        if fault.is_some() {
            return fault;
        }
        (self.travel_mm, self.speed_mm_per_s) = (travel_mm, 0.0);
        (0..3_000).find_map(|_| self.frame())
    }
}

/// At rest every duty passes up to the end of the travel, beyond it only duty back; 1 mm beyond it is a fault.
#[test]
fn an_end_is_where_it_is_said_to_be() {
    let back_mm: f64 = Finger::new().config.bounds.back.0.to_num();
    for (end_mm, sign, way) in [(20.0, 1.0, 0), (-back_mm, -1.0, 1)] {
        let mut finger = Finger::new();
        for (beyond_mm, let_through) in [(-0.01, true), (0.01, false), (0.99, false)] {
            assert_eq!(finger.placed(end_mm + sign * beyond_mm), None, "{beyond_mm} mm");
            assert_eq!(lets_through(&finger.guard)[way], let_through, "{beyond_mm} mm");
            assert!(lets_through(&finger.guard)[1 - way], "back in it may always");
        }
        assert_eq!(finger.placed(end_mm + sign * 1.01), Some(Fault::Runaway));
    }
}

/// A moving tip is held back where it will be beyond the end in 1/256 s.
#[test]
fn an_end_is_seen_coming() {
    for (speed, way) in [(20.0, 0), (-20.0, 1)] {
        let mut finger = Finger::new();
        let back_mm: f64 = finger.config.bounds.back.0.to_num();
        let end_mm = [20.0, -back_mm][way];
        assert_eq!(finger.placed(end_mm - speed * 0.2), None);
        assert_eq!(finger.goes(speed, 0.1), None);
        while lets_through(&finger.guard)[way] {
            assert!((finger.travel_mm - end_mm) * speed.signum() < 0.0, "{} mm", finger.travel_mm);
            finger.frame();
        }
        let ahead_mm = (finger.travel_mm - end_mm).abs();
        assert!((0.9..1.1).contains(&(ahead_mm / (speed.abs() / 256.0))), "{ahead_mm} mm ahead");
    }
}

/// 1.5 times the approach, 45 mm/s, in the air, 20 ms after the last contact; 20 ms more and it stops.
#[test]
fn in_the_air_one_and_a_half_times_the_approach_is_allowed_and_no_more() {
    for sign in [1.0, -1.0] {
        let mut finger = Finger::new();
        if sign < 0.0 {
            assert_eq!(finger.placed(15.0), None);
        }
        assert_eq!(finger.goes(sign * 44.0, 0.2), None);
        assert_eq!(lets_through(&finger.guard), [true; 2]);
        let forward = usize::from(sign < 0.0);
        let mut cut_s = None;
        let frames = (0.1 / finger.frame_s()) as u32;
        finger.speed_mm_per_s = sign * 46.0;
        let stopped_s = (0..frames).find_map(|frame| {
            let fault = finger.frame();
            let time_s = f64::from(frame) * finger.frame_s();
            if !lets_through(&finger.guard)[forward] && cut_s.is_none() {
                cut_s = Some(time_s);
                assert!(lets_through(&finger.guard)[1 - forward], "it may brake");
            }
            assert!(fault.is_none_or(|fault| fault == Fault::Runaway), "{fault:?}");
            fault.map(|_| time_s)
        });
        let (cut_s, stopped_s) = (cut_s.expect("it is cut"), stopped_s.expect("it is stopped"));
        assert!(cut_s < 0.01 && (0.019..0.022).contains(&(stopped_s - cut_s)), "{cut_s} s, {stopped_s} s");
    }
}

/// 1.5 times the largest speed, 375 mm/s, until 20 ms after the last contact.
#[test]
fn after_a_contact_it_may_be_fast_for_a_while() {
    for (speed_mm_per_s, cut) in [(-370.0, false), (-380.0, true)] {
        let mut finger = Finger::new();
        // 1 N at 15 mm, touched there: the force gives the place of the touch.
        assert_eq!(finger.placed(15.0), None);
        finger.force = newtons(1_000);
        finger.frames(2_000);
        assert!(finger.guard.presses());
        finger.speed_mm_per_s = speed_mm_per_s;
        (0..100).for_each(|_| _ = finger.frame());
        assert_eq!(!lets_through(&finger.guard)[1], cut, "{speed_mm_per_s} mm/s");
    }
}

/// Pressed: from 0.5 mm behind the touch to two indentations forward, or five back, and 0.5 mm more.
#[test]
fn a_tip_is_pressed_as_deep_as_its_force_bears_out() {
    let mut finger = Finger::new();
    assert_eq!(finger.placed(10.0), None);
    for force_mn in [41, 500] {
        finger.force = newtons(force_mn);
        finger.frames(300);
    }
    let depth_mm: f64 = finger.config.tip.indentation(newtons(500)).0.to_num();
    // Where it was noticed, at 40 mN, less the indentation of that.
    let noticed_mm: f64 = finger.config.tip.indentation(newtons(40)).0.to_num();
    for (deep_mm, presses, in_it) in [
        (-0.45, true, false),
        (-0.1, true, false),
        (0.1, true, true),
        (5.0 * depth_mm + 0.45, true, true),
        (5.0 * depth_mm + 0.6, false, false),
        (-0.55, false, false),
    ] {
        assert_eq!(finger.placed(10.0 - noticed_mm + deep_mm), None, "{deep_mm} mm");
        assert_eq!((finger.guard.presses(), finger.guard.presses_in()), (presses, in_it), "{deep_mm} mm");
    }
}

/// A touch begins at 40 mN and ends below 15 mN, by the mean force.
#[test]
fn a_touch_begins_and_ends_with_the_mean_force() {
    let mut finger = Finger::new();
    for (force_mn, presses) in
        [(39, false), (41, true), (16, true), (14, false), (39, false), (-500, false), (41, true)]
    {
        finger.force = newtons(force_mn);
        finger.frames(200);
        assert_eq!(finger.guard.presses(), presses, "{force_mn} mN");
    }
    // The mean moves by 1/16 of its distance to the input in a frame: 3 frames of 0 leave 82 % of it, 17 leave a third.
    finger.force = Newtons::ZERO;
    for (frames, presses) in [(3, true), (10, true), (10, false)] {
        (0..frames).for_each(|_| _ = finger.frame());
        assert_eq!(finger.guard.presses(), presses);
    }
}

/// A driven tip that does not move is a fault only after the expected motion is large enough: a quarter of the force's.
#[test]
fn a_tip_that_stands_is_stopped_from_what_must_be_expected_on() {
    for force_n in [0.0, 4.0] {
        for (share, fault) in [(0.97, None), (1.03, Some(Fault::EncoderFrozen))] {
            let mut finger = Finger::new();
            finger.force = newtons((force_n * 1e3) as i32);
            let bounds = finger.config.bounds;
            // At first the motor balances the force exactly.
            let held = force_n * f64::from(bounds.acceleration_per_n);
            for _ in 0..2_000 {
                assert_eq!(finger.pushed(held as i32), None);
            }
            let change = (f64::from(bounds.change_least) + force_n * f64::from(bounds.change_per_n) / 4.0) / 65_536.0;
            // A steady push makes the change that it would in tau.
            let tau_s = finger.frame_s() * (65_536.0 / f64::from(bounds.leak) - 1.0);
            let beyond = 256.0 * share * change / tau_s;
            assert_eq!((0..2_000).find_map(|_| finger.pushed((held + beyond) as i32)), fault, "{force_n} N, {share}");
        }
    }
}

/// A jump of the encoder is faster than 32 bits tell: as fast as they tell, and not slow.
#[test]
fn a_jump_is_fast() {
    for (jump_mm, lets) in [(5.0, [false, true]), (-5.0, [true, false])] {
        let mut finger = Finger::new();
        assert_eq!(finger.placed(8.0), None);
        finger.travel_mm += jump_mm;
        assert_eq!(finger.frame(), None);
        assert_eq!(lets_through(&finger.guard), lets, "{jump_mm} mm");
    }
}

#[test]
fn a_jump_before_torque_is_forgotten() {
    for jump_mm in [0.0, 0.5, -0.5, 5.0, -5.0] {
        let mut finger = Finger::new();
        finger.travel_mm = jump_mm;
        let encoder = finger.encoder();
        let seen = seen(encoder, Newtons::ZERO, true, 0);
        // 1 ms at rest.
        for _ in 0..10 {
            finger.guard.check(&seen, false, &finger.config);
        }
        finger.guard.start(encoder, encoder, &finger.config);
        // 40 m/s^2 up to 160 mm/s.
        let acceleration = 40_000.0;
        for _ in 0..(160.0 / acceleration / finger.frame_s()) as u32 {
            finger.speed_mm_per_s += acceleration * finger.frame_s();
            assert_eq!(finger.pushed((acceleration * 256.0) as i32), None, "{jump_mm} mm");
        }
    }
}
