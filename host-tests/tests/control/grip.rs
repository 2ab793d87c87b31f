//! Speed reference of an approach, a hold and a release, and the record of the touch that it is computed from.

use crate::{config, mm};
use fingertip::config::Config;
use fingertip::config::newtons;
use fingertip::contact::Contact;
use fingertip::control::SpeedLoop;
use fingertip::control::profile::Reference;
use fingertip::grip::{Goal, Grip};
use fingertip::state::{Limits, Mode};
use fingertip::touch::{Felt, Stage, Touch};
use fingertip::units::{Millimetres, MillimetresPerSecond, Newtons};

/// Position error that a calm loop accepts: 0.4 um.
const SLACK: Millimetres = Millimetres::from_bits((1 << 24) / 2_500);

/// A contact of this force that the array sees completely.
fn contact(force_mn: i32, config: &Config) -> Contact {
    let force = newtons(force_mn);
    Contact { force, indentation: config.tip.indentation(force), confidence: 255, ..Contact::default() }
}

/// The tip at rest at a travel.
fn at(travel: Millimetres) -> SpeedLoop {
    let mut motion = SpeedLoop::new();
    motion.observer.travel = travel;
    motion
}

/// The tip at rest for a while.
fn calm_at(travel: Millimetres, config: &Config) -> SpeedLoop {
    let mut motion = at(travel);
    for _ in 0..10 * config.calm_frames {
        motion.pace.note(Millimetres::ZERO, config);
    }
    motion
}

fn minus(a: Millimetres, b: Millimetres) -> Millimetres {
    Millimetres(a.0 - b.0)
}

fn plus(a: Millimetres, b: Millimetres) -> Millimetres {
    Millimetres(a.0 + b.0)
}

/// The reference over a distance, and the flag that the speed limit sets.
fn over(
    distance: Millimetres,
    slack: Millimetres,
    limit: MillimetresPerSecond,
    motion: SpeedLoop,
    config: &Config,
) -> (Reference, u16) {
    let (reference, limited) = { motion }.towards(distance, slack, limit, config);
    (reference, if limited { Limits::SPEED } else { 0 })
}

fn is_fast(reference: Reference) -> bool {
    reference.speed.0.to_num::<f64>().abs() > 31.0
}

/// Travel that a shorted motor coasts from this speed, mm.
fn coasts_mm(speed: MillimetresPerSecond, config: &Config) -> f64 {
    speed.0.to_num::<f64>() / (f64::from(config.damping_q17_per_s) / 131_072.0)
}

/// A grip with its touch, frame by frame.
#[derive(Clone, Copy)]
struct Hand {
    grip: Grip,
    touch: Touch,
}

fn asked(force: Newtons) -> Goal {
    Goal { force, drift: Newtons::ZERO }
}

impl Hand {
    /// Nothing touches.
    fn free(config: &Config) -> Self {
        let mut hand = Self { grip: Grip::default(), touch: Touch::default() };
        hand.see(&Contact::default(), at(mm(4.0)), config);
        hand
    }

    /// Presses with 1 N on a surface that it found at 5 mm; the contact and the travel.
    fn pressing(config: &Config) -> (Self, Contact, Millimetres) {
        Self::pressing_with(1_000, config)
    }

    /// Presses with this force on a surface that it found at 5 mm; the contact and the travel.
    fn pressing_with(force_mn: i32, config: &Config) -> (Self, Contact, Millimetres) {
        let mut hand = Self::free(config);
        // The least contact comes first: a touch has a place once its force rose.
        let least = Contact { force: config.contact_on, ..contact(40, config) };
        hand.frame(force_mn, &least, at(plus(mm(5.0), least.indentation)), config);
        assert!(hand.touch.held() && !hand.touch.placed());
        let held = contact(force_mn, config);
        let travel = plus(mm(5.0), held.indentation);
        // Two frames: one alone is no reference for a step.
        for _ in 0..2 {
            hand.frame(force_mn, &held, at(travel), config);
        }
        assert!(hand.touch.placed());
        (hand, held, travel)
    }

    fn see(&mut self, contact: &Contact, motion: SpeedLoop, config: &Config) {
        let felt = Felt {
            contact,
            summed: contact.force,
            travel: motion.observer.travel,
            presses: self.grip.mode(&self.touch) != Mode::Release,
        };
        self.touch.observe(&felt, || Millimetres::ZERO, config);
    }

    /// A frame; the reference, and the flags that it sets.
    fn frame(&mut self, goal_mn: i32, contact: &Contact, motion: SpeedLoop, config: &Config) -> (Reference, u16) {
        self.frame_of(newtons(goal_mn), contact, motion, config)
    }

    fn frame_of(&mut self, goal: Newtons, contact: &Contact, motion: SpeedLoop, config: &Config) -> (Reference, u16) {
        self.see(contact, motion, config);
        let mut limits = Limits::default();
        let Self { grip, touch } = self;
        let reference = grip.reference(&asked(goal), contact, touch, &mut { motion }, config, &mut limits);
        (reference, limits.0)
    }

