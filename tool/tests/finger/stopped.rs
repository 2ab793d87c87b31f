//! A signal, a kill or `fingertip stop` in the middle of each motion: the finger is at rest afterwards. And the state after
//! KILL behind each packet of a command, or behind some of them where there are hundreds.

use crate::served::{Served, Told, ended, fails, program};
use fingertip::measure::Ended;
use fingertip::shipped::address;
use rustix::process::Signal;
use std::fs;
use std::io::{Read as _, Write as _};
use std::net::{Shutdown, TcpListener};

/// A force that a stopped finger may still show, N.
pub const RESIDUAL_N: f64 = 0.05;

/// The commands that move the finger, each with the mode in which it is caught. `commission` is caught in its jog.
const MOTIONS: [(&[&str], &str); 4] = [
    (&["press", "1", "--seconds", "1000000", "--within-s", "3600"], "Force:"),
    (&["identify", "--no-wait", "--pause-s", "0", "--within-s", "3600", "--apply"], "Press:"),
    (&["commission", "--forward", "yes", "--within-s", "3600", "--apply"], "Strokes:"),
    (&["capture", "--press", "1", "--within-s", "3600", "--force", "--out", "caught.mcap"], "Force:"),
];

/// Starts a command, holds up its packets in a mode of its motion, those of a press while it presses, and sends it a signal.
/// Its exit code, and its errors.
fn signalled(finger: &Served, arguments: &[&str], mode: &'static str, signal: Signal) -> (Option<i32>, String) {
    finger.line(move |line| line.at.push((mode, if mode == "Press:" { 0.5 } else { -1.0 }, Told::stall)));
    let mut child = finger.start(arguments);
    Served::wait_for(|| {
        assert!(
            child.try_wait().expect("it was started").is_none(),
            "{arguments:?} ended before {mode} {}",
            finger.look()
        );
        finger.line(|line| line.stalled.is_some())
    });
    Served::signal(&child, signal);
    finger.go_on();
    ended(&child.wait_with_output().expect("it ends"))
}

pub fn is_at_rest(finger: &Served, what: &str) {
    let info = finger.json(&["info"]);
    let now = (&info["torque_enable"], &info["goal_mn"], &info["bus_watchdog_ms"], info["mode_name"].as_str());
    assert_eq!(now, (&0.into(), &0.into(), &0.into(), Some("off")), "{what}");
}

#[test]
fn a_signal_leaves_every_motion_at_rest_and_clear_of_the_object() {
    for (arguments, mode) in MOTIONS {
        let finger = Served::patient("wall");
        if arguments[0] == "capture" {
            // The force is reached before the capture's memory is full, 0.2 s after the tare, however late a packet comes: the
            // object is near, and the finger's clock waits.
            finger.command("move 1 500");
            finger.line(|line| line.patience_s = Some(0.02));
        }
        for signal in [Signal::INT, Signal::TERM, Signal::HUP, Signal::KILL] {
            let what = format!("{arguments:?} {signal:?}");
            let parameters = finger.json(&["params", "get"]);
            finger.done(&["tare"]);
            let (code, said) = signalled(&finger, arguments, mode, signal);
            if signal == Signal::KILL {
                // The controller releases the object by itself once its bus is silent.
                finger.until_alone("BusSilent");
            }
            assert!(finger.true_force_n() < RESIDUAL_N, "{what}: {}", finger.command("state"));
            if signal == Signal::KILL {
                let stopped = finger.json(&["stop"]);
                assert_eq!((&stopped["mode"], &stopped["fault"]), (&"fault".into(), &7.into()), "{what}: {stopped}");
                finger.done(&["recover"]);
            } else {
                assert_eq!(code, Some(130), "{what}: {said}");
                assert!(said.contains("interrupted before its end; torque is off"), "{what}: {said}");
            }
            is_at_rest(&finger, &what);
            assert_eq!(finger.json(&["params", "get"]), parameters, "{what}");
            if signal != Signal::KILL && ["Press:", "Strokes:"].contains(&mode) {
                let ended = finger.client().number(address::MEASURE_ENDED).expect("it answers");
                assert_eq!(ended, Ended::Interrupted as i64, "{what}");
            }
        }
    }
}

