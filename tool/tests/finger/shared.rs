//! `fingertip share`: one client commands, all read, anyone stops.

use crate::served::{Served, ended, line_with};
use crate::stopped::RESIDUAL_N;
use fingertip::link::packet::{BROADCAST, StatusError, instruction};
use fingertip::shipped::address;
use fingertip::state::Mode;
use fingertip_cli::client::{Pong, packet};
use fingertip_cli::{Client, Error};
use std::io::{Read as _, Write as _};
use std::net::TcpStream;
use std::process::Child;
use std::time::Duration;

/// Time that a client of the broker waits by its `--timeout-ms`.
const TIMEOUT_MS: u64 = 6_000;

/// A served finger and a broker in front of it, through which all programs and clients reach the finger.
pub struct Shared {
    pub finger: Served,
    pub broker: Child,
    /// The finger's own port.
    behind: String,
    /// Time after which it takes an answer for lost, where that is short.
    lost: Option<Duration>,
}

/// A client of a broker. What the broker took for lost it asks again: on a busy machine the answer came too late.
pub struct Asker {
    /// The client that asks once.
    pub once: Client,
    again: bool,
}

impl Asker {
    fn ask<T>(&mut self, ask: impl Fn(&mut Client) -> Result<T, Error>) -> Result<T, Error> {
        loop {
            match ask(&mut self.once) {
                Err(Error::Silent(_)) if self.again => {}
                other => return other,
            }
        }
    }

    pub fn set(&mut self, register: u16, value: i64) -> Result<(), Error> {
        self.ask(|client| client.set(register, value))
    }

    pub fn number(&mut self, register: u16) -> Result<i64, Error> {
        self.ask(|client| client.number(register))
    }

    pub fn ping(&mut self) -> Result<Pong, Error> {
        self.ask(Client::ping)
    }

    /// Writes a register of several devices in group packets. No device answers.
    pub fn set_each(&mut self, ids: impl IntoIterator<Item = u8>, register: u16, value: i64) {
        self.once.set_each(&ids.into_iter().collect::<Vec<_>>(), register, value).expect("it listens");
    }
}

/// Starts a broker of a port; it and its own port, once it listens. That port is in a line of JSON.
fn broker(finger: &Served, port: &str, listen: &str, timeout_ms: u64) -> (Child, String) {
    let timeout = timeout_ms.to_string();
    let mut broker = finger.start(&["--port", port, "share", "--listen", listen, "--timeout-ms", &timeout, "--json"]);
    let line = line_with("tcp:", broker.stdout.take().expect("a pipe"));
    let line: serde_json::Value = serde_json::from_str(&line).expect(&line);
    (broker, line["address"].as_str().expect("a port").to_owned())
}

impl Shared {
    pub fn begin(scene: &str) -> Self {
        Self::of(Served::patient(scene))
    }

    pub fn of(finger: Served) -> Self {
        Self::behind(TIMEOUT_MS, None, finger)
    }

    fn behind(timeout_ms: u64, lost: Option<Duration>, mut finger: Served) -> Self {
        let (broker, port) = broker(&finger, &finger.port, "127.0.0.1:0", timeout_ms);
        let behind = std::mem::replace(&mut finger.port, port);
        Self { finger, broker, behind, lost }
    }

    /// With a time-out that is short because fingers are absent or packets are lost.
    pub fn within(timeout_ms: u64, finger: Served) -> Self {
        Self::behind(timeout_ms, Some(Duration::from_millis(timeout_ms / 3)), finger)
    }

    pub fn client(&self) -> Asker {
        let mut once = self.finger.client();
        if let Some(lost) = self.lost {
            once.timeout = 2 * lost;
        }
        Asker { once, again: self.lost.is_some() }
    }

    fn address(&self) -> &str {
        self.finger.port.strip_prefix("tcp:").expect("a TCP port")
    }

    /// Tares, and presses until the force is held.
    pub fn press(&self) -> Child {
        self.finger.done(&["tare"]);
        let press = self.finger.start(&["press", "1", "--seconds", "1000000", "--within-s", "3600"]);
        self.finger.until("Force:");
        press
    }

    /// Ends the broker. Returns the number of its packets meanwhile.
    pub fn packets_at_its_end(&mut self) -> u64 {
        let before = self.finger.heard();
        Served::interrupt(&self.broker);
        self.broker.wait().expect("it ends");
        self.finger.heard() - before
    }

    pub fn until_released(&self) {
        Served::wait_for(|| self.finger.true_force_n() <= RESIDUAL_N && self.finger.look().contains(": Off"));
    }
}

impl Drop for Shared {
    fn drop(&mut self) {
        let _ = self.broker.kill();
        let _ = self.broker.wait();
    }
}

