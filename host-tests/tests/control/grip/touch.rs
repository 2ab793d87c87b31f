//! Stages of a touch: a force that vanishes in a frame, returns, or stays away.

use super::*;

/// Expects that this much force is withheld after these frames, and that the tip presses harder only where less than
/// the goal of 1 N is left.
fn withholds(mut hand: Hand, frames: impl Iterator<Item = Contact>, travel: Millimetres, withheld_mn: i32) {
    let (mut left, mut presses) = (Newtons::ZERO, false);
    for seen in frames {
        let (reference, _) = hand.frame(1_000, &seen, at(travel));
        (left, presses) = (seen.force, reference.speed > MillimetresPerSecond::from_bits(1 << 12));
    }
    let withheld = hand.touch.withheld();
    let withheld_n: f64 = withheld.0.to_num();
    assert!((1e3 * withheld_n - f64::from(withheld_mn)).abs() < 0.1, "{withheld_n} N, not {withheld_mn} mN");
    assert_eq!(presses, left.0 + withheld.0 < newtons(999).0, "{left:?} and {withheld_mn} mN");
    assert_eq!(hand.touch.stage(), Stage::Held);
}

/// No object moves at metres per second: of a force that falls by a quarter in a frame the loop keeps the earlier value,
/// until the signal returns. The lesser of the last two frames counts: interference that adds to one frame leaves no
/// step behind. What adds to more frames, for 10 ms at most, is taken back by a fall to within half of the force before.
#[test]
fn a_force_that_falls_by_a_quarter_in_a_frame_is_withheld() {
    let (hand, _, travel) = Hand::pressing();
    for (frames_mn, withheld_mn) in [
        // A quarter of 1 N and the 40 mN of a contact.
        (&[711][..], 0),
        (&[709], 291),
        (&[300], 700),
        (&[0], 1_000),
        (&[709, 1_000], 0),
        (&[300, 1_000], 0),
        (&[0, 1_000], 0),
        (&[5_000, 1_000], 0),
        (&[1_300, 1_000], 0),
        (&[5_000, 1_000, 5_000, 1_000, 1_000], 0),
        (&[5_000, 5_000, 1_000], 0),
        (&[5_000, 5_000, 1_000, 300], 700),
        (&[5_000, 5_000, 490], 4_510),
        (&[5_000, 5_000, 1_510], 3_490),
        (&[5_000, 5_000, 510], 0),
        (&[5_000, 5_000, 1_490], 0),
        (&[&[5_000; 100][..], &[1_000]].concat(), 0),
        (&[&[5_000; 103][..], &[1_000]].concat(), 4_000),
        // A real fall of the force still counts.
        (&[5_000, 1_000, 1_000, 0], 1_000),
        (&[5_000, 1_000, 700], 300),
        (&[5_000, 1_000, 720], 0),
    ] {
        withholds(hand, frames_mn.iter().map(|force_mn| contact(*force_mn)), travel, withheld_mn);
    }
    // One frame of a contact is no reference either.
    withholds(Hand::free(), [contact(1_000), contact(300)].into_iter(), travel, 0);
}

/// Taxels that fail take their force with them, and bring it back; only in that frame a step does not count.
#[test]
fn a_step_with_other_bad_taxels_is_not_withheld() {
    let (hand, _, travel) = Hand::pressing();
    for (frames, withheld_mn) in [
        (&[(500, 1)][..], 0),
        (&[(500, 1), (500, 1), (500, 1)], 0),
        (&[(500, 1), (1_000, 0), (500, 1), (1_000, 0), (1_000, 0)], 0),
        (&[(500, 1), (200, 1)], 300),
        (&[(500, 1), (200, 2)], 0),
        (&[(500, 0)], 500),
    ] {
        let seen = |(force_mn, bad_taxels): &(i32, u8)| Contact { bad_taxels: *bad_taxels, ..contact(*force_mn) };
        withholds(hand, frames.iter().map(seen), travel, withheld_mn);
    }
}