/// Early end of a command: by a signal, a cable that is pulled out, or a controller without power.
#[derive(Clone, Copy, Debug)]
pub enum End {
    Signal(Signal),
    Cable,
    Power,
}

pub const ENDS: [End; 6] = [
    End::Signal(Signal::INT),
    End::Signal(Signal::TERM),
    End::Signal(Signal::HUP),
    End::Signal(Signal::KILL),
    End::Cable,
    End::Power,
];

// One instant of every motion and end, drawn with a fixed seed. More with
// `INSTANTS=50 cargo test -p fingertip-cli --test finger any_instant -- --ignored --nocapture`.
sim::sizes!(
    a_program_that_ends_at_any_instant_leaves_no_force,
    end_at_any_instant(&[End::Cable]),
    // Without power, friction holds the tip in place.
    end_at_any_instant(&ENDS[..5])
);

fn end_at_any_instant(ends: &[End]) {
    let instants = std::env::var("INSTANTS").map_or(1, |text| text.parse().expect("a number of instants"));
    let mut random = fastrand::Rng::with_seed(28);
    for (arguments, _) in MOTIONS {
        // Long enough to be ended while the force is held.
        let short = arguments.iter().map(|word| if *word == "1000000" { "0.5" } else { *word });
        let arguments: Vec<&str> = short.collect();
        let finger = Served::patient("wall");
        finger.done(&["tare"]);
        let packets = finger.packets(&arguments);
        for end in ends.iter().flat_map(|end| std::iter::repeat_n(end, instants)) {
            let (finger, packets) = (Served::patient("wall"), random.u64(1..packets));
            finger.done(&["tare"]);
            end_behind(&finger, packets, &arguments, *end);
            let state = finger.command("state");
            assert!(finger.true_force_n() < RESIDUAL_N, "{arguments:?} {end:?} after {packets} packets: {state}");
        }
        println!("{arguments:?}: no force left at {instants} instants of each end, {packets} packets");
    }
}

/// Ends a command behind a number of its packets; then 1 s goes by. Without power it ends by itself.
pub fn end_behind(finger: &Served, packets: u64, arguments: &[&str], end: End) {
    let begun = finger.heard();
    let (mut arguments, mut behind) = (arguments.to_vec(), packets);
    match end {
        End::Signal(_) => {}
        End::Cable => {
            finger.deaf(packets, u64::MAX);
            arguments.extend(["--timeout-ms", "100"]);
        }
        End::Power => {
            finger.line(move |line| line.restart = Some(packets));
            behind = u64::MAX;
        }
    }
    let mut child = finger.start(&arguments);
    let mut runs = || child.try_wait().expect("it was started").is_none();
    Served::wait_for(|| finger.heard() - begun >= behind || !runs());
    let ended_s = finger.now_s();
    if let (End::Signal(signal), true) = (end, runs()) {
        Served::signal(&child, signal);
    }
    child.wait().expect("it ends");
    while finger.now_s() < ended_s + 1.0 {
        finger.command("state");
    }
}

#[test]
fn stop_stops_every_mode() {
    let finger = Served::patient("wall");
    let press: &[(u16, i64)] = &[(address::TORQUE_ENABLE, 1), (address::GOAL_FORCE_MN, 1_000)];
    for (writes, mode) in [
        (&[][..], "Off:"),
        (press, "Approach:"),
        (press, "Force:"),
        // A host that reads few answers.
        (&[press[0], press[1], (address::STATUS_RETURN_LEVEL, 0)], "Force:"),
        (&[press[0], press[1], (address::STATUS_RETURN_LEVEL, 1)], "Force:"),
        (&[(address::TORQUE_ENABLE, 1), (address::MEASURE, 3)], "Press:"),
        (&[(address::MEASURE, 2)], "Strokes:"),
    ] {
        finger.done(&["tare"]);
        finger.set(&[&[(address::BUS_WATCHDOG, 100)], writes].concat());
        finger.until_alone(mode);
        let stopped = finger.json(&["stop"]);
        assert_eq!((&stopped["mode"], &stopped["at_rest"]), (&"off".into(), &true.into()), "{mode} {stopped}");
        assert!(!stopped["mode_before"].is_null() && !stopped["force_before_mn"].is_null(), "{stopped}");
        assert!(finger.true_force_n() < RESIDUAL_N, "{mode} {}", finger.command("state"));
        is_at_rest(&finger, mode);
    }
}