    /// The travel at which a release rests: there the reference changes its sign.
    fn rest_mm(&self, contact: &Contact, config: &Config) -> f64 {
        let forward = |travel_mm: f64| {
            let mut hand = *self;
            let mut limits = Limits::default();
            let mut motion = at(mm(travel_mm));
            let Self { grip, touch } = &mut hand;
            let reference = grip.reference(&asked(Newtons::ZERO), contact, touch, &mut motion, config, &mut limits);
            reference.speed > MillimetresPerSecond::ZERO
        };
        let (mut back_mm, mut front_mm) = (-60.0, 20.0);
        while front_mm - back_mm > 1e-4 {
            let middle_mm = f64::midpoint(back_mm, front_mm);
            *(if forward(middle_mm) { &mut back_mm } else { &mut front_mm }) = middle_mm;
        }
        front_mm
    }
}

#[test]
fn an_approach_goes_slowly_and_over_its_whole_distance() {
    let config = config();
    for force_mn in [40, 500, 7_000] {
        for motion in [at(mm(4.0)), calm_at(mm(4.0), &config)] {
            let mut hand = Hand::free(&config);
            let (reference, flags) = hand.frame(force_mn, &Contact::default(), motion, &config);
            let distance = config.tip.indentation(newtons(force_mn));
            assert_eq!((reference, flags), over(distance, Millimetres::ZERO, config.approach, motion, &config));
            assert!(reference.speed <= config.approach && reference.speed > MillimetresPerSecond::ZERO);
            assert_eq!(hand.grip.mode(&hand.touch), Mode::Approach);
        }
    }
}

#[test]
fn a_hold_goes_quickly_over_what_is_left() {
    let config = config();
    let (hand, held, travel) = Hand::pressing(&config);
    assert_eq!(hand.grip.mode(&hand.touch), Mode::Force);
    for force_mn in [200, 1_000, 1_001] {
        let distance = minus(config.tip.indentation(newtons(force_mn)), held.indentation);
        for motion in [at(travel), calm_at(travel, &config)] {
            let got = { hand }.frame(force_mn, &held, motion, &config);
            assert_eq!(got, over(distance, SLACK, config.speed_max, motion, &config), "{force_mn} mN");
        }
    }
    assert!(is_fast({ hand }.frame(7_000, &held, at(travel), &config).0));
}

/// Indentation at which a shorted motor stops that goes into a contact with this speed: by the motor's damping, its
/// friction and the contact.
fn stops_mm(from_mm: f64, speed: MillimetresPerSecond, config: &Config) -> f64 {
    let c_per_s = f64::from(config.damping_q17_per_s) / 131_072.0;
    let mm_per_s2_per_n = f64::from(config.bounds.acceleration_per_n) / 256.0;
    let friction_n = 1e-6 * f64::from(config.params.friction_unm) * f64::from(config.params.reduction_mrad_per_mm);
    let (mut d_mm, mut mm_per_s) = (from_mm, speed.0.to_num::<f64>());
    let step_s = 1e-6;
    while mm_per_s > 0.0 {
        let force_n: f64 = config.tip.force(mm(d_mm)).0.to_num();
        mm_per_s -= (c_per_s * mm_per_s + mm_per_s2_per_n * (force_n + friction_n)) * step_s;
        d_mm += mm_per_s * step_s;
    }
    d_mm
}

/// Forward, beyond the speed of an approach: the speed from which a shorted motor alone would coast 1.25 times the
/// indentation that is left below 1.3 times the goal and 0.4 N, and not less where nothing else limits it. The contact
/// brakes the rest.
#[test]
fn a_shorted_motor_stops_within_three_tenths_and_four_tenths_of_a_newton() {
    let config = config();
    let mut bounded = 0;
    for held_mn in [90, 200, 1_000, 3_000, 6_000] {
        let (hand, held, travel) = Hand::pressing_with(held_mn, &config);
        for goal_mn in [50, 300, 1_000, 2_000, 4_000, 7_000] {
            let (reference, _) = { hand }.frame(goal_mn, &held, at(travel), &config);
            if goal_mn <= held_mn || reference.speed <= config.approach {
                assert!(reference.speed <= config.approach, "{held_mn} to {goal_mn} mN: {reference:?}");
                continue;
            }
            let name = format!("{held_mn} to {goal_mn} mN");
            let goal = newtons(goal_mn);
            let most: f64 = config.tip.indentation(newtons(goal_mn * 13 / 10 + 400)).0.to_num();
            let held_mm: f64 = held.indentation.0.to_num();
            let allowed_mm = 1.25 * (most - held_mm);
            let coasts_mm = coasts_mm(reference.speed, &config);
            assert!(coasts_mm <= allowed_mm + 1e-4, "{name}: {coasts_mm} of {allowed_mm} mm");
            let stops_mm = mm(stops_mm(held_mm, reference.speed, &config));
            // From a light contact the speed itself may not be stopped in time: the contact does not help enough.
            let most_n = 1.3e-3 * f64::from(goal_mn) + 0.4;
            let most_n = if held_mn < 1_000 { 1.4 * most_n } else { most_n };
            let stops_n: f64 = config.tip.force(stops_mm).0.to_num();
            assert!(stops_n <= most_n, "{name}: {stops_n} of {most_n} N");
            let distance = minus(config.tip.indentation(goal), held.indentation);
            let (unbounded, _) = over(distance, SLACK, config.speed_max, at(travel), &config);
            if reference != unbounded {
                assert!(coasts_mm >= allowed_mm - 1e-4, "{name}: {coasts_mm} of {allowed_mm} mm");
                bounded += 1;
            }
        }
    }
    assert!(bounded > 0, "the bound never applied");
}

