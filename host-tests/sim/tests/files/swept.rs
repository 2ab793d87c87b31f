//! Sweeps, shards and merging; messages about files that block a run or cannot be resumed.

use crate::interrupted::{SIM, SWEEP};
use crate::*;
use sim::shards::Shard;
use sim::sweep::{Plan, Table, merge, sweep};
use std::process::{Command, Stdio};

/// Short, near, and with noise.
const SET: [&str; 3] = ["duration_s=0.04", "object.distance_mm=0.5", "effects.noise.rms_codes=1.5"];

/// Two keys and two seeds, short.
fn plan(out: &Path, shard: Shard) -> Plan {
    Plan {
        scene: WALL.into(),
        set: SET.map(String::from).into(),
        vary: vec!["tip.modulus_kpa=240..260:3".parse().unwrap(), "tip.radius_mm=9.5..10.5:2".parse().unwrap()],
        seeds: 2,
        shard,
        out: Some(out.into()),
    }
}

fn files(folder: &Path) -> BTreeMap<String, Vec<u8>> {
    let file = |path: PathBuf| (path.file_name().unwrap().to_string_lossy().into_owned(), fs::read(path).unwrap());
    fs::read_dir(folder).unwrap().map(|entry| file(entry.unwrap().path())).collect()
}

#[test]
fn shards_merged_are_the_whole_byte_for_byte() {
    let whole = folder("swept/whole");
    let (table, told) = sweep(&plan(&whole, Shard::WHOLE), &native::board).unwrap();
    assert_eq!(told, whole);
    runs_are_numbered_point_by_point_and_seed_by_seed(&table);
    let expected = files(&whole);
    assert_eq!(expected.keys().collect::<Vec<_>>(), ["peak_force_n.svg", "runs.csv", "summary.csv"]);
    let has = |text: &str| table.text().contains(text);
    assert!(has("tip.modulus_kpa = 240.0, tip.radius_mm = 9.5") || has("tip.modulus_kpa = 240, "));

    let shards = folder("swept/shards");
    // The last first: the order of the files does not count.
    for shard in (1..=4).rev() {
        sweep(&plan(&shards, Shard { number: shard, of: 4 }), &native::board).unwrap();
    }
    let parts: Vec<PathBuf> = (1..=4).rev().map(|shard| shards.join(format!("runs-{shard}-of-4.csv"))).collect();
    let merged = folder("swept/merged");
    assert_eq!(merge(&parts, &merged).unwrap(), table);
    assert_eq!(files(&merged), expected);

    // What cannot be merged is refused.
    let refused = |files: &[PathBuf]| merge(files, &folder("swept/refused")).unwrap_err().to_string();
    let other = folder("swept/other");
    sweep(&Plan { seeds: 1, ..plan(&other, Shard { number: 1, of: 2 }) }, &native::board).unwrap();
    assert!(refused(&[parts[0].clone(), other.join("runs-1-of-2.csv")]).contains("is of the sweep"));
}

fn runs_are_numbered_point_by_point_and_seed_by_seed(table: &Table) {
    let column = |name: &str| table.head.iter().position(|known| known == name).unwrap();
    let number = |row: &Vec<String>, name: &str| row[column(name)].parse::<f64>().unwrap();
    let shown = ["run", "tip.modulus_kpa", "tip.radius_mm", "seed"];
    let rows: Vec<_> = table.rows.iter().map(|row| shown.map(|name| number(row, name))).collect();
    let mut expected = Vec::new();
    for modulus_kpa in [240.0, 250.0, 260.0] {
        for radius_mm in [9.5, 10.5] {
            expected.extend([1.0, 2.0].map(|seed| [expected.len() as f64 + seed, modulus_kpa, radius_mm, seed]));
        }
    }
    assert_eq!(rows, expected);
    // A row has the values that were run.
    let row = &table.rows[7];
    let scene = scene(WALL, &[&SET[..], &["tip.modulus_kpa=250", "tip.radius_mm=10.5"]].concat(), Some(2));
    let mut last = sim::metrics::Meter::default();
    assert_eq!(row[column("digest")], native::board(&scene, &mut last).unwrap().digest);
}

#[test]
fn what_cannot_be_run_is_told() {
    let out = folder("swept/wrong");
    let plan = Plan { vary: vec!["tip.radius_mm=10..1000:2".parse().unwrap()], ..plan(&out, Shard::WHOLE) };
    assert!(sweep(&plan, &native::board).unwrap_err().to_string().contains("radius_mm"));
    let twice = vec!["tip.radius_mm=9..10:2".parse().unwrap(); 2];
    let plan = Plan { vary: twice, ..plan };
    assert!(sweep(&plan, &native::board).unwrap_err().to_string().contains("twice"));
    let failing = sweep(&self::plan(&out, Shard::WHOLE), &|_, _| Err("the board burns".into()));
    assert!(failing.unwrap_err().to_string().contains("the board burns"));
}

