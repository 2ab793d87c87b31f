//! Limits at which the guard begins to hold back, each from both sides.

use crate::common::*;
use crate::guard::seen;
use fingertip::safety::guard::Guard;

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
        let params = Params { encoder_counts_per_turn: 65_536, clearance_um: 10_000, ..Params::DEFAULT };
        let config = allowed(params);
        let mut guard = Guard::default();
        guard.start(0, 0, &config);
        Self { guard, config, travel_mm: 0.0, speed_mm_per_s: 0.0, force: Newtons::ZERO }
    }

    fn frame_s(&self) -> f64 {
        1.0 / f64::from(self.config.bounds.frames_per_s)
    }

    /// Advances the guard by a frame in which the g V given exceeds the back-EMF by `beyond`; both in Q8 mm/s^2.
    fn pushed(&mut self, beyond: i32) -> Option<Fault> {
        self.travel_mm += self.speed_mm_per_s * self.frame_s();
        let count_mm = self.config.mm_per_count_q40 as f64 / 2_f64.powi(40);
        let damping = f64::from(self.config.damping_q17_per_s) / 131_072.0;
        let voltage = (damping * self.speed_mm_per_s * 256.0) as i32 + beyond;
        let encoder = (self.travel_mm / count_mm).round() as i32;
        self.guard.check(&seen(encoder, self.force, true, voltage), true, &self.config)
    }

    fn frame(&mut self) -> Option<Fault> {
        self.pushed(0)
    }

    /// Advances frames without a fault.
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

    /// Which of forward and back is let through.
    fn lets(&self) -> [bool; 2] {
        [1, -1].map(|sign| {
            let mut limits = Limits::default();
            let duty = self.guard.permit(Duty(sign), &mut limits);
            assert_eq!(duty == Duty(sign), limits == Limits::default());
            assert_eq!(self.guard.permit(Duty::ZERO, &mut Limits::default()), Duty::ZERO);
            duty == Duty(sign)
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
            assert_eq!(finger.lets()[way], let_through, "{beyond_mm} mm");
            assert!(finger.lets()[1 - way], "back in it may always");
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
        while finger.lets()[way] {
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
        assert_eq!(finger.lets(), [true; 2]);
        let forward = usize::from(sign < 0.0);
        let mut cut_s = None;
        let frames = (0.1 / finger.frame_s()) as u32;
        finger.speed_mm_per_s = sign * 46.0;
        let stopped_s = (0..frames).find_map(|frame| {
            let fault = finger.frame();
            let time_s = f64::from(frame) * finger.frame_s();
            if !finger.lets()[forward] && cut_s.is_none() {
                cut_s = Some(time_s);
                assert!(finger.lets()[1 - forward], "it may brake");
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
        assert_eq!(!finger.lets()[1], cut, "{speed_mm_per_s} mm/s");
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
            let found = (0..2_000).find_map(|_| finger.pushed((held + beyond) as i32));
            assert_eq!(found, fault, "{force_n} N, {share}");
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
        assert_eq!(finger.lets(), lets, "{jump_mm} mm");
    }
}

#[test]
fn a_jump_before_torque_is_forgotten() {
    for jump_mm in [0.0, 0.5, -0.5, 5.0, -5.0] {
        let mut finger = Finger::new();
        finger.travel_mm = jump_mm;
        let count_mm = finger.config.mm_per_count_q40 as f64 / 2_f64.powi(40);
        let encoder = (jump_mm / count_mm).round() as i32;
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
