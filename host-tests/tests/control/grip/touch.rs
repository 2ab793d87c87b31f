//! Stages of a touch: a force that vanishes in a frame, returns, or stays away.

use super::*;

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