/// Within a frame of more than 0.5 ms an object can leave: its contact is lost, and an approach follows at once.
#[test]
fn a_step_in_a_slow_frame_is_not_withheld() {
    for (frame_ns, withheld) in [(500_000, true), (500_001, false), (2_000_000, false)] {
        let mut config = config();
        config.timing.frame_ns = frame_ns;
        let (hand, held, travel) = Hand::pressing();
        let mut hand = Hand { config: Box::leak(Box::new(config)), ..hand };
        hand.frame(1_000, &Contact::default(), at(travel));
        let expected = if withheld { (held.force, Stage::Held) } else { (Newtons::ZERO, Stage::Lost) };
        assert_eq!((hand.touch.withheld(), hand.touch.stage()), expected, "{frame_ns} ns");
    }
}

/// A doubtful touch is held again from a rise by a contact's force. It keeps place and peak until a further rise.
#[test]
fn a_force_that_returns_is_held_again() {
    let (mut hand, held, travel) = Hand::pressing();
    let least = Contact { force: CONFIG.contact_on, ..contact(40) };
    let none = Contact::default();
    while hand.touch.stage() == Stage::Held {
        hand.frame(1_000, &none, at(travel));
    }
    for seen in [none, least, none, least] {
        hand.frame(1_000, &seen, at(travel));
        assert_eq!((hand.touch.stage(), hand.grip.mode(&hand.touch)), (Stage::Doubtful, Mode::Release));
    }
    for force_mn in [41, 1_000, 3_000] {
        let mut hand = hand;
        let seen = contact(force_mn);
        hand.frame(1_000, &seen, at(travel));
        assert_eq!((hand.touch.stage(), hand.grip.mode(&hand.touch)), (Stage::Held, Mode::Force), "{force_mn} mN");
        let [surface, here] = [mm(5.0), minus(travel, seen.indentation)];
        assert_eq!((hand.touch.surface(), hand.touch.placed()), (Some(surface), false), "{force_mn} mN");
        assert_eq!((hand.touch.peak(), hand.touch.withheld()), (held.force, Newtons::ZERO), "{force_mn} mN");
        // Noise is not longer than 3 ms, neither before nor after the force rises.
        let frames = 3_000_000 / CONFIG.timing.frame_ns;
        for _ in 0..frames {
            hand.frame(1_000, &seen, at(travel));
        }
        let more = contact(force_mn + 41);
        for frame in 0..=frames {
            hand.frame(1_000, &more, at(plus(travel, minus(more.indentation, seen.indentation))));
            assert_eq!(hand.touch.placed(), frame == frames, "{force_mn} mN, frame {frame}");
        }
        assert_eq!((hand.touch.surface(), hand.touch.placed()), (Some(here), true), "{force_mn} mN");
        assert_eq!(hand.touch.peak(), more.force, "{force_mn} mN");
    }
}

/// After a step, up to a quarter of the largest force counts as a residue, and the touch becomes doubtful. It is held
/// again only above the least force that was read since then.
#[test]
fn a_residue_after_a_step_is_doubtful_until_the_force_rises() {
    let (pressing, _, travel) = Hand::pressing();
    let frames = |hand: &mut Hand, time_ns: u32, force_mn| {
        for _ in 0..time_ns / CONFIG.timing.frame_ns {
            hand.frame(1_000, &contact(force_mn), at(travel));
        }
    };
    for (left_mn, doubtful) in [(0, true), (14, true), (249, true), (251, false), (600, false)] {
        let mut hand = pressing;
        frames(&mut hand, 4_000_000, left_mn);
        assert_eq!(hand.touch.stage(), if doubtful { Stage::Doubtful } else { Stage::Held }, "{left_mn} mN");
    }
    let mut hand = pressing;
    frames(&mut hand, 4_000_000, 200);
    // The least force follows the residue down, and not up again.
    for (residue_mn, least_mn) in [(200, 200), (230, 200), (100, 100), (130, 100)] {
        frames(&mut hand, 1_000_000, residue_mn);
        for (more_mn, stage) in [(39, Stage::Doubtful), (41, Stage::Held)] {
            let mut hand = hand;
            hand.frame(1_000, &contact(least_mn + more_mn), at(travel));
            assert_eq!(hand.touch.stage(), stage, "{more_mn} mN above {least_mn} mN");
        }
    }
}