/// A sweep of four runs with noise, or with other arguments.
fn sweep_command(out: &Path, more: &[&str]) -> Command {
    let mut command = Command::new(SWEEP);
    command.args([WALL, "--seeds", "4", "--set", "duration_s=0.02", "--set", "object.distance_mm=0.2"]);
    command.args(["--set", "effects.noise.rms_codes=1.5", "--out"]).arg(out).args(more);
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
    assert_eq!(told(&mut sweep_command(&out, &[])).0, Some(1));
    let runs = fs::read_to_string(out.join("runs.csv")).unwrap();
    let id = runs.lines().nth(1).unwrap().split(',').next().unwrap();
    let head = format!("the sweep {id} of 4 runs");
    let line = |text: &str| format!("{:016x} {text}\n", CRC.checksum(text.as_bytes()));
    let part = std::iter::once(head.as_str()).chain(runs.lines().skip(1)).map(line).collect();
    (out, runs, part)
}

/// A cut row is among the interruptions.
#[test]
fn a_row_with_a_changed_digit_is_run_again() {
    let (out, runs, part) = swept("rows");
    let ends: Vec<usize> = part.match_indices('\n').map(|(at, _)| at + 1).collect();
    let mut changed = part.into_bytes();
    changed[ends[2] - 3] ^= 1;
    fs::write(out.join("runs.csv.part"), changed).unwrap();
    assert!(told(&mut sweep_command(&out, &[])).1.contains("where 3 runs are done"));
    assert_eq!(fs::read_to_string(out.join("runs.csv")).unwrap(), runs);
}

#[test]
fn the_results_of_another_sweep_stay() {
    let (out, runs, part) = swept("others");
    let other = ["--vary", "tip.radius_mm=9..10:2"];
    refused(&mut sweep_command(&out, &other), "holds the sweep wall-");
    assert!(!fs::exists(out.join("runs.csv.part")).unwrap(), "it would keep out the sweep whose folder this is");
    fs::remove_file(out.join("runs.csv")).unwrap();
    fs::write(out.join("runs.csv.part"), &part).unwrap();
    refused(&mut sweep_command(&out, &other), "holds what is done of the sweep wall-");
    assert_eq!(fs::read_to_string(out.join("runs.csv.part")).unwrap(), part);
    fs::write(out.join("runs.csv.part"), &runs).unwrap();
    refused(&mut sweep_command(&out, &[]), "something that cannot be read");
    fs::remove_file(out.join("runs.csv.part")).unwrap();
    fs::write(out.join("runs.csv"), "my own notes\n").unwrap();
    refused(&mut sweep_command(&out, &[]), "holds something else");
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
    refused(&mut sweep_command(&out, &["--set", "effects.noise.rms_codes=0"]), "nothing in wall is random");
    let many = ["--vary", "tip.radius_mm=9..10:99999", "--vary", "tip.modulus_kpa=200..300:999"];
    refused(&mut sweep_command(&out, &many), "more than");
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
    for (text, what) in [
        (runs.clone(), ""),
        (row("run", "0"), "no run's number"),
        (row("run", "5"), "no run's number"),
        (row("of_runs", "99999999999999999"), "and not of"),
        (row("of_runs", "inf"), "no run's number"),
        (row("peak_force_n", "inf"), "`inf` under peak_force_n is no number"),
        (row("peak_force_n", "NaN"), "is no number"),
        (row("peak_force_n", "1e308"), "is no number"),
        (row("expect peak_force_n", "inf..1"), "is no number"),
        (runs[..runs.len() - 1].into(), "cut off in its last line"),
        ([lines[0], lines[2], ""].join("\n"), "3 of 4 runs are missing, run 1 the first"),
        ([lines[0], lines[1], lines[1], ""].join("\n"), "there twice"),
        ("sweep\nx\n".into(), "no shard of a sweep"),
        ("sweep,run,of_runs\nx,1,1\n".into(), "no shard of a sweep"),
        ("sweep,run,of_runs,seed,passed,digest\nx,1,99999999999999999,1,1,x\n".into(), "99999999999999998 of"),
        ("".into(), "cut off"),
        ("\u{0}\n".into(), "no shard of a sweep"),
    ] {
        fs::write(&file, text).unwrap();
        let mut merge = Command::new(SWEEP);
        merge.arg("merge").arg(&file).arg("--out").arg(file.with_extension("merged"));
        if what.is_empty() {
            assert_eq!(told(&mut merge).0, Some(1));
        } else {
            refused(&mut merge, what);
        }
    }
}

#[test]
fn what_cannot_be_shown_is_told_and_the_rest_is_done() {
    let full = || File::options().write(true).open("/dev/full").unwrap();
    for words in [&["--list"][..], &["--explain", WALL]] {
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
