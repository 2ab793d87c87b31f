//! What is interrupted: a command, and the files that it leaves when nothing disturbs it.

use crate::{POPULATION, SCENE, SIM, SWEEP, folder};
use serde_json::Value;
use std::collections::BTreeMap;
use std::ffi::OsString;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

/// Fingers that are done within milliseconds.
const BALLS: &str = "about = \"Walls here and there\"\nduration_s = 0.03\n[object]\ndistance_mm = { uniform = [0.1, 0.6] }\n\
    [effects.noise]\nrms_codes = { log_uniform = [0.3, 3] }\n[[script]]\nat_s = 0.0\ngoal_n = { uniform = [0.5, 2] }\n\
    [[expect]]\nmetric = \"peak_force_n\"\nmax = 1.2\n";

/// A command and its folder.
pub struct Job {
    pub name: &'static str,
    program: &'static str,
    words: Vec<OsString>,
    out: PathBuf,
    /// Grows while the command runs; its last size in an undisturbed run.
    pub growing: PathBuf,
    pub bytes: u64,
    /// What it leaves: each file by its name, without times.
    expected: BTreeMap<String, Vec<u8>>,
    /// The lines that it may keep so far.
    lines: Vec<String>,
}

impl Job {
    /// All three kinds.
    pub fn all(campaign: &str) -> [Self; 3] {
        let place = |name: &str| folder(&format!("{campaign}/{name}"));
        [Self::sweep(&place("sweep")), Self::run(&place("run")), Self::population(&place("population"))]
    }

    fn sweep(place: &Path) -> Self {
        let mut words: Vec<OsString> = vec![SCENE.into()];
        let set = ["duration_s=0.02", "object.distance_mm=0.2", "effects.noise.rms_codes=1.5"];
        words.extend(set.iter().flat_map(|set| ["--set".into(), set.into()]));
        words.extend(["--vary", "tip.modulus_kpa=240..260:3", "--seeds", "4", "--out"].map(OsString::from));
        let mut job = Self::new("sweep", SWEEP, words, place, "runs.csv.part");
        job.words.push(job.out.clone().into());
        job.undisturbed();
        let runs = String::from_utf8(job.expected["runs.csv"].clone()).unwrap();
        job.lines = runs.lines().skip(1).map(str::to_owned).collect();
        // What each row has more in front of it: the check word and a space.
        job.bytes = runs.len() as u64;
        job
    }

    fn run(place: &Path) -> Self {
        let words = [SCENE, "--set", "duration_s=0.03", "--set", "object.distance_mm=0.2", "--out"];
        let mut job = Self::new("run", SIM, words.map(OsString::from).into(), place, "run.mcap.new");
        job.words.extend([job.out.clone().into(), "--json".into(), job.out.join("run.json").into()]);
        job.undisturbed();
        job.bytes = job.expected["run.mcap"].len() as u64;
        job
    }

    fn population(place: &Path) -> Self {
        let file = place.join("balls.toml");
        fs::write(&file, BALLS).unwrap();
        let words = vec![file.into(), "--fingers".into(), "12".into(), "--json".into()];
        let mut job = Self::new("population", POPULATION, words, place, "all.json.part");
        job.words.push(job.out.join("all.json").into());
        job.undisturbed();
        let all: Value = serde_json::from_slice(&job.expected["all.json"]).unwrap();
        job.lines = all["fingers"].as_array().unwrap().iter().map(Value::to_string).collect();
        job.bytes = job.lines.iter().map(|line| line.len() as u64 + 18).sum();
        job
    }

    fn new(name: &'static str, program: &'static str, words: Vec<OsString>, place: &Path, growing: &str) -> Self {
        let out = place.join("out");
        let (growing, expected) = (out.join(growing), BTreeMap::new());
        Self { name, program, words, out, growing, bytes: 0, expected, lines: Vec::new() }
    }

    /// Notes what an undisturbed run leaves, and clears the folder.
    fn undisturbed(&mut self) {
        let status = self.command().stdout(Stdio::null()).stderr(Stdio::null()).status().unwrap();
        assert!(status.code().is_some_and(|code| code < 2), "{}: {status}", self.name);
        self.expected = self.files();
        self.clear();
    }

    pub fn clear(&self) {
        fs::remove_dir_all(&self.out).unwrap();
    }