/// A tip that cannot back off gives a doubtful touch up half a second after the force was last read, and seeks again.
#[test]
fn a_doubtful_touch_is_given_up_after_half_a_second() {
    let (mut hand, _, travel) = Hand::pressing();
    let mut time_ns = 0;
    while hand.touch.stage() != Stage::None {
        hand.frame(1_000, &Contact::default(), at(travel));
        time_ns += CONFIG.timing.frame_ns;
        assert!(time_ns < 510_000_000, "{:?} after {time_ns} ns", hand.touch.stage());
    }
    assert!(time_ns > 500_000_000, "{time_ns} ns");
    assert_eq!(hand.grip.mode(&hand.touch), Mode::Approach);
}

/// A force that stays away for 3 ms is doubtful; the finger releases, and then seeks again.
#[test]
fn a_force_that_stays_away_is_released_and_sought_again() {
    let (mut hand, _, travel) = Hand::pressing();
    let none = Contact::default();
    let mut time_ns = 0;
    while hand.grip.mode(&hand.touch) == Mode::Force {
        let (reference, _) = hand.frame(1_000, &none, at(travel));
        assert!(reference.speed <= MillimetresPerSecond::from_bits(1 << 12), "it presses after {time_ns} ns");
        time_ns += CONFIG.timing.frame_ns;
    }
    assert!((3_000_000..3_300_000).contains(&time_ns), "{time_ns} ns");
    assert_eq!((hand.touch.stage(), hand.grip.mode(&hand.touch)), (Stage::Doubtful, Mode::Release));
    assert!((hand.rest_mm(&none) - 4.0).abs() < 0.01);
    for _ in 0..2 {
        hand.frame(1_000, &none, at(mm(4.0)));
    }
    assert_eq!((hand.touch.stage(), hand.grip.mode(&hand.touch)), (Stage::None, Mode::Approach));
}

// A release: its place of rest, and changes of that place.

/// Moves to the clearance behind the surface: fast until the force is a quarter of the largest one, then slow for good.
#[test]
fn a_release_goes_to_the_clearance_behind_the_surface() {
    let (hand, _, travel) = Hand::pressing();
    let mut released = hand;
    let mut goes = |force_mn: i32, from: Option<Millimetres>, limit| {
        let contact = contact(force_mn);
        // The surface is at 5 mm.
        let from = from.unwrap_or(plus(mm(5.0), contact.indentation));
        let got = released.frame(0, &contact, at(from));
        assert_eq!(released.grip.mode(&released.touch), Mode::Release);
        assert_eq!(got, over(minus(mm(4.0), from), CONFIG.count, limit, at(from)), "{force_mn} mN, {from:?}");
    };
    goes(1_000, Some(travel), CONFIG.speed_max);
    for force_mn in [800, 600, 450, 330, 251] {
        goes(force_mn, None, CONFIG.speed_max);
    }
    for force_mn in [249, 400, 600, 400, 250, 150, 80, 40, 20, 0] {
        goes(force_mn, None, CONFIG.approach);
    }
    for from_mm in [4.6, 4.0, 3.9] {
        goes(0, Some(mm(from_mm)), CONFIG.approach);
    }
    // Slow from the start where the contact is lost, and where most of the force was gone before.
    for left_mn in [249, 10] {
        let mut hand = hand;
        for force_mn in (left_mn..1_000).rev().step_by(40) {
            hand.frame(1_000, &contact(force_mn), at(travel));
        }
        let (reference, _) = hand.frame(0, &contact(left_mn), at(travel));
        assert!(!is_fast(reference), "{left_mn} mN");
    }
}

