//! Interrupted runs, sweeps and populations, and their files.
//!
//! A short campaign runs with the other tests; docs/runs.md describes the whole one, which is run by name.
//!
//! What is interrupted: a command, and the files that it leaves when nothing disturbs it.
//!
//! Ways to interrupt a command. Each strikes at a number of bytes, never after a time.

mod refused;

use fastrand::Rng;
use rustix::process::{Pid, Signal, kill_process};
use serde_json::Value;
use std::collections::BTreeMap;
use std::ffi::OsString;
use std::fs::File;
use std::io::Read;
use std::os::unix::process::ExitStatusExt;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::time::Duration;
use std::{fs, thread};

const SIM: &str = env!("CARGO_BIN_EXE_sim");
const SWEEP: &str = env!("CARGO_BIN_EXE_sweep");
const POPULATION: &str = env!("CARGO_BIN_EXE_population");

/// A wall with one effect.
const SCENE: &str = concat!(env!("FINGERTIP_ROOT"), "/host-tests/sim/tests/left_behind/wall.toml");

/// An empty folder.
fn folder(name: &str) -> PathBuf {
    let folder = PathBuf::from(env!("CARGO_TARGET_TMPDIR")).join("interrupted").join(name);
    let _ = fs::remove_dir_all(&folder);
    fs::create_dir_all(&folder).unwrap();
    folder
}

/// Fingers that are done within milliseconds.
const BALLS: &str = "about = \"Walls here and there\"\nduration_s = 0.03\n[object]\ndistance_mm = { uniform = [0.1, 0.6] }\n\
    [effects.noise]\nrms_codes = { log_uniform = [0.3, 3] }\n[[script]]\nat_s = 0.0\ngoal_n = { uniform = [0.5, 2] }\n\
    [[expect]]\nmetric = \"peak_force_n\"\nmax = 1.2\n";

/// A command and its folder.
struct Job {
    name: &'static str,
    program: &'static str,
    words: Vec<OsString>,
    out: PathBuf,
    /// Grows while the command runs; its last size in an undisturbed run.
    growing: PathBuf,
    bytes: u64,
    /// Expected output files by name, without times.
    expected: BTreeMap<String, Vec<u8>>,
    /// Complete lines that an interrupted run may leave.
    lines: Vec<String>,
}