    /// The command.
    pub fn command(&self) -> Command {
        let mut command = Command::new(self.program);
        command.args(&self.words);
        command
    }

    /// The same, where Ctrl-C ends it also when these tests run in the background of a script, which ignores that.
    pub fn in_front(&self) -> Command {
        let mut command = Command::new("env");
        command.arg("--default-signal=INT").arg(self.program).args(&self.words);
        command
    }

    /// The same under a limit of its files' size. Beyond it the system kills it, or lets it live with a write that
    /// failed.
    pub fn limited(&self, bytes: u64, lives: bool) -> Command {
        let mut command = Command::new("sh");
        let trap = if lives { "trap '' XFSZ; " } else { "" };
        command.args(["-c", &format!("{trap}exec prlimit --core=0 --fsize={bytes} \"$@\""), "sh", self.program]);
        command.args(&self.words);
        command
    }

    fn files(&self) -> BTreeMap<String, Vec<u8>> {
        let Ok(entries) = fs::read_dir(&self.out) else { return BTreeMap::new() };
        let paths = entries.map(|entry| entry.unwrap().path());
        let name = |path: &Path| path.file_name().unwrap().to_string_lossy().into_owned();
        paths.map(|path| (name(&path), timeless(&path))).collect()
    }

    /// Nothing but whole files of the undisturbed run, and whole lines of it so far; returns how many lines.
    pub fn check_parts(&self, after: &str) -> usize {
        let mut done = 0;
        for (name, bytes) in self.files() {
            match self.expected.get(&name) {
                Some(expected) => assert!(bytes == *expected, "{}: {name} is another after {after}", self.name),
                None if name.ends_with(".part") => done = self.check_lines(&bytes, after),
                None => {
                    assert!(name.ends_with(".new") || name.ends_with(".lock"), "{}: {name} after {after}", self.name)
                }
            }
        }
        let finished = self.expected.keys().any(|name| name.starts_with("runs.") && self.out.join(name).exists());
        if finished { self.lines.len() } else { done }
    }

    fn check_lines(&self, bytes: &[u8], after: &str) -> usize {
        let text = String::from_utf8_lossy(bytes);
        let lines = text.split_inclusive('\n').skip(1).filter_map(|line| line.strip_suffix('\n'));
        let texts: Vec<&str> = lines.filter_map(|line| line.get(17..)).collect();
        for text in &texts {
            // A finger's fields stand in the order of their names there.
            let sorted = serde_json::from_str::<Value>(text).map_or((*text).to_owned(), |value| value.to_string());
            assert!(self.lines.contains(&sorted), "{}: {text} after {after}", self.name);
        }
        texts.len()
    }

    /// Goes on to the end: all is as if nothing had happened, and nothing else is left.
    pub fn check_whole(&self, after: &str) {
        let output = self.command().output().unwrap();
        let told = String::from_utf8_lossy(&output.stderr);
        assert!(output.status.code().is_some_and(|code| code < 2), "{} after {after}: {told}", self.name);
        self.check_left(after);
    }

    /// All files are there, and no other.
    pub fn check_left(&self, after: &str) {
        let files = self.files();
        let names = |files: &BTreeMap<String, Vec<u8>>| files.keys().cloned().collect::<Vec<_>>();
        assert_eq!(names(&files), names(&self.expected), "{} after {after}", self.name);
        for (name, bytes) in files {
            assert!(bytes == self.expected[&name], "{}: {name} is another after {after}", self.name);
        }
    }
}

/// A file without the times that it took.
fn timeless(path: &Path) -> Vec<u8> {
    let bytes = fs::read(path).unwrap();
    match path.file_name().and_then(|name| name.to_str()) {
        Some("run.json") => {
            let mut run: Value = serde_json::from_slice(&bytes).expect("whole JSON");
            for key in ["wall_s", "set_up_wall_s", "ledger"] {
                run[key] = Value::Null;
            }
            run.to_string().into_bytes()
        }
        Some("report.html") => {
            let page = String::from_utf8(bytes).unwrap();
            assert!(page.ends_with("</html>"), "the report is cut off");
            let (front, rest) = page.split_once("<section id=\"ledger\">").unwrap();
            (front.to_owned() + rest.split_once("</section>").unwrap().1).into_bytes()
        }
        _ => bytes,
    }
}