#[test]
fn a_release_never_goes_forward_and_without_a_touch_nowhere() {
    let (mut hand, _, travel) = Hand::pressing();
    for force_mn in (0..1_000).rev().step_by(27) {
        hand.frame(1_000, &contact(force_mn), at(travel));
    }
    assert_eq!(hand.touch.stage(), Stage::Lost);
    // Released when already farther back than the clearance: it stays there.
    for _ in 0..2 {
        assert_eq!(hand.frame(0, &Contact::default(), at(mm(2.0))).0.speed, MillimetresPerSecond::ZERO);
    }
    let got = Hand::free().frame(0, &contact(39), at(mm(7.0)));
    assert_eq!(got.0.speed, MillimetresPerSecond::ZERO, "no surface is known");
}

/// The force that was there before torque may be a residue: it gets a place once it is exceeded; its release is slow.
#[test]
fn a_touch_from_before_torque_has_no_place_until_its_force_rises() {
    for (force_mn, known) in [(39, false), (40, true), (2_000, true)] {
        let mut hand = Hand::new();
        let held = contact(force_mn);
        hand.frame(force_mn, &held, at(Millimetres::ZERO));
        assert_eq!(hand.touch.surface().is_some(), known, "{force_mn} mN");
        assert!(!hand.touch.placed());
        if !known {
            continue;
        }
        // The surface moves with the tip, and the tip is slow forward and back.
        let more = contact(force_mn + 39);
        hand.frame(7_000, &more, at(mm(3.0)));
        let (reference, _) = hand.frame(7_000, &more, at(mm(3.0)));
        assert!(!hand.touch.placed() && !is_fast(reference), "{force_mn} mN");
        assert_eq!(hand.touch.surface(), Some(minus(mm(3.0), more.indentation)));
        let mut released = hand;
        assert!(!is_fast(released.frame(0, &more, at(mm(3.0))).0));
        // Above it by the force of a contact the surface stays, however much deeper this force presses.
        // A peak of noise is shorter.
        let (surface, frames) = (hand.touch.surface(), 300_000 / CONFIG.timing.frame_ns);
        for frame in 0..frames + 10 {
            let travel_mm = if frame <= frames { 3.0 } else { 3.1 };
            hand.frame(7_000, &contact(force_mn + 41), at(mm(travel_mm)));
            assert_eq!(hand.touch.placed(), frame >= frames, "{force_mn} mN, frame {frame}");
            assert_eq!(hand.touch.surface(), surface, "{force_mn} mN at {travel_mm} mm");
        }
    }
}

/// A surface without a place moves forward with the tip, and back only where a release finds that the force falls: an
/// object that follows the tip does that, a residue does not.
#[test]
fn a_surface_without_a_place_moves_back_only_where_the_force_falls() {
    let mut hand = Hand::new();
    let held = contact(1_000);
    for (travel_mm, farthest_mm) in [(0.0, 0.0), (2.0, 2.0), (1.0, 2.0), (-1.0, 2.0), (2.5, 2.5)] {
        hand.frame(1_000, &held, at(mm(travel_mm)));
        assert!(!hand.touch.placed());
        assert_eq!(hand.touch.surface(), Some(minus(mm(farthest_mm), held.indentation)), "at {travel_mm} mm");
    }
    let surface = hand.touch.surface();
    // In thousandths of a newton for a millimetre back: half a millimetre must lower 1 N by 0.1 N.
    for (falls, follows) in [(0.0, false), (190.0, false), (210.0, true), (400.0, true)] {
        let mut hand = hand;
        for back_um in 0..1_000 {
            let travel = mm(2.5 - 1e-3 * f64::from(back_um));
            let seen = contact((1_000.0 - 1e-3 * falls * f64::from(back_um)) as i32);
            hand.frame(0, &seen, at(travel));
            let (found, name) = (hand.touch.surface(), format!("{falls} mN/mm, {back_um} um back"));
            if back_um <= 500 || !follows {
                assert_eq!(found, surface, "{name}");
            } else if back_um == 501 {
                assert_eq!(found, Some(minus(travel, seen.indentation)), "{name}");
            }
        }
    }
}