/// The tactile image shows the middle of the scan; the tip has moved for half a frame since then.
#[test]
fn the_motion_since_the_scan_counts() {
    let config = config();
    let (mut hand, held, travel) = Hand::pressing(&config);
    for mm_per_s in [-80, 40] {
        let mut motion = at(travel);
        motion.observer.speed = MillimetresPerSecond::from_bits(mm_per_s << 16);
        let frame_s = f64::from(config.frame_s_q39) / 2_f64.powi(39);
        let distance = minus(config.tip.indentation(newtons(900)), held.indentation);
        let distance = minus(distance, mm(f64::from(mm_per_s) * frame_s / 2.0));
        let (reference, _) = hand.frame(900, &held, motion, &config);
        let (expected, _) = over(distance, Millimetres::ZERO, config.speed_max, motion, &config);
        assert!((reference.speed.to_bits() - expected.speed.to_bits()).abs() < 10, "{reference:?}, {expected:?}");
    }
}

/// Of the distance that the tip moved beyond the indentation since the touch, the share of the uncertainty counts as
/// indentation.
#[test]
fn an_uncertain_force_takes_the_tip_to_be_as_deep_as_it_moved() {
    let config = config();
    let (hand, held, travel) = Hand::pressing(&config);
    let deeper = mm(0.25);
    let motion = at(plus(travel, deeper));
    for (doubt, reported) in [(0, false), (1, false), (64, false), (127, false), (128, true), (255, true)] {
        let doubtful = Contact { doubt, ..held };
        let (reference, flags) = { hand }.frame(1_100, &doubtful, motion, &config);
        assert_eq!(flags & Limits::FROM_BELOW != 0, reported, "{doubt}");
        let distance = minus(config.tip.indentation(newtons(1_100)), held.indentation);
        let share = Millimetres::from_bits((i64::from(deeper.to_bits()) * i64::from(doubt) / 255) as i32);
        let distance = minus(distance, share);
        let limit = match (distance < Millimetres::ZERO, doubt) {
            (true, 0..=127) | (false, 0..32) => config.speed_max,
            (true, _) => slow_back(&config),
            (false, _) => config.approach,
        };
        let (expected, _) = over(distance, SLACK, limit, motion, &config);
        assert_eq!(reference, expected, "{doubt}");
    }
    // A tip that moved less than its indentation cannot be deeper than that.
    let before = at(minus(travel, mm(0.1)));
    let reference = |doubt| { hand }.frame(900, &Contact { doubt, ..held }, before, &config).0;
    assert_eq!(reference(255), reference(0));
}

/// A tip still moves at full speed forward up to an eighth of uncertainty.
#[test]
fn more_than_an_eighth_of_uncertainty_is_slow_forward() {
    let config = config();
    let (hand, held, travel) = Hand::pressing(&config);
    for (doubt, fast) in [(31, true), (32, false), (255, false)] {
        let (reference, _) = { hand }.frame(6_000, &Contact { doubt, ..held }, at(travel), &config);
        assert_eq!(is_fast(reference), fast, "{doubt}: {reference:?}");
    }
}

/// Speed limit on the way back from a force that the array hardly shows, and behind the surface: 1.25 times the approach.
fn slow_back(config: &Config) -> MillimetresPerSecond {
    MillimetresPerSecond(config.approach.0 * 5 / 4)
}

/// A tip moves back at full speed up to half of the uncertainty, and only in front of the surface.
#[test]
fn half_of_the_uncertainty_and_a_place_behind_the_surface_are_slow_back() {
    let config = config();
    let (hand, held, travel) = Hand::pressing(&config);
    let behind = Millimetres::from_bits(mm(5.0).to_bits() - 1);
    for (doubt, travel, full) in [
        (0, travel, true),
        (127, travel, true),
        (128, travel, false),
        (255, travel, false),
        (0, mm(5.0), true),
        (0, behind, false),
        (0, mm(3.0), false),
    ] {
        let got = { hand }.frame(40, &Contact { doubt, ..held }, at(travel), &config).0;
        let distance = minus(config.tip.indentation(newtons(40)), held.indentation);
        let limit = if full { config.speed_max } else { slow_back(&config) };
        assert_eq!(got, over(distance, SLACK, limit, at(travel), &config).0, "{doubt} at {travel:?}");
        assert!(is_fast(got), "faster than an approach: {got:?}");
    }
}

