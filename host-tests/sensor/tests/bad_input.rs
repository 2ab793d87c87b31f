//! What cannot be used is refused with the file, the line, the reason and what to do; nothing is written then.

mod made;

use made::{Creeping, Pressed};
use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};

/// A folder of its own for a test.
fn folder(name: &str) -> PathBuf {
    let path = Path::new(env!("CARGO_TARGET_TMPDIR")).join(name);
    let _ = fs::remove_dir_all(&path);
    fs::create_dir_all(&path).unwrap();
    path
}

fn fit(arguments: &[&Path]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_sensor")).arg("fit").args(arguments).output().unwrap()
}

fn said(output: &Output) -> String {
    String::from_utf8_lossy(&output.stderr).into_owned()
}

/// Fits to a text and expects it to be refused with these words.
fn refused(name: &str, text: &[u8], words: &[&str]) {
    let folder = folder(name);
    let (file, json) = (folder.join("in.csv"), folder.join("out.json"));
    fs::write(&file, text).unwrap();
    let output = fit(&[&file, Path::new("--json"), &json]);
    let said = said(&output);
    assert_eq!(output.status.code(), Some(2), "{name}: {said}");
    for word in words.iter().copied().chain(["in.csv"]) {
        assert!(said.contains(word), "{name}: \"{word}\" is not in: {said}");
    }
    assert!(output.stdout.is_empty() && !said.contains("panicked"), "{said}");
    assert_eq!(fs::read_dir(&folder).unwrap().count(), 1, "{name}: something was written");
}

fn changed(line: usize, to: &str) -> Vec<u8> {
    let text = Pressed::default().text();
    let lines: Vec<_> = text.lines().enumerate().map(|(at, old)| if at + 1 == line { to } else { old }).collect();
    lines.join("\n").into_bytes()
}

#[test]
fn what_is_no_recording() {
    refused("empty", b"", &["line 1", "header lacks", "name the columns"]);
    refused("header", b"set,sample,force_N,conductance_mS\n", &["line 2", "no rows", "give a recording"]);
    refused("one", b"set,sample,force_N,conductance_mS\na,0,1,2\n", &["line 2", "1 readings", "record"]);
    refused("binary", &[0xff, 0xfe, 0, 1, 10, 200], &["line 1", "not text", "UTF-8"]);
    refused("missing", b"set,sample,force_N\na,0,1\n", &["line 1", "lacks conductance_mS"]);
    refused("other", b"run,weight_kg,t_s\na,0,1\n", &["line 1", "lacks conductance_mS", "run,weight_kg,t_s"]);
    for mark in [";", "\t"] {
        let text = Pressed::default().text().replace(',', mark);
        refused("parted", text.as_bytes(), &["line 1", "parted by", "with commas"]);
    }
    refused("twice", b"set,set,sample,force_N,conductance_mS\na,a,0,1,2\n", &["line 1", "twice", "leave one"]);
}

#[test]
fn a_row_that_says_nothing() {
    for (name, row, words) in [
        ("nan", "a,5,NaN,0.1", ["force_N is NaN", "take the row out"]),
        ("infinite", "a,5,1.0,inf", ["conductance_mS is inf", "take the row out"]),
        ("word", "a,5,much,0.1", ["not a number", "decimal point"]),
        ("comma", "a,5,\"1,5\",0.1", ["not a number", "decimal point"]),
        ("gap", "a,5,,0.1", ["force_N is empty", "fill it in"]),
        ("short", "a,5,1.0", ["3 fields where the header has 4", "complete the line"]),
        ("huge", "a,5,1e300,0.1", ["which no recording shows", "unit"]),
        ("nameless", ",5,1.0,0.1", ["set is empty", "name what"]),
        ("again", "a,3,1.0,0.1", ["sample 3 of a after 4", "order of time"]),
        ("back", "a,0,1.0,0.1", ["sample 0 of a after 4", "order of time"]),
    ] {
        refused(name, &changed(7, row), &[&["line 7"], &words[..]].concat());
    }
}

