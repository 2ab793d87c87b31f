//! Clients that nobody here wrote, on the link itself behind a pseudo-terminal: no emulator between, a made-up loop behind.
//!
//! `FINGERTIP_PYTHON` names a Python with the packages `dynamixel-sdk` and `rustypot`; `cargo xtask test` makes it and sets
//! it. The clients are as patient as it takes on the slowest machine; what they get by their own time-outs is a matter of
//! the board that is served.

#[path = "../../tests/link/bench.rs"]
#[allow(dead_code, unused_imports, reason = "the link's tests take more of it")]
mod bench;

use crate::common::*;
use bench::Bench;
use dynamixel2::Bus;
use serial2::SerialPort;
use serve::{Event, Place, Port};
use std::io::{BufRead, BufReader};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Output, Stdio};
use std::time::Duration;

/// Answers until the port is stopped.
fn answer(mut bench: Bench, mut port: Port) {
    loop {
        match port.wait(Duration::from_secs(1), None) {
            Event::Bytes(bytes) => {
                bench.hear(&bytes).iter().for_each(|reply| port.send(reply));
                bench.take_up();
                bench.status.sequence += 10;
            }
            Event::Nothing => {}
            Event::Command(_) | Event::Stop => return,
        }
    }
}

/// Standard output of a program, which must succeed.
fn said(output: &Output) -> String {
    let [said, complained] = [&output.stdout, &output.stderr].map(|text| String::from_utf8_lossy(text));
    assert!(output.status.success(), "{said}{complained}");
    said.into_owned()
}

/// A folder with the model file and the list that names it, as ROBOTIS' packages have them.
fn models() -> PathBuf {
    let folder = std::env::temp_dir().join(format!("fingertip-models-{}", std::process::id()));
    std::fs::create_dir_all(&folder).expect("a folder for the model file");
    let model = Path::new(env!("FINGERTIP_ROOT")).join("examples/dynamixel/fingertip.model");
    std::fs::copy(model, folder.join("fingertip.model")).expect("the model file is there");
    std::fs::write(folder.join("dynamixel.model"), "Number\tName\n21574\tfingertip.model\n").expect("a list");
    folder
}

#[test]
fn robotis_and_pollens_clients_drive_the_finger() {
    let python = named("FINGERTIP_PYTHON");
    let port = Port::open(&Place::Pty(None)).expect("a pseudo-terminal");
    let (name, stop, folder) = (port.name().to_owned(), port.stopper(), models());
    let script = Path::new(env!("FINGERTIP_ROOT")).join("host-tests/virtual-board/tests/clients.py");
    let output = std::thread::scope(|scope| {
        scope.spawn(|| answer(Bench::new(), port));
        let mut command = Command::new(python);
        command.env("PYTHONDONTWRITEBYTECODE", "1").arg(script).arg(&name).arg(&folder);
        let output = command.args(["--patience-ms", "7200000"]).output();
        stop.stop();
        output.expect("Python starts")
    });
    std::fs::remove_dir_all(&folder).expect("it is there");
    let said = said(&output);
    for client in ["dynamixel-sdk: ", "dynamixel_easy_sdk: ", "rustypot: "] {
        assert!(said.lines().any(|line| line.starts_with(client) && line.ends_with(" operations")), "{said}");
    }
}

// The board behind a port.

/// A served board, stopped when dropped.
struct Board {
    child: Child,
    name: String,
}

impl Board {
    fn serve(arguments: &[&str]) -> Self {
        let mut command = Command::new(env!("CARGO_BIN_EXE_virtual-board"));
        command.arg("serve").arg("--image").arg(image()).args(arguments);
        let mut child = command.stdout(Stdio::piped()).spawn().expect("the board starts");
        let mut line = String::new();
        let stdout = child.stdout.as_mut().expect("it was asked for");
        BufReader::new(stdout).read_line(&mut line).expect("it says where it is");
        let name = line.split_whitespace().nth(1).unwrap_or_else(|| panic!("it says where it is: {line:?}"));
        Self { name: name.to_owned(), child }
    }

    fn interrupt(mut self) -> bool {
        let pid = rustix::process::Pid::from_child(&self.child);
        rustix::process::kill_process(pid, rustix::process::Signal::INT).expect("it runs");
        self.child.wait().expect("it ends").success()
    }
}

impl Drop for Board {
    fn drop(&mut self) {
        // One that has ended already needs no more.
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

/// What a program does with the Rust client: each kind of transaction, and a read beyond its own buffers.
fn is_answered(port: &Path) {
    // Its time-outs are by the speed, which a pseudo-terminal ignores: at 1 baud they are two minutes of a board that hangs.
    let port = SerialPort::open(port, 1).expect("the pseudo-terminal");
    let mut bus = Bus::with_buffers(port, vec![0; 2_048], vec![0; 2_048]).expect("a bus");
    assert_eq!(bus.ping(1).expect("it answers").data.model, 21_574);
    // The first parameter keeps its default.
    let radius_um = Params::DEFAULT.tip_radius_um.unsigned_abs();
    bus.write_u32(1, address::PARAMS, radius_um).expect("it obeys");
    assert_eq!(bus.read_u32(1, address::PARAMS).expect("it answers").data, radius_um);
    assert_eq!(bus.read(1, address::PRESSURES, 200).expect("it answers").data.len(), 200);
    bus.reg_write_u16(1, address::INDIRECT_ADDRESS_1, address::FAULT).expect("it obeys");
    bus.action(1).expect("it obeys");
    let answers = bus.sync_read_u16(&[1], address::INDIRECT_ADDRESS_1).expect("it answers");
    assert_eq!((answers.len(), answers[0].data), (1, address::FAULT));
    assert!(bus.write_u8(1, address::TORQUE_ENABLE, 7).is_err(), "out of its range");
}

#[test]
fn the_rust_client_is_answered_and_the_python_example_touches_holds_and_lets_go() {
    let link = std::env::temp_dir().join(format!("fingertip-bus-{}", std::process::id()));
    let board = Board::serve(&["--distance-mm", "0.3", "--pty", link.to_str().expect("a plain path")]);
    assert_eq!(Path::new(&board.name), link);

    is_answered(&link);
    // As patient as it takes on the slowest machine: two hours mean that the board hangs.
    let package = Path::new(env!("FINGERTIP_ROOT")).join("python");
    let mut python = Command::new(named("FINGERTIP_PYTHON"));
    python.env("PYTHONDONTWRITEBYTECODE", "1").env("PYTHONPATH", &package).arg(package.join("examples/force.py"));
    python.arg("--port").arg(&link).args(["--newtons", "1.5", "--readings", "10", "--patience-ms", "7200000"]);
    let said = said(&python.output().expect("Python starts"));
    // The letters FT.
    assert!(said.starts_with("model 21574\ntared, force 0 mN\n"), "{said}");
    let held = said.lines().find_map(|line| line.strip_prefix("holding ")).expect(&said);
    let force_mn: f64 = held.split(' ').next().and_then(|number| number.parse().ok()).expect(held);
    assert!((1_480.0..=1_520.0).contains(&force_mn), "{said}");
    assert!(said.ends_with("let go, mode off\n"), "{said}");

    assert!(board.interrupt());
    assert!(!link.is_symlink(), "the link is gone with the board");
}