/// Releases from `from_mm` with an array force given by the distance moved; returns the travel at rest, mm.
fn released_mm(mut hand: Hand, from_mm: f64, force_mn: impl Fn(f64) -> f64) -> f64 {
    let mut travel_mm = from_mm;
    // 30 mm/s, a frame of 0.1 ms.
    loop {
        let seen = contact(force_mn(from_mm - travel_mm) as i32);
        let (reference, _) = hand.frame(0, &seen, at(mm(travel_mm)));
        if reference.speed >= MillimetresPerSecond::ZERO || travel_mm < from_mm - 25.0 {
            return travel_mm;
        }
        travel_mm -= 0.003;
    }
}

/// An object that follows the tip is released as long as each half millimetre lowers its force by 1/64 and a bit.
#[test]
fn a_release_moves_back_while_the_force_falls() {
    let (hand, held, travel) = Hand::pressing();
    let (from_mm, depth_mm): (f64, f64) = (travel.0.to_num(), held.indentation.0.to_num());
    let at_once = |back_mm: f64| 1_000.0 * (1.0 - back_mm / depth_mm).max(0.0).powi(2);
    let rest_mm = released_mm(hand, from_mm, at_once);
    assert!((rest_mm - 4.0).abs() < 0.02, "{rest_mm} mm");
    // The object yields by 5 mm: the tip moves on until the force ends.
    let rest_mm = released_mm(hand, from_mm, |back_mm| 1_000.0 * (1.0 - back_mm / 5.0).max(0.0));
    assert!((from_mm - 6.0 - depth_mm..from_mm - 5.5).contains(&rest_mm), "{rest_mm} mm");
    // A residue stays: it may hide by how much it indents the tip, and no more.
    for residue_mn in [50.0, 200.0] {
        let left = |back_mm: f64| at_once(back_mm).max(residue_mn);
        let rest_mm = released_mm(hand, from_mm, left);
        let hidden_mm: f64 = CONFIG.tip.indentation(newtons(residue_mn as i32)).0.to_num();
        let name = format!("a residue of {residue_mn} mN: {rest_mm} mm");
        assert!((4.0 - hidden_mm - 0.02..4.02).contains(&rest_mm), "{name}");
    }
}

/// Behind half of the clearance the reading is a residue, which the baseline may learn; never while the tip presses.
#[test]
fn only_behind_the_surface_the_baseline_learns_a_residue() {
    let (mut hand, held, travel) = Hand::pressing();
    let learns = |hand: &Hand, force_mn| hand.touch.learns(newtons(force_mn), 10, &CONFIG).is_some();
    assert!(!learns(&hand, 1_000) && !learns(&hand, 0));
    // A residue of 30 mN: less than a contact, so it moves nothing.
    let (mut back_mm, from_mm): (f64, f64) = (0.0, travel.0.to_num());
    let depth_mm: f64 = held.indentation.0.to_num();
    while from_mm - back_mm > 4.52 {
        let force_mn = (1_000.0 * (1.0 - back_mm / depth_mm).max(0.0).powi(2)).max(30.0);
        hand.frame(0, &contact(force_mn as i32), at(mm(from_mm - back_mm)));
        assert!(!learns(&hand, 30), "{back_mm} mm back");
        back_mm += 0.003;
    }
    for from_mm in [4.48, 4.47] {
        hand.frame(0, &contact(30), at(mm(from_mm)));
    }
    assert_eq!(hand.touch.stage(), Stage::Clear);
    // Up to a quarter of the held force.
    assert!(learns(&hand, 30) && learns(&hand, 250) && !learns(&hand, 251));
    // 40 mN more than that are another touch, if they last longer than a peak of noise.
    hand.frame(0, &contact(69), at(mm(4.4)));
    let frames = 1_000_000 / CONFIG.timing.frame_ns;
    for frame in 0..=frames {
        assert!(!hand.touch.held() && learns(&hand, 30), "frame {frame}");
        hand.frame(0, &contact(71), at(mm(4.4)));
    }
    assert!(hand.touch.held() && !learns(&hand, 30));
}
