//! Clients that nobody here wrote, on the link itself behind a pseudo-terminal: no emulator between, a made-up loop behind.
//!
//! `FINGERTIP_PYTHON` names a Python with the packages `dynamixel-sdk` and `rustypot`; `cargo xtask test` makes it and sets
//! it. The clients are as patient as it takes on the slowest machine; what they get by their own time-outs is a matter of
//! the board that is served.

#[path = "../../tests/link/bench.rs"]
#[allow(dead_code, reason = "the link's tests take more of it")]
mod bench;

use bench::Bench;
use serial2::SerialPort;
use std::os::fd::AsRawFd;
use std::path::{Path, PathBuf};
use std::process::Command;

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
    let python = std::env::var_os("FINGERTIP_PYTHON").expect("FINGERTIP_PYTHON must be set: run `cargo xtask test`");
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
    let (said, complained) = (String::from_utf8_lossy(&output.stdout), String::from_utf8_lossy(&output.stderr));
    assert!(output.status.success(), "{said}{complained}");
    for client in ["dynamixel-sdk: ", "dynamixel_easy_sdk: ", "rustypot: "] {
        assert!(said.lines().any(|line| line.starts_with(client) && line.ends_with(" operations")), "{said}");
    }
}
