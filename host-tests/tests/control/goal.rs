//! What each mode asks of the speed loop: the way, the slack, and how fast.

use crate::{config, mm};
use fingertip::config::Config;
use fingertip::config::newtons;
use fingertip::contact::Contact;
use fingertip::control::SpeedLoop;
use fingertip::control::goal::Goal;
use fingertip::control::profile::Reference;
use fingertip::state::{Limits, Mode};
use fingertip::units::{Millimetres, MillimetresPerSecond, Newtons};

/// A calm force leaves 0.4 um.
const SLACK: Millimetres = Millimetres::from_bits((1 << 24) / 2_500);

/// A contact of this force, all of it seen.
pub fn contact(force_mn: i32, config: &Config) -> Contact {
    let force = newtons(force_mn);
    Contact { force, indentation: config.tip.indentation(force), confidence: 255, ..Contact::default() }
}

/// With the tip at rest at a travel.
pub fn at(travel: Millimetres) -> SpeedLoop {
    let mut motion = SpeedLoop::new();
    motion.observer.travel = travel;
    motion
}

/// With the tip at rest, and calm.
fn calm_at(travel: Millimetres, config: &Config) -> SpeedLoop {
    let mut motion = at(travel);
    for _ in 0..10 * config.calm_frames {
        motion.pace.note(Millimetres::ZERO, config);
    }
    motion
}

pub fn minus(a: Millimetres, b: Millimetres) -> Millimetres {
    Millimetres(a.0 - b.0)
}

fn plus(a: Millimetres, b: Millimetres) -> Millimetres {
    Millimetres(a.0 + b.0)
}

/// What a goal is asked, and the flags that it sets.
pub fn asked(
    goal: &mut Goal,
    mode: Mode,
    wanted: Newtons,
    contact: &Contact,
    motion: SpeedLoop,
    config: &Config,
) -> (Reference, u16) {
    let mut limits = Limits::default();
    let reference = goal.reference(mode, wanted, contact, &mut { motion }, config, &mut limits);
    (reference, limits.0)
}

/// A way, and at most how fast.
pub fn over(
    way: Millimetres,
    slack: Millimetres,
    limit: MillimetresPerSecond,
    motion: SpeedLoop,
    config: &Config,
) -> (Reference, u16) {
    let (reference, limited) = { motion }.towards(way, slack, limit, config);
    (reference, if limited { Limits::SPEED } else { 0 })
}

/// A goal that pressed with 1 N where the surface is 5 mm out.
pub fn pressing(config: &Config) -> (Goal, Contact, Millimetres) {
    let mut goal = Goal::default();
    goal.start();
    asked(&mut goal, Mode::Approach, newtons(1_000), &Contact::default(), at(mm(4.0)), config);
    let held = contact(1_000, config);
    let travel = plus(mm(5.0), held.indentation);
    asked(&mut goal, Mode::Force, newtons(1_000), &held, at(travel), config);
    (goal, held, travel)
}

#[test]
fn an_approach_goes_slowly_and_all_of_its_way() {
    let config = config();
    let mut goal = Goal::default();
    for force_mn in [40, 500, 7_000] {
        let wanted = newtons(force_mn);
        for motion in [at(mm(1.0)), calm_at(mm(1.0), &config)] {
            let (reference, flags) = asked(&mut goal, Mode::Approach, wanted, &Contact::default(), motion, &config);
            let way = config.tip.indentation(wanted);
            assert_eq!((reference, flags), over(way, Millimetres::ZERO, config.approach, motion, &config));
            assert!(reference.speed <= config.approach && reference.speed > MillimetresPerSecond::ZERO);
        }
    }
}

