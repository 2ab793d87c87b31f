//! Letting go: where the tip is to rest, and when it stands clear.

use crate::goal::{asked, at, contact, minus, over, pressing};
use crate::{config, mm};
use fingertip::config::Config;
use fingertip::config::newtons;
use fingertip::contact::Contact;
use fingertip::control::goal::Goal;
use fingertip::state::Mode;
use fingertip::units::{Millimetres, MillimetresPerSecond, Newtons};

/// Back to the clearance behind the surface, quickly while the array bears out that it is pressed.
#[test]
fn a_release_goes_to_the_clearance_behind_the_surface() {
    let config = config();
    let (goal, held, travel) = pressing(&config);
    // The surface is 5 mm out, so it rests at 4.
    for (from, contact, limit) in [
        (travel, held, config.speed_max),
        (mm(5.1), contact(40, &config), config.speed_max),
        // Within the clearance, and with the array empty, it goes on slowly.
        (mm(4.9), contact(40, &config), config.approach),
        (travel, Contact::default(), config.approach),
        (mm(4.0), Contact::default(), config.approach),
        (mm(3.9), Contact::default(), config.approach),
        // Deeper than five times the indentation is none that is known.
        (mm(6.5), contact(40, &config), config.approach),
    ] {
        let motion = at(from);
        let mut goal = goal;
        asked(&mut goal, Mode::Release, Newtons::ZERO, &held, at(travel), &config);
        let got = asked(&mut goal, Mode::Release, Newtons::ZERO, &contact, motion, &config);
        assert_eq!(got, over(minus(mm(4.0), from), config.count, limit, motion, &config), "from {from:?}");
    }
}

#[test]
fn a_release_never_goes_forward_and_without_a_touch_nowhere() {
    let config = config();
    let (mut goal, _, _) = pressing(&config);
    // Let go when already farther back than the clearance: it stays there.
    for _ in 0..2 {
        let got = asked(&mut goal, Mode::Release, Newtons::ZERO, &Contact::default(), at(mm(2.0)), &config);
        assert_eq!(got.0.speed, MillimetresPerSecond::ZERO);
    }
    goal.start();
    let got = asked(&mut goal, Mode::Release, Newtons::ZERO, &contact(30, &config), at(mm(7.0)), &config);
    assert_eq!(got.0.speed, MillimetresPerSecond::ZERO, "nothing is known of a surface");
}

/// Torque that is enabled on something pressed knows where that begins.
#[test]
fn what_is_pressed_when_torque_is_enabled_has_its_surface() {
    let config = config();
    for (force_mn, mode, known) in [(40, Mode::Release, true), (39, Mode::Release, false), (40, Mode::Approach, true)] {
        let mut goal = Goal::default();
        goal.start();
        let held = contact(force_mn, &config);
        asked(&mut goal, mode, newtons(1_000), &held, at(Millimetres::ZERO), &config);
        asked(&mut goal, Mode::Release, Newtons::ZERO, &held, at(Millimetres::ZERO), &config);
        // It stands clear half a clearance behind where it is to rest, and farther back.
        let rests = minus(Millimetres::from_bits(-held.indentation.to_bits()), config.clearance);
        let half = Millimetres::from_bits(rests.to_bits() + config.clearance.to_bits() / 2);
        assert!(!goal.clear(half, &config), "{force_mn} mN, {mode:?}");
        assert_eq!(goal.clear(Millimetres::from_bits(half.to_bits() - 1), &config), known, "{force_mn} mN, {mode:?}");
    }
    // Later, an approach that sees something has not touched yet: only a force has.
    let mut goal = Goal::default();
    asked(&mut goal, Mode::Release, Newtons::ZERO, &Contact::default(), at(Millimetres::ZERO), &config);
    asked(&mut goal, Mode::Approach, newtons(1_000), &contact(50, &config), at(mm(1.0)), &config);
    asked(&mut goal, Mode::Release, Newtons::ZERO, &contact(50, &config), at(mm(1.0)), &config);
    assert!(!goal.clear(mm(-50.0), &config));
}

#[test]
fn only_a_release_with_a_clearance_stands_clear() {
    let config = config();
    let (mut goal, held, travel) = pressing(&config);
    assert!(!goal.clear(mm(0.0), &config), "it presses");
    asked(&mut goal, Mode::Release, Newtons::ZERO, &held, at(travel), &config);
    assert!(goal.clear(mm(4.49), &config) && !goal.clear(mm(4.51), &config));
    let none = Config { clearance: Millimetres::ZERO, ..config };
    assert!(!goal.clear(mm(-50.0), &none));
}