/// Twice its indentation and 0.3 mm forward, five times on the way back.
#[test]
fn a_tip_farther_in_than_the_array_confirms_is_slow() {
    let config = config();
    let (hand, held, travel) = Hand::pressing(&config);
    let depth_mm: f64 = held.indentation.0.to_num();
    for (goal_mn, times) in [(6_000, 2.0), (40, 5.0)] {
        for (deep_mm, fast) in [(times * depth_mm + 0.299, true), (times * depth_mm + 0.301, false)] {
            let (reference, _) = { hand }.frame(goal_mn, &held, at(mm(5.0 + deep_mm)), &config);
            assert_eq!(is_fast(reference), fast, "{deep_mm} mm in, {goal_mn} mN: {reference:?}");
        }
    }
    // A force that ends slowly ends the contact: an approach follows.
    let mut hand = hand;
    for force_mn in (14..1_000).rev().step_by(29) {
        hand.frame(6_000, &contact(force_mn, &config), at(travel), &config);
    }
    let lost = contact(14, &config);
    let got = hand.frame(6_000, &lost, at(travel), &config);
    assert_eq!((hand.touch.stage(), hand.grip.mode(&hand.touch)), (Stage::Lost, Mode::Approach));
    let distance = config.tip.indentation(newtons(6_000));
    assert_eq!(got, over(distance, Millimetres::ZERO, config.approach, at(travel), &config));
}

#[test]
fn a_force_counts_from_the_end_of_a_contact_on() {
    let config = config();
    let off = config.contact_off;
    let goal = config.tip.indentation(config.contact_on);
    let motion = calm_at(mm(1.0), &config);
    for (force, indented) in [(off, true), (Newtons::from_bits(off.to_bits() - 1), false), (Newtons::ZERO, false)] {
        let seen = Contact { force, indentation: mm(0.1), ..Contact::default() };
        let got = Hand::free(&config).frame_of(config.contact_on, &seen, motion, &config);
        let distance = if indented { minus(goal, mm(0.1)) } else { goal };
        assert_eq!(got, over(distance, Millimetres::ZERO, config.approach, motion, &config), "{force:?}");
        assert!(got.0.speed < config.approach, "{force:?}");
    }
}

#[test]
fn a_goal_is_held_between_the_least_contact_and_the_largest_force() {
    let config = config();
    let (hand, held, travel) = Hand::pressing(&config);
    let most = config.force_max.min(config.force_seen);
    let asks = |goal: Newtons| { hand }.frame_of(goal, &held, at(travel), &config);
    for goal in [config.contact_on, most, newtons(2_000)] {
        assert_eq!(asks(goal).1 & Limits::GOAL, 0, "{goal:?}");
    }
    for (goal, held) in [
        (Newtons::from_bits(config.contact_on.to_bits() - 1), config.contact_on),
        (Newtons::from_bits(1), config.contact_on),
        (Newtons::from_bits(most.to_bits() + 1), most),
        (Newtons::from_bits(i32::MAX), most),
    ] {
        let (expected, flags) = asks(held);
        assert_eq!(asks(goal), (expected, flags | Limits::GOAL));
    }
    // The converter may see less than what is allowed.
    let blind = Config { force_seen: newtons(1_500), ..config.clone() };
    let (seen, flags) = { hand }.frame(1_500, &held, at(travel), &blind);
    let more = { hand }.frame(1_501, &held, at(travel), &blind);
    assert_eq!(more, (seen, flags | Limits::GOAL));
}

#[test]
fn no_distance_goes_beyond_the_end_of_the_travel() {
    let config = config();
    let distance = config.tip.indentation(newtons(5_000));
    for (left, cut) in
        [(distance, false), (Millimetres::from_bits(distance.to_bits() - 1), true), (Millimetres::ZERO, true)]
    {
        let motion = at(minus(config.travel_max, left));
        let (reference, flags) = Hand::free(&config).frame(5_000, &Contact::default(), motion, &config);
        let (expected, _) = over(left, Millimetres::ZERO, config.approach, motion, &config);
        assert_eq!((reference, flags & Limits::TRAVEL != 0), (expected, cut), "{left:?}");
    }
}

/// No object leaves at metres in a second: the loop keeps the force of before the step, and does not press harder.
#[test]
fn a_force_that_falls_by_a_quarter_in_a_frame_is_withheld() {
    let config = config();
    let (hand, held, travel) = Hand::pressing(&config);
    let motion = at(travel);
    // A quarter of 1 N and the 40 mN of a contact.
    for (left_mn, withheld) in [(711, false), (709, true), (300, true), (0, true)] {
        let mut hand = hand;
        let left = contact(left_mn, &config);
        let (reference, _) = hand.frame(1_000, &left, motion, &config);
        let expected = if withheld { held.force.0 - left.force.0 } else { Newtons::ZERO.0 };
        assert_eq!(hand.touch.withheld(), Newtons(expected), "{left_mn} mN");
        let presses = reference.speed > MillimetresPerSecond::from_bits(1 << 12);
        assert_eq!(presses, !withheld, "{left_mn} mN: {reference:?}");
        // The signal returns: what it shows counts again.
        hand.frame(1_000, &held, motion, &config);
        assert_eq!(hand.touch.withheld(), Newtons::ZERO, "{left_mn} mN");
    }
}

