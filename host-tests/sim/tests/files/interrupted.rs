//! Runs, sweeps and populations that are interrupted, each at a number of bytes, never after a time. No complete file is
//! lost or changed, and a continued run ends with the same result as an undisturbed one.

use crate::*;
use fastrand::Rng;
use rustix::process::{Pid, Signal, kill_process};
use std::io::Read;
use std::os::unix::process::ExitStatusExt;
use std::process::{Child, Command, Stdio};
use std::thread;
use std::time::Duration;

pub const SIM: &str = env!("CARGO_BIN_EXE_sim");
pub const SWEEP: &str = env!("CARGO_BIN_EXE_sweep");
const POPULATION: &str = env!("CARGO_BIN_EXE_population");

/// Fingers that are done within milliseconds.
const TOUCHING: &str = concat!(env!("FINGERTIP_ROOT"), "/host-tests/sim/tests/files/touching.toml");

/// A command that runs in a folder and writes to another one in it.
struct Job {
    name: &'static str,
    place: PathBuf,
    words: Vec<&'static str>,
    out: PathBuf,
    /// Grows while the command runs; its last size in an undisturbed run.
    growing: PathBuf,
    bytes: usize,
    /// Expected output files by name, without times.
    expected: BTreeMap<String, Vec<u8>>,
    /// Complete lines that an interrupted run may leave.
    lines: Vec<String>,
}

impl Job {
    fn all(campaign: &str) -> [Self; 3] {
        let place = folder(&format!("interrupted/{campaign}"));
        let sweep = "--set duration_s=0.02 --set object.distance_mm=0.2 --set effects.noise.rms_codes=1.5 \
            --vary tip.modulus_kpa=240..260:3 --seeds 4 --out sweep";
        let run = "--set duration_s=0.03 --set object.distance_mm=0.2 --out run --json run/run.json";
        let population = "--fingers 12 --json population/all.json";
        [
            Self::new("sweep", &place, "runs.csv.part", [SWEEP, WALL], sweep),
            Self::new("run", &place, "run.mcap.new", [SIM, WALL], run),
            Self::new("population", &place, "all.json.part", [POPULATION, TOUCHING], population),
        ]
    }

