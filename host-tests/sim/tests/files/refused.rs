//! Messages about files that block a run or cannot be resumed.

use crate::interrupted::{SIM, SWEEP};
use crate::{CRC, WALL, folder};
use std::fs::{self, File};
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

/// A sweep of four runs with noise, or with other arguments.
fn sweep(out: &Path, more: &[&str]) -> Command {
    let mut command = Command::new(SWEEP);
    command.args([WALL, "--seeds", "4", "--set", "duration_s=0.02", "--set", "object.distance_mm=0.2"]);
    command.args(["--set", "effects.noise.rms_codes=1.5", "--out"]).arg(out).args(more);
    command
}

fn merge(file: &Path) -> Command {
    let mut command = Command::new(SWEEP);
    command.arg("merge").arg(file).arg("--out").arg(file.with_extension("merged"));
    command
}

/// Exit code and standard error of a command.
fn told(command: &mut Command) -> (Option<i32>, String) {
    let output = command.output().unwrap();
    (output.status.code(), String::from_utf8(output.stderr).unwrap())
}

/// Checks that a command is refused with a message.
fn refused(command: &mut Command, what: &str) {
    let (code, told) = told(command);
    assert!(code == Some(2) && told.contains(what), "{code:?} {told}");
}

/// Folder and table of a whole sweep, and its lines before the end.
fn swept(name: &str) -> (PathBuf, String, String) {
    let out = folder(&format!("refused/{name}"));
    assert_eq!(told(&mut sweep(&out, &[])).0, Some(1));
    let runs = fs::read_to_string(out.join("runs.csv")).unwrap();
    let id = runs.lines().nth(1).unwrap().split(',').next().unwrap();
    let head = format!("the sweep {id} of 4 runs");
    let line = |text: &str| format!("{:016x} {text}\n", CRC.checksum(text.as_bytes()));
    let part = std::iter::once(head.as_str()).chain(runs.lines().skip(1)).map(line).collect();
    (out, runs, part)
}

#[test]
fn a_row_is_whole_or_it_is_run_again() {
    let (out, runs, part) = swept("rows");
    let file = out.join("runs.csv.part");
    let ends: Vec<usize> = part.match_indices('\n').map(|(at, _)| at + 1).collect();
    // Cut anywhere in the last row and its number, in the head, and right behind a row.
    for cut in (ends[3] - 1..ends[4]).step_by(29).chain([ends[4] - 2, ends[4] - 1, 0, 1, ends[0] - 1, ends[1]]) {
        fs::write(&file, &part[..cut]).unwrap();
        let (_, told) = told(&mut sweep(&out, &[]));
        let whole = ends.iter().filter(|end| **end <= cut).count().saturating_sub(1);
        assert!(whole == 0 || told.contains(&format!("where {whole} runs are done")), "{cut}: {told}");
        assert_eq!(fs::read_to_string(out.join("runs.csv")).unwrap(), runs, "cut at {cut}");
        assert!(!file.exists());
    }
    // A changed digit in the middle.
    let mut changed = part.clone().into_bytes();
    changed[ends[2] - 3] ^= 1;
    fs::write(&file, changed).unwrap();
    assert!(told(&mut sweep(&out, &[])).1.contains("where 3 runs are done"));
    assert_eq!(fs::read_to_string(out.join("runs.csv")).unwrap(), runs);
}

#[test]
fn the_results_of_another_sweep_stay() {
    let (out, runs, part) = swept("others");
    let other = ["--vary", "tip.radius_mm=9..10:2"];
    refused(&mut sweep(&out, &other), "holds the sweep wall-");
    fs::remove_file(out.join("runs.csv")).unwrap();
    fs::write(out.join("runs.csv.part"), &part).unwrap();
    refused(&mut sweep(&out, &other), "holds what is done of the sweep wall-");
    assert_eq!(fs::read_to_string(out.join("runs.csv.part")).unwrap(), part);
    fs::write(out.join("runs.csv.part"), &runs).unwrap();
    refused(&mut sweep(&out, &[]), "something that cannot be read");
    fs::remove_file(out.join("runs.csv.part")).unwrap();
    fs::write(out.join("runs.csv"), "my own notes\n").unwrap();
    refused(&mut sweep(&out, &[]), "holds something else");
    assert_eq!(fs::read_to_string(out.join("runs.csv")).unwrap(), "my own notes\n");
}

#[test]
fn each_sweep_has_a_folder_of_its_own() {
    let place = folder("refused/own");
    let run = |more: &[&str]| {
        let mut command = Command::new(SWEEP);
        command.current_dir(&place).args([WALL, "--set", "duration_s=0.01"]).args(more);
        told(&mut command).1.split("the runs go to ").nth(1).unwrap().trim().to_owned()
    };
    let (one, other) = (run(&[]), run(&["--vary", "tip.radius_mm=9..10:2"]));
    assert!(one != other && one.starts_with("target/sweep/wall-"), "{one} {other}");
    assert!([one, other].iter().all(|folder| place.join(folder).join("summary.csv").is_file()));
}