#[test]
fn a_force_goes_quickly_over_what_is_left() {
    let config = config();
    let (goal, held, travel) = pressing(&config);
    for force_mn in [200, 1_000, 1_001, 5_000] {
        let way = minus(config.tip.indentation(newtons(force_mn)), held.indentation);
        for motion in [at(travel), calm_at(travel, &config)] {
            let got = asked(&mut { goal }, Mode::Force, newtons(force_mn), &held, motion, &config);
            assert_eq!(got, over(way, SLACK, config.speed_max, motion, &config), "{force_mn} mN");
        }
    }
    // Fast where it is quick, and only there.
    let (reference, _) = asked(&mut { goal }, Mode::Force, newtons(7_000), &held, at(travel), &config);
    assert!(reference.speed > config.approach);
}

/// The picture shows the middle of the scan, the tip moved on for half a frame since.
#[test]
fn what_moved_since_the_scan_counts() {
    let config = config();
    let (mut goal, held, travel) = pressing(&config);
    for mm_per_s in [-80, 40] {
        let mut motion = at(travel);
        motion.observer.speed = MillimetresPerSecond::from_bits(mm_per_s << 16);
        let frame_s = f64::from(config.frame_s_q39) / 2_f64.powi(39);
        let way = minus(config.tip.indentation(newtons(2_000)), held.indentation);
        let way = minus(way, mm(f64::from(mm_per_s) * frame_s / 2.0));
        let (reference, _) = asked(&mut goal, Mode::Force, newtons(2_000), &held, motion, &config);
        let (expected, _) = over(way, Millimetres::ZERO, config.speed_max, motion, &config);
        assert!((reference.speed.to_bits() - expected.speed.to_bits()).abs() < 10, "{reference:?}, {expected:?}");
    }
}

/// Of how much deeper than the indentation the tip went since the touch, the doubt's share counts as indentation.
#[test]
fn doubt_takes_the_tip_to_be_as_deep_as_it_went() {
    let config = config();
    let (goal, held, travel) = pressing(&config);
    let deeper = mm(0.25);
    let motion = at(plus(travel, deeper));
    for (doubt, told) in [(0, false), (1, false), (64, false), (127, false), (128, true), (255, true)] {
        let doubtful = Contact { doubt, ..held };
        let (reference, flags) = asked(&mut { goal }, Mode::Force, newtons(1_100), &doubtful, motion, &config);
        assert_eq!(flags & Limits::FROM_BELOW != 0, told, "{doubt}");
        let way = minus(config.tip.indentation(newtons(1_100)), held.indentation);
        let share = Millimetres::from_bits((i64::from(deeper.to_bits()) * i64::from(doubt) / 255) as i32);
        let way = minus(way, share);
        let limit = if way < Millimetres::ZERO || doubt < 32 { config.speed_max } else { config.approach };
        let (expected, _) = over(way, SLACK, limit, motion, &config);
        assert_eq!(reference, expected, "{doubt}");
    }
    // A tip that went less deep than it is indented has nothing to doubt.
    let before = at(minus(travel, mm(0.1)));
    let reference =
        |doubt| asked(&mut { goal }, Mode::Force, newtons(900), &Contact { doubt, ..held }, before, &config).0;
    assert_eq!(reference(255), reference(0));
}

/// Up to an eighth of doubt a tip still goes on at full speed; back it always does.
#[test]
fn more_than_an_eighth_of_doubt_is_slow_on_the_way_in() {
    let config = config();
    let (goal, held, travel) = pressing(&config);
    for (doubt, wanted_mn, quick) in [(31, 6_000, true), (32, 6_000, false), (255, 6_000, false), (255, 20, true)] {
        let doubtful = Contact { doubt, ..held };
        let motion = at(travel);
        let (reference, _) = asked(&mut { goal }, Mode::Force, newtons(wanted_mn), &doubtful, motion, &config);
        let is_quick = reference.speed.0.to_num::<f64>().abs() > 31.0;
        assert_eq!(is_quick, quick, "{doubt} {wanted_mn} mN: {reference:?}");
    }
}

