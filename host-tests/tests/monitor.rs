//! The monitor by itself: each limit on both sides, and for how many frames.

use fingertip::command::Command;
use fingertip::config::newtons;
use fingertip::contact::Contact;
use fingertip::control::SpeedLoop;
use fingertip::frame::Sense;
use fingertip::safety::monitor::{Monitor, View, array_broken, array_sound};
use fingertip::shipped::{COLUMNS, Picture, ROWS};
use fingertip::state::Fault;
use fingertip::units::{Millimetres, Newtons};
use host_tests::finger::config;

/// What a sound finger shows that presses with 1 N.
#[derive(Clone, Copy)]
struct Shown {
    picture: Picture,
    contact: Contact,
    pressed: bool,
    sense: Sense,
    motion: SpeedLoop,
    command: Command,
}

impl Shown {
    fn sound() -> Self {
        Self {
            picture: Picture { sum: 1_000, moment_x: 50, moment_y: -50, ..Picture::EMPTY },
            contact: Contact { force: newtons(1_000), ..Contact::default() },
            pressed: true,
            sense: Sense { supply_mv: 6_000, ..Sense::default() },
            motion: SpeedLoop::new(),
            command: Command::default(),
        }
    }

    fn view(&self) -> View<'_, ROWS, COLUMNS> {
        let Self { picture, contact, pressed, sense, motion, command } = self;
        View { picture, contact, pressed: *pressed, sense, motion, command }
    }

    fn at(mut self, um: i32) -> Self {
        self.motion.observer.travel = Millimetres::from_bits((i64::from(um) * (1 << 24) / 1_000) as i32);
        self
    }
}

#[test]
fn a_force_above_the_limit_stops_at_once() {
    let config = config();
    let mut shown = Shown::sound();
    let limit = config.force_fault.to_bits();
    for (bits, fault) in [(limit, None), (limit + 1, Some(Fault::OverForce))] {
        shown.contact.force = Newtons::from_bits(bits);
        assert_eq!(Monitor::default().check(&shown.view(), true, &config), fault);
        assert_eq!(Monitor::default().check(&shown.view(), false, &config), None, "nothing is driven");
    }
}

#[test]
fn a_silent_bus_stops_after_the_watchdogs_time() {
    let config = config();
    for (watchdog_ms, silent_ms, fault) in [
        (0, u16::MAX, None),
        (20, 19, None),
        (20, 20, Some(Fault::BusSilent)),
        (20, 21, Some(Fault::BusSilent)),
        (1, 0, None),
    ] {
        let mut shown = Shown::sound();
        (shown.command.bus_watchdog_ms, shown.sense.bus_silent_ms) = (watchdog_ms, silent_ms);
        for driven in [false, true] {
            assert_eq!(Monitor::default().check(&shown.view(), driven, &config), fault, "{silent_ms} ms");
        }
    }
}

/// The window's ends belong to it, and five frames running must be outside.
#[test]
fn a_supply_outside_its_window_for_five_frames_stops() {
    let config = config();
    let (low, high) = (config.params.supply_min_mv as u16, config.params.supply_max_mv as u16);
    let with = |supply_mv| {
        let mut shown = Shown::sound();
        shown.sense.supply_mv = supply_mv;
        shown
    };
    for inside in [low, high] {
        let mut monitor = Monitor::default();
        for _ in 0..100 {
            assert_eq!(monitor.check(&with(inside).view(), true, &config), None, "{inside} mV");
        }
    }
    for (outside, fault) in [(low - 1, Fault::SupplyLow), (0, Fault::SupplyLow), (high + 1, Fault::SupplyHigh)] {
        let mut monitor = Monitor::default();
        for _ in 0..3 {
            for _ in 0..4 {
                assert_eq!(monitor.check(&with(outside).view(), true, &config), None);
            }
            assert_eq!(monitor.check(&with(low).view(), true, &config), None, "one good frame is enough");
        }
        let faults = [(); 6].map(|()| monitor.check(&with(outside).view(), true, &config));
        assert_eq!(faults, [None, None, None, None, Some(fault), Some(fault)]);
    }
}

/// 0.2 mm, either way, with a picture that is the same to the last bit.
#[test]
fn an_array_that_shows_the_same_while_the_tip_moves_stops() {
    let config = config();
    for sign in [-1, 1] {
        let mut monitor = Monitor::default();
        monitor.restart(&Shown::sound().at(5_000).view());
        for (um, fault) in [(0, None), (199, None), (201, Some(Fault::ArrayFrozen)), (150, None)] {
            let shown = Shown::sound().at(5_000 + sign * um);
            assert_eq!(monitor.check(&shown.view(), true, &config), fault, "{um} um");
        }
    }
}

#[test]
fn an_array_that_shows_any_change_or_no_contact_does_not() {
    let config = config();
    let changes: [fn(&mut Shown); 5] = [
        |shown| shown.picture.sum += 1,
        |shown| shown.picture.moment_x += 1,
        |shown| shown.picture.moment_y -= 1,
        |shown| shown.pressed = false,
        |shown| shown.contact.force = Newtons::from_bits(newtons(15).to_bits() - 1),
    ];
    for (number, change) in changes.into_iter().enumerate() {
        let mut monitor = Monitor::default();
        monitor.restart(&Shown::sound().at(5_000).view());
        let mut changed = Shown::sound().at(5_150);
        change(&mut changed);
        assert_eq!(monitor.check(&changed.view(), true, &config), None, "{number}");
        // From there on it counts anew.
        let mut later = changed.at(5_340);
        (later.pressed, later.contact.force) = (true, newtons(15));
        assert_eq!(monitor.check(&later.view(), true, &config), None, "{number}");
        let later = later.at(5_360);
        assert_eq!(monitor.check(&later.view(), true, &config), Some(Fault::ArrayFrozen), "{number}");
    }
}

/// The same taxels twice, or half of all once; and a column that shows current with no row driven.
#[test]
fn an_array_is_broken_from_the_very_limit_on() {
    let config = config();
    let most = config.params.bad_taxels_max as u16;
    let stuck = config.params.undriven_max_codes as u16;
    let broken = Some(Fault::ArrayBroken);
    for (bad_count, bad_again, undriven_max, fault, sound) in [
        (0, 0, 0, None, true),
        (most, most, stuck, None, true),
        (most + 1, most, stuck, None, false),
        (most + 1, most + 1, stuck, broken, false),
        (50, 0, 0, None, false),
        (51, 0, 0, broken, false),
        (0, 0, stuck + 1, Some(Fault::RowStuck), false),
        (51, 51, stuck + 1, Some(Fault::RowStuck), false),
    ] {
        let picture = Picture { bad_count, bad_again, undriven_max, ..Picture::EMPTY };
        let found = (array_broken(&picture, &config), array_sound(&picture, &config));
        assert_eq!(found, (fault, sound), "{bad_count} bad, {bad_again} again, {undriven_max} codes");
    }
}
