//! Format of a report, that each check can fail, and `bringup-host` at a serial port, with a simulated board.

use bringup::checks::{self, checks};
use bringup::judge::{Board, Judgement, Verdict, judge};
use bringup::listen::{Report, listen};
use bringup::script::{Bench, STEPS};
use bringup::{CHECK, READY, asked_frames, checked};
use fingertip::shipped::{Config, Pipeline};
use fingertip::units::CoreCycles;
use serde_json::Value;
use serial2::SerialPort;
use std::collections::HashMap;
use std::io::{Cursor, Read, Result, Write};
use std::os::fd::AsRawFd as _;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};
use std::{fs, thread};

fn sound() -> Report {
    let middle = |[least, most]: [f64; 2]| if most.is_finite() { 0.5 * (least + most) } else { least };
    let figures = checks().into_iter().map(|check| (check.name, middle(check.within))).collect();
    let cycles = vec![("nothing: an empty call".into(), 20.0, 20.0), ("root: a way".into(), 120.0, 150.0)];
    Report { uid: "0123".into(), figures, cycles }
}

fn judged(report: &Report, board: Board) -> Judgement {
    judge(report, board, "ab".into(), &HashMap::from([("root: a way".into(), 95.0)]))
}

#[test]
fn a_sound_board_passes_and_each_check_can_fail_alone() {
    let whole = judged(&sound(), Board::Silicon);
    assert_eq!((whole.failed, whole.not_shown), (0, 0));
    assert_eq!(whole.passed, checks().len() + 1, "the checks and a kernel");
    for (place, check) in checks().iter().enumerate() {
        let mut outside = sound();
        outside.figures[place].1 = check.within[0] - 1.0;
        let mut missing = sound();
        missing.figures.remove(place);
        for report in [outside, missing] {
            let judgement = judged(&report, Board::Silicon);
            let failed: Vec<_> = judgement.checks.iter().filter(|of| of.verdict == Verdict::Fail).collect();
            assert!(failed.len() == 1 && failed[0].name == check.name, "{}", check.name);
            assert!(judgement.text().contains("to do: "), "{}", judgement.text());
        }
    }
    let mut slow = sound();
    slow.cycles[1].1 = 130.0;
    assert_eq!(judged(&slow, Board::Silicon).failed, 1, "110 cycles for an estimate of 95");
}

#[test]
fn what_the_emulated_board_cannot_show_never_passes() {
    let judgement = judged(&sound(), Board::Emulated);
    for (check, of) in checks().iter().zip(&judgement.checks) {
        let expected = if check.unseen.is_some() { Verdict::NotShown } else { Verdict::Pass };
        assert_eq!(of.verdict, expected, "{}", check.name);
    }
    assert!(judgement.kernels.iter().all(|kernel| kernel.verdict == Verdict::NotShown));
}

/// Port that sends this, and keeps the bytes that it receives.
struct Port(Cursor<Vec<u8>>, Vec<u8>);

impl Read for Port {
    fn read(&mut self, bytes: &mut [u8]) -> Result<usize> {
        match self.0.read(bytes)? {
            0 => Err(std::io::ErrorKind::TimedOut.into()),
            count => Ok(count),
        }
    }
}

impl Write for Port {
    fn write(&mut self, bytes: &[u8]) -> Result<usize> {
        self.1.write(bytes)
    }

    fn flush(&mut self) -> Result<()> {
        Ok(())
    }
}

/// Result of the host, and its output.
fn heard(said: &str) -> (Result<Report>, String) {
    let mut port = Port(Cursor::new(said.as_bytes().to_vec()), Vec::new());
    let report = listen(&mut port, 7, &mut |_| {});
    (report, String::from_utf8(port.1).expect("text"))
}

#[test]
fn a_report_is_taken_in_among_other_lines_and_a_damaged_one_is_refused() {
    let lines = "bringup 1 0123\nfigure a 1.5\ncycles 2 3 root: a way\n";
    let check = lines.bytes().fold(CHECK, checked);
    let whole = format!("half a li\n# {READY}\n{lines}# far\n\u{fffd}#*\nend {check:08x}\n");
    let (report, said) = heard(&whole);
    let expected =
        Report { uid: "0123".into(), figures: vec![("a".into(), 1.5)], cycles: vec![("root: a way".into(), 2.0, 3.0)] };
    assert_eq!((report.expect("it is whole"), said.as_str()), (expected, "go 7\n"));
    for (from, to) in [("1.5", "1.4"), ("figure a", "fig"), ("root: a", "root: b"), ("bringup 1", "bringup 2")] {
        assert!(heard(&whole.replacen(from, to, 1)).0.is_err(), "{from} as {to}");
    }
    let again = whole.replacen("# far", &format!("# {READY}"), 1);
    assert!(heard(&again).0.is_err_and(|error| error.to_string().contains("restarted")));
    assert!(heard("# crashed: cause 2\n").0.is_err_and(|error| error.to_string().contains("cause 2")));
    assert!(heard("").0.is_err_and(|error| error.to_string().contains("silent")));
}

