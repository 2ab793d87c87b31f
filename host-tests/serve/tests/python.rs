//! The Python package and its examples on a served finger.
//!
//! `FINGERTIP_PYTHON` names a Python with `dynamixel-sdk`; `cargo xtask test` makes it and sets it.

mod common;

use common::Served;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

/// As patient as it takes on the slowest machine.
const PATIENCE_MS: &str = "600000";

/// Runs a program under the longest bus watchdog: a busy machine stops programs for longer than the 0.5 s of the examples.
const RUN: &str = "import runpy, sys
from fingertip import Bus
watch = Bus.watch
Bus.watch = lambda bus, ids, silence_s: watch(bus, ids, 2.54)
del sys.argv[0]
runpy.run_path(sys.argv[0], run_name='__main__')";

/// Output of an example.
fn example(served: &Served, name: &str, arguments: &[&str]) -> String {
    let example = Path::new(env!("FINGERTIP_ROOT")).join("python/examples").join(name);
    let mut command = python();
    command.args(["-c", RUN]).arg(example).args(["--port", &served.name, "--timeout-ms", PATIENCE_MS]);
    said(command.args(arguments))
}

/// A Python that finds the package.
fn python() -> Command {
    let python = std::env::var_os("FINGERTIP_PYTHON").expect("`cargo xtask test` sets FINGERTIP_PYTHON");
    let mut command = Command::new(PathBuf::from(python));
    let root = Path::new(env!("FINGERTIP_ROOT"));
    command.env("PYTHONDONTWRITEBYTECODE", "1").env("PYTHONPATH", root.join("python"));
    command
}

fn said(command: &mut Command) -> String {
    let output = command.output().expect("Python starts");
    let (said, complained) = (String::from_utf8_lossy(&output.stdout), String::from_utf8_lossy(&output.stderr));
    assert!(output.status.success(), "{said}{complained}");
    said.into_owned()
}

#[test]
#[ignore = "needs a Python with dynamixel-sdk: `cargo xtask test` runs it"]
fn the_examples_stream_show_set_and_recover() {
    let mut served = Served::begin(Stdio::inherit(), &[]);
    let file = std::env::temp_dir().join(format!("fingertip-python-{}.csv", std::process::id()));
    let path = file.to_str().expect("a plain path");
    example(&served, "stream_to_csv.py", &["--seconds", "1", "--rate-hz", "200", "--press", "1.5", path]);
    let text = std::fs::read_to_string(&file).expect("it was written");
    std::fs::remove_file(&file).expect("it is there");
    let row = |line: &str| line.split(',').map(|cell| cell.parse().expect("a number")).collect();
    let rows: Vec<Vec<f64>> = text.lines().skip(1).map(row).collect();
    for pair in rows.windows(2) {
        // Time is that of the frames: 99.786 us each.
        let (frames, time_s) = (pair[1][1] - pair[0][1], pair[1][0] - pair[0][0]);
        assert!(frames > 0.0 && (time_s - frames * 99.786e-6).abs() < 2e-6, "{frames} frames in {time_s} s");
    }
    let held = rows.last().expect("some states");
    assert!((held[2] - 1.5).abs() < 0.02, "{held:?}");

    let map = example(&served, "heat_map.py", &["--seconds", "0.1"]);
    assert!(map.contains("0.000 N  OFF"), "{map}");
    let shown =
        example(&served, "parameters.py", &["--set", "modulus_pa=300000", "--set", "contact_on_mn=50", "--save"]);
    assert!(shown.contains("300000  (was 250000)") && shown.contains("50  (was 40)"), "{shown}");

    served.ask("fault supply-low");
    served.ask("mend");
    let recovered = example(&served, "recovery.py", &["--seconds", "0.5", "--newtons", "0.5"]);
    assert!(recovered.ends_with("times\n"), "{recovered}");
}

/// Runs the files side by side, each in a process of its own.
#[test]
#[ignore = "needs a Python with dynamixel-sdk: `cargo xtask test` runs it"]
fn the_tests_of_the_package_pass() {
    let tests = Path::new(env!("FINGERTIP_ROOT")).join("python/tests");
    let names = std::fs::read_dir(&tests).expect("the folder is there").map(|file| file.expect("a file").file_name());
    let mut names: Vec<String> = names.filter_map(|name| name.into_string().ok()).collect();
    names.retain(|name| name.starts_with("test_") && name.ends_with(".py"));
    assert!(names.len() >= 5, "{names:?}");
    std::thread::scope(|scope| {
        for name in names {
            let mut command = python();
            command.env("FINGERTIP_SERVE", env!("CARGO_BIN_EXE_serve"));
            command.args(["-m", "unittest", "discover", "--pattern", &name]).arg(&tests);
            scope.spawn(move || said(&mut command));
        }
    });
}
