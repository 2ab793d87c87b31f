//! The model against cycles that others measured on STM32F4 boards and published. Needs QEMU and the image:
//! `cargo xtask timing --check` runs these tests.
//!
//! The kernels are assembly, so no compiler changes these figures; `m4-timing/tests/kernels`
//! has them with their licences. What was measured there is the call with its arguments in place: so it is here.

use m4_timing::meter::{Measured, parse};
use std::{env, fs, path::PathBuf, process::Command};

/// Folder of this package. Its use rebuilds the paths below after the checkout was moved.
const _: &str = env!("FINGERTIP_ROOT");

/// A kernel: its name, the cycles published without wait states, blocks a call, the cycles published at 5 wait states.
type Published = (&'static str, f64, f64, Option<f64>);

/// In the order of the regions, from 1 on.
///
/// The first seven: P. Schwabe and K. Stoffelen, "All the AES You Need on Cortex-M3 and M4" (SAC 2016), means over many
/// runs on an STM32F407 at 24 MHz. The others: J. Oleksiewicz, cortexm-AES, `doc/aes/CM3_CM4_details.md`, an STM32F4.
const PUBLISHED: [Published; 23] = [
    ("AES-128 key expansion, S+S", 244.9, 1.0, None),
    ("AES-128 block, S+S", 634.7, 1.0, None),
    ("AES-128 CTR, S+S", 527.9, 256.0, None),
    ("AES-192 key expansion, S+S", 232.2, 1.0, None),
    ("AES-192 CTR, S+S", 644.0, 256.0, None),
    ("AES-256 key expansion, S+S", 309.9, 1.0, None),
    ("AES-256 CTR, S+S", 760.7, 256.0, None),
    ("AES-128 key expansion, J.O.", 302.0, 1.0, None),
    ("AES-256 key expansion, J.O.", 378.0, 1.0, None),
    ("AES-128 encryption, J.O.", 626.0, 1.0, None),
    ("AES-256 encryption, J.O.", 858.0, 1.0, None),
    ("AES-128 encryption, unrolled, J.O.", 601.0, 1.0, Some(715.0)),
    ("AES-256 encryption, unrolled, J.O.", 821.0, 1.0, Some(975.0)),
    ("AES-128 inverse keys, J.O.", 811.0, 1.0, None),
    ("AES-256 inverse keys, J.O.", 1164.0, 1.0, None),
    ("AES-128 decryption, J.O.", 629.0, 1.0, None),
    ("AES-256 decryption, J.O.", 863.0, 1.0, None),
    ("AES-128 decryption, unrolled, J.O.", 602.0, 1.0, Some(716.0)),
    ("AES-256 decryption, unrolled, J.O.", 822.0, 1.0, Some(978.0)),
    ("AES-128 encryption by DSP, J.O.", 844.0, 1.0, None),
    ("AES-256 encryption by DSP, J.O.", 1172.0, 1.0, None),
    ("AES-128 decryption by DSP, J.O.", 1240.0, 1.0, None),
    ("AES-256 decryption by DSP, J.O.", 1744.0, 1.0, None),
];

const MEAN_MAX: f64 = 0.02;
const WORST_MAX: f64 = 0.10;

fn variable(name: &str) -> PathBuf {
    env::var_os(name).unwrap_or_else(|| panic!("{name} is not set; use cargo xtask timing --check")).into()
}

/// The command that runs the image under the plugin, with a word for its command line.
fn qemu(word: &str, out: &str) -> Command {
    let mut command = Command::new("qemu-system-arm");
    command.args(["-M", "netduinoplus2", "-display", "none", "-monitor", "none", "-serial", "none"]);
    command.arg("-semihosting-config").arg(format!("enable=on,target=native,arg={word}"));
    command.arg("-plugin").arg(format!("{},out={}", variable("M4_TIMING_PLUGIN").display(), file(out).display()));
    command.arg("-kernel").arg(variable("M4_TIMING_IMAGE"));
    command
}

fn file(name: &str) -> PathBuf {
    PathBuf::from(env!("CARGO_TARGET_TMPDIR")).join(name)
}

/// The plugin's text and JSON lines.
fn emulate(out: &str) -> (String, String) {
    let output = qemu("measure", out).output().expect("QEMU starts");
    let text = String::from_utf8_lossy(&output.stderr).into_owned();
    assert!(output.status.success(), "{text}");
    (text, fs::read_to_string(file(out)).expect("the plugin wrote its output"))
}

/// Prints an estimate beside the published cycles, and returns its error.
fn error(name: &str, published: f64, estimate: f64) -> f64 {
    let error = estimate / published - 1.0;
    println!("{name:<36} {published:>9.1} {estimate:>9.1} {:>6.1} %", 100.0 * error);
    error
}

#[test]
#[ignore = "needs QEMU: cargo xtask timing --check"]
fn the_estimates_agree_with_published_measurements() {
    let (text, json) = emulate("silicon.json");
    let measured = parse(&json).unwrap_or_else(|| panic!("no report:\n{json}\n{text}"));
    let region = |number: u32| measured.iter().find(|measured| measured.region == number).expect("a region");
    let mut errors = Vec::new();
    println!("{:<36} {:>9} {:>9} {:>7}", "cycles without wait states", "published", "estimate", "error");
    for (number, (name, cycles, blocks, _)) in (1..).zip(PUBLISHED) {
        let Measured { low, estimate, high, .. } = region(number);
        assert!(low.median <= estimate.median && estimate.median <= high.median);
        errors.push(error(name, cycles, estimate.median as f64 / blocks).abs());
    }
    let mean = errors.iter().sum::<f64>() / errors.len() as f64;
    let worst = errors.iter().copied().fold(0.0, f64::max);
    println!("mean absolute error {:.2} %, worst {:.2} %", 100.0 * mean, 100.0 * worst);
    // Two-sided: to agree exactly would mean that the figures were copied.
    assert!(mean > 0.0 && mean <= MEAN_MAX, "{mean}");
    assert!(worst <= WORST_MAX, "{worst}");

    println!("{:<36} {:>9} {:>9} {:>7}", "cycles with five wait states", "published", "estimate", "error");
    for (number, (name, .., flash)) in (1..).zip(PUBLISHED) {
        let Some(published) = flash else { continue };
        let (plain, estimate) = (region(number).estimate.median as f64, region(number).flash.median as f64);
        let error = error(name, published, estimate);
        assert!(error.abs() <= MEAN_MAX, "{name}: {error}");
        // The wait states are most of what is to be told apart: a model without them would be off by 16 %.
        assert!(estimate > 1.1 * plain, "{name}");
    }
}

#[test]
#[ignore = "needs QEMU: cargo xtask timing --check"]
fn three_runs_give_the_same_bytes() {
    let runs = ["first.json", "second.json", "third.json"].map(emulate);
    assert_eq!(runs[0].1.lines().count(), PUBLISHED.len());
    assert_eq!(runs[0], runs[1]);
    assert_eq!(runs[1], runs[2]);
}

#[test]
#[ignore = "needs QEMU: cargo xtask timing --check"]
fn an_unknown_instruction_ends_the_measurement() {
    let output = qemu("unknown", "unknown.json").output().expect("QEMU starts");
    let text = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(3), "{text}");
    assert!(text.starts_with("m4-timing: not measured: unknown instruction ee31 0b02 at 0x08"), "{text}");
    assert!(!file("unknown.json").exists());
}