/// The lesser of the last two frames counts: interference that adds to one frame leaves no step behind.
#[test]
fn a_frame_that_reads_too_much_is_no_reference() {
    let config = config();
    let (hand, _, travel) = Hand::pressing(&config);
    for (frames_mn, withheld_mn) in [
        (&[5_000, 1_000][..], 0),
        (&[1_300, 1_000], 0),
        (&[5_000, 1_000, 5_000, 1_000, 1_000], 0),
        (&[5_000, 5_000, 1_000], 4_000),
        // Beside it, what falls counts.
        (&[5_000, 1_000, 1_000, 0], 1_000),
        (&[5_000, 1_000, 700], 300),
        (&[5_000, 1_000, 720], 0),
    ] {
        let mut hand = hand;
        for force_mn in frames_mn {
            hand.frame(1_000, &contact(*force_mn, &config), at(travel), &config);
        }
        let withheld_n: f64 = hand.touch.withheld().0.to_num();
        assert!((1e3 * withheld_n - f64::from(withheld_mn)).abs() < 0.1, "{frames_mn:?} mN: {withheld_n} N");
        assert_eq!(hand.touch.stage(), Stage::Held, "{frames_mn:?} mN");
    }
    // One frame of a contact is no reference either.
    let mut hand = Hand::free(&config);
    hand.frame(1_000, &contact(1_000, &config), at(travel), &config);
    hand.frame(1_000, &contact(300, &config), at(travel), &config);
    assert_eq!(hand.touch.withheld(), Newtons::ZERO);
}

/// Taxels that fail take their force with them, and bring it back; only in that frame a step does not count.
#[test]
fn a_step_with_other_bad_taxels_is_not_withheld() {
    let config = config();
    let (hand, _, travel) = Hand::pressing(&config);
    let seen = |force_mn, bad_taxels| Contact { bad_taxels, ..contact(force_mn, &config) };
    for (frames, withheld_mn) in [
        (&[(500, 1)][..], 0),
        (&[(500, 1), (500, 1), (500, 1)], 0),
        (&[(500, 1), (1_000, 0), (500, 1), (1_000, 0), (1_000, 0)], 0),
        (&[(500, 1), (200, 1)], 300),
        (&[(500, 1), (200, 2)], 0),
        (&[(500, 0)], 500),
    ] {
        let mut hand = hand;
        for (force_mn, bad_taxels) in frames {
            hand.frame(1_000, &seen(*force_mn, *bad_taxels), at(travel), &config);
        }
        let withheld_n: f64 = hand.touch.withheld().0.to_num();
        assert!((1e3 * withheld_n - f64::from(withheld_mn)).abs() < 0.1, "{frames:?}: {withheld_n} N");
    }
}

/// Within a frame of more than 0.5 ms an object can leave: its contact is lost, and an approach follows at once.
#[test]
fn a_step_in_a_slow_frame_is_not_withheld() {
    let mut config = config();
    for (frame_ns, withheld) in [(500_000, true), (500_001, false), (2_000_000, false)] {
        config.timing.frame_ns = frame_ns;
        let (mut hand, held, travel) = Hand::pressing(&config);
        hand.frame(1_000, &Contact::default(), at(travel), &config);
        let expected = if withheld { (held.force, Stage::Held) } else { (Newtons::ZERO, Stage::Lost) };
        assert_eq!((hand.touch.withheld(), hand.touch.stage()), expected, "{frame_ns} ns");
    }
}

/// A doubtful touch whose force rises above its least by that of a contact is held again. It keeps its place and its
/// largest force until the force rises further, and lasts for longer than noise.
#[test]
fn a_force_that_returns_is_held_again() {
    let config = config();
    let (mut hand, held, travel) = Hand::pressing(&config);
    let least = Contact { force: config.contact_on, ..contact(40, &config) };
    let none = Contact::default();
    while hand.touch.stage() == Stage::Held {
        hand.frame(1_000, &none, at(travel), &config);
    }
    for seen in [none, least, none, least] {
        hand.frame(1_000, &seen, at(travel), &config);
        assert_eq!((hand.touch.stage(), hand.grip.mode(&hand.touch)), (Stage::Doubtful, Mode::Release));
    }
    for force_mn in [41, 1_000, 3_000] {
        let mut hand = hand;
        let seen = contact(force_mn, &config);
        hand.frame(1_000, &seen, at(travel), &config);
        assert_eq!((hand.touch.stage(), hand.grip.mode(&hand.touch)), (Stage::Held, Mode::Force), "{force_mn} mN");
        let [surface, here] = [mm(5.0), minus(travel, seen.indentation)];
        assert_eq!((hand.touch.surface(), hand.touch.placed()), (Some(surface), false), "{force_mn} mN");
        assert_eq!((hand.touch.peak(), hand.touch.withheld()), (held.force, Newtons::ZERO), "{force_mn} mN");
        // Noise is not longer than 3 ms, neither before nor after the force rises.
        let frames = 3_000_000 / config.timing.frame_ns;
        for _ in 0..frames {
            hand.frame(1_000, &seen, at(travel), &config);
        }
        let more = contact(force_mn + 41, &config);
        for frame in 0..=frames {
            hand.frame(1_000, &more, at(plus(travel, minus(more.indentation, seen.indentation))), &config);
            assert_eq!(hand.touch.placed(), frame == frames, "{force_mn} mN, frame {frame}");
        }
        assert_eq!((hand.touch.surface(), hand.touch.placed()), (Some(here), true), "{force_mn} mN");
        assert_eq!(hand.touch.peak(), more.force, "{force_mn} mN");
    }
}

