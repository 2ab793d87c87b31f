//! Clients that nobody here wrote, on the link itself behind a pseudo-terminal: no emulator between, a made-up loop behind.
//!
//! `FINGERTIP_PYTHON` names a Python with the packages `dynamixel-sdk` and `rustypot`; `cargo xtask test` makes it and sets
//! it. The clients are as patient as it takes on the slowest machine; what they get by their own time-outs is a matter of
//! the board that is served.

#[path = "../../tests/link/bench.rs"]
#[allow(dead_code, unused_imports, reason = "the link's tests take more of it")]
mod bench;

use crate::common::{image, named};
use bench::Bench;
use serial2::SerialPort;
use std::io::{BufRead, BufReader};
use std::os::fd::AsRawFd;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Output, Stdio};

/// A pseudo-terminal: the device's end, and the name of the client's, which is held open.
fn terminal() -> (SerialPort, SerialPort, PathBuf) {
    let (one, other) = SerialPort::pair().expect("a pseudo-terminal");
    let name = |port: &SerialPort| std::fs::read_link(format!("/proc/self/fd/{}", port.as_raw_fd())).expect("its name");
    // The device has the end that has no name.
    let (near, far) = if name(&one).starts_with("/dev/pts") { (other, one) } else { (one, other) };
    let name = name(&far);
    assert!(name.starts_with("/dev/pts"), "{}", name.display());
    (near, far, name)
}

/// Answers until the terminal's other end is closed.
fn serve(mut bench: Bench, near: &SerialPort) {
    let mut bytes = [0; 512];
    loop {
        match near.read(&mut bytes) {
            Ok(count @ 1..) => {
                for reply in bench.hear(&bytes[..count]) {
                    near.write_all(&reply).expect("the terminal takes a reply");
                }
                bench.take_up();
                bench.status.sequence += 10;
            }
            Err(error) if error.kind() == std::io::ErrorKind::TimedOut => {}
            _ => return,
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
    let (near, far, name) = terminal();
    let folder = models();
    let script = Path::new(env!("FINGERTIP_ROOT")).join("host-tests/virtual-board/tests/clients.py");
    let output = std::thread::scope(|scope| {
        scope.spawn(|| serve(Bench::new(), &near));
        let mut command = Command::new(python);
        command.env("PYTHONDONTWRITEBYTECODE", "1").arg(script).arg(&name).arg(&folder);
        let output = command.args(["--patience-ms", "7200000"]).output().expect("Python starts");
        drop(far);
        output
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

/// Output of an example of the Python package with the board at a port.
fn example(name: &str, port: &Path, arguments: &[&str]) -> String {
    let package = Path::new(env!("FINGERTIP_ROOT")).join("python");
    let mut python = Command::new(named("FINGERTIP_PYTHON"));
    python.env("PYTHONDONTWRITEBYTECODE", "1").env("PYTHONPATH", &package).arg(package.join("examples").join(name));
    said(&python.arg("--port").arg(port).args(arguments).output().expect("Python starts"))
}

#[test]
fn the_python_example_touches_holds_and_lets_go() {
    let link = std::env::temp_dir().join(format!("fingertip-bus-{}", std::process::id()));
    let board = Board::serve(&["--distance-mm", "0.3", "--pty", link.to_str().expect("a plain path")]);
    assert_eq!(Path::new(&board.name), link);

    // As patient as it takes on the slowest machine: two hours mean that the board hangs.
    let said = example("force.py", &link, &["--newtons", "1.5", "--readings", "10", "--patience-ms", "7200000"]);
    // The letters FT.
    assert!(said.starts_with("model 21574\ntared, force 0 mN\n"), "{said}");
    let held = said.lines().find_map(|line| line.strip_prefix("holding ")).expect(&said);
    let force_mn: f64 = held.split(' ').next().and_then(|number| number.parse().ok()).expect(held);
    assert!((1_480.0..=1_520.0).contains(&force_mn), "{said}");
    assert!(said.ends_with("let go, mode off\n"), "{said}");

    assert!(board.interrupt());
    assert!(!link.is_symlink(), "the link is gone with the board");
}