/// The release has begun, nobody feeds the watchdog, and torque is still on.
#[test]
fn a_signal_does_not_end_a_stop_before_torque_is_off() {
    let finger = Served::patient("wall");
    for signal in [Signal::INT, Signal::TERM, Signal::HUP] {
        finger.done(&["tare"]);
        finger.set(&[(address::TORQUE_ENABLE, 1), (address::GOAL_FORCE_MN, 1_000)]);
        finger.until_alone("Force:");
        let (code, said) = signalled(&finger, &["stop"], "Release:", signal);
        assert_eq!(code, Some(130), "{signal:?}: {said}");
        is_at_rest(&finger, "stop");
    }
}

/// A controller that turns torque on restarts, which ends the capture with another code.
#[test]
fn a_signal_during_the_tare_of_a_capture_keeps_torque_off() {
    let finger = Served::patient("wall");
    finger.line(|line| line.at.push(("Release:", -1.0, Told::restart)));
    let capture = ["capture", "--press", "1", "--within-s", "3600", "--out", "tare.mcap"];
    let (code, said) = signalled(&finger, &capture, "Tare:", Signal::INT);
    assert_eq!(code, Some(130), "{said}");
    is_at_rest(&finger, "capture");
}

#[test]
fn stop_works_in_a_fault_and_on_a_line_that_loses_packets() {
    let finger = Served::patient("wall");
    finger.done(&["tare"]);
    finger.set(&[(address::TORQUE_ENABLE, 1), (address::GOAL_FORCE_MN, 1_000)]);
    finger.until_alone("Force:");
    finger.deaf(0, 2);
    let said = finger.done(&["--timeout-ms", "1000", "stop"]);
    assert!(said.contains("ID 1: mode force, ") && said.contains(" -> mode off, "), "{said}");
    is_at_rest(&finger, "lost packets");

    finger.command("fault supply-low");
    finger.set(&[(address::TORQUE_ENABLE, 1)]);
    finger.until_alone("SupplyLow");
    let said = finger.done(&["stop"]);
    assert!(said.contains("fault 9 (supply low) remains: `fingertip recover`"), "{said}");
}

#[test]
fn stop_says_that_a_port_is_busy() {
    let listener = TcpListener::bind("127.0.0.1:0").expect("some port is free");
    let port = format!("tcp:{}", listener.local_addr().expect("a socket"));
    std::thread::spawn(move || {
        let (mut client, _) = listener.accept().expect("a client");
        client.write_all(b"busy: somebody is connected").expect("it listens");
        client.shutdown(Shutdown::Write).expect("it listens");
        let _ = client.read_to_end(&mut Vec::new());
    });
    fails(&program(&["--port", &port, "stop"]).output().expect("it starts"), &["busy: somebody is connected"]);
}

