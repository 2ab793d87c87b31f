//! A commander of `fingertip share` leaves or is silent, or `share` ends: the fingers are stopped.

use crate::served::Served;
use crate::shared::{Asker, Shared};
use fingertip::link::packet::{BROADCAST, instruction};
use fingertip::shipped::address;
use fingertip::state::Mode;
use fingertip_cli::client::packet;
use std::io::Read as _;
use std::time::Duration;

/// Reads the mode until it is off, with at most this number of packets.
fn reads_until_off(finger: &Served, reader: &mut Asker, packets: u64) {
    let begun = finger.heard();
    while !matches!(reader.once.number(address::PRESENT_MODE), Ok(mode) if mode == Mode::Off as i64) {
        assert!(finger.heard() - begun < packets, "{}", finger.look());
    }
}

/// A broker with a time-out of 300 ms, in front of tared fingers.
fn tared(finger: Served, ids: std::ops::RangeInclusive<u8>) -> Shared {
    ids.for_each(|id| drop(finger.tared(id)));
    Shared::within(300, finger)
}

/// Turns torque on and sets a goal of 1 N.
fn presses(commander: &mut Asker) {
    commander.set(address::TORQUE_ENABLE, 1).expect("it obeys");
    commander.set(address::GOAL_FORCE_MN, 1_000).expect("it obeys");
}

fn error_at_its_end(mut shared: Shared) -> String {
    Served::interrupt(&shared.broker);
    let mut said = String::new();
    shared.broker.stderr.take().expect("a pipe").read_to_string(&mut said).expect("text");
    assert_eq!(shared.broker.wait().expect("it ends").code(), Some(1), "{said}");
    said
}

#[test]
fn a_press_is_released_at_the_end_of_the_broker() {
    let shared = Shared::begin("wall");
    let mut press = shared.press();
    Served::interrupt(&shared.broker);
    shared.until_released();
    press.wait().expect("it ends");
}

/// Another client stops one of two fingers. The commander feeds the watchdog of the other one until it leaves.
#[test]
fn the_other_fingers_of_a_stopped_commander_are_stopped_once_it_has_left() {
    let shared = tared(Served::patient("grasp"), 1..=2);
    let (mut first, mut second) = (shared.client(), shared.client());
    for id in [1, 2] {
        first.once.id = id;
        first.set(address::TORQUE_ENABLE, 1).expect("it obeys");
    }
    first.set(address::BUS_WATCHDOG, 50).expect("it obeys");
    second.set_each([1], address::GOAL_FORCE_MN, 0);
    second.number(address::TORQUE_ENABLE).expect("it answers");
    first.set(address::GOAL_FORCE_MN, 500).expect_err("it was stopped");
    first.once.id = 1;
    let begun_s = shared.finger.now_s();
    while shared.finger.now_s() < begun_s + 3.0 {
        first.once.pass(&packet(BROADCAST, instruction::SYNC_WRITE, &[0; 4]), None, 0).expect("it listens");
        first.ping().expect("it answers");
    }
    second.once.id = 2;
    assert_eq!(second.number(address::TORQUE_ENABLE).expect("it answers"), 1, "{}", shared.finger.look());
    drop(first);
    Served::wait_for(|| second.number(address::TORQUE_ENABLE).expect("it answers") == 0);
}

/// A script starts one program after the other.
#[test]
fn once_a_commander_has_left_the_next_client_writes() {
    let shared = Shared::begin("wall");
    let mut clients: Vec<Asker> = std::iter::repeat_with(|| shared.client()).take(100).collect();
    for client in &mut clients {
        client.ping().expect("it answers");
    }
    for mut client in clients {
        client.set(address::BUS_WATCHDOG, 25).expect("it obeys");
    }
}

/// Fingers of an unplugged hand: each try to stop one costs a time-out of 2 s.
#[test]
fn absent_fingers_of_who_left_keep_nobody_from_the_bus() {
    let shared = Shared::begin("wall");
    shared.finger.done(&["tare"]);
    let (mut first, mut press) = (shared.client(), shared.client());
    first.set_each(1..60, address::GOAL_FORCE_MN, 1);
    first.ping().expect("it answers");
    press.once.timeout = Duration::from_millis(5_500);
    for (register, value) in [(address::TORQUE_ENABLE, 0), (address::TORQUE_ENABLE, 1), (address::GOAL_FORCE_MN, 1_000)]
    {
        press.set(register, value).expect("it obeys");
    }
    drop(first);
    for goal_mn in [900, 800, 700] {
        press.set(address::GOAL_FORCE_MN, goal_mn).expect("it still commands");
    }
    // A stop of all fingers does not wait for the absent ones.
    press.set_each(1..60, address::TORQUE_ENABLE, 0);
    while press.number(address::TORQUE_ENABLE).expect("it answers") != 0 {}
}

/// The clock of the finger waits for packets, so its watchdog does not trip: the keep-alive packets are counted.
#[test]
fn the_end_feeds_all_fingers_and_asks_many_ids_by_one_ping() {
    for (last, packets) in [(9, 8..60), (9 + 80, 2..8)] {
        let mut shared = Shared::within(900, Served::patient("wall"));
        let mut client = shared.client();
        client.set_each(9..=last, address::BUS_WATCHDOG, 25);
        client.ping().expect("it answers");
        let sent = shared.packets_at_its_end();
        assert!(packets.contains(&sent), "{sent} packets, IDs 9 to {last}");
    }
}

