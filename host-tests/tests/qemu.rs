//! The core on an emulated Cortex-M4F. Needs QEMU and the image: `cargo xtask test` runs these tests.

use std::env;
use std::process::{Command, Output};

/// Folder of this package. Its use rebuilds the paths below after the checkout was moved.
const _: &str = env!("FINGERTIP_ROOT");

/// Runs the comparison that `cargo xtask qemu` runs.
fn qemu(failure: &[&str]) -> Output {
    let image = env::var_os("FINGERTIP_QEMU_IMAGE").expect("it names the image; use cargo xtask test");
    let mut command = Command::new(env!("CARGO_BIN_EXE_qemu-host"));
    command
        .arg(image)
        .arg(env!("CARGO_TARGET_TMPDIR"))
        .args(failure)
        .output()
        .expect("the runner was built with this test")
}

#[test]
#[ignore = "needs QEMU: cargo xtask test"]
fn the_emulated_core_gives_the_same_bits() {
    let output = qemu(&[]);
    let text = String::from_utf8_lossy(&output.stdout);
    assert!(output.status.success(), "{text}{}", String::from_utf8_lossy(&output.stderr));
    assert!(text.contains("steps                  10000\n"), "{text}");
    println!("{text}");
}

#[test]
#[ignore = "needs QEMU: cargo xtask test"]
fn a_panic_a_hard_fault_and_a_hang_fail() {
    for (failure, with) in [
        ("panic", "FAILED: panic: injected"),
        ("hardfault", "FAILED: hard fault at 0x08"),
        ("hang", "FAILED: hang: a step took"),
    ] {
        let output = qemu(&[failure]);
        let text = String::from_utf8_lossy(&output.stderr);
        assert!(!output.status.success() && text.starts_with(with), "{failure}: {text}");
    }
}