#[test]
fn one_packet_stops_all_fingers() {
    let finger = Served::patient("grasp");
    let both = |word: &str| finger.command("state").matches(word).count() == 2;
    let press = |goal_mn, mode| {
        // Both are tared before one of them may push the object onto the other.
        [1, 2].into_iter().for_each(|id| drop(finger.tared(id)));
        let mut client = finger.client();
        for (register, value) in [(address::TORQUE_ENABLE, 1), (address::GOAL_FORCE_MN, goal_mn)] {
            client.set_each(&[1, 2], register, value).expect("it listens");
        }
        while !both(mode) {}
    };
    press(0, "Release:");
    let stopped = finger.json(&["--timeout-ms", "1000", "stop", "--all"]);
    let ids: Vec<_> = stopped.as_array().expect("a list").iter().map(|one| one["id"].as_u64()).collect();
    assert_eq!(ids, [Some(1), Some(2)], "{stopped}");
    assert!(both("Off:"), "{}", finger.command("state"));
    // The first packet is enough. What comes in with it is heard as well, nothing after that.
    press(0, "Release:");
    finger.deaf(1, u64::MAX);
    let why = finger.refuses(&["--timeout-ms", "50", "stop", "--all"], &[]);
    assert!(both("Off:"), "{why} {}", finger.command("state"));
    // So it is for listed ones: an absent ID before them does not keep them pressing.
    finger.deaf(0, 0);
    press(500, "Force:");
    finger.deaf(1, u64::MAX);
    let stop = finger.start(&["--id", "9,1,2", "--timeout-ms", "50", "stop", "--json"]).wait_with_output();
    let stop = stop.expect("it ends");
    fails(&stop, &["ID 9: ", "ID 1: ", "ID 2: "]);
    assert_eq!(stop.stdout, b"[]\n");
    assert!(both("Release:"), "{}", finger.command("state"));
}

#[test]
fn a_restore_leaves_the_old_parameters_or_the_new_ones() {
    let finger = Served::begin("wall");
    let get = || finger.json(&["params", "get"]);
    let is = |file: &String| finger.json(&["params", "diff", file]) == serde_json::json!({});
    let [old, new] = ["old.toml", "new.toml"].map(|name| finger.file(name));
    let beside = ["fit_level", "return_delay_time"];
    finger.done(&["params", "backup", &old]);
    finger.done(&["params", "set", "modulus_pa=300000", "clearance_um=500", "fit_level=4", "return_delay_time=100"]);
    finger.done(&["params", "backup", &new]);
    let after = get();
    finger.done(&["params", "restore", &old, "--save"]);
    let before = get();
    let mut seen = [0; 3];
    for packets in 0.. {
        if !finger.ended_after(packets, &["params", "restore", &new, "--save"], Signal::KILL) {
            break;
        }
        let now = get();
        let side = |name: &str| if now[name] == after[name] { &after } else { &before };
        let all_of = |side: &serde_json::Value| {
            let names = side.as_object().expect("a map").iter();
            names.filter(|(name, _)| !beside.contains(&name.as_str())).all(|(name, value)| now[name] == *value)
        };
        // Until the next reset: the parameters go together, those beside them one by one, each whole.
        assert!(all_of(side("modulus_pa")), "killed after {packets}: {now}");
        assert!(beside.iter().all(|name| now[*name] == side(name)[*name]), "killed after {packets}: {now}");
        assert_eq!(is(&new), now == after, "killed after {packets}");
        // Behind a reset: all old, or all new.
        finger.restart();
        let kept = get();
        assert!(kept == before || kept == after, "killed after {packets}: {kept}");
        seen[usize::from(now == after) + usize::from(kept == after)] += 1;
        finger.done(&["params", "restore", &old, "--save"]);
    }
    assert!(seen.iter().sum::<i32>() >= 20 && seen.iter().all(|count| *count > 0), "{seen:?}");
    assert_eq!(get(), after, "the last one came to its end");
    assert!(!fs::exists(finger.file("new.toml.part")).expect("a folder"));

    // TERM while the finger misses each packet in turn; KILL would leave gains of the file with parameters of before.
    let text = fs::read_to_string(&new).expect("it was written");
    fs::write(&new, text.replace("row_3 = [16384, ", "row_3 = [20000, ")).expect("a file");
    let mut seen = [0; 2];
    for packets in 0.. {
        finger.done(&["params", "restore", &old]);
        if !finger.ended_after(packets, &["--timeout-ms", "1000", "params", "restore", &new], Signal::TERM) {
            break;
        }
        let same = [&old, &new].map(is);
        assert!(same[0] != same[1], "signalled after {packets}: {}", finger.json(&["params", "diff", &new]));
        seen[usize::from(same[1])] += 1;
    }
    assert!(seen.iter().all(|count| *count > 0), "{seen:?}");
}

