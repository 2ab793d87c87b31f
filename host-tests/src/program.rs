//! Exit codes and the emulator of the programs of this package.

use std::error::Error;
use std::fs;
use std::path::Path;
use std::process::{Command, ExitCode, Stdio};

/// Prints the error, and returns the exit code.
pub fn ended(result: Result<(), String>) -> ExitCode {
    match result {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("error: {error}");
            ExitCode::FAILURE
        }
    }
}

// QEMU with an emulated core, for images that report by semihosting.

/// The firmware's core: an STM32F405, a board that QEMU 7 knows as well. An instruction takes 8 ns of virtual time: more
/// than a tick of SysTick, so every one of them counts.
const CORTEX_M4F: &str = "qemu-system-arm -M netduinoplus2 -icount shift=3,align=off,sleep=off";
/// The image's own watchdog ends a hang in virtual time. The program `timeout`, by the clock on the wall, is for an
/// image that cannot even do that: the slowest machine takes a small part of it.
const HUNG_S: &str = "7200";

/// Runs an image for the firmware's core in a folder with the words of its command line to its end, and returns what it wrote.
pub fn run(image: &Path, folder: &Path, words: &[&str]) -> Result<String, Box<dyn Error>> {
    run_on(CORTEX_M4F, image, folder, words)
}

/// Runs an image on an emulator: its program and its options for the board, separated by spaces.
pub fn run_on(emulator: &str, image: &Path, folder: &Path, words: &[&str]) -> Result<String, Box<dyn Error>> {
    let image = fs::canonicalize(image).map_err(|error| format!("the image {}: {error}", image.display()))?;
    // A comma within a word is written twice.
    let words: Vec<_> = words.iter().map(|word| format!(",arg={}", word.replace(',', ",,"))).collect();
    let output = Command::new("timeout")
        .arg(HUNG_S)
        .args(emulator.split(' '))
        .current_dir(folder)
        .args(["-display", "none", "-monitor", "none", "-serial", "none", "-semihosting-config"])
        .arg(format!("enable=on,target=native{}", words.concat()))
        .arg("-kernel")
        .arg(image)
        .stdin(Stdio::null())
        .stderr(Stdio::inherit())
        .output()
        .map_err(|error| format!("cannot start `timeout` from PATH: {error}"))?;
    let (text, status) = (String::from_utf8_lossy(&output.stdout).into_owned(), output.status);
    match text.lines().find(|line| line.starts_with("FAILED:")) {
        Some(line) => Err(line.into()),
        None if status.code() == Some(124) => {
            Err(format!("FAILED: hang: the image did not end within {HUNG_S} s").into())
        }
        None if !status.success() => Err(format!("FAILED: `{emulator}` ended with {status}:\n{text}").into()),
        None => Ok(text),
    }
}