/// A reader goes on, and the finger has no bus watchdog.
#[test]
fn a_finger_is_stopped_once_the_line_is_back_unless_another_client_commands_it() {
    let shared = tared(Served::patient("wall"), 1..=1);
    let mut commander = shared.client();
    presses(&mut commander);
    shared.finger.until_alone("Force:");
    let (mut reader, mut next) = (shared.client(), shared.client());
    shared.finger.deaf(0, 12);
    drop(commander);
    reads_until_off(&shared.finger, &mut reader, 200);
    shared.until_released();
    next.set(address::TORQUE_ENABLE, 1).expect("it commands now");
    shared.finger.deaf(0, 2);
    drop(next);
    Served::wait_for(|| shared.finger.missed() == 2);
    // A client that writes to it in a group packet commands it before the next try to stop it.
    let mut next = shared.client();
    next.set_each([1], address::TORQUE_ENABLE, 1);
    next.ping().expect("it answers");
    for _ in 0..1_000 {
        assert_eq!(reader.number(address::TORQUE_ENABLE).expect("it answers"), 1, "it has a commander");
    }
}

/// Another program has set the bus watchdog, so the broker asks the finger for it. One commander writes in group packets only.
#[test]
fn a_silent_commander_is_stopped_whoever_set_the_watchdog() {
    for groups in [true, false] {
        let finger = Served::patient("wall");
        finger.set(&[(address::BUS_WATCHDOG, 25)]);
        let shared = tared(finger, 1..=1);
        let (mut commander, mut reader) = (shared.client(), shared.client());
        if groups {
            commander.set_each([1], address::TORQUE_ENABLE, 1);
            commander.set_each([1], address::GOAL_FORCE_MN, 1_000);
        } else {
            presses(&mut commander);
        }
        while reader.number(address::PRESENT_MODE).expect("it answers") == Mode::Off as i64 {}
        reads_until_off(&shared.finger, &mut reader, 20_000);
        let fault = reader.number(address::FAULT).expect("it answers");
        assert_eq!(fault, 0, "the broker stopped it, not the watchdog");
    }
}

/// The keep-alive packets would be hundreds.
#[test]
fn absent_fingers_of_who_left_do_not_feed_the_watchdog_of_a_silent_commander() {
    let shared = tared(Served::patient("wall"), 1..=1);
    let (mut first, mut second) = (shared.client(), shared.client());
    first.set_each(1..60, address::GOAL_FORCE_MN, 1);
    first.ping().expect("it answers");
    second.set(address::TORQUE_ENABLE, 0).expect("anyone stops");
    second.set(address::BUS_WATCHDOG, 25).expect("it commands now");
    presses(&mut second);
    let begun = shared.finger.heard();
    drop(first);
    Served::wait_for(|| {
        let (packets, state) = (shared.finger.heard() - begun, shared.finger.look());
        assert!(packets < 60, "{packets} packets, {state}");
        ["Off", "Fault"].iter().any(|mode| state.contains(mode))
    });
}

#[test]
fn the_end_names_the_fingers_that_it_could_not_stop() {
    let shared = tared(Served::patient("grasp"), 1..=2);
    let mut commander = shared.client();
    for id in [1, 2] {
        commander.once.id = id;
        commander.set(address::TORQUE_ENABLE, 1).expect("it obeys");
    }
    shared.finger.deaf(0, u64::MAX);
    let said = error_at_its_end(shared);
    assert!(said.contains("could not stop ID 1, 2:"), "{said}");
}

/// Its client writes by broadcast, which is not answered anyway.
#[test]
fn a_finger_that_answers_nothing_is_stopped_and_a_client_cannot_make_it_so() {
    let finger = Served::patient("wall");
    drop(finger.tared(1));
    finger.set(&[(address::STATUS_RETURN_LEVEL, 0)]);
    let mut client = finger.client();
    client.timeout = Duration::from_millis(1);
    let why = client.number(address::FAULT).expect_err("it answers pings only").to_string();
    assert!(why.contains("status_return_level") && why.contains("fingertip stop"), "{why}");
    drop(client);
    let shared = Shared::within(300, finger);
    let mut commander = shared.client();
    commander.set_each([1], address::TORQUE_ENABLE, 1);
    commander.set_each([1], address::GOAL_FORCE_MN, 1_000);
    shared.finger.until_alone("Force:");
    drop(commander);
    shared.until_released();
    let mut client = shared.client();
    assert_eq!(client.number(address::TORQUE_ENABLE).expect("it answers again"), 0);
    for level in [0, 1] {
        client.set(address::STATUS_RETURN_LEVEL, level).expect_err("the broker would not see it stop");
    }
    client.set(address::STATUS_RETURN_LEVEL, 2).expect("that is how it is");
}

/// Of two fingers one is absent.
#[test]
fn an_absent_finger_keeps_the_other_one_neither_from_its_stop_nor_from_its_next_commander() {
    let shared = tared(Served::patient("wall"), 1..=1);
    let mut commander = shared.client();
    commander.set_each([0, 1], address::TORQUE_ENABLE, 1);
    commander.set(address::GOAL_FORCE_MN, 1_000).expect("it obeys");
    drop(commander);
    let mut next = shared.client();
    next.set(address::TORQUE_ENABLE, 1).expect("it commands now");
    next.set(address::GOAL_FORCE_MN, 500).expect("it obeys");
    let begun = shared.finger.heard();
    while shared.finger.heard() - begun < 2_000 {
        assert_eq!(next.number(address::GOAL_FORCE_MN).expect("it answers"), 500);
    }
    drop(next);
    shared.until_released();
    let said = error_at_its_end(shared);
    assert!(said.contains("could not stop ID 0:"), "{said}");
}