#[test]
fn a_press_leaves_a_motor_that_stops() {
    let finger = Served::begin("wall");
    finger.done(&["tare"]);
    let points = (0..12).chain((12..).step_by(12));
    let mut stopped = 0;
    let press = ["press", "0.5", "--seconds", "0.1", "--within-s", "3600"];
    for packets in points {
        if !finger.ended_after(packets, &press, Signal::KILL) {
            break;
        }
        stopped += i32::from(at_rest(&finger, packets).contains("BusSilent"));
        finger.done(&["recover"]);
        assert_eq!(finger.json(&["info"])["torque_enable"], 0, "killed after {packets}");
    }
    assert!(stopped > 0);
    finger.done(&press);
}

/// Nobody asks it anything: it stops by itself, or was not moving.
fn at_rest(finger: &Served, point: u64) -> String {
    let rests = |state: &String| state.contains(": Off") || state.contains("BusSilent");
    let state = (0..5_000).map(|_| finger.command("state")).find(rests);
    state.unwrap_or_else(|| panic!("at {point}: {}", finger.command("state")))
}

#[test]
fn a_press_whose_packets_are_lost_does_not_press_on() {
    let finger = Served::begin("wall");
    finger.done(&["tare"]);
    for (packets, lost) in [(5, 2), (30, 1), (30, 2), (30, 3), (31, 5), (32, 6), (33, 40)] {
        finger.deaf(packets, lost);
        let press = ["--timeout-ms", "50", "press", "0.5", "--seconds", "1", "--within-s", "3600"];
        let (code, said) = ended(&finger.start(&press).wait_with_output().expect("it ends"));
        at_rest(&finger, lost);
        // The sixth packet sets the bus watchdog, which would stay if only its answer was lost: it is sent again.
        assert!(code == Some(0) || packets > 5 && said.contains("fingertip: "), "{said}");
        finger.deaf(0, 0);
        finger.done(&["recover"]);
    }
}

/// The line stalls, the press is interrupted, and the finger hears all of its packets at once.
#[test]
fn a_release_that_arrives_late_leaves_no_force() {
    let finger = Served::begin("wall");
    finger.done(&["tare"]);
    let child = finger.start(&["--timeout-ms", "50", "press", "1", "--seconds", "3600", "--within-s", "3600"]);
    finger.until("Force");
    // The bus watchdog does not come first.
    finger.line(|line| line.patience_s = Some(0.1));
    finger.line(|line| line.stalled = Some(Vec::new()));
    Served::interrupt(&child);
    let output = child.wait_with_output().expect("it ends");
    assert!(!output.status.success(), "{output:?}");
    finger.go_on();
    finger.line(|line| line.patience_s = None);
    at_rest(&finger, 0);
    assert!(finger.true_force_n() < 0.05, "{} N", finger.true_force_n());
}

#[test]
fn a_controller_that_starts_anew_was_not_commissioned() {
    let finger = Served::begin("wall");
    finger.line(|line| line.at.push(("Strokes", -1.0, Told::restart)));
    finger.refuses(&["commission", "--forward", "yes"], &["came to no end", "restarted"]);
}

#[test]
fn a_motion_that_somebody_else_began_is_left_alone() {
    let finger = Served::begin("wall");
    finger.done(&["tare"]);
    finger.set(&[(address::MEASURE, 2)]);
    finger.until_alone("Strokes");
    let (identify, file) = (["identify", "--no-wait", "--pause-s", "0"], finger.file("other.mcap"));
    for command in [&["commission", "--forward", "yes"][..], &identify, &["tare"], &["capture", "--out", &file]] {
        finger.refuses(command, &["another motion that measures is under way"]);
    }
    assert!(finger.command("state").contains("Strokes"), "it was left alone");
    finger.done(&["stop"]);
    finger.command("fault supply-low");
    finger.refuses(&["commission", "--forward", "yes"], &["fault 9 (supply low)"]);
}