#[test]
fn seeds_that_change_nothing_are_refused() {
    let out = folder("refused/seeds");
    let mut same = Command::new(SWEEP);
    refused(same.args([WALL, "--seeds", "3", "--out"]).arg(&out), "nothing in wall is random");
    refused(&mut sweep(&out, &["--set", "effects.noise.rms_codes=0"]), "nothing in wall is random");
    let many = ["--vary", "tip.radius_mm=9..10:99999", "--vary", "tip.modulus_kpa=200..300:999"];
    refused(&mut sweep(&out, &many), "more than");
    assert_eq!(fs::read_dir(&out).unwrap().count(), 0);
}

#[test]
fn shards_that_are_none_are_told() {
    let (out, runs, _) = swept("shards");
    let file = out.join("shard.csv");
    let lines: Vec<&str> = runs.lines().collect();
    let row = |column: &str, value: &str| {
        let place = lines[0].split(',').position(|name| name == column).unwrap();
        let mut cells: Vec<&str> = lines[1].split(',').collect();
        cells[place] = value;
        [&[lines[0], &cells.join(",")], &lines[2..]].concat().join("\n") + "\n"
    };
    let expect = "expect peak_force_n";
    for (text, what) in [
        (runs.clone(), ""),
        (row("run", "0"), "no run's number"),
        (row("run", "5"), "no count of runs"),
        (row("of_runs", "99999999999999999"), "and not of"),
        (row("of_runs", "inf"), "no count of runs"),
        (row("peak_force_n", "inf"), "`inf` under peak_force_n is no number"),
        (row("peak_force_n", "NaN"), "is no number"),
        (row("peak_force_n", "1e308"), "is no number"),
        (row("passed", "2"), "no verdict"),
        (row("seed", "-1"), "no seed"),
        (row(expect, "1"), "no range"),
        (runs[..runs.len() - 1].into(), "cut off in its last line"),
        ([lines[0], lines[2], ""].join("\n"), "3 of 4 runs are missing, run 1 the first"),
        ([lines[0], lines[1], lines[1], ""].join("\n"), "there twice"),
        ("sweep\nx\n".into(), "no shard of a sweep"),
        ("sweep,run,of_runs\nx,1,1\n".into(), "no shard of a sweep"),
        ("sweep,run,of_runs,expect a,seed,passed,digest\nx,1,1,..,1,1,x\n".into(), "no shard of a sweep"),
        ("sweep,run,of_runs,seed,passed,digest,a,a\nx,1,1,1,1,x,1,1\n".into(), "the same name"),
        ("sweep,run,of_runs,seed,passed,digest\nx,1,99999999999999999,1,1,x\n".into(), "99999999999999998 of"),
        ("".into(), "cut off"),
        ("\u{0}\n".into(), "no shard of a sweep"),
    ] {
        fs::write(&file, text).unwrap();
        if what.is_empty() {
            assert_eq!(told(&mut merge(&file)).0, Some(1));
        } else {
            refused(&mut merge(&file), what);
        }
    }
}

#[test]
fn a_lock_of_a_dead_process_stands_in_nobodys_way() {
    let (out, runs, _) = swept("dead");
    for left in ["runs.csv.lock", "runs.csv.new", "summary.csv.new", "runs.csv.part.new"] {
        fs::write(out.join(left), "4194304 0\n").unwrap();
    }
    assert_eq!(told(&mut sweep(&out, &[])).0, Some(1));
    assert_eq!(fs::read_to_string(out.join("runs.csv")).unwrap(), runs);
    assert!(!out.join("runs.csv.lock").exists() && !out.join("runs.csv.new").exists());

    // A running process is named, and its file is kept.
    let lock = output::kept::Lock::take(&out.join("runs.csv")).unwrap();
    refused(&mut sweep(&out, &[]), &format!("is being written by process {}", std::process::id()));
    drop(lock);
    assert_eq!(told(&mut sweep(&out, &[])).0, Some(1));
}

#[test]
fn what_cannot_be_shown_is_told_and_the_rest_is_done() {
    let full = || File::options().write(true).open("/dev/full").unwrap();
    for words in [&["--list"][..], &["--keys"], &["--explain", WALL]] {
        let mut command = Command::new(SIM);
        let output = command.args(words).stdout(full()).stderr(Stdio::piped()).output().unwrap();
        let told = String::from_utf8(output.stderr).unwrap();
        assert_eq!(output.status.code(), Some(2), "{told}");
        assert!(told.contains("cannot write to the standard output: No space left"), "{told}");
    }
    // Without any output, the exit code shows the failure.
    let mut command = Command::new(SIM);
    let status = command.args(["--set", "a.b=1", WALL]).stdout(full()).stderr(full()).status().unwrap();
    assert_eq!(status.code(), Some(2));
    // A file that cannot be written leaves the others there.
    let out = folder("refused/rest");
    let mut command = Command::new(SIM);
    command.args([WALL, "--set", "duration_s=0.01", "--json", "/dev/full", "--out"]).arg(&out);
    refused(&mut command, "cannot write /dev/full: No space left");
    assert!(out.join("report.html").is_file() && out.join("run.mcap").is_file());
    sim::recording::check(&fs::read(out.join("run.mcap")).unwrap()).unwrap();
}
