//! The commands as a user runs them. A script takes cargo's place, so nothing is built.

use std::fs;
use std::os::unix::fs::PermissionsExt as _;
use std::path::{Path, PathBuf};
use std::process::{Command, Output, Stdio};

/// A folder of this test with a script that reports a build, and leaves a note that it ran.
fn folder(name: &str) -> PathBuf {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join(name);
    let _ = fs::remove_dir_all(&folder);
    fs::create_dir_all(folder.join("debug")).expect("a folder");
    script(&folder.join("cargo"), &format!("touch {}/built; echo Building >&2; echo also built", folder.display()));
    folder
}

fn script(path: &Path, text: &str) {
    fs::write(path, format!("#!/bin/sh\n{text}\n")).expect("a script");
    fs::set_permissions(path, fs::Permissions::from_mode(0o755)).expect("its mode");
}

fn xtask(folder: &Path, arguments: &[&str]) -> Output {
    let mut command = Command::new(env!("CARGO_BIN_EXE_xtask"));
    command.args(arguments).env("CARGO", folder.join("cargo")).env("CARGO_TARGET_DIR", folder).stdin(Stdio::null());
    command.output().expect("it starts")
}

#[test]
fn progress_stays_out_of_the_results() {
    let folder = folder("progress");
    script(&folder.join("debug/fit"), "echo force_n; echo 1.5");
    let output = xtask(&folder, &["fit"]);
    let said = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success() && said.contains("Building\nalso built"), "{said}");
    assert_eq!(String::from_utf8_lossy(&output.stdout), "force_n\n1.5\n");
}

#[test]
fn flash_looks_for_probe_rs_before_it_builds() {
    let folder = folder("flash");
    let mut command = Command::new(env!("CARGO_BIN_EXE_xtask"));
    command.arg("flash").env("CARGO", folder.join("cargo")).env("CARGO_TARGET_DIR", &folder).env("PATH", &folder);
    let output = command.output().expect("it starts");
    let said = String::from_utf8_lossy(&output.stderr);
    assert!(!output.status.success() && said.contains("cargo install probe-rs-tools --locked"), "{said}");
    assert!(!folder.join("built").exists(), "{said}");
}

#[test]
fn every_command_has_examples_in_its_help() {
    let folder = folder("help");
    let help = |arguments: &[&str]| String::from_utf8(xtask(&folder, arguments).stdout).expect("UTF-8");
    let all = help(&["--help"]);
    let commands = all.split("Commands:").nth(1).and_then(|rest| rest.split("Options:").next()).expect("a list");
    let names: Vec<&str> = commands.lines().filter_map(|line| line.split_whitespace().next()).collect();
    assert!(names.len() > 20 && names.contains(&"serve"), "{names:?}");
    for name in names {
        let text = help(&["help", name]);
        assert!(text.contains("Examples:") || name == "help", "{name}: {text}");
    }
    let serve = help(&["help", "serve"]);
    assert!(serve.contains("--board") && serve.contains("--pty"), "{serve}");
    assert!(!folder.join("built").exists());
}
