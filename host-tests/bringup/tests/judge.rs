//! Format of a report, and that each check can fail.

use bringup::checks;
use bringup::checks::checks;
use bringup::judge::{Board, Judgement, Verdict, judge};
use bringup::listen::{Report, listen};
use bringup::script::{Bench, STEPS};
use bringup::text::{CHECK, READY, asked_frames, checked};
use fingertip::shipped::{Config, Pipeline};
use fingertip::units::CoreCycles;
use std::collections::HashMap;
use std::io::{Cursor, Read, Result, Write};

/// A report of a sound board.
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
    let (mut pipeline, mut bench) = (Pipeline::new(&config), Bench::new());
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
