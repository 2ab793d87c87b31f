//! Speed reference of an approach and a hold; in the modules that of a release, and the touch that both start from.

mod touch;

use super::{config, mm};
use crate::common::*;
use fingertip::config::Config;
use fingertip::control::Reference;
use fingertip::grip::{Goal, Grip};
use fingertip::touch::{Stage, Touch, TouchInputs};
use std::sync::LazyLock;

/// The reference finger.
static CONFIG: LazyLock<Config> = LazyLock::new(config);

/// Position error that a calm loop accepts: 0.4 um.
const SLACK: Millimetres = Millimetres::from_bits((1 << 24) / 2_500);

/// A contact of this force that the array sees completely.
fn contact(force_mn: i32) -> Contact {
    let force = newtons(force_mn);
    Contact { force, indentation: CONFIG.tip.indentation(force), confidence: 255, ..Contact::default() }
}

/// The tip at rest at a travel.
fn at(travel: Millimetres) -> SpeedLoop {
    let mut motion = SpeedLoop::new();
    motion.observer.travel = travel;
    motion
}

/// The tip at rest for a while.
fn calm_at(travel: Millimetres) -> SpeedLoop {
    let mut motion = at(travel);
    for _ in 0..10 * CONFIG.settled_frames {
        motion.schedule.note(Millimetres::ZERO, &CONFIG);
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
fn over(distance: Millimetres, slack: Millimetres, limit: MillimetresPerSecond, motion: SpeedLoop) -> (Reference, u16) {
    let (reference, limited) = { motion }.towards(distance, slack, limit, &CONFIG);
    (reference, if limited { Limits::SPEED } else { 0 })
}

fn is_fast(reference: Reference) -> bool {
    reference.speed.0.to_num::<f64>().abs() > 31.0
}

/// A grip with its touch, frame by frame.
#[derive(Clone, Copy)]
struct Hand {
    grip: Grip,
    touch: Touch,
    config: &'static Config,
}

impl Hand {
    /// Before the first frame.
    fn new() -> Self {
        Self { grip: Grip::default(), touch: Touch::default(), config: &CONFIG }
    }

    /// Nothing touches.
    fn free() -> Self {
        let mut hand = Self::new();
        hand.see(&Contact::default(), at(mm(4.0)));
        hand
    }

    fn pressing() -> (Self, Contact, Millimetres) {
        Self::pressing_with(1_000)
    }

    /// Presses with this force on a surface that it found at 5 mm; the contact and the travel.
    fn pressing_with(force_mn: i32) -> (Self, Contact, Millimetres) {
        let mut hand = Self::free();
        // The weakest contact comes first: the place of a touch is known only after its force has risen.
        let least = Contact { force: CONFIG.contact_on, ..contact(40) };
        hand.frame(force_mn, &least, at(plus(mm(5.0), least.indentation)));
        assert!(hand.touch.held() && !hand.touch.placed());
        let held = contact(force_mn);
        let travel = plus(mm(5.0), held.indentation);
        // Two frames: one alone is no reference for a step.
        for _ in 0..2 {
            hand.frame(force_mn, &held, at(travel));
        }
        assert!(hand.touch.placed());
        (hand, held, travel)
    }

    fn see(&mut self, contact: &Contact, motion: SpeedLoop) {
        let presses = self.grip.mode(&self.touch) != Mode::Release;
        let felt = TouchInputs { contact, summed: contact.force, travel: motion.observer.travel, presses };
        self.touch.observe(&felt, || Millimetres::ZERO, self.config);
    }

    /// A frame; the reference, and the flags that it sets.
    fn frame(&mut self, goal_mn: i32, contact: &Contact, motion: SpeedLoop) -> (Reference, u16) {
        self.frame_of(newtons(goal_mn), contact, motion)
    }

    fn frame_of(&mut self, goal: Newtons, contact: &Contact, motion: SpeedLoop) -> (Reference, u16) {
        self.see(contact, motion);
        self.reference(goal, contact, motion)
    }

    fn reference(&mut self, force: Newtons, contact: &Contact, motion: SpeedLoop) -> (Reference, u16) {
        let (goal, mut limits) = (Goal { force, drift: Newtons::ZERO }, Limits::default());
        let reference = self.grip.reference(&goal, contact, &mut self.touch, &mut { motion }, self.config, &mut limits);
        (reference, limits.0)
    }

    /// The travel at which a release rests: there the reference changes its sign.
    fn rest_mm(&self, contact: &Contact) -> f64 {
        let forward = |travel_mm: f64| {
            let (reference, _) = { *self }.reference(Newtons::ZERO, contact, at(mm(travel_mm)));
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
    for force_mn in [40, 500, 7_000] {
        for motion in [at(mm(4.0)), calm_at(mm(4.0))] {
            let mut hand = Hand::free();
            let (reference, flags) = hand.frame(force_mn, &Contact::default(), motion);
            let distance = CONFIG.tip.indentation(newtons(force_mn));
            assert_eq!((reference, flags), over(distance, Millimetres::ZERO, CONFIG.approach, motion));
            assert!(reference.speed <= CONFIG.approach && reference.speed > MillimetresPerSecond::ZERO);
            assert_eq!(hand.grip.mode(&hand.touch), Mode::Approach);
        }
    }
}

#[test]
fn a_hold_goes_quickly_over_what_is_left() {
    let (hand, held, travel) = Hand::pressing();
    assert_eq!(hand.grip.mode(&hand.touch), Mode::Force);
    for force_mn in [200, 1_000, 1_001] {
        let distance = minus(CONFIG.tip.indentation(newtons(force_mn)), held.indentation);
        for motion in [at(travel), calm_at(travel)] {
            let got = { hand }.frame(force_mn, &held, motion);
            assert_eq!(got, over(distance, SLACK, CONFIG.speed_max, motion), "{force_mn} mN");
        }
    }
    assert!(is_fast({ hand }.frame(7_000, &held, at(travel)).0));
}

/// Forward, a shorted motor alone would coast from the speed limit by 1.25 times the indentation left until 1.3 times
/// the goal plus 0.4 N; the contact brakes the rest, as a test of the force loop shows. The limit is not lower unless
/// another one acts.
#[test]
fn a_shorted_motor_would_coast_by_a_quarter_more_than_the_indentation_left() {
    let mut bounded = 0;
    for held_mn in [90, 200, 1_000, 3_000, 6_000] {
        let (hand, held, travel) = Hand::pressing_with(held_mn);
        for goal_mn in [50, 300, 1_000, 2_000, 4_000, 7_000] {
            let (reference, _) = { hand }.frame(goal_mn, &held, at(travel));
            if goal_mn <= held_mn || reference.speed <= CONFIG.approach {
                assert!(reference.speed <= CONFIG.approach, "{held_mn} to {goal_mn} mN: {reference:?}");
                continue;
            }
            let name = format!("{held_mn} to {goal_mn} mN");
            let most: f64 = CONFIG.tip.indentation(newtons(goal_mn * 13 / 10 + 400)).0.to_num();
            let held_mm: f64 = held.indentation.0.to_num();
            let allowed_mm = 1.25 * (most - held_mm);
            // By the damping alone.
            let coasts_mm = reference.speed.0.to_num::<f64>() / (f64::from(CONFIG.damping_q17_per_s) / 131_072.0);
            assert!(coasts_mm <= allowed_mm + 1e-4, "{name}: {coasts_mm} of {allowed_mm} mm");
            let distance = minus(CONFIG.tip.indentation(newtons(goal_mn)), held.indentation);
            let (unbounded, _) = over(distance, SLACK, CONFIG.speed_max, at(travel));
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
    let (mut hand, held, travel) = Hand::pressing();
    for mm_per_s in [-80, 40] {
        let mut motion = at(travel);
        motion.observer.speed = MillimetresPerSecond::from_bits(mm_per_s << 16);
        let frame_s = f64::from(CONFIG.frame_s_q37) / 2_f64.powi(37);
        let distance = minus(CONFIG.tip.indentation(newtons(900)), held.indentation);
        let distance = minus(distance, mm(f64::from(mm_per_s) * frame_s / 2.0));
        let (reference, _) = hand.frame(900, &held, motion);
        let (expected, _) = over(distance, Millimetres::ZERO, CONFIG.speed_max, motion);
        assert!((reference.speed.to_bits() - expected.speed.to_bits()).abs() < 10, "{reference:?}, {expected:?}");
    }
}

/// The share of the uncertainty of the way beyond the indentation since the touch counts as indentation.
#[test]
fn an_uncertain_force_takes_the_tip_to_be_as_deep_as_it_moved() {
    let (hand, held, travel) = Hand::pressing();
    let deeper = mm(0.25);
    let motion = at(plus(travel, deeper));
    for (doubt, reported) in [(0, false), (1, false), (64, false), (127, false), (128, true), (255, true)] {
        let doubtful = Contact { doubt, ..held };
        let (reference, flags) = { hand }.frame(1_100, &doubtful, motion);
        assert_eq!(flags & Limits::FROM_BELOW != 0, reported, "{doubt}");
        let distance = minus(CONFIG.tip.indentation(newtons(1_100)), held.indentation);
        let share = Millimetres::from_bits((i64::from(deeper.to_bits()) * i64::from(doubt) / 255) as i32);
        let distance = minus(distance, share);
        let limit = match (distance < Millimetres::ZERO, doubt) {
            (true, 0..=127) | (false, 0..32) => CONFIG.speed_max,
            (true, _) => slow_back(),
            (false, _) => CONFIG.approach,
        };
        let (expected, _) = over(distance, SLACK, limit, motion);
        assert_eq!(reference, expected, "{doubt}");
    }
    // A tip that moved less than its indentation cannot be deeper than that.
    let before = at(minus(travel, mm(0.1)));
    let reference = |doubt| { hand }.frame(900, &Contact { doubt, ..held }, before).0;
    assert_eq!(reference(255), reference(0));
}

#[test]
fn more_than_an_eighth_of_uncertainty_is_slow_forward() {
    let (hand, held, travel) = Hand::pressing();
    for (doubt, fast) in [(31, true), (32, false), (255, false)] {
        let (reference, _) = { hand }.frame(6_000, &Contact { doubt, ..held }, at(travel));
        assert_eq!(is_fast(reference), fast, "{doubt}: {reference:?}");
    }
}

/// Speed limit of a retreat from a force that the array hardly shows, and behind the surface: 1.25 times the approach.
fn slow_back() -> MillimetresPerSecond {
    MillimetresPerSecond(CONFIG.approach.0 * 5 / 4)
}

/// A tip moves back at full speed up to half of the uncertainty, and only in front of the surface.
#[test]
fn half_of_the_uncertainty_and_a_place_behind_the_surface_are_slow_back() {
    let (hand, held, travel) = Hand::pressing();
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
        let got = { hand }.frame(40, &Contact { doubt, ..held }, at(travel)).0;
        let distance = minus(CONFIG.tip.indentation(newtons(40)), held.indentation);
        let limit = if full { CONFIG.speed_max } else { slow_back() };
        assert_eq!(got, over(distance, SLACK, limit, at(travel)).0, "{doubt} at {travel:?}");
        assert!(is_fast(got), "faster than an approach: {got:?}");
    }
}

/// Depth limit at full speed: 2 times the indentation and 0.3 mm forward, 5 times and 0.3 mm in a retreat.
#[test]
fn a_tip_farther_in_than_the_array_confirms_is_slow() {
    let (hand, held, travel) = Hand::pressing();
    let depth_mm: f64 = held.indentation.0.to_num();
    for (goal_mn, times) in [(6_000, 2.0), (40, 5.0)] {
        for (deep_mm, fast) in [(times * depth_mm + 0.299, true), (times * depth_mm + 0.301, false)] {
            let (reference, _) = { hand }.frame(goal_mn, &held, at(mm(5.0 + deep_mm)));
            assert_eq!(is_fast(reference), fast, "{deep_mm} mm in, {goal_mn} mN: {reference:?}");
        }
    }
    // A force that ends slowly ends the contact: an approach follows.
    let mut hand = hand;
    for force_mn in (14..1_000).rev().step_by(29) {
        hand.frame(6_000, &contact(force_mn), at(travel));
    }
    let lost = contact(14);
    let got = hand.frame(6_000, &lost, at(travel));
    assert_eq!((hand.touch.stage(), hand.grip.mode(&hand.touch)), (Stage::Lost, Mode::Approach));
    let distance = CONFIG.tip.indentation(newtons(6_000));
    assert_eq!(got, over(distance, Millimetres::ZERO, CONFIG.approach, at(travel)));
}

#[test]
fn a_force_counts_from_the_end_of_a_contact_on() {
    let off = CONFIG.contact_off;
    let goal = CONFIG.tip.indentation(CONFIG.contact_on);
    let motion = calm_at(mm(1.0));
    for (force, indented) in [(off, true), (Newtons::from_bits(off.to_bits() - 1), false), (Newtons::ZERO, false)] {
        let seen = Contact { force, indentation: mm(0.1), ..Contact::default() };
        let got = Hand::free().frame_of(CONFIG.contact_on, &seen, motion);
        let distance = if indented { minus(goal, mm(0.1)) } else { goal };
        assert_eq!(got, over(distance, Millimetres::ZERO, CONFIG.approach, motion), "{force:?}");
        assert!(got.0.speed < CONFIG.approach, "{force:?}");
    }
}

#[test]
fn no_distance_goes_beyond_the_end_of_the_travel() {
    let distance = CONFIG.tip.indentation(newtons(5_000));
    for (left, cut) in
        [(distance, false), (Millimetres::from_bits(distance.to_bits() - 1), true), (Millimetres::ZERO, true)]
    {
        let motion = at(minus(CONFIG.travel_max, left));
        let (reference, flags) = Hand::free().frame(5_000, &Contact::default(), motion);
        let (expected, _) = over(left, Millimetres::ZERO, CONFIG.approach, motion);
        assert_eq!((reference, flags & Limits::TRAVEL != 0), (expected, cut), "{left:?}");
    }
}