impl Job {
    /// All three kinds.
    fn all(campaign: &str) -> [Self; 3] {
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

    /// Records the output of an undisturbed run, and clears the folder.
    fn undisturbed(&mut self) {
        let status = self.command().stdout(Stdio::null()).stderr(Stdio::null()).status().unwrap();
        assert!(status.code().is_some_and(|code| code < 2), "{}: {status}", self.name);
        self.expected = self.files();
        self.clear();
    }

    fn clear(&self) {
        fs::remove_dir_all(&self.out).unwrap();
    }

    /// The command.
    fn command(&self) -> Command {
        let mut command = Command::new(self.program);
        command.args(&self.words);
        command
    }

    /// Command that Ctrl-C ends also when these tests run in the background of a script, where Ctrl-C is ignored.
    fn in_front(&self) -> Command {
        let mut command = Command::new("env");
        command.arg("--default-signal=INT").arg(self.program).args(&self.words);
        command
    }

    /// The same under a limit of its files' size. Beyond it the system kills it, or lets it live with a write that
    /// failed.
    fn limited(&self, bytes: u64, lives: bool) -> Command {
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
    fn check_parts(&self, after: &str) -> usize {
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
    fn check_whole(&self, after: &str) {
        let output = self.command().output().unwrap();
        let told = String::from_utf8_lossy(&output.stderr);
        assert!(output.status.code().is_some_and(|code| code < 2), "{} after {after}: {told}", self.name);
        self.check_left(after);
    }

    /// All files are there, and no other.
    fn check_left(&self, after: &str) {
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

/// Interruption of a command.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
enum Kind {
    /// The system kills it within a write, to the byte.
    CutWrite,
    /// A write fails from a byte on, as on a full disk.
    FullDisk,
    /// It is killed once a file has the given number of bytes.
    Killed,
    /// The same by Ctrl-C.
    CtrlC,
    /// The reader of its output closes the pipe after some bytes.
    ClosedPipe,
    /// Its output goes to a full disk.
    FullOutput,
    /// A second command is started at the same time, and refused.
    TwoAtOnce,
    /// The first of two is killed, and the second takes over.
    TakenOver,
}

impl Kind {
    const ALL: [Self; 8] = [
        Self::CutWrite,
        Self::FullDisk,
        Self::Killed,
        Self::CtrlC,
        Self::ClosedPipe,
        Self::FullOutput,
        Self::TwoAtOnce,
        Self::TakenOver,
    ];
}

/// Interrupts a job at a number of bytes and checks its end. Returns false if the command ended before.
fn strike(job: &Job, kind: Kind, at: u64) -> bool {
    match kind {
        Kind::CutWrite => {
            let status = quiet(job.limited(at, false)).status().unwrap();
            status.signal() == Some(Signal::XFSZ.as_raw())
        }
        Kind::FullDisk => {
            let output = job.limited(at, true).output().unwrap();
            let told = String::from_utf8_lossy(&output.stderr);
            match output.status.code() {
                Some(0 | 1) => false,
                Some(2) => {
                    assert!(told.contains("cannot write") || told.contains("cannot make"), "{}: {told}", job.name);
                    true
                }
                code => panic!("{} ended with {code:?}: {told}", job.name),
            }
        }
        Kind::Killed => signalled(job, at, Signal::KILL),
        Kind::CtrlC => signalled(job, at, Signal::INT),
        Kind::ClosedPipe => closed_pipe(job, at),
        Kind::FullOutput => {
            let full = File::options().write(true).open("/dev/full").unwrap();
            let output = job.command().stdout(full).stderr(Stdio::piped()).output().unwrap();
            let told = String::from_utf8_lossy(&output.stderr);
            assert_eq!(output.status.code(), Some(2), "{told}");
            assert!(told.contains("cannot write to the standard output"), "{told}");
            job.check_left("a full output");
            true
        }
        Kind::TwoAtOnce | Kind::TakenOver => two(job, kind == Kind::TakenOver),
    }
}

fn quiet(mut command: Command) -> Command {
    command.stdout(Stdio::null()).stderr(Stdio::null());
    command
}

/// Waits until a file of the command has a number of bytes; returns false if the command ends before.
fn reached(child: &mut Child, job: &Job, bytes: u64) -> bool {
    loop {
        if fs::metadata(&job.growing).is_ok_and(|file| file.len() >= bytes) {
            return true;
        }
        if child.try_wait().unwrap().is_some() {
            return false;
        }
        // Only leaves the core to others: how long it is decides nothing.
        thread::sleep(Duration::from_micros(100));
    }
}

/// Signals a child. Before `wait` this is valid also after the child has ended.
fn signal(child: &Child, signal: Signal) {
    kill_process(Pid::from_child(child), signal).unwrap();
}

fn signalled(job: &Job, at: u64, kind: Signal) -> bool {
    let mut child = quiet(job.in_front()).spawn().unwrap();
    if reached(&mut child, job, at) {
        signal(&child, kind);
    }
    child.wait().unwrap().signal() == Some(kind.as_raw())
}

/// Closes the reading end at once, or after some bytes; a quick command may have written all of its output before.
fn closed_pipe(job: &Job, at: u64) -> bool {
    let (pipe, end) = std::io::pipe().unwrap();
    let mut stays = (!at.is_multiple_of(2)).then_some(pipe);
    let child = job.command().stdout(end).stderr(Stdio::piped()).spawn().unwrap();
    if let Some(pipe) = &mut stays {
        // Fewer bytes than the command says: the pipe is closed within its text.
        let _ = pipe.read(&mut vec![0; (at % 40) as usize]);
    }
    drop(stays);
    let output = child.wait_with_output().unwrap();
    let told = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.code().is_some_and(|code| code < 2), "{}: {told}", job.name);
    job.check_left("a closed pipe");
    told.contains("went away")
}

/// Child that ends with the test, also if the test fails while the child is stopped.
struct Ends(Child);

impl Drop for Ends {
    fn drop(&mut self) {
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}

/// Stops the first command while it holds the lock, so that the second one always meets the lock.
fn two(job: &Job, kill: bool) -> bool {
    let mut first = Ends(quiet(job.command()).spawn().unwrap());
    let first = &mut first.0;
    // The lock is there before the first byte.
    if !reached(first, job, 1) {
        return false;
    }
    signal(first, Signal::STOP);
    if !job.growing.exists() {
        // It had come to its end meanwhile.
        signal(first, Signal::CONT);
        first.wait().unwrap();
        return false;
    }
    let second = job.command().output().unwrap();
    let told = String::from_utf8_lossy(&second.stderr);
    assert_eq!(second.status.code(), Some(2), "{}: {told}", job.name);
    assert!(told.contains(&format!("process {}", first.id())), "{}: {told}", job.name);
    if kill {
        first.kill().unwrap();
        first.wait().unwrap();
        job.check_parts("the first was killed");
    } else {
        signal(first, Signal::CONT);
        assert!(first.wait().unwrap().code().is_some_and(|code| code < 2));
        job.check_left("a second was refused");
    }
    true
}

// Hundreds of interruptions: no complete file is lost or changed, and a continued run ends with the same result as an
// undisturbed one.

#[test]
fn a_short_campaign_loses_nothing() {
    campaign("short", 1);
}

/// `cargo test -p sim --profile host --test interrupted -- --ignored --nocapture`
#[test]
#[ignore = "takes minutes"]
fn the_whole_campaign_loses_nothing() {
    campaign("whole", 24);
}

/// Interrupts each job a number of times by each kind.
fn campaign(name: &str, times: usize) {
    let mut rng = Rng::with_seed(7);
    let mut tally: BTreeMap<(&str, Kind), usize> = BTreeMap::new();
    for job in Job::all(name) {
        for kind in Kind::ALL {
            let mut struck = 0;
            // A command that is done before it is struck does not count.
            for _ in 0..20 * times {
                if struck == times {
                    break;
                }
                struck += usize::from(once(&job, kind, &mut rng));
            }
            assert_eq!(struck, times, "{} could not be struck by {kind:?}", job.name);
            tally.insert((job.name, kind), struck);
        }
    }
    println!("{tally:#?}\n{} interruptions, nothing lost or changed", tally.values().sum::<usize>());
}

/// Interrupts a job once, or several times before it is resumed to its end.
fn once(job: &Job, kind: Kind, rng: &mut Rng) -> bool {
    let after = format!("{kind:?}");
    let mut at = rng.u64(1..job.bytes * 9 / 10);
    // Now and then within the lock and the first line.
    if rng.u8(..) < 40 {
        at = rng.u64(1..200);
    }
    let interrupted = strike(job, kind, at);
    let done = job.check_parts(&after);
    if interrupted && kind != Kind::TwoAtOnce && rng.bool() {
        // A second interruption while the command continues: completed results remain.
        strike(job, Kind::CutWrite, rng.u64(1..job.bytes));
        let still = job.check_parts("a second strike");
        assert!(still >= done, "{}: {still} of {done} are left after {after} and a cut", job.name);
    }
    job.check_whole(&after);
    job.clear();
    interrupted
}
