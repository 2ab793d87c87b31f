//! The monitor by itself: each limit on both sides, and for how many frames.

use crate::common::*;
use fingertip::safety::monitor::{Monitor, MonitorInputs, array_broken, array_readable};

/// Readings of a sound finger that presses with 1 N.
#[derive(Clone, Copy)]
struct Shown {
    picture: TactileImage,
    contact: Contact,
    pressed: bool,
    sense: Sense,
    motion: SpeedLoop,
    command: Command,
}

impl Shown {
    fn sound() -> Self {
        Self {
            picture: TactileImage { sum: 1_000, moment_x: 50, moment_y: -50, ..TactileImage::EMPTY },
            contact: Contact { force: newtons(1_000), ..Contact::default() },
            pressed: true,
            sense: Sense { supply_mv: 6_000, ..Sense::default() },
            motion: SpeedLoop::new(),
            command: Command::default(),
        }
    }

    fn view(&self) -> MonitorInputs<'_, ROWS, COLUMNS> {
        let Self { picture, contact, pressed, sense, motion, command } = self;
        MonitorInputs { picture, contact, pressed: *pressed, sense, motion, command }
    }

    fn at(mut self, um: i32) -> Self {
        self.motion.observer.travel = Millimetres::from_bits((i64::from(um) * (1 << 24) / 1_000) as i32);
        self
    }

    /// The object pushes the tip back with so much more.
    fn loaded(mut self, mn: i32) -> Self {
        let load = i64::from(config().bounds.acceleration_per_n) * i64::from(mn) / 1_000;
        self.motion.observer.disturbance = MillimetresPerSecond2::from_bits(-load as i32);
        self
    }
}

fn restarted(Shown { picture, motion, .. }: &Shown) -> Monitor {
    let mut monitor = Monitor::default();
    monitor.restart(picture, motion);
    monitor
}

