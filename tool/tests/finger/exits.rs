//! Ends of commands: the exit codes of docs/host.md, errors in JSON, and the help of every command.

use crate::served::{Served, line_with};
use serde_json::Value;
use std::io::Read as _;
use std::os::fd::OwnedFd;

/// Runs each example of the table. Two of them end by what happens meanwhile: 3 by an object that goes away, 130 by
/// Ctrl-C.
#[test]
fn the_exit_codes_are_those_of_the_documentation() {
    let page = include_str!("../../../docs/host.md");
    let table = page.split("| exit code |").nth(1).expect("the table");
    let mut codes = Vec::new();
    for row in table.lines().skip(2).take_while(|line| line.starts_with('|')) {
        let finger = Served::begin("wall");
        finger.done(&["tare"]);
        let cells: Vec<&str> = row.trim_matches('|').split('|').collect();
        let code: i32 = cells[0].trim().parse().expect("a code");
        codes.push(code);
        let examples: Vec<&str> = cells[2].split('`').filter_map(|text| text.strip_prefix("fingertip ")).collect();
        assert!(!examples.is_empty(), "{row}");
        for example in examples {
            let mut child = finger.start(&example.split_whitespace().collect::<Vec<_>>());
            match code {
                3 => {
                    line_with("reached", child.stderr.take().expect("a pipe"));
                    finger.command("remove");
                }
                130 => {
                    line_with("reached", child.stderr.take().expect("a pipe"));
                    Served::interrupt(&child);
                }
                _ => {}
            }
            let output = child.wait_with_output().expect("it ends");
            assert_eq!(output.status.code(), Some(code), "{example}: {output:?}");
        }
    }
    assert_eq!(codes, [0, 1, 2, 3, 130]);
}

#[test]
fn errors_in_json_are_the_last_line_of_standard_error() {
    let finger = Served::begin("wall");
    for (arguments, code, words) in [
        (&["press", "1"][..], 1, "not tared"),
        (&["params", "set", "modulus_pa=4"], 1, "modulus_pa of 4"),
        (&["scan", "--speeds", "115200"], 1, "nothing answers"),
        (&["replay", "/nowhere"], 1, "cannot read"),
        (&["record", "x.txt"], 2, ".csv or .mcap"),
        (&["params", "get", "nonsense"], 2, "no register `nonsense`"),
        (&["press", "0"], 2, "from 0.001 to 150"),
        (&["pres"], 2, "unrecognized subcommand"),
        (&[], 2, "requires a subcommand"),
    ] {
        let output = finger.start(&[arguments, &["--json"]].concat()).wait_with_output().expect("it ends");
        let text = String::from_utf8(output.stderr).expect("UTF-8");
        let error: Value = serde_json::from_str(text.lines().last().unwrap_or_default()).expect(&text);
        assert_eq!((output.status.code(), error["exit_code"].as_i64()), (Some(code), Some(code.into())), "{text}");
        assert!(error["error"].as_str().is_some_and(|error| error.contains(words)), "{text}");
    }
}

#[test]
fn a_press_reports_whether_the_force_was_reached_and_held() {
    let finger = Served::begin("wall");
    finger.done(&["tare"]);
    let press = |arguments: &[&str]| {
        let output = finger.start(&[&["press", "0.5", "--json"], arguments].concat()).wait_with_output();
        let output = output.expect("it ends");
        let report: Value = serde_json::from_slice(&output.stdout).expect("JSON");
        (output.status.code(), report)
    };
    let (code, report) = press(&["--seconds", "0.3", "--within-s", "3600"]);
    assert_eq!((code, &report["reached"], &report["held"]), (Some(0), &true.into(), &true.into()), "{report}");
    assert_eq!((&report["tolerance_mn"], &report["states_outside"]), (&25.0.into(), &0.into()));
    let least_mn = report["least_mn"].as_i64().expect("a number");
    assert!(least_mn >= 475 && report["most_mn"].as_i64() <= Some(525), "{report}");
    finger.command("remove");
    let (code, report) = press(&["--within-s", "0.5"]);
    assert_eq!((code, &report["reached"], &report["held"]), (Some(1), &false.into(), &false.into()), "{report}");
    assert_eq!((&report["states"], &report["mean_mn"]), (&0.into(), &Value::Null));
}

#[test]
fn a_press_rewrites_one_line_of_a_terminal() {
    let finger = Served::begin("wall");
    finger.done(&["tare"]);
    let (mut near, far) = serial2::SerialPort::pair().expect("a pseudo-terminal");
    let mut press = finger.fingertip(&["press", "0.5", "--seconds", "0.5", "--within-s", "3600"]);
    let output = press.stderr(OwnedFd::from(far)).output().expect("it starts");
    drop(press);
    let mut shown = Vec::new();
    let _ = near.read_to_end(&mut shown);
    let shown = String::from_utf8(shown).expect("UTF-8");
    assert!(output.status.success(), "{shown}");
    assert!(shown.matches("\r\x1b[Kforce ").count() > 1 && shown.ends_with("\r\x1b[K"), "{shown:?}");
    assert_eq!(shown.lines().count(), 2, "{shown:?}");
}

/// Looks at the help of a command and of all that are below it.
fn walk(path: &[&str]) -> usize {
    let output = std::process::Command::new(env!("CARGO_BIN_EXE_fingertip")).args(path).arg("--help").output();
    let text = String::from_utf8(output.expect("it starts").stdout).expect("UTF-8");
    assert!(text.contains("Example"), "{path:?}: {text}");
    let commands = text.split("\nCommands:\n").nth(1).and_then(|rest| rest.split("\n\n").next()).unwrap_or_default();
    let names = commands.lines().filter_map(|line| line.split_whitespace().next()).filter(|name| *name != "help");
    1 + names.map(|name| walk(&[path, &[name]].concat())).sum::<usize>()
}

#[test]
fn every_command_has_examples_in_its_help() {
    assert!(walk(&[]) > 20);
    let help = Served::begin("wall").done(&["--help"]);
    assert_eq!(help.contains("stream"), cfg!(feature = "foxglove"), "{help}");
}