    /// Records the output of an undisturbed run, and clears the folder.
    fn new(name: &'static str, place: &Path, growing: &str, first: [&'static str; 2], more: &'static str) -> Self {
        let words = first.into_iter().chain(more.split(' ')).collect();
        let (place, out) = (place.to_owned(), place.join(name));
        let (growing, expected) = (out.join(growing), BTreeMap::new());
        let mut job = Self { name, place, words, out, growing, bytes: 0, expected, lines: Vec::new() };
        let status = quiet(job.command()).status().unwrap();
        assert!(status.code().is_some_and(|code| code < 2), "{name}: {status}");
        job.expected = job.files();
        job.clear();
        if let Some(runs) = job.expected.get("runs.csv") {
            job.lines = String::from_utf8_lossy(runs).lines().skip(1).map(str::to_owned).collect();
        }
        if let Some(all) = job.expected.get("all.json") {
            let all: Value = serde_json::from_slice(all).unwrap();
            job.lines = all["fingers"].as_array().unwrap().iter().map(Value::to_string).collect();
        }
        // A line has the check word and a space in front of it.
        let lines_bytes = job.lines.iter().map(|line| line.len() + 18).sum();
        job.bytes = job.expected.get("run.mcap").map_or(lines_bytes, Vec::len);
        job
    }

    fn clear(&self) {
        fs::remove_dir_all(&self.out).unwrap();
    }

    fn command(&self) -> Command {
        self.behind(&[])
    }

    /// The command as the last arguments of another one.
    fn behind(&self, other: &[&str]) -> Command {
        let words = [other, &self.words[..]].concat();
        let mut command = Command::new(words[0]);
        command.args(&words[1..]).current_dir(&self.place);
        command
    }

    /// The command under a limit of its files' size. Beyond it the system kills it, or lets it live with a write that
    /// failed.
    fn limited(&self, bytes: u64, lives: bool) -> Command {
        let trap = if lives { "trap '' XFSZ; " } else { "" };
        self.behind(&["sh", "-c", &format!("{trap}exec prlimit --core=0 --fsize={bytes} \"$@\""), "sh"])
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

/// Interrupts a job at a number of bytes and checks its end. Returns false if the command ended before.
type Strike = fn(&Job, u64) -> bool;

/// Ways to interrupt a command.
const KINDS: [(&str, Strike); 8] = [
    ("a cut write", cut_write),
    ("a full disk", full_disk),
    ("a kill", |job, at| signalled(job, at, Signal::KILL)),
    ("Ctrl-C", |job, at| signalled(job, at, Signal::INT)),
    ("a closed pipe", closed_pipe),
    ("a full output", full_output),
    ("a second command that takes over", |job, _| two(job, true)),
    // Leaves nothing to be interrupted again.
    ("a second command that is refused", |job, _| two(job, false)),
];

/// The system kills the command within a write, to the byte.
fn cut_write(job: &Job, at: u64) -> bool {
    quiet(job.limited(at, false)).status().unwrap().signal() == Some(Signal::XFSZ.as_raw())
}

/// A write fails from a byte on, as on a full disk.
fn full_disk(job: &Job, at: u64) -> bool {
    let output = job.limited(at, true).output().unwrap();
    let told = String::from_utf8_lossy(&output.stderr);
    let (code, named) = (output.status.code(), told.contains("cannot write") || told.contains("cannot make"));
    assert!(matches!(code, Some(0 | 1)) || code == Some(2) && named, "{} ended with {code:?}: {told}", job.name);
    code == Some(2)
}

/// The output goes to a full disk.
fn full_output(job: &Job, _: u64) -> bool {
    let full = File::options().write(true).open("/dev/full").unwrap();
    let output = job.command().stdout(full).stderr(Stdio::piped()).output().unwrap();
    let told = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(2), "{told}");
    assert!(told.contains("cannot write to the standard output"), "{told}");
    job.check_left("a full output");
    true
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
    // Ctrl-C ends it also when these tests run in the background of a script, where Ctrl-C is ignored.
    let mut child = quiet(job.behind(&["env", "--default-signal=INT"])).spawn().unwrap();
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
        // Fewer bytes than the command writes: the pipe is closed within its text.
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

sim::sizes!(interruptions_lose_nothing, campaign("usual", 1), campaign("long", 23));

/// Interrupts each job a number of times in each way.
fn campaign(name: &str, times: usize) {
    let mut rng = Rng::with_seed(times as u64);
    for job in Job::all(name) {
        for (number, (kind, strike)) in KINDS.into_iter().enumerate() {
            // A command that is done before it is struck does not count.
            let struck = (0..20 * times)
                .filter(|_| once(&job, kind, strike, number + 1 < KINDS.len(), &mut rng))
                .take(times)
                .count();
            assert_eq!(struck, times, "{} could not be struck by {kind}", job.name);
        }
    }
}

/// Interrupts a job once, or several times before it is resumed to its end.
fn once(job: &Job, after: &str, strike: Strike, again: bool, rng: &mut Rng) -> bool {
    // Now and then within the lock and the first line.
    let bytes = job.bytes as u64;
    let end = if rng.u8(..) < 40 { 200 } else { bytes * 9 / 10 };
    let interrupted = strike(job, rng.u64(1..end));
    let done = job.check_parts(after);
    if interrupted && again && rng.bool() {
        // A second interruption while the command continues: completed results remain.
        cut_write(job, rng.u64(1..bytes));
        let still = job.check_parts("a second strike");
        assert!(still >= done, "{}: {still} of {done} are left after {after} and a cut", job.name);
    }
    job.check_whole(after);
    job.clear();
    interrupted
}
