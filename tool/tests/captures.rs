//! The captures of the repository: the core answers as the boards did.

use std::path::Path;
use std::process::Command;

#[test]
fn every_capture_replays_to_the_bit() {
    let captures = Path::new(env!("CARGO_MANIFEST_DIR")).join("../captures");
    let output = Command::new(env!("CARGO_BIN_EXE_fingertip")).arg("replay").arg(captures).output().expect("it starts");
    let (out, err) = (String::from_utf8_lossy(&output.stdout), String::from_utf8_lossy(&output.stderr));
    assert!(output.status.success(), "{out}{err}");
    assert!(out.contains("press.mcap") && out.lines().all(|line| line.ends_with("the same to the bit")), "{out}");
}