#[test]
fn a_press_is_watched_and_no_answer_reaches_another_client() {
    let shared = Shared::begin("wall");
    let mut press = shared.press();
    let record = shared.finger.start(&["record", "--seconds", "0.5", "watched.csv"]);
    let words = [(address::MODEL_NUMBER, 2), (address::GOAL_FORCE_MN, 4), (address::TORQUE_ENABLE, 1)];
    let readers = words.map(|(register, length)| {
        let mut client = shared.client();
        std::thread::spawn(move || {
            let first = client.once.read(register, length).expect("it answers");
            for _ in 0..200 {
                assert_eq!(client.once.read(register, length).expect("it answers"), first);
            }
        })
    });
    for reader in readers {
        reader.join().expect("no answer of another client");
    }
    let record = record.wait_with_output().expect("it ends");
    assert!(record.status.success(), "{record:?}");
    // A second client does not command.
    let why = shared.client().set(address::GOAL_FORCE_MN, 2_000).expect_err("another one commands").to_string();
    assert!(why.contains("error 7") && why.contains("`fingertip share`"), "{why}");
    assert!(press.try_wait().expect("it was started").is_none());
    // But it stops.
    shared.finger.done(&["stop"]);
    shared.until_released();
    let (code, said) = ended(&press.wait_with_output().expect("it ends"));
    assert_eq!(code, Some(1));
    assert!(!said.contains("stopping the finger failed"), "{said}");
}

/// Two clients keep the bus busy: each of their stops waits for an absent ID.
#[test]
fn a_stop_behind_reads_is_passed_though_its_client_has_left() {
    let finger = Served::patient("wall");
    finger.tared(1).set(address::TORQUE_ENABLE, 1).expect("it obeys");
    let shared = Shared::within(600, finger);
    let [low, high] = address::TORQUE_ENABLE.to_le_bytes();
    let stop = |id| packet(id, instruction::WRITE, &[low, high, 0]);
    let send = |bytes: &[u8]| {
        let mut stream = TcpStream::connect(shared.address()).expect("it listens");
        stream.write_all(bytes).expect("it listens");
        stream
    };
    let _busy = [send(&stop(9).repeat(300)), send(&stop(9).repeat(300))];
    drop(send(&[&packet(1, instruction::PING, &[]).repeat(20)[..], &stop(1)].concat()));
    shared.until_released();
}

#[test]
fn a_press_that_measures_is_stopped_by_every_stop() {
    let finger = Served::patient("wall");
    finger.tared(1).set(address::TORQUE_ENABLE, 1).expect("it obeys");
    let shared = Shared::of(finger);
    let (mut first, mut second) = (shared.client(), shared.client());
    let [low, high] = address::TORQUE_ENABLE.to_le_bytes();
    let bulk = packet(BROADCAST, instruction::BULK_WRITE, &[1, low, high, 1, 0, 0, 9, low, high, 1, 0, 0]);
    first.set(address::BUS_WATCHDOG, 0).expect("it obeys");
    second.once.pass(&bulk, None, 0).expect("anyone stops");
    assert_eq!(second.number(address::TORQUE_ENABLE).expect("it answers"), 0);
    second.set(address::TORQUE_ENABLE, 1).expect("it commands now");
    second.set(address::MEASURE, 3).expect("it obeys");
    while second.number(address::PRESENT_MODE).expect("it answers") != Mode::Press as i64 {}
    let mut third = shared.client();
    for register in [address::SHORT_GOAL_MN, address::MIRROR_GOAL_MN, address::MEASURE] {
        third.set(register, 0).expect("anyone stops");
    }
    shared.finger.done(&["stop"]);
    shared.until_released();
}

#[test]
fn clients_that_send_junk_or_read_nothing_block_nobody() {
    let shared = Shared::begin("wall");
    let connect = || TcpStream::connect(shared.address()).expect("it listens");
    let mut client = shared.client();
    client.set(address::TARE, 1).expect("it obeys");
    let mut random = fastrand::Rng::with_seed(7);
    let mut half = connect();
    half.write_all(&[0xFF, 0xFF, 0xFD, 0x00, 1, 7, 0, 2]).expect("it listens");
    let mut junk = connect();
    junk.write_all(&std::iter::repeat_with(|| random.u8(..)).take(100_000).collect::<Vec<_>>()).expect("it listens");
    // It is refused more often than the system has room for answers, and takes none.
    let mut deaf = connect();
    let [low, high] = address::TARE.to_le_bytes();
    let write = packet(1, instruction::WRITE, &[low, high, 1]);
    deaf.write_all(&write.repeat(500_000)).expect("the system takes it, or the broker reads it");
    while deaf.write_all(&write).is_ok() {
        client.ping().expect("it answers");
    }
    for _ in 0..20 {
        let mut client = connect();
        let count = random.usize(..write.len() + 1);
        client.write_all(&write[..count]).expect("it listens");
        if random.bool() && count == write.len() {
            client.read_exact(&mut [0; 4]).expect("it answers");
        }
    }
    for _ in 0..100 {
        assert_eq!(client.ping().expect("it answers").id, 1);
    }
    client.set(address::TARE, 1).expect("it obeys");
    client.once.timeout = Duration::from_secs(5);
    assert_eq!(client.once.ping_all().expect("it answers").len(), 1);
}

