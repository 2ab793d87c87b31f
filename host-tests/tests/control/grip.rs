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
        // Longer than a peak of noise.
        for _ in 0..=300_000 / CONFIG.timing.frame_ns {
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

/// It goes slowly over the whole distance, less the indentation of a force from the end of a contact on, and not beyond
/// the end of the travel.
#[test]
fn an_approach_goes_over_its_whole_distance() {
    let (none, zero, unit) = (Contact::default(), Millimetres::ZERO, Millimetres::from_bits(1));
    let seen = |force_bits| Contact { force: Newtons::from_bits(force_bits), indentation: mm(0.1), ..none };
    let (on, off) = (CONFIG.contact_on, CONFIG.contact_off.to_bits());
    let [deep, end] = [CONFIG.tip.indentation(newtons(5_000)), CONFIG.travel_max];
    for (force, contact, travel, less, cut) in [
        (newtons(40), none, mm(4.0), zero, false),
        (newtons(500), none, mm(4.0), zero, false),
        (newtons(7_000), none, mm(4.0), zero, false),
        (on, seen(off), mm(1.0), mm(0.1), false),
        (on, seen(off - 1), mm(1.0), zero, false),
        (on, seen(0), mm(1.0), zero, false),
        (newtons(5_000), none, minus(end, deep), zero, false),
        (newtons(5_000), none, plus(minus(end, deep), unit), unit, true),
        (newtons(5_000), none, end, deep, true),
    ] {
        for motion in [at(travel), calm_at(travel)] {
            let mut hand = Hand::free();
            let (reference, flags) = hand.frame_of(force, &contact, motion);
            let (expected, limited) = over(minus(CONFIG.tip.indentation(force), less), zero, CONFIG.approach, motion);
            let expected = (expected, limited | if cut { Limits::TRAVEL } else { 0 });
            assert_eq!((reference, flags), expected, "{force:?} from {travel:?}");
            assert!(reference.speed <= CONFIG.approach && hand.grip.mode(&hand.touch) == Mode::Approach);
        }
    }
}

/// Speed limit of a retreat from a force that the array hardly shows, and behind the surface: 1.25 times the approach.
fn slow_back() -> MillimetresPerSecond {
    MillimetresPerSecond(CONFIG.approach.0 * 5 / 4)
}

/// The share of the uncertainty of the way beyond the indentation since the touch counts as indentation. A tip is fast
/// only as deep as the array confirms (2 times the indentation and 0.3 mm forward, 5 times and 0.3 mm in a retreat);
/// forward up to an eighth of uncertainty; in a retreat up to half of it, and only in front of the surface.
#[test]
fn a_hold_is_fast_where_the_array_confirms_its_depth() {
    let (hand, held, _) = Hand::pressing();
    assert_eq!(hand.grip.mode(&hand.touch), Mode::Force);
    // Another image: one that the array repeats counts as late.
    let held = Contact { force: Newtons::from_bits(held.force.to_bits() + 1), ..held };
    let depth_mm: f64 = held.indentation.0.to_num();
    let confirmed = [2.0, 5.0].map(|times| times * depth_mm + 0.3);
    let deeps = [-2.0, 0.0, depth_mm - 0.1, depth_mm, depth_mm + 0.25].into_iter();
    let deeps = deeps.chain(confirmed.into_iter().flat_map(|deep_mm| [deep_mm - 1e-3, deep_mm + 1e-3]));
    let deeps: Vec<_> = deeps.map(mm).chain([Millimetres::from_bits(-1)]).collect();
    for (goal_mn, deep) in [40, 200, 900, 1_000, 1_001, 1_100, 6_000]
        .into_iter()
        .flat_map(|goal_mn| deeps.iter().map(move |deep| (goal_mn, *deep)))
    {
        for (doubt, calm) in
            [0, 1, 31, 32, 64, 127, 128, 255].into_iter().flat_map(|doubt| [(doubt, false), (doubt, true)])
        {
            let travel = plus(mm(5.0), deep);
            let motion = if calm { calm_at(travel) } else { at(travel) };
            let (reference, flags) = { hand }.frame(goal_mn, &Contact { doubt, ..held }, motion);
            let deeper = minus(deep, held.indentation).max(Millimetres::ZERO);
            let share = Millimetres::from_bits((i64::from(deeper.to_bits()) * i64::from(doubt) / 255) as i32);
            let distance = minus(minus(CONFIG.tip.indentation(newtons(goal_mn)), held.indentation), share);
            let back = distance < Millimetres::ZERO;
            let limit = match (back, deep.0.to_num::<f64>() <= confirmed[usize::from(back)]) {
                (true, true) if doubt < 128 && deep >= Millimetres::ZERO => CONFIG.speed_max,
                (true, true) => slow_back(),
                (false, true) if doubt < 32 => CONFIG.speed_max,
                _ => CONFIG.approach,
            };
            let (expected, _) = over(distance, SLACK, limit, motion);
            let name = format!("{goal_mn} mN, {deep:?} deep, doubt {doubt}, calm: {calm}");
            // Forward, a fast tip must also be able to stop, as the next test shows.
            if !back && limit == CONFIG.speed_max && reference != expected {
                assert!((CONFIG.approach..expected.speed).contains(&reference.speed), "{name}: {reference:?}");
            } else {
                assert_eq!(reference, expected, "{name}");
            }
            assert_eq!(flags & Limits::FROM_BELOW != 0, doubt > 127, "{name}");
        }
    }
}

#[test]
fn a_force_that_ends_slowly_is_approached_again() {
    let (mut hand, _, travel) = Hand::pressing();
    for force_mn in (14..1_000).rev().step_by(29) {
        hand.frame(6_000, &contact(force_mn), at(travel));
    }
    let got = hand.frame(6_000, &contact(14), at(travel));
    assert_eq!((hand.touch.stage(), hand.grip.mode(&hand.touch)), (Stage::Lost, Mode::Approach));
    let distance = CONFIG.tip.indentation(newtons(6_000));
    assert_eq!(got, over(distance, Millimetres::ZERO, CONFIG.approach, at(travel)));
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