#[test]
fn a_force_above_the_limit_stops_at_once() {
    let config = config();
    let mut shown = Shown::sound();
    let limit = config.force_fault.to_bits();
    for (bits, fault) in [(limit, None), (limit + 1, Some(Fault::OverForce))] {
        shown.contact.force = Newtons::from_bits(bits);
        assert_eq!(Monitor::default().check(&shown.view(), &config), fault);
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
    let watched = |monitor: &mut Monitor, supply_mv| {
        let shown = with(supply_mv);
        monitor.watch_supply(&shown.sense, &config);
        monitor.check(&shown.view(), &config)
    };
    for inside in [low, high] {
        let mut monitor = Monitor::default();
        for _ in 0..100 {
            assert_eq!(watched(&mut monitor, inside), None, "{inside} mV");
        }
    }
    for (outside, fault) in [(low - 1, Fault::SupplyLow), (0, Fault::SupplyLow), (high + 1, Fault::SupplyHigh)] {
        let mut monitor = Monitor::default();
        for _ in 0..3 {
            for _ in 0..4 {
                assert_eq!(watched(&mut monitor, outside), None);
            }
            assert_eq!(watched(&mut monitor, low), None, "one good frame is enough");
        }
        let faults = [(); 6].map(|()| watched(&mut monitor, outside));
        assert_eq!(faults, [None, None, None, None, Some(fault), Some(fault)]);
    }
}

/// Moves the tip forward under a constant image and a load that grows per 0.1 mm. Returns the travel at its stop.
fn stopped_um(um_per_frame: i32, load_mn: i32, force_mn: i32, goal_mn: i32) -> Option<i32> {
    let config = config();
    let mut monitor = restarted(&Shown::sound().at(5_000));
    (1..=6_000 / um_per_frame).map(|frame| frame * um_per_frame).find(|um| {
        let mut shown = Shown::sound().at(5_000 + um).loaded(load_mn * (um - 100).clamp(0, 100) / 100);
        (shown.contact.force, shown.command.goal) = (newtons(force_mn), newtons(goal_mn));
        monitor.check(&shown.view(), &config) == Some(Fault::ArrayFrozen)
    })
}

/// With a constant tactile image, a motor that pushes harder by 0.25 N plus half of the force is stopped within 0.2 mm
/// and the lag of the mean load. Without more load the object may be moving: then it is stopped after 4 mm.
#[test]
fn an_array_that_shows_the_same_while_the_tip_presses_on_stops() {
    for force_mn in [100, 1_000, 3_000] {
        let least_mn = 250 + force_mn / 2;
        for more_mn in [least_mn + 100, 2 * least_mn] {
            let um = stopped_um(1, more_mn, force_mn, 9_000).expect("it is stopped");
            assert!((200..=500).contains(&um), "{force_mn} mN, {more_mn} mN more: {um} um");
        }
        for less_mn in [-2_000, 0, least_mn - 20] {
            let um = stopped_um(1, less_mn, force_mn, 9_000).expect("it is stopped");
            assert!((4_000..=4_002).contains(&um), "{force_mn} mN, {less_mn} mN more: {um} um");
        }
    }
}

/// A force within an eighth of its goal is held: an object may carry the tip.
#[test]
fn a_force_that_is_held_may_stay_the_same() {
    for (goal_mn, stops) in [(0, true), (888, true), (890, false), (1_000, false), (1_140, false), (1_144, true)] {
        assert_eq!(stopped_um(1, 2_000, 1_000, goal_mn).is_some(), stops, "{goal_mn} mN");
    }
}

/// No fault if the image changes at all, the tip does not press or moves back, or the force is small.
#[test]
fn an_array_that_shows_any_change_or_no_contact_does_not() {
    let config = config();
    let changes: [fn(&mut Shown, i32); 6] = [
        |shown, frame| shown.picture.sum += frame % 2,
        |shown, frame| shown.picture.moment_x += frame % 2,
        |shown, frame| shown.picture.moment_y -= frame % 2,
        |shown, _| shown.pressed = false,
        |shown, _| shown.contact.force = Newtons::from_bits(newtons(15).to_bits() - 1),
        |shown, frame| *shown = shown.at(5_000 - frame),
    ];
    for (number, change) in changes.into_iter().enumerate() {
        let mut monitor = restarted(&Shown::sound().at(5_000));
        for frame in 1..5_000 {
            let mut shown = Shown::sound().at(5_000 + frame).loaded(frame);
            change(&mut shown, frame);
            assert_eq!(monitor.check(&shown.view(), &config), None, "{number}");
        }
    }
}

/// All taxels together read less than at the tare by three times the least contact, for three frames.
#[test]
fn an_array_that_reads_less_than_at_its_tare_is_broken() {
    let config = config();
    let with = |sum| {
        let mut shown = Shown::sound();
        (shown.picture.sum, shown.contact.force, shown.pressed) = (sum, Newtons::ZERO, false);
        shown
    };
    // Half of the least contact is `touch_line`.
    let least = -6 * config.touch_line;
    let of_contacts = f64::from(least) * config.newtons_per_sum_q48 as f64 / 2_f64.powi(48);
    assert!((-0.121..-0.119).contains(&of_contacts), "{of_contacts} N are not three times 40 mN");
    for sum in [least, 0, 1_000_000] {
        let mut monitor = restarted(&with(sum));
        for _ in 0..100 {
            assert_eq!(monitor.check(&with(sum).view(), &config), None, "{sum}");
        }
    }
    let broken = Some(Fault::ArrayBroken);
    for sum in [least - 1, 10 * least, i32::MIN] {
        let mut monitor = Monitor::default();
        for _ in 0..3 {
            let faults = [sum, sum, least].map(|sum| monitor.check(&with(sum).view(), &config));
            assert_eq!(faults, [None; 3], "{sum}: one good frame is enough");
        }
        let faults = [(); 5].map(|()| monitor.check(&with(sum).view(), &config));
        assert_eq!(faults, [None, None, broken, broken, broken], "{sum}");
        // A new start forgets the frames before.
        let Shown { picture, motion, .. } = with(sum);
        monitor.restart(&picture, &motion);
        assert_eq!([(); 3].map(|()| monitor.check(&with(sum).view(), &config)), [None, None, broken], "{sum}");
    }
}

/// Checks consecutive frames with these sums and numbers of bad taxels at a goal; returns the frame of the fault.
fn stopped_by_sums(goal_mn: i32, sums: impl Iterator<Item = (i32, u16)>) -> Option<usize> {
    let config = config();
    let mut shown = Shown::sound();
    shown.command.goal = newtons(goal_mn);
    let mut monitor = restarted(&Shown::sound());
    let mut fault = |(sum, bad_count)| {
        shown.picture = TactileImage { sum, bad_count, moment_x: sum, ..shown.picture };
        let fault = monitor.check(&shown.view(), &config);
        assert!(matches!(fault, None | Some(Fault::ArrayBroken)), "{fault:?}");
        fault
    };
    sums.into_iter().position(|frame| fault(frame).is_some())
}

/// A step of the sum that no contact makes stops the motor after 8 ms, unless it goes back or taxels recover.
#[test]
fn an_array_that_reads_much_more_within_a_frame_is_broken() {
    let config = config();
    let frames = 8_000_000 / config.timing.frame_ns as usize;
    let most = 1_000 / 4 + 4 * config.touch_line;
    let stepped =
        |up, length, bad| (0..4 * frames).map(move |frame| if frame < length { (1_000 + up, bad) } else { (1_000, 0) });
    assert_eq!(stopped_by_sums(1_000, stepped(most, 4 * frames, 0)), None);
    assert_eq!(stopped_by_sums(1_000, stepped(most + 1, 4 * frames, 0)), Some(frames));
    assert_eq!(stopped_by_sums(1_000, stepped(most + 1, frames - 1, 0)), None);
    assert_eq!(stopped_by_sums(1_000, stepped(most + 1, 4 * frames, 1)), None);
    assert_eq!(stopped_by_sums(0, stepped(most + 1, 4 * frames, 0)), Some(frames), "in a release");
    // A contact that grows by a fifth in each frame does not step.
    let grows = (0..4 * frames).map(|frame| ((1_000.0 * 1.2_f64.powi(frame.min(30) as i32)) as i32, 0));
    assert_eq!(stopped_by_sums(1_000, grows), None);
}

/// Taxels that are masked or fail after the tare lose their baseline, too: the sum of the others is no fault.
#[test]
fn an_array_without_some_of_its_taxels_does_not_read_less() {
    let config = config();
    let [pressed, blank] = crate::frame_pass::frames();
    let most = config.params.bad_taxels_max as usize;
    for masked in 0..=ROWS {
        let mask = core::array::from_fn(|row| if row < masked { (1 << COLUMNS) - 1 } else { 0 });
        let calibration = Calibration::new(&[[GAIN_ONE; COLUMNS]; ROWS], &mask).unwrap();
        for (frame, dead) in [(blank, 0), (blank, most), (pressed, 0), (pressed, most)] {
            let mut array = tared(&calibration, &blank, &config);
            let mut frame = frame;
            (0..dead).for_each(|place| frame.set_code(ROWS - 1, place, 0));
            let (mut monitor, mut shown) = (Monitor::default(), Shown::sound());
            (shown.contact.force, shown.pressed) = (Newtons::ZERO, false);
            for _ in 0..10 {
                shown.picture = *array.read(&frame, &config);
                let sum = shown.picture.sum;
                assert_eq!(monitor.check(&shown.view(), &config), None, "{masked} rows, {dead} dead: {sum}");
            }
        }
    }
    // An array that lost a tenth of its codes, as by its supply, does.
    let mut array = tared(&Calibration::NONE, &blank, &config);
    let mut frame = blank;
    recode(&mut frame, |_, _, code| code / 10 * 9);
    let shown = Shown { picture: *array.read(&frame, &config), ..Shown::sound() };
    let mut monitor = Monitor::default();
    let faults = [(); 3].map(|()| monitor.check(&shown.view(), &config));
    assert_eq!(faults, [None, None, Some(Fault::ArrayBroken)], "a sum of {}", shown.picture.sum);
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
        let picture = TactileImage { bad_count, bad_again, undriven_max, ..TactileImage::EMPTY };
        let found = (array_broken(&picture, &config), array_readable(bad_count, undriven_max, &config));
        assert_eq!(found, (fault, sound), "{bad_count} bad, {bad_again} again, {undriven_max} codes");
    }
}