/// The stopped program turns torque off, too. It wrote by broadcast.
#[test]
fn a_stop_takes_the_command_except_to_clean_up_or_of_another_finger() {
    let mut shared = Shared::begin("wall");
    let (mut first, mut second) = (shared.client(), shared.client());
    first.once.set_all(address::BUS_WATCHDOG, 25).expect("it listens");
    first.set(address::BUS_WATCHDOG, 25).expect("it obeys");
    for _ in 0..2 {
        second.set(address::TORQUE_ENABLE, 0).expect("anyone stops");
    }
    second.set(address::BUS_WATCHDOG, 0).expect("it commands now");
    first.set(address::TORQUE_ENABLE, 0).expect("anyone stops");
    first.set(address::BUS_WATCHDOG, 25).expect_err("it was stopped");
    let mut third = shared.client();
    third.set_each([9], address::TORQUE_ENABLE, 0);
    third.ping().expect("it answers");
    second.set(address::BUS_WATCHDOG, 0).expect("it still commands");
    second.set(address::BAUD_RATE, 4).expect_err("the broker would not follow");
    second.once.write(address::ID, &[1, 4]).expect_err("the broker would not follow");
    first.set(address::TORQUE_ENABLE, 0).expect("anyone stops");
    second.set(address::BUS_WATCHDOG, 0).expect_err("the first one did not only clean up");
    for client in [&mut first, &mut second] {
        client.once.set_all(address::TORQUE_ENABLE, 0).expect("it listens");
        client.ping().expect("it answers");
    }
    assert_eq!(shared.packets_at_its_end(), 0, "no finger is left to stop");
}

/// Each of their packets waits for nothing, for 4 s.
#[test]
fn clients_that_ask_an_absent_id_do_not_starve_a_press() {
    let shared = Shared::begin("wall");
    shared.finger.done(&["tare"]);
    let mut press = shared.client();
    // What is left of `TIMEOUT` is for its own answer: a USB port may delay it.
    press.once.timeout = Duration::from_millis(5_500);
    for (register, value) in [(address::BUS_WATCHDOG, 25), (address::TORQUE_ENABLE, 1), (address::GOAL_FORCE_MN, 1_000)]
    {
        press.set(register, value).expect("it obeys");
    }
    let begun = shared.finger.heard();
    let _pollers: Vec<Asker> = std::iter::repeat_with(|| {
        let mut client = shared.client();
        client.once.id = 9;
        client.once.timeout = Duration::from_millis(1);
        client.ping().expect_err("it is absent");
        client
    })
    .take(4)
    .collect();
    for reads in 0.. {
        if shared.finger.heard() - begun >= reads + 4 {
            break;
        }
        press.number(address::PRESENT_MODE).expect("it is answered in time");
    }
    press.set(address::GOAL_FORCE_MN, 900).expect("it still commands");
}

/// The broker stops the finger at its new ID, and does not wait for answers of the old one.
#[test]
fn an_id_that_a_client_set_is_followed() {
    let mut shared = Shared::within(900, Served::patient("wall"));
    let mut client = shared.client();
    client.set(address::BUS_WATCHDOG, 25).expect("it obeys");
    // Not a second time: it has another ID then.
    client.once.set(address::ID, 7).expect("it obeys");
    client.once.id = 7;
    let reset = packet(7, instruction::FACTORY_RESET, &[1]);
    let refusal = client.once.pass(&reset, Some(7), 1).expect("it answers");
    assert_eq!(refusal[8], StatusError::Access as u8, "it would change the speed");
    let sent = shared.packets_at_its_end();
    assert!((2..8).contains(&sent), "{sent} packets");
}

/// The broker always refuses `baud_rate`, the last of the three.
#[test]
fn a_refused_parameter_does_not_keep_the_others_from_being_put_back() {
    let shared = Shared::begin("wall");
    let set = ["params", "set", "return_delay_time=100", "id=7", "baud_rate=1"];
    shared.finger.refuses(&set, &["nothing was changed", "the bus speed"]);
    let info = shared.finger.json(&["info"]);
    assert_eq!((&info["id"], &info["return_delay_us"]), (&1.into(), &500.into()));
}

#[test]
fn a_scan_through_tcp_finds_each_finger_once() {
    let shared = Shared::within(900, Served::patient("wall"));
    let scan = ["scan", "--speeds", "57600,9600"];
    let found = shared.finger.json(&scan);
    let found = found.as_array().expect("a list");
    assert_eq!((found.len(), &found[0]["id"], &found[0]["baud"]), (1, &1.into(), &serde_json::Value::Null));
    let text = shared.finger.done(&scan);
    assert!(text.lines().count() == 1 && !text.contains("baud"), "{text}");
}

/// As `view` does it.
#[test]
fn a_lost_port_is_opened_again_once_it_is_back() {
    let mut shared = Shared::begin("wall");
    let mut client = shared.client();
    client.ping().expect("it answers");
    shared.broker.kill().expect("it runs");
    shared.broker.wait().expect("it ends");
    assert!(matches!(client.ping(), Err(fingertip_cli::Error::Port(..))));
    assert!(client.once.reopen().is_err(), "it is not back");
    (shared.broker, _) = broker(&shared.finger, &shared.behind, shared.address(), TIMEOUT_MS);
    client.once.reopen().expect("it is back");
    client.ping().expect("it answers");
}
