//! Ends of commands: the exit codes of docs/host.md, errors in JSON, and the help of every command; and robustness against
//! any request and any failure of the controller.

use crate::served::{Served, fails, line_with, program};
use fingertip::shipped::address;
use fingertip_cli::Error;
use serde_json::Value;
use std::fs;
use std::os::unix::fs::FileTypeExt as _;
use std::time::Duration;

/// Runs each example of the table. Code 3 needs an object that goes away meanwhile, code 130 Ctrl-C.
#[test]
fn the_exit_codes_are_those_of_the_documentation() {
    let page = include_str!("../../../docs/host.md");
    let table = page.split("| exit code |").nth(1).expect("the table");
    let mut codes = Vec::new();
    for row in table.lines().skip(2).take_while(|line| line.starts_with('|')) {
        let finger = Served::patient("wall");
        finger.done(&["tare"]);
        let cells: Vec<&str> = row.trim_matches('|').split('|').collect();
        let code: i32 = cells[0].trim().parse().expect("a code");
        codes.push(code);
        let examples: Vec<&str> = cells[2].split('`').filter_map(|text| text.strip_prefix("fingertip ")).collect();
        assert!(!examples.is_empty(), "{row}");
        for example in examples {
            let mut child = finger.start(&example.split_whitespace().collect::<Vec<_>>());
            if [3, 130].contains(&code) {
                line_with("reached", child.stderr.take().expect("a pipe"));
            }
            match code {
                3 => drop(finger.command("remove")),
                130 => Served::interrupt(&child),
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
fn an_answer_to_a_killed_program_is_taken_by_none() {
    let finger = Served::begin("wall");
    let held = || finger.line(|line| line.stalled.as_ref().map_or(0, Vec::len));
    for length in [0, 40] {
        finger.line(|line| line.stalled = Some(Vec::new()));
        let mut killed = finger.client();
        killed.timeout = Duration::from_millis(1);
        let asked = match length {
            0 => killed.ping().map(drop),
            _ => killed.read(address::FIRMWARE_VERSION, length).map(drop),
        };
        assert!(matches!(asked, Err(Error::Silent(_))));
        drop(killed);
        // Two packets in one read would count as one.
        Served::wait_for(|| held() == 1);
        let next = finger.start(&["info"]);
        Served::wait_for(|| held() == 2);
        finger.go_on();
        let next = next.wait_with_output().expect("it ends");
        assert!(next.status.success(), "{next:?}");
    }
}

/// Looks at the help of a command and of all that are below it.
fn walk(path: &[&str]) -> usize {
    let output = program(path).arg("--help").output().expect("it starts");
    let text = String::from_utf8(output.stdout).expect("UTF-8");
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

#[test]
fn numbers_that_are_none_are_not_understood() {
    for (command, options) in [
        ("record a.csv", "--seconds nan|--seconds=-1|--seconds inf"),
        ("record a.csv", "--rate-hz nan|--rate-hz=-5|--rate-hz 1e-30|--rate-hz 1e30"),
        ("view", "--rate-hz nan|--seconds nan"),
        ("stream", "--rate-hz nan"),
        ("tare", "--within-s nan|--within-s 1e300"),
        ("press", "nan|0|-1|151"),
        ("press 1", "--seconds nan|--within-s nan|--seconds=-1"),
        ("capture --out a.mcap", "--press 0"),
        ("calibrate", "--within-s nan|--shown-n 200|--presses 0|--creep-s 5"),
        ("commission", "--forward perhaps|--resistance-ohm nan"),
        ("params get", "nonsense|pressures"),
        ("latency", "--seconds nan"),
        ("scan", "--speeds 0"),
        ("info", "--baud 0"),
    ] {
        for wrong in options.split('|') {
            let arguments: Vec<&str> = command.split(' ').chain(wrong.split(' ')).collect();
            Served::not_understood(&arguments, "for '");
        }
    }
}

#[test]
fn a_controller_that_starts_anew_ends_a_recording_and_a_press() {
    let finger = Served::begin("wall");
    finger.done(&["tare"]);
    let file = finger.file("again.csv");
    let child = finger.start(&["record", "--rate-hz", "0", "--seconds", "1000000", &file]);
    Served::recorded(&format!("{file}.part"));
    finger.restart();
    fails(&child.wait_with_output().expect("it ends"), &["the recording ends after", "restarted"]);
    // What it had is whole, and its times are.
    let text = fs::read_to_string(&file).expect("it is there");
    let times: Vec<f64> =
        text.lines().skip(1).map(|row| row.split(',').next().expect("a cell").parse().expect("a time")).collect();
    assert!(times.windows(2).all(|pair| pair[0] < pair[1]) && times.last() < Some(&4_000.0), "{:?}", times.last());

    finger.done(&["tare"]);
    let child = finger.start(&["press", "1", "--seconds", "1000000", "--within-s", "3600"]);
    finger.until("Force:");
    finger.restart();
    fails(&child.wait_with_output().expect("it ends"), &["restarted"]);
}

#[test]
fn a_register_that_is_named_twice_changes_nothing() {
    let finger = Served::begin("wall");
    let before = finger.json(&["params", "get"]);
    let set = ["params", "set", "modulus_pa=300000", "clearance_um=500", "MODULUS_PA=200000"];
    finger.refuses(&set, &["modulus_pa is there twice", "nothing was changed"]);
    let file = finger.file("twice.toml");
    fs::write(&file, "[parameters]\nmodulus_pa = 300000\nclearance_um = 500\nModulus_Pa = 200000\n").expect("a file");
    for command in ["restore", "diff"] {
        finger.refuses(&["params", command, &file], &["modulus_pa is there twice"]);
    }
    assert_eq!(finger.json(&["params", "get"]), before);
}

#[test]
fn a_register_that_cannot_be_put_back_does_not_keep_the_others() {
    let finger = Served::begin("wall");
    let set = ["--timeout-ms", "1000", "params", "set", "return_delay_time=100", "fit_level=4"];
    let (packets, reads) = (finger.packets(&set), finger.packets(&["params", "diff"]));
    finger.done(&["params", "set", "return_delay_time=250", "fit_level=3"]);
    // Lost: the packet that sets `fit_level`, behind which all is read, and the one that puts it back.
    finger.deaf(packets - reads, 2);
    finger.refuses(&set, &["putting back failed: set fit_level to 3", "saved values of fit_level\n"]);
    let now = finger.json(&["params", "get", "return_delay_time", "fit_level"]);
    assert_eq!(now, serde_json::json!({ "return_delay_time": 250, "fit_level": 3 }));
}

#[test]
fn a_backup_that_was_cut_changes_nothing() {
    let finger = Served::begin("wall");
    let file = finger.file("cut.toml");
    finger.done(&["params", "set", "creep_time_ms=20000", "modulus_pa=300000"]);
    finger.done(&["params", "backup", &file]);
    let whole = fs::read_to_string(&file).expect("it was written");
    finger.done(&["params", "set", "creep_time_ms=10000", "modulus_pa=250000"]);
    let before = finger.json(&["params", "get"]);
    let number = whole.rfind("20000").expect("the last parameter") + 4;
    let lines = whole.match_indices('\n').map(|(at, _)| at + 1).filter(|at| *at < whole.len());
    // In the middle of the last number, in the middle of the last line, before its end, and between two lines.
    for at in [number, number + 9, whole.len() - 1].into_iter().chain(lines.step_by(7)) {
        fs::write(&file, &whole[..at]).expect("a file");
        finger.refuses(&["params", "restore", &file], &["cannot read"]);
        assert_eq!(finger.json(&["params", "get"]), before, "cut at {at}");
    }
    // A client that leaves some out reports it.
    fs::write(&file, "[parameters]\nmodulus_pa = 300000").expect("a file");
    finger.done(&["params", "restore", &file]);
    assert_eq!(finger.json(&["params", "get", "modulus_pa"]), serde_json::json!({ "modulus_pa": 300_000 }));
}

#[test]
fn an_address_that_another_has_is_refused() {
    let finger = Served::begin("grasp");
    let set = ["params", "set", "id=2", "modulus_pa=300000"];
    finger.refuses(&set, &["another device has the ID 2", "Nothing was changed"]);
    let ids: Vec<_> = finger.json(&["scan", "--speeds", "1000000"]).as_array().expect("a list").clone();
    assert_eq!(ids.iter().map(|found| found["id"].as_u64()).collect::<Vec<_>>(), [Some(1), Some(2)]);
    assert_ne!(finger.json(&["params", "get", "modulus_pa"])["modulus_pa"], 300_000);
    // Its own ID does not count as taken, and a free one is free.
    finger.done(&["params", "set", "id=1"]);
    finger.done(&["params", "set", "id=3"]);
    finger.done(&["--id", "3", "params", "set", "id=1"]);
}

#[test]
fn recover_says_torque_is_off_only_where_it_is() {
    let finger = Served::begin("wall");
    finger.done(&["tare"]);
    finger.set(&[(address::TORQUE_ENABLE, 1)]);
    let said = finger.done(&["recover"]);
    assert!(said.starts_with("there was nothing to recover from; torque is on"), "{said}");
    assert!(said.contains("`fingertip stop`"), "{said}");
    finger.refuses(&["tare"], &["torque is on", "`fingertip stop`"]);
    assert_eq!(finger.json(&["info"])["torque_enable"], 1);
}

#[test]
fn only_files_are_written_in_place_and_by_one_at_a_time() {
    let finger = Served::begin("wall");
    let pipe = finger.file("pipe.csv");
    assert!(std::process::Command::new("mkfifo").arg(&pipe).status().expect("it starts").success());
    for arguments in [&["record", "--seconds", "0", &pipe][..], &["params", "backup", "--force", &pipe]] {
        finger.refuses(arguments, &["it is no file"]);
        assert!(fs::metadata(&pipe).expect("it is there").file_type().is_fifo());
    }
    // The folder is refused before anything is recorded, so nothing is lost.
    fs::create_dir(finger.file("folder.csv")).expect("a folder");
    finger.refuses(&["record", "--seconds", "0", &finger.file("folder.csv")], &["it is no file"]);

    let other = Served::begin("wall");
    let file = finger.file("both.csv");
    let child = finger.start(&["record", &file]);
    Served::recorded(&format!("{file}.part"));
    other.refuses(&["record", "--seconds", "0", &file], &["another program is writing"]);
    Served::interrupt(&child);
    assert!(child.wait_with_output().expect("it ends").status.success());
    assert!(fs::read_to_string(&file).expect("it is there").lines().count() > 10);
}

#[test]
fn a_full_disk_is_told_and_a_closed_pipe_is_no_error() {
    let finger = Served::begin("wall");
    // Nobody reads from the first byte on.
    let (reader, writer) = std::io::pipe().expect("a pipe");
    drop(reader);
    let output = finger.writing_to(&["record", "--seconds", "1000000", "-"], writer);
    assert_eq!(output.status.code(), Some(0), "{}", String::from_utf8_lossy(&output.stderr));
    let full = || fs::OpenOptions::new().write(true).open("/dev/full").expect("Linux has it");
    fails(&finger.writing_to(&["record", "--seconds", "1000000", "-"], full()), &["cannot write -: No space left"]);
    for arguments in [&["info"][..], &["info", "--json"], &["params", "get"], &["completions", "bash"]] {
        fails(&finger.writing_to(arguments, full()), &["the output cannot be written"]);
        let (reader, writer) = std::io::pipe().expect("a pipe");
        drop(reader);
        assert_eq!(finger.writing_to(arguments, writer).status.code(), Some(0), "{arguments:?}");
    }
    // Nor is a warning that cannot be written.
    let set = finger.fingertip(&["params", "set", "force_max_mn=60"]).stderr(full()).status();
    assert_eq!(set.expect("it starts").code(), Some(0));
    assert_eq!(finger.json(&["params", "get", "force_max_mn"])["force_max_mn"], 60);
}