#[test]
fn a_recording_that_contradicts_itself() {
    let table = |row: &dyn Fn(i32) -> String| {
        let rows: Vec<_> = (0..50).map(row).collect();
        format!("set,sample,force_N,conductance_mS\n{}\n", rows.join("\n")).into_bytes()
    };
    refused(
        "falls",
        &table(&|at| format!("a,{at},{at},{}", 50 - at)),
        &["line 2", "does not grow", "check the columns"],
    );
    refused("still", &table(&|at| format!("a,{at},5.0,{at}")), &["line 2", "stays within", "record from no force"]);
    refused("pulls", &table(&|at| format!("a,{at},-{at},-{at}")), &["line 2", "no force above zero", "positive"]);
    let cut = |at: i32| if at < 10 { f64::from(at) } else { 10.0 };
    refused(
        "cut",
        &table(&|at| format!("a,{at},{at},{}", cut(at))),
        &["line 2", "10 readings are below", "press less"],
    );
    refused("flat", &table(&|at| format!("a,{at},{at},0.0")), &["line 2", "does not grow"]);
}

#[test]
fn holds_that_cannot_be() {
    let text = Creeping { rate: 0.05, time_constant_s: 10.0, spread: 0.0, seed: 1 }.text(&["one"]);
    let with = |line: usize, to: &str| -> Vec<u8> {
        let lines: Vec<_> = text.lines().enumerate().map(|(at, old)| if at + 1 == line { to } else { old }).collect();
        lines.join("\n").into_bytes()
    };
    refused("unordered", &with(100, "one,1,0.5,12.0"), &["line 100", "t_s of 0.5 after", "sort them"]);
    refused("light", &with(100, "one,-1,0.5,12.0"), &["line 100", "-1 kg", "check the columns"]);
    refused("early", &with(100, "one,1,-0.5,12.0"), &["line 100", "-0.5 s", "check the columns"]);
    refused("dead", &with(100, "one,1,4.800,0"), &["0 mS at 4.8 s", "check the columns"]);
    refused("bare", text.lines().take(76).collect::<Vec<_>>().join("\n").as_bytes(), &["no weight above zero"]);
    refused("few", text.lines().take(226).collect::<Vec<_>>().join("\n").as_bytes(), &["2 holds", "hold more weights"]);
    refused(
        "short_hold",
        text.lines().take(80).collect::<Vec<_>>().join("\n").as_bytes(),
        &["4 readings", "hold longer"],
    );
    let mixed: Vec<_> = std::iter::once("run,weight_kg,t_s,conductance_mS".to_owned())
        .chain((0..300).map(|at| format!("one,{},{}.5,10", 1 + at % 7, at)))
        .collect();
    refused("shuffled", mixed.join("\n").as_bytes(), &["1 readings", "sort the rows"]);
}

#[test]
fn the_other_file_is_checked_too() {
    let folder = folder("judge");
    let [cycles, others, holds] = ["cycles.csv", "others.csv", "holds.csv"].map(|name| folder.join(name));
    let json = folder.join("out.json");
    fs::write(&cycles, Pressed::default().text()).unwrap();
    fs::write(&others, Pressed::default().text().replace("\na,", "\nb,")).unwrap();
    fs::write(&holds, Creeping { rate: 0.05, time_constant_s: 10.0, spread: 0.0, seed: 1 }.text(&["one"])).unwrap();
    fs::write(&json, "as it was").unwrap();
    let missing = folder.join("nowhere.csv");
    let [judge, to] = ["--judge", "--json"].map(Path::new);
    for (other, word) in [(&others, "the set b is not in"), (&holds, "are not those of"), (&missing, "cannot be read")]
    {
        let output = fit(&[&cycles, judge, other, to, &json]);
        assert_eq!(output.status.code(), Some(2));
        assert!(said(&output).contains(word) && output.stdout.is_empty(), "{}", said(&output));
        assert_eq!(fs::read_to_string(&json).unwrap(), "as it was");
    }
    let output = fit(&[&cycles, to, &folder.join("no/such/folder.json")]);
    assert_eq!(output.status.code(), Some(2));
    assert!(said(&output).contains("cannot be written") && output.stdout.is_empty());
}

#[test]
fn marks_and_ends_of_lines_change_nothing() {
    let folder = folder("marks");
    let [plain, marked] = ["plain.csv", "marked.csv"].map(|name| folder.join(name));
    let [to, other] = ["plain.json", "marked.json"].map(|name| folder.join(name));
    let text = Pressed::default().text();
    fs::write(&plain, &text).unwrap();
    fs::write(&marked, format!("\u{feff}{}", text.replace('\n', "\r\n"))).unwrap();
    for (file, json) in [(&plain, &to), (&marked, &other)] {
        assert!(fit(&[file, Path::new("--json"), json]).status.success());
    }
    let [plain, marked] = [to, other].map(|path| fs::read_to_string(path).unwrap());
    assert_eq!(plain.replace("plain.csv", ""), marked.replace("marked.csv", ""));
    assert!(plain.contains("\"force_per_conductance_n_per_ms\""));
}