/// Twice its indentation and 0.3 mm forward, five times on the way back.
#[test]
fn a_tip_farther_in_than_the_array_bears_out_is_slow() {
    let config = config();
    let (goal, held, _) = pressing(&config);
    let depth_mm: f64 = held.indentation.0.to_num();
    for (wanted_mn, times) in [(6_000, 2.0), (40, 5.0)] {
        for (deep_mm, quick) in [(times * depth_mm + 0.299, true), (times * depth_mm + 0.301, false)] {
            let motion = at(mm(5.0 + deep_mm));
            let (reference, _) = asked(&mut { goal }, Mode::Force, newtons(wanted_mn), &held, motion, &config);
            let is_quick = reference.speed.0.to_num::<f64>().abs() > 31.0;
            assert_eq!(is_quick, quick, "{deep_mm} mm in, {wanted_mn} mN: {reference:?}");
        }
    }
    // Nor where the force is no contact: the goal is sought then.
    let lost = Contact { force: newtons(14), ..held };
    let motion = at(plus(mm(5.0), held.indentation));
    let got = asked(&mut { goal }, Mode::Force, newtons(6_000), &lost, motion, &config);
    let way = config.tip.indentation(newtons(6_000));
    assert_eq!(got, over(way, SLACK, config.approach, motion, &config));
}

/// Nothing is indented by a force that is none.
#[test]
fn a_force_counts_from_the_end_of_a_contact_on() {
    let config = config();
    let off = config.contact_off;
    let wanted = config.tip.indentation(config.contact_on);
    let motion = calm_at(mm(1.0), &config);
    for (force, indented) in [(off, true), (Newtons::from_bits(off.to_bits() - 1), false), (Newtons::ZERO, false)] {
        let seen = Contact { force, indentation: mm(0.1), ..Contact::default() };
        let got = asked(&mut Goal::default(), Mode::Approach, config.contact_on, &seen, motion, &config);
        let way = if indented { minus(wanted, mm(0.1)) } else { wanted };
        assert_eq!(got, over(way, Millimetres::ZERO, config.approach, motion, &config), "{force:?}");
        assert!(got.0.speed < config.approach, "{force:?}");
    }
}

#[test]
fn a_goal_is_held_between_the_least_contact_and_the_largest_force() {
    let config = config();
    let (goal, held, travel) = pressing(&config);
    let most = config.force_max.min(config.force_seen);
    let asks = |wanted: Newtons| asked(&mut { goal }, Mode::Force, wanted, &held, at(travel), &config);
    for wanted in [config.contact_on, most, newtons(2_000)] {
        assert_eq!(asks(wanted).1 & Limits::GOAL, 0, "{wanted:?}");
    }
    for (wanted, held) in [
        (Newtons::from_bits(config.contact_on.to_bits() - 1), config.contact_on),
        (Newtons::from_bits(1), config.contact_on),
        (Newtons::from_bits(most.to_bits() + 1), most),
        (Newtons::from_bits(i32::MAX), most),
    ] {
        let (expected, flags) = asks(held);
        assert_eq!(asks(wanted), (expected, flags | Limits::GOAL));
    }
    // What the converter does not see whole is less than what is allowed.
    let blind = Config { force_seen: newtons(1_500), ..config.clone() };
    let (seen, flags) = asked(&mut { goal }, Mode::Force, newtons(1_500), &held, at(travel), &blind);
    let more = asked(&mut { goal }, Mode::Force, newtons(1_501), &held, at(travel), &blind);
    assert_eq!(more, (seen, flags | Limits::GOAL));
}

#[test]
fn no_way_goes_beyond_the_end_of_the_travel() {
    let config = config();
    let way = config.tip.indentation(newtons(5_000));
    for (left, cut) in [(way, false), (Millimetres::from_bits(way.to_bits() - 1), true), (Millimetres::ZERO, true)] {
        let motion = at(minus(config.travel_max, left));
        let (reference, flags) =
            asked(&mut Goal::default(), Mode::Approach, newtons(5_000), &Contact::default(), motion, &config);
        let (expected, _) = over(left, Millimetres::ZERO, config.approach, motion, &config);
        assert_eq!((reference, flags & Limits::TRAVEL != 0), (expected, cut), "{left:?}");
    }
}