#[test]
fn the_host_asks_for_frames() {
    let asked = ["go", "go 5", " go 12 \r", "gone", "go x", ""].map(asked_frames);
    assert_eq!(asked, [Some(1_000_000), Some(5), Some(12), None, None, None]);
}

#[test]
fn its_steps_are_within_a_tenth_of_the_demonstrations() {
    let config = Config::shipped(&images::CONFIRMED).expect("the defaults make a configuration");
    let (mut pipeline, mut bench) = (Pipeline::new(&config), Bench::at_rest());
    bench.finger.make_table();
    let mut answers = Vec::new();
    while !bench.done() {
        let (frame, sense, command) = bench.inputs();
        pipeline.step(frame, sense, command);
        let status = pipeline.status();
        assert_eq!(status.fault, None, "at {} mm", bench.finger.travel_mm());
        answers.extend(bench.pass(status, config.timing.frame_ns, CoreCycles(0)));
    }
    let checks = checks::steps();
    for (answer, of_step) in answers[STEPS].iter().zip(checks.chunks(3)) {
        let ours = [answer.rise_ms, answer.overshoot_percent, answer.settled_ms];
        for (ours, check) in ours.into_iter().zip(of_step) {
            let [least, most] = check.within;
            assert!((least..=most).contains(&f64::from(ours)), "{}: {ours}, {least} to {most}", check.what);
        }
    }
}

/// Runs the program at a port at which a board reports so.
fn judged_by_program(report: &Report, json: &Path) -> Output {
    let mut text = format!("bringup 1 {}\n", report.uid);
    for (name, figure) in &report.figures {
        text += &format!("figure {name} {figure}\n");
    }
    for (kernel, median, most) in &report.cycles {
        text += &format!("cycles {median} {most} {kernel}\n");
    }
    let check = text.bytes().fold(CHECK, checked);
    let (board, host) = SerialPort::pair().expect("a pair of pseudo-terminals");
    let port = fs::read_link(format!("/proc/self/fd/{}", host.as_raw_fd())).expect("it has a name");
    let folder = json.parent().expect("it lies in a folder");
    let estimates = folder.join("estimates.txt");
    fs::write(&estimates, "98 root: a way\n").expect("it can be written");
    let said = thread::spawn(move || {
        let mut heard = String::new();
        let mut bytes = [0; 64];
        while !heard.contains("go 5\n") {
            // As the image does, until the host is there.
            board.write_all(format!("\u{1}half a line\n# {READY}\n").as_bytes()).expect("it takes it");
            if let Ok(count) = board.read(&mut bytes) {
                heard.push_str(&String::from_utf8_lossy(&bytes[..count]));
            }
        }
        board.write_all(format!("# far\n{text}end {check:08x}\n").as_bytes()).expect("it takes it");
        board
    });
    let mut command = Command::new(env!("CARGO_BIN_EXE_bringup-host"));
    command.arg("--port").arg(port).args(["--sha256", "ab", "--frames", "5"]);
    command.arg("--estimates").arg(&estimates).arg("--json").arg(json);
    let output = command.output().expect("it starts");
    drop((said.join().expect("the board ends"), host));
    output
}

fn scratch(name: &str) -> PathBuf {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join(name);
    fs::create_dir_all(&folder).expect("the build folder can be written");
    folder.join("board.json")
}

#[test]
fn a_sound_board_ends_well_and_another_does_not() {
    let json = scratch("sound");
    let output = judged_by_program(&sound(), &json);
    let text = String::from_utf8_lossy(&output.stdout);
    assert!(output.status.success(), "{text}{}", String::from_utf8_lossy(&output.stderr));
    assert!(text.contains("far\n") && text.contains("0 failed"), "{text}");
    let file: Value = serde_json::from_slice(&fs::read(&json).expect("it was written")).expect("it is JSON");
    let plain = ["schema_version", "image_sha256", "board_uid", "board", "failed"].map(|key| file[key].to_string());
    assert_eq!(plain, ["1", "\"ab\"", "\"0123\"", "\"silicon\"", "0"]);
    assert_eq!(file["kernels"][0]["estimated_cycles"], 98.0);

    let json = scratch("spoilt");
    let mut report = sound();
    report.figures.iter_mut().filter(|(name, _)| name == "rows_wrong").for_each(|(_, figure)| *figure -= 1.0);
    let output = judged_by_program(&report, &json);
    let text = String::from_utf8_lossy(&output.stdout);
    assert_eq!(output.status.code(), Some(1), "{text}");
    assert!(text.contains("FAIL") && text.contains("to do: ") && text.contains("1 failed"), "{text}");
    let file: Value = serde_json::from_slice(&fs::read(&json).expect("it was written")).expect("it is JSON");
    assert_eq!(file["failed"], 1);
}

#[test]
fn a_port_that_is_not_there_is_named() {
    let mut command = Command::new(env!("CARGO_BIN_EXE_bringup-host"));
    let output = command.args(["--port", "/nowhere", "--sha256", "ab"]).output().expect("it starts");
    assert_eq!(output.status.code(), Some(2));
    assert!(String::from_utf8_lossy(&output.stderr).contains("/nowhere"));
}
