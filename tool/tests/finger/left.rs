//! A commander of `fingertip share` leaves or is silent, or `share` ends: the fingers are stopped.

use crate::served::Served;
use crate::shared::{Asker, Shared, sync_write};
use fingertip::link::packet::instruction;
use fingertip::shipped::address;
use fingertip::state::Mode;
use fingertip_cli::client::packet;
use std::io::Read as _;
use std::time::Duration;

/// Reads the mode until it is off, with at most this number of packets.
fn reads_until_off(finger: &Served, reader: &mut Asker, packets: u64) {
    let begun = finger.heard();
    while !matches!(reader.once.number(address::PRESENT_MODE), Ok(mode) if mode == Mode::Off as i64) {
        assert!(finger.heard() - begun < packets, "{}", finger.command("look"));
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
fn a_killed_commander_is_stopped_though_others_read() {
    let shared = Shared::begin("wall");
    let mut reader = shared.client();
    for round in 0..2 {
        let mut press = shared.press();
        let signal = [rustix::process::Signal::KILL, rustix::process::Signal::STOP][round];
        Served::signal(&press, signal);
        shared.soon(|| reader.number(address::PRESENT_MODE).expect("it answers") == 0);
        shared.until_released();
        let _ = press.kill();
        press.wait().expect("it ends");
        let fault = reader.number(address::FAULT).expect("it answers");
        assert_eq!(fault, 0, "{signal:?}: the broker stopped it, not the watchdog");
    }
    // The end of the broker, too.
    let mut press = shared.press();
    Served::interrupt(&shared.broker);
    shared.until_released();
    press.wait().expect("it ends");
}

#[test]
fn a_finger_of_a_group_is_stopped_once_its_commander_has_left() {
    let finger = Served::patient("grasp");
    drop(finger.tared(1));
    finger.tared(2).set(address::TORQUE_ENABLE, 1).expect("it obeys");
    let shared = Shared::of(finger);
    let mut commander = shared.client();
    sync_write(&mut commander, address::TORQUE_ENABLE, 1, &[1, 1]);
    while commander.number(address::TORQUE_ENABLE).expect("it answers") != 1 {}
    drop(commander);
    shared.until_released();
    let mut client = shared.client();
    client.once.id = 2;
    assert_eq!(client.number(address::TORQUE_ENABLE).expect("it answers"), 1, "nobody commanded it");
}

/// Another client stops one of two fingers. The commander feeds the watchdog of the other one until it leaves.
#[test]
fn the_other_fingers_of_a_stopped_commander_are_stopped_once_it_has_left() {
    let finger = Served::patient("grasp");
    for id in [1, 2] {
        drop(finger.tared(id));
    }
    let shared = Shared::of(finger);
    let (mut first, mut second) = (shared.client(), shared.client());
    for id in [1, 2] {
        first.once.id = id;
        first.set(address::TORQUE_ENABLE, 1).expect("it obeys");
    }
    first.set(address::BUS_WATCHDOG, 50).expect("it obeys");
    sync_write(&mut second, address::GOAL_FORCE_MN, 4, &[1, 0, 0, 0, 0]);
    second.number(address::TORQUE_ENABLE).expect("it answers");
    first.set(address::GOAL_FORCE_MN, 500).expect_err("it was stopped");
    first.once.id = 1;
    let begun_s = shared.finger.now_s();
    while shared.finger.now_s() < begun_s + 3.0 {
        sync_write(&mut first, 0, 0, &[]);
        first.ping().expect("it answers");
    }
    second.once.id = 2;
    assert_eq!(second.number(address::TORQUE_ENABLE).expect("it answers"), 1, "{}", shared.finger.command("look"));
    drop(first);
    shared.soon(|| second.number(address::TORQUE_ENABLE).expect("it answers") == 0);
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
    assert!(shared.output(&["tare"]).status.success());
    let (mut first, mut press) = (shared.client(), shared.client());
    let goals: Vec<u8> = (1..60).flat_map(|id| [id, 1, 0, 0, 0]).collect();
    sync_write(&mut first, address::GOAL_FORCE_MN, 4, &goals);
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
    sync_write(&mut press, address::TORQUE_ENABLE, 1, &(1..60).flat_map(|id| [id, 0]).collect::<Vec<u8>>());
    while press.number(address::TORQUE_ENABLE).expect("it answers") != 0 {}
}

/// The clock of the finger waits for packets, so its watchdog does not trip: the keep-alive packets are counted.
#[test]
fn the_end_feeds_all_fingers_and_asks_many_ids_by_one_ping() {
    for (last, packets) in [(9, 8..60), (9 + 80, 2..8)] {
        let mut shared = Shared::within(900, Served::patient("wall"));
        let mut client = shared.client();
        let steps: Vec<u8> = (9..=last).flat_map(|id| [id, 25]).collect();
        sync_write(&mut client, address::BUS_WATCHDOG, 1, &steps);
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
    shared.finger.command("deaf after 0 for 12");
    drop(commander);
    reads_until_off(&shared.finger, &mut reader, 200);
    shared.until_released();
    next.set(address::TORQUE_ENABLE, 1).expect("it commands now");
    shared.finger.command("deaf after 0 for 2");
    drop(next);
    Served::wait_for(|| shared.finger.command("unheard") == "2");
    // A client that writes to it in a group packet commands it before the next try to stop it.
    let mut next = shared.client();
    sync_write(&mut next, address::TORQUE_ENABLE, 1, &[1, 1]);
    next.ping().expect("it answers");
    for _ in 0..1_000 {
        assert_eq!(reader.number(address::TORQUE_ENABLE).expect("it answers"), 1, "it has a commander");
    }
}

sim::sizes!(
    a_silent_commander_is_stopped_whoever_set_the_watchdog,
    stopped(&[("before", true), ("later", false)]),
    stopped(&[("before", false), ("since", false), ("indirect", false)])
);

/// Another program has set the bus watchdog, before `share` began or since, or the commander sets it in a packet that does not
/// name its register; and the commander may write in group packets only.
fn stopped(ways: &[(&str, bool)]) {
    for &(way, groups) in ways {
        let finger = Served::patient("wall");
        if way == "before" {
            finger.set(&[(address::BUS_WATCHDOG, 25)]);
        }
        let shared = tared(finger, 1..=1);
        if way == "since" {
            shared.client().set(address::BUS_WATCHDOG, 25).expect("it obeys");
        }
        let (mut commander, mut reader) = (shared.client(), shared.client());
        if groups {
            sync_write(&mut commander, address::TORQUE_ENABLE, 1, &[1, 1]);
            sync_write(&mut commander, address::GOAL_FORCE_MN, 4, &[1, 0xE8, 3, 0, 0]);
        } else {
            presses(&mut commander);
        }
        let [low, high] = address::BUS_WATCHDOG.to_le_bytes();
        if way == "later" {
            let later = [(instruction::REG_WRITE, &[low, high, 25][..]), (instruction::ACTION, &[])];
            // Both again where an answer was lost: an action without its write is refused.
            let answers = std::iter::repeat_with(|| {
                later.map(|(number, params)| {
                    commander.once.pass(&packet(1, number, params), Some(1), 1).expect("it listens")
                })
            });
            let mut answered = answers.skip_while(|answers| answers.iter().any(Vec::is_empty));
            assert_eq!(answered.next().expect("an answer comes").map(|answer| answer[8]), [0; 2]);
        }
        if way == "indirect" {
            commander.write(address::INDIRECT_ADDRESS_1, &[low, high]).expect("it obeys");
            commander.write(address::INDIRECT_DATA_1, &[25]).expect("it obeys");
        }
        while reader.number(address::PRESENT_MODE).expect("it answers") == Mode::Off as i64 {}
        reads_until_off(&shared.finger, &mut reader, 20_000);
        let fault = reader.number(address::FAULT).expect("it answers");
        assert_eq!(fault, 0, "{way}: the broker stopped it, not the watchdog");
    }
}

/// The keep-alive packets would be hundreds.
#[test]
fn absent_fingers_of_who_left_do_not_feed_the_watchdog_of_a_silent_commander() {
    let shared = tared(Served::patient("wall"), 1..=1);
    let (mut first, mut second) = (shared.client(), shared.client());
    let goals: Vec<u8> = (1..60).flat_map(|id| [id, 1, 0, 0, 0]).collect();
    sync_write(&mut first, address::GOAL_FORCE_MN, 4, &goals);
    first.ping().expect("it answers");
    second.set(address::TORQUE_ENABLE, 0).expect("anyone stops");
    second.set(address::BUS_WATCHDOG, 25).expect("it commands now");
    presses(&mut second);
    let begun = shared.finger.heard();
    drop(first);
    while !["Off", "Fault"].iter().any(|mode| shared.finger.command("look").contains(mode)) {
        let packets = shared.finger.heard() - begun;
        assert!(packets < 60, "{packets} packets, {}", shared.finger.command("look"));
        std::thread::sleep(Served::LOOK);
    }
}

#[test]
fn the_end_names_the_fingers_that_it_could_not_stop() {
    let shared = tared(Served::patient("grasp"), 1..=2);
    let mut commander = shared.client();
    for id in [1, 2] {
        commander.once.id = id;
        commander.set(address::TORQUE_ENABLE, 1).expect("it obeys");
    }
    shared.finger.command(&format!("deaf after 0 for {}", u64::MAX));
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
    sync_write(&mut commander, address::TORQUE_ENABLE, 1, &[1, 1]);
    sync_write(&mut commander, address::GOAL_FORCE_MN, 4, &[1, 0xE8, 3, 0, 0]);
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
    sync_write(&mut commander, address::TORQUE_ENABLE, 1, &[0, 1, 1, 1]);
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
