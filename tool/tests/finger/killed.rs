//! State after a killed command: KILL after each of its packets, or after some of them where there are hundreds.

use crate::served::{Served, ended};
use fingertip::link::packet::instruction::REBOOT;
use fingertip::shipped::address;
use std::fs;

#[test]
fn a_restore_leaves_the_old_parameters_or_the_new_ones() {
    let finger = Served::begin("wall");
    let get = || finger.json(&["params", "get"]);
    let (old, new) = (finger.file("old.toml"), finger.file("new.toml"));
    let beside = ["fit_level", "return_delay_time"];
    finger.done(&["params", "backup", &old]);
    finger.done(&["params", "set", "modulus_pa=300000", "clearance_um=500", "fit_level=4", "return_delay_time=100"]);
    finger.done(&["params", "backup", &new]);
    let after = get();
    finger.done(&["params", "restore", &old, "--save"]);
    let before = get();
    let mut seen = [0; 3];
    for packets in 0.. {
        if !finger.killed_after(packets, &["params", "restore", &new, "--save"]) {
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
        // Differences are reported.
        let differing = finger.json(&["params", "diff", &new]);
        assert_eq!(differing.as_object().map(serde_json::Map::is_empty), Some(now == after), "killed after {packets}");
        // Behind a reset: all old, or all new.
        finger.command(&format!("raw {REBOOT}"));
        let kept = get();
        assert!(kept == before || kept == after, "killed after {packets}: {kept}");
        seen[usize::from(now == after) + usize::from(kept == after)] += 1;
        finger.done(&["params", "restore", &old, "--save"]);
    }
    assert!(seen.iter().sum::<i32>() >= 20 && seen.iter().all(|count| *count > 0), "{seen:?}");
    assert_eq!(get(), after, "the last one came to its end");
    assert!(!fs::exists(finger.file("new.toml.part")).expect("a folder"));
}

/// A controller that restarts has the values of the flash, and reports them as saved.
#[test]
fn a_save_during_which_the_controller_starts_anew_is_not_told_as_one() {
    let finger = Served::begin("wall");
    let modulus = || finger.json(&["params", "get"])["modulus_pa"].as_i64().expect("a number");
    let kept = modulus();
    let mut refused = 0;
    for packets in 0.. {
        finger.done(&["params", "set", "modulus_pa=300000"]);
        finger.command(&format!("restart after {packets}"));
        let output = finger.writing_to(&["params", "save"], std::process::Stdio::null());
        let restarted = finger.command("restarted") == "true";
        finger.command(&format!("raw {REBOOT}"));
        let now = modulus();
        if !restarted {
            assert!(output.status.success() && now == 300_000, "{output:?}");
            break;
        }
        // Before the first packet there is nothing yet that could be lost.
        let lost = output.status.success() && now != 300_000;
        assert!(!lost || packets <= 1, "restarted after {packets}: {output:?}");
        refused += i32::from(!output.status.success());
        finger.done(&["params", "set", &format!("modulus_pa={kept}"), "--save"]);
    }
    assert!(refused > 0, "{refused} refused");
}

#[test]
fn a_press_leaves_a_motor_that_stops() {
    let finger = Served::begin("wall");
    finger.done(&["tare"]);
    let points = (0..12).chain((12..).step_by(12));
    let mut stopped = 0;
    for packets in points {
        if !finger.killed_after(packets, &["press", "0.5", "--seconds", "0.1", "--within-s", "3600"]) {
            break;
        }
        stopped += i32::from(at_rest(&finger, packets).contains("BusSilent"));
        finger.done(&["recover"]);
        assert_eq!(finger.json(&["info"])["torque_enable"], 0, "killed after {packets}");
    }
    assert!(stopped > 0);
    finger.done(&["press", "0.5", "--seconds", "0.1", "--within-s", "3600"]);
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
    for (packets, lost) in [(30, 1), (30, 2), (30, 3), (31, 5), (32, 6), (33, 40)] {
        finger.command(&format!("deaf after {packets} for {lost}"));
        let press = ["--timeout-ms", "50", "press", "0.5", "--seconds", "1", "--within-s", "3600"];
        let (code, said) = ended(&finger.start(&press).wait_with_output().expect("it ends"));
        at_rest(&finger, lost);
        assert!(code == Some(0) || said.contains("fingertip: "), "{said}");
        finger.command("deaf no more");
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
    finger.command("patient on");
    finger.command("stall");
    Served::interrupt(&child);
    let output = child.wait_with_output().expect("it ends");
    assert!(!output.status.success(), "{output:?}");
    finger.command("go on");
    finger.command("patient off");
    at_rest(&finger, 0);
    assert!(finger.true_force_n() < 0.05, "{} N", finger.true_force_n());
}

#[test]
fn a_controller_that_starts_anew_was_not_commissioned() {
    let finger = Served::begin("wall");
    finger.command(&format!("trap Strokes {REBOOT}"));
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