/// After a step, up to a quarter of the largest force counts as a residue, and the touch becomes doubtful. It is held again
/// only above the least force that was read since then.
#[test]
fn a_residue_after_a_step_is_doubtful_until_the_force_rises() {
    let config = config();
    let (pressing, _, travel) = Hand::pressing(&config);
    let frames = |hand: &mut Hand, time_ns: u32, force_mn| {
        for _ in 0..time_ns / config.timing.frame_ns {
            hand.frame(1_000, &contact(force_mn, &config), at(travel), &config);
        }
    };
    for (left_mn, stage) in
        [(0, Stage::Doubtful), (14, Stage::Doubtful), (249, Stage::Doubtful), (251, Stage::Held), (600, Stage::Held)]
    {
        let mut hand = pressing;
        frames(&mut hand, 4_000_000, left_mn);
        assert_eq!(hand.touch.stage(), stage, "{left_mn} mN");
    }
    let mut hand = pressing;
    frames(&mut hand, 4_000_000, 200);
    // The least force follows the residue down, and not up again.
    for (residue_mn, least_mn) in [(200, 200), (230, 200), (100, 100), (130, 100)] {
        frames(&mut hand, 1_000_000, residue_mn);
        for (more_mn, stage) in [(39, Stage::Doubtful), (41, Stage::Held)] {
            let mut hand = hand;
            hand.frame(1_000, &contact(least_mn + more_mn, &config), at(travel), &config);
            assert_eq!(hand.touch.stage(), stage, "{more_mn} mN above {least_mn} mN");
        }
    }
}

/// A tip that cannot back off gives a doubtful touch up half a second after the force was last read, and seeks again.
#[test]
fn a_doubtful_touch_is_given_up_after_half_a_second() {
    let config = config();
    let (mut hand, _, travel) = Hand::pressing(&config);
    let mut time_ns = 0;
    while hand.touch.stage() != Stage::None {
        hand.frame(1_000, &Contact::default(), at(travel), &config);
        time_ns += config.timing.frame_ns;
        assert!(time_ns < 510_000_000, "{:?} after {time_ns} ns", hand.touch.stage());
    }
    assert!(time_ns > 500_000_000, "{time_ns} ns");
    assert_eq!(hand.grip.mode(&hand.touch), Mode::Approach);
}

/// A force that stays away for 3 ms is doubtful; the finger releases, and then seeks again.
#[test]
fn a_force_that_stays_away_is_released_and_sought_again() {
    let config = config();
    let (mut hand, _, travel) = Hand::pressing(&config);
    let none = Contact::default();
    let mut time_ns = 0;
    while hand.grip.mode(&hand.touch) == Mode::Force {
        let (reference, _) = hand.frame(1_000, &none, at(travel), &config);
        assert!(reference.speed <= MillimetresPerSecond::from_bits(1 << 12), "it presses after {time_ns} ns");
        time_ns += config.timing.frame_ns;
    }
    assert!((3_000_000..3_300_000).contains(&time_ns), "{time_ns} ns");
    assert_eq!((hand.touch.stage(), hand.grip.mode(&hand.touch)), (Stage::Doubtful, Mode::Release));
    assert!((hand.rest_mm(&none, &config) - 4.0).abs() < 0.01);
    for _ in 0..2 {
        hand.frame(1_000, &none, at(mm(4.0)), &config);
    }
    assert_eq!((hand.touch.stage(), hand.grip.mode(&hand.touch)), (Stage::None, Mode::Approach));
}

