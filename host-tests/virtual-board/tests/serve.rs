//! The board behind a port, for clients that nobody here wrote.
//!
//! `FINGERTIP_IMAGE` names the image, `FINGERTIP_PYTHON` a Python with the package `dynamixel-sdk`; `cargo xtask test`
//! makes both and sets them.

use std::io::{BufRead, BufReader, Read, Write};
use std::net::TcpStream;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};

fn named(variable: &str) -> PathBuf {
    let path = std::env::var_os(variable);
    path.unwrap_or_else(|| panic!("{variable} must be set: run `cargo xtask test`, which does")).into()
}

/// A served board, stopped when dropped.
struct Board {
    child: Child,
    name: String,
}

impl Board {
    fn serve(arguments: &[&str]) -> Self {
        let mut command = Command::new(env!("CARGO_BIN_EXE_virtual-board"));
        command.arg("serve").arg("--image").arg(named("FINGERTIP_IMAGE")).args(arguments);
        let mut child = command.stdout(Stdio::piped()).spawn().expect("the board starts");
        let mut line = String::new();
        let stdout = child.stdout.as_mut().expect("it was asked for");
        BufReader::new(stdout).read_line(&mut line).expect("it says where it is");
        let name = line.split_whitespace().nth(1).unwrap_or_else(|| panic!("it says where it is: {line:?}"));
        Self { name: name.to_owned(), child }
    }

    /// Ctrl-C.
    fn interrupt(mut self) -> bool {
        let pid = i32::try_from(self.child.id()).expect("a process number");
        let pid = rustix::process::Pid::from_raw(pid).expect("a process number");
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
    let output = python.arg("--port").arg(port).args(arguments).output().expect("Python starts");
    let (said, complained) = (String::from_utf8_lossy(&output.stdout), String::from_utf8_lossy(&output.stderr));
    assert!(output.status.success(), "{said}{complained}");
    said.into_owned()
}

#[test]
fn the_python_example_touches_holds_and_lets_go() {
    let link = std::env::temp_dir().join(format!("fingertip-bus-{}", std::process::id()));
    let board = Board::serve(&["--pty", link.to_str().expect("a plain path")]);
    assert_eq!(Path::new(&board.name), link);

    // As patient as it takes on the slowest machine: two hours mean that the board hangs.
    let said = example("force.py", &link, &["--newtons", "1.5", "--readings", "200", "--patience-ms", "7200000"]);
    // The letters FT.
    assert!(said.starts_with("model 21574\ntared, force 0 mN\n"), "{said}");
    let held = said.lines().find_map(|line| line.strip_prefix("holding ")).expect(&said);
    let force_mn: f64 = held.split(' ').next().and_then(|number| number.parse().ok()).expect(held);
    assert!((1_480.0..=1_520.0).contains(&force_mn), "{said}");
    assert!(said.ends_with("let go, mode off\n"), "{said}");

    assert!(board.interrupt());
    assert!(!link.is_symlink(), "the link is gone with the board");
}

#[test]
fn a_tcp_client_pings() {
    let board = Board::serve(&["--tcp", "0"]);
    // A client that goes away makes room for the next.
    for _ in 0..2 {
        let mut client = TcpStream::connect(&board.name).expect("it listens");
        client.write_all(&[0xff, 0xff, 0xfd, 0x00, 0x01, 0x03, 0x00, 0x01, 0x19, 0x4e]).expect("it listens");
        let mut reply = [0; 14];
        client.read_exact(&mut reply).expect("it answers");
        assert_eq!(reply[..9], [0xff, 0xff, 0xfd, 0x00, 0x01, 0x07, 0x00, 0x55, 0x00]);
    }
    assert!(board.interrupt());
}

#[test]
fn a_port_that_is_taken_is_said() {
    let taken = std::net::TcpListener::bind("127.0.0.1:0").expect("some port is free");
    let port = taken.local_addr().expect("it is bound").port();
    let mut command = Command::new(env!("CARGO_BIN_EXE_virtual-board"));
    command.arg("serve").arg("--image").arg(named("FINGERTIP_IMAGE")).args(["--tcp", &port.to_string()]);
    let output = command.output().expect("it starts");
    assert!(!output.status.success());
    let complained = String::from_utf8_lossy(&output.stderr);
    assert!(complained.contains(&format!("cannot open TCP port {port}")), "{complained}");
}
