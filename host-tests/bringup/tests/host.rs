//! `bringup-host` at a serial port, with a simulated board.

use bringup::checks::checks;
use bringup::text::{CHECK, READY, checked};
use serde_json::Value;
use serial2::SerialPort;
use std::fmt::Write as _;
use std::os::fd::AsRawFd as _;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};
use std::{fs, thread};

/// The report of a sound board, but for one figure.
fn report(spoilt: Option<&str>) -> String {
    let mut text = String::from("bringup 1 0123ABCD\n");
    for check in checks() {
        let [least, most] = check.within;
        let middle = if most.is_finite() { 0.5 * (least + most) } else { least };
        let figure = if spoilt == Some(check.name.as_str()) { least - 1.0 } else { middle };
        writeln!(text, "figure {} {figure}", check.name).expect("a string takes it");
    }
    text.push_str("cycles 20 21 nothing: an empty call\ncycles 120 150 root: a way\n");
    let check = text.bytes().fold(CHECK, checked);
    text + &format!("end {check:08x}\n")
}

/// Runs the program at a port at which a board reports so.
fn judged(report: String, json: &Path) -> Output {
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
        board.write_all(format!("# far\n{report}").as_bytes()).expect("it takes it");
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
    let output = judged(report(None), &json);
    let text = String::from_utf8_lossy(&output.stdout);
    assert!(output.status.success(), "{text}{}", String::from_utf8_lossy(&output.stderr));
    assert!(text.contains("far\n") && text.contains("0 failed"), "{text}");
    let file: Value = serde_json::from_slice(&fs::read(&json).expect("it was written")).expect("it is JSON");
    let plain = ["schema_version", "image_sha256", "board_uid", "board", "failed"].map(|key| file[key].to_string());
    assert_eq!(plain, ["1", "\"ab\"", "\"0123ABCD\"", "\"silicon\"", "0"]);
    assert_eq!(file["kernels"][0]["estimated_cycles"], 98.0);

    let json = scratch("spoilt");
    let output = judged(report(Some("rows_wrong")), &json);
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