/// To the clearance behind the surface; fast until the force is a quarter of the largest one, and never again then.
#[test]
fn a_release_goes_to_the_clearance_behind_the_surface() {
    let config = config();
    let (hand, _, travel) = Hand::pressing(&config);
    let mut released = hand;
    let mut goes = |force_mn: i32, from: Option<Millimetres>, limit| {
        let contact = contact(force_mn, &config);
        // The surface is at 5 mm.
        let from = from.unwrap_or(plus(mm(5.0), contact.indentation));
        let got = released.frame(0, &contact, at(from), &config);
        assert_eq!(released.grip.mode(&released.touch), Mode::Release);
        assert_eq!(got, over(minus(mm(4.0), from), config.count, limit, at(from), &config), "{force_mn} mN, {from:?}");
    };
    goes(1_000, Some(travel), config.speed_max);
    for force_mn in [800, 600, 450, 330, 251] {
        goes(force_mn, None, config.speed_max);
    }
    for force_mn in [249, 400, 600, 400, 250, 150, 80, 40, 20, 0] {
        goes(force_mn, None, config.approach);
    }
    for from_mm in [4.6, 4.0, 3.9] {
        goes(0, Some(mm(from_mm)), config.approach);
    }
    // Slow from the start where the contact is lost, and where most of the force was gone before.
    for left_mn in [249, 10] {
        let mut hand = hand;
        for force_mn in (left_mn..1_000).rev().step_by(40) {
            hand.frame(1_000, &contact(force_mn, &config), at(travel), &config);
        }
        let (reference, _) = hand.frame(0, &contact(left_mn, &config), at(travel), &config);
        assert!(!is_fast(reference), "{left_mn} mN");
    }
}

#[test]
fn a_release_never_goes_forward_and_without_a_touch_nowhere() {
    let config = config();
    let (mut hand, _, travel) = Hand::pressing(&config);
    for force_mn in (0..1_000).rev().step_by(27) {
        hand.frame(1_000, &contact(force_mn, &config), at(travel), &config);
    }
    assert_eq!(hand.touch.stage(), Stage::Lost);
    // Released when already farther back than the clearance: it stays there.
    for _ in 0..2 {
        let got = hand.frame(0, &Contact::default(), at(mm(2.0)), &config);
        assert_eq!(got.0.speed, MillimetresPerSecond::ZERO);
    }
    let got = Hand::free(&config).frame(0, &contact(39, &config), at(mm(7.0)), &config);
    assert_eq!(got.0.speed, MillimetresPerSecond::ZERO, "no surface is known");
}

/// The force that was there before torque may be a residue: it gets a place once it is exceeded, and its release is slow.
#[test]
fn a_touch_from_before_torque_has_no_place_until_its_force_rises() {
    let config = config();
    for (force_mn, known) in [(39, false), (40, true), (2_000, true)] {
        let mut hand = Hand { grip: Grip::default(), touch: Touch::default() };
        let held = contact(force_mn, &config);
        hand.frame(force_mn, &held, at(Millimetres::ZERO), &config);
        assert_eq!(hand.touch.surface().is_some(), known, "{force_mn} mN");
        assert!(!hand.touch.placed());
        if !known {
            continue;
        }
        // The surface moves with the tip, and the tip is slow forward and back.
        let more = contact(force_mn + 39, &config);
        hand.frame(7_000, &more, at(mm(3.0)), &config);
        let (reference, _) = hand.frame(7_000, &more, at(mm(3.0)), &config);
        assert!(!hand.touch.placed() && !is_fast(reference), "{force_mn} mN");
        assert_eq!(hand.touch.surface(), Some(minus(mm(3.0), more.indentation)));
        let mut released = hand;
        assert!(!is_fast(released.frame(0, &more, at(mm(3.0)), &config).0));
        // Above it by the force of a contact: from here on the surface stays. What this force presses deeper than the
        // last one does not move it back.
        let surface = hand.touch.surface();
        for travel_mm in [3.0, 3.1] {
            hand.frame(7_000, &contact(force_mn + 41, &config), at(mm(travel_mm)), &config);
            assert!(hand.touch.placed(), "{force_mn} mN");
            assert_eq!(hand.touch.surface(), surface, "{force_mn} mN at {travel_mm} mm");
        }
    }
}

/// A surface without a place moves forward with the tip, and back only where a release finds that the force falls: an
/// object that follows the tip does that, a residue does not.
#[test]
fn a_surface_without_a_place_moves_back_only_where_the_force_falls() {
    let config = config();
    let mut hand = Hand { grip: Grip::default(), touch: Touch::default() };
    let held = contact(1_000, &config);
    for (travel_mm, farthest_mm) in [(0.0, 0.0), (2.0, 2.0), (1.0, 2.0), (-1.0, 2.0), (2.5, 2.5)] {
        hand.frame(1_000, &held, at(mm(travel_mm)), &config);
        assert!(!hand.touch.placed());
        assert_eq!(hand.touch.surface(), Some(minus(mm(farthest_mm), held.indentation)), "at {travel_mm} mm");
    }
    let surface = hand.touch.surface();
    // In thousandths of a newton for a millimetre back: half a millimetre must lower 1 N by 0.1 N.
    for (falls, follows) in [(0.0, false), (190.0, false), (210.0, true), (400.0, true)] {
        let mut hand = hand;
        for back_um in 0..1_000 {
            let travel = mm(2.5 - 1e-3 * f64::from(back_um));
            let seen = contact((1_000.0 - 1e-3 * falls * f64::from(back_um)) as i32, &config);
            hand.frame(0, &seen, at(travel), &config);
            let (found, name) = (hand.touch.surface(), format!("{falls} mN/mm, {back_um} um back"));
            if back_um <= 500 || !follows {
                assert_eq!(found, surface, "{name}");
            } else if back_um == 501 {
                assert_eq!(found, Some(minus(travel, seen.indentation)), "{name}");
            }
        }
    }
}

/// What the array reads while the tip moves back from `from_mm`, as a function of the distance moved; the place of rest.
fn released_mm(mut hand: Hand, from_mm: f64, force_mn: impl Fn(f64) -> f64, config: &Config) -> f64 {
    let mut travel_mm = from_mm;
    // 30 mm/s, a frame of 0.1 ms.
    loop {
        let seen = contact(force_mn(from_mm - travel_mm) as i32, config);
        let (reference, _) = hand.frame(0, &seen, at(mm(travel_mm)), config);
        if reference.speed >= MillimetresPerSecond::ZERO || travel_mm < from_mm - 25.0 {
            return travel_mm;
        }
        travel_mm -= 0.003;
    }
}

/// An object that follows the tip is released as long as each half millimetre lowers its force by 1/64 and a bit.
#[test]
fn a_release_moves_back_while_the_force_falls() {
    let config = config();
    let (hand, held, travel) = Hand::pressing(&config);
    let (from_mm, depth_mm): (f64, f64) = (travel.0.to_num(), held.indentation.0.to_num());
    let at_once = |back_mm: f64| 1_000.0 * (1.0 - back_mm / depth_mm).max(0.0).powi(2);
    let rest_mm = released_mm(hand, from_mm, at_once, &config);
    assert!((rest_mm - 4.0).abs() < 0.02, "{rest_mm} mm");
    // It yields 5 mm: the tip goes on to where the force ends.
    let rest_mm = released_mm(hand, from_mm, |back_mm| 1_000.0 * (1.0 - back_mm / 5.0).max(0.0), &config);
    assert!((from_mm - 6.0 - depth_mm..from_mm - 5.5).contains(&rest_mm), "{rest_mm} mm");
    // A residue stays: it may hide by how much it indents the tip, and no more.
    for residue_mn in [50.0, 200.0] {
        let left = |back_mm: f64| at_once(back_mm).max(residue_mn);
        let rest_mm = released_mm(hand, from_mm, left, &config);
        let hidden_mm: f64 = config.tip.indentation(newtons(residue_mn as i32)).0.to_num();
        let name = format!("a residue of {residue_mn} mN: {rest_mm} mm");
        assert!((4.0 - hidden_mm - 0.02..4.02).contains(&rest_mm), "{name}");
    }
}

/// A residue from before torque does not make the tip go back for ever.
#[test]
fn a_residue_from_before_torque_does_not_move_the_place_of_rest_for_ever() {
    let config = config();
    for residue_mn in [50.0, 200.0] {
        let mut hand = Hand { grip: Grip::default(), touch: Touch::default() };
        hand.see(&contact(residue_mn as i32, &config), at(Millimetres::ZERO), &config);
        let rest_mm = released_mm(hand, 0.0, |_| residue_mn, &config);
        let depth_mm: f64 = config.tip.indentation(newtons(residue_mn as i32)).0.to_num();
        assert!(rest_mm >= -depth_mm - 1.7, "a residue of {residue_mn} mN: {rest_mm} mm");
    }
}

/// Behind half of the clearance what the array reads is a residue, which the baseline may learn; never while it presses.
#[test]
fn only_behind_the_surface_the_baseline_learns_a_residue() {
    let config = config();
    let (mut hand, held, travel) = Hand::pressing(&config);
    let learns = |hand: &Hand, force_mn| hand.touch.learns(newtons(force_mn), 10, &config).is_some();
    assert!(!learns(&hand, 1_000) && !learns(&hand, 0));
    // A residue of 30 mN: less than a contact, so it moves nothing.
    let (mut back_mm, from_mm): (f64, f64) = (0.0, travel.0.to_num());
    let depth_mm: f64 = held.indentation.0.to_num();
    while from_mm - back_mm > 4.52 {
        let force_mn = (1_000.0 * (1.0 - back_mm / depth_mm).max(0.0).powi(2)).max(30.0);
        hand.frame(0, &contact(force_mn as i32, &config), at(mm(from_mm - back_mm)), &config);
        assert!(!learns(&hand, 30), "{back_mm} mm back");
        back_mm += 0.003;
    }
    for from_mm in [4.48, 4.47] {
        hand.frame(0, &contact(30, &config), at(mm(from_mm)), &config);
    }
    assert_eq!(hand.touch.stage(), Stage::Clear);
    // Up to a quarter of what was held.
    assert!(learns(&hand, 30) && learns(&hand, 250) && !learns(&hand, 251));
    // 40 mN more than that are another touch.
    hand.frame(0, &contact(69, &config), at(mm(4.4)), &config);
    assert!(learns(&hand, 30));
    hand.frame(0, &contact(71, &config), at(mm(4.4)), &config);
    assert!(hand.touch.held() && !learns(&hand, 30));
}
