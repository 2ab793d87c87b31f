//! A finger that is served from a thread, and `fingertip` set on it.

use fingertip::link::packet::BROADCAST;
use fingertip::link::packet::instruction::REBOOT;
use fingertip::shipped::address;
use fingertip_cli::Client;
use fingertip_cli::client::{Reach, packet};
use rustix::process::{Pid, Signal};
use serve::{Place, Port, Stop};
use signal_hook::consts::SIGHUP;
use sim::native::served::Bus;
use std::convert::Infallible;
use std::io::{BufRead as _, BufReader, Read};
use std::path::PathBuf;
use std::process::{Child, Command, Output, Stdio};
use std::sync::Arc;
use std::sync::mpsc::{Receiver, Sender, channel};
use std::time::{Duration, Instant};

/// Patience on the slowest machine, where an answer is expected.
const PATIENCE: Duration = Duration::from_secs(600);

type Job = Box<dyn FnOnce(&mut Told) + Send>;

pub struct Served {
    pub port: String,
    folder: PathBuf,
    stop: Stop,
    jobs: Sender<Job>,
}

/// A finger that executes jobs of the test between two polls.
pub struct Told {
    bus: Bus,
    jobs: Receiver<Job>,
    line: Line,
}

/// A word of the finger's state, a force at its tip, N, and what happens once the state has the word and the force is reached.
type At = (&'static str, f64, fn(&mut Told));

/// What happens to packets before the finger hears them.
#[derive(Default)]
pub struct Line {
    /// Packets until it stops receiving, packets that it misses then, and packets that it missed.
    ears: (u64, u64, u64),
    pub at: Vec<At>,
    /// Packets that a stalled line holds.
    pub stalled: Option<Vec<Vec<u8>>>,
    /// Number of packets before it restarts.
    pub restart: Option<u64>,
    /// Time that the finger's clock goes on after each packet, s, so that no watchdog outruns a slow program under test.
    pub patience_s: Option<f64>,
    /// Time of the last packet, s, and the number of packets.
    heard_s: f64,
    heard: u64,
    /// Time by which a patient finger's clock differs from the one that its server sees, s: more while it waits, less with
    /// each packet, behind which it is late and thus as fast as the machine.
    waited_s: f64,
}

impl Told {
    /// What was broken or mended acts on the next frames.
    fn frames(&mut self) {
        (0..20).for_each(|_| self.bus.frame());
    }

    pub fn restart(&mut self) {
        self.bus.hear(&packet(BROADCAST, REBOOT, &[]));
        self.frames();
    }

    fn state(&mut self) -> String {
        self.bus.command("state").expect("a command")
    }

    pub fn stall(&mut self) {
        self.line.stalled = Some(Vec::new());
    }
}

impl serve::Finger for Told {
    type Error = Infallible;

    fn now_s(&self) -> f64 {
        self.bus.now_s() + self.line.waited_s
    }

    fn run_until(&mut self, time_s: f64) -> Result<(), Infallible> {
        while let Ok(job) = self.jobs.try_recv() {
            job(self);
        }
        if !self.line.at.is_empty() {
            let state = self.state();
            let is_due = |(word, force_n, _): &mut At| state.contains(*word) && true_force_n(&state) >= *force_n;
            let due: Vec<At> = self.line.at.extract_if(.., is_due).collect();
            due.into_iter().for_each(|(.., happens)| happens(self));
        }
        let line = &mut self.line;
        let last_s = line.heard_s + line.patience_s.unwrap_or(f64::INFINITY);
        self.bus.run_until(last_s.min(time_s - line.waited_s))?;
        // While it waits it keeps up, so that its server sleeps.
        if time_s - line.waited_s > last_s {
            line.waited_s = time_s - self.bus.now_s();
        }
        Ok(())
    }

    fn hear(&mut self, bytes: &[u8]) -> Result<(), Infallible> {
        let line = &mut self.line;
        if let Some(stalled) = &mut line.stalled {
            stalled.push(bytes.to_vec());
            return Ok(());
        }
        line.heard_s = self.bus.now_s();
        line.heard += 1;
        line.waited_s -= line.patience_s.unwrap_or(0.0);
        let (left, lost, unheard) = &mut line.ears;
        if *left > 0 {
            *left -= 1;
        } else if unheard < lost {
            *unheard += 1;
            return Ok(());
        }
        let now = line.restart.take_if(|left| *left == 0).is_some();
        line.restart = line.restart.map(|left| left - 1);
        if now {
            self.restart();
        }
        self.bus.hear(bytes);
        Ok(())
    }

    fn answer(&mut self) -> Result<Vec<u8>, Infallible> {
        serve::Finger::answer(&mut self.bus)
    }

    fn due_s(&self) -> Option<f64> {
        self.bus.due_s().map(|due_s| due_s + self.line.waited_s)
    }

    fn baud(&self) -> Option<u32> {
        Some(self.bus.baud())
    }
}

impl Served {
    pub fn begin(scene: &str) -> Self {
        // Under `nohup` the programs would ignore it too. A handler, which they do not inherit, ends that.
        signal_hook::flag::register(SIGHUP, Arc::default()).expect("a handler");
        let scene = sim::cli::load(scene, &[], None).expect("a scene");
        let mut port = Port::open(&Place::Pty(None)).expect("a pseudo-terminal");
        let (name, stop) = (port.name().to_owned(), port.stopper());
        let (jobs, told_jobs) = channel();
        std::thread::spawn(move || {
            let mut told = Told { bus: Bus::new(&scene).expect("a world"), jobs: told_jobs, line: Line::default() };
            let Ok(_) = serve::serve(&mut told, &mut port, Duration::from_secs(3600), false);
        });
        let folder =
            std::env::temp_dir().join(format!("fingertip-cli-{}-{}", std::process::id(), name.replace('/', "-")));
        std::fs::create_dir_all(&folder).expect("a folder");
        Self { port: name, folder, stop, jobs }
    }

    /// A finger that does not outrun its host on a loaded machine.
    pub fn patient(scene: &str) -> Self {
        let finger = Self::begin(scene);
        finger.line(|line| line.patience_s = Some(0.1));
        finger
    }

    /// A client whose answers come in the end.
    pub fn client(&self) -> Client {
        let reach = Reach { port: Some(self.port.clone()), baud: 1_000_000, ids: vec![1], timeout_ms: 600_000 };
        Client::open(&reach).expect("it listens")
    }

    /// A client of one finger of several, which is tared.
    pub fn tared(&self, id: u8) -> Client {
        let mut client = self.client();
        client.id = id;
        client.set(address::TARE, 1).expect("it obeys");
        while client.number(address::TARE_STATE).expect("it answers") != 2 {}
        client
    }

    pub fn set(&self, values: &[(u16, i64)]) {
        let mut client = self.client();
        values.iter().for_each(|(register, value)| client.set(*register, *value).expect("it obeys"));
    }

    /// Does this with the finger between two of its polls.
    fn with<T: Send + 'static>(&self, job: impl FnOnce(&mut Told) -> T + Send + 'static) -> T {
        let (answer, answered) = channel();
        let job = move |told: &mut Told| answer.send(job(told)).expect("somebody waits for it");
        self.jobs.send(Box::new(job)).expect("it is served");
        answered.recv().expect("it is served")
    }

    /// Looks at the line to the finger, or changes it.
    pub fn line<T: Send + 'static>(&self, job: impl FnOnce(&mut Line) -> T + Send + 'static) -> T {
        self.with(|told| job(&mut told.line))
    }

    /// Executes a command that a served finger has. The finger's clock goes on by some frames.
    pub fn command(&self, text: &str) -> String {
        let text = text.to_owned();
        self.with(move |told| {
            let done = told.bus.command(&text).expect("a command");
            told.frames();
            done
        })
    }

    /// State of the finger, whose clock is left alone.
    pub fn look(&self) -> String {
        self.with(Told::state)
    }

    pub fn restart(&self) {
        self.with(Told::restart);
    }

    /// The finger receives this number of packets, then misses `lost` packets.
    pub fn deaf(&self, received: u64, lost: u64) {
        self.line(move |line| line.ears = (received, lost, 0));
    }

    /// Packets that the deaf finger has missed.
    pub fn missed(&self) -> u64 {
        self.line(|line| line.ears.2)
    }

    /// Delivers what a stalled line holds.
    pub fn go_on(&self) {
        self.with(|told| {
            told.line.stalled.take().into_iter().flatten().for_each(|bytes| told.bus.hear(&bytes));
            told.frames();
        });
    }

    pub fn end(&self) {
        self.stop.stop();
    }

    pub fn file(&self, name: &str) -> String {
        self.folder.join(name).display().to_string()
    }

    /// Sends a command this signal once the finger received `packets` of its packets; false if it ended before.
    pub fn ended_after(&self, packets: u64, arguments: &[&str], signal: Signal) -> bool {
        self.deaf(packets, u64::MAX);
        let mut child = self.start(arguments);
        let mut ended = false;
        Self::wait_for(|| {
            ended = child.try_wait().expect("it was started").is_some();
            ended || self.missed() > 0
        });
        if !ended {
            Self::signal(&child, signal);
        }
        if signal != Signal::KILL {
            self.deaf(0, 0);
        }
        child.wait_with_output().expect("it ends");
        self.deaf(0, 0);
        !ended
    }

    pub fn start(&self, arguments: &[&str]) -> Child {
        self.fingertip(arguments).stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().expect("it starts")
    }

    pub fn writing_to(&self, arguments: &[&str], place: impl Into<Stdio>) -> Output {
        let child = self.fingertip(arguments).stdout(place).stderr(Stdio::piped()).spawn().expect("it starts");
        child.wait_with_output().expect("it ends")
    }

    pub fn fingertip(&self, arguments: &[&str]) -> Command {
        let mut command = program(arguments);
        command.env("FINGERTIP_PORT", &self.port).current_dir(&self.folder);
        if !arguments.contains(&"--timeout-ms") && !arguments.contains(&"scan") {
            command.arg("--timeout-ms").arg(PATIENCE.as_millis().to_string());
        }
        command
    }

    /// Output of a command that succeeds.
    pub fn done(&self, arguments: &[&str]) -> String {
        let output = self.fingertip(arguments).output().expect("it starts");
        assert!(output.status.success(), "{output:?}");
        String::from_utf8_lossy(&output.stdout).into_owned()
    }

    /// Packets that a command sends from its beginning to its end.
    pub fn packets(&self, arguments: &[&str]) -> u64 {
        let begun = self.heard();
        self.done(arguments);
        self.heard() - begun
    }

    pub fn json(&self, arguments: &[&str]) -> serde_json::Value {
        let text = self.done(&[arguments, &["--json"]].concat());
        serde_json::from_str(&text).unwrap_or_else(|why| panic!("{why}: {text}"))
    }

    /// Asserts that a command fails, and that its error has these words. Returns the error.
    #[track_caller]
    pub fn refuses(&self, arguments: &[&str], words: &[&str]) -> String {
        fails(&self.fingertip(arguments).output().expect("it starts"), words)
    }

    /// Asserts that a command is not understood, and that its error has this word.
    #[track_caller]
    pub fn not_understood(arguments: &[&str], word: &str) {
        let output = program(arguments).env("FINGERTIP_PORT", "/nowhere").output();
        let (code, err) = ended(&output.expect("it starts"));
        assert!(code == Some(2) && err.contains(word), "{arguments:?}: {err}");
    }

    /// Waits for what a finger or another program does, and leaves the core to it between two looks.
    #[track_caller]
    pub fn wait_for(mut happened: impl FnMut() -> bool) {
        let begun = Instant::now();
        while !happened() {
            assert!(begun.elapsed() < PATIENCE, "it did not happen");
            std::thread::sleep(Duration::from_millis(2));
        }
    }

    pub fn begun(file: &str) {
        Self::wait_for(|| std::fs::metadata(file).is_ok());
    }

    /// Waits until a recording has more than ten lines: it is past the checks of its file.
    pub fn recorded(part: &str) {
        Self::wait_for(|| std::fs::read_to_string(part).is_ok_and(|text| text.lines().count() > 10));
    }

    pub fn interrupt(child: &Child) {
        Self::signal(child, Signal::INT);
    }

    pub fn signal(child: &Child, signal: Signal) {
        rustix::process::kill_process(Pid::from_child(child), signal).expect("it runs");
    }

    /// Waits until the finger's state has this word, its mode for example. The finger's clock runs by itself.
    pub fn until(&self, word: &str) {
        Self::wait_for(|| self.look().contains(word));
    }

    /// The same for a patient finger without requests: each poll moves its clock on.
    pub fn until_alone(&self, word: &str) {
        Self::wait_for(|| self.command("state").contains(word));
    }

    pub fn now_s(&self) -> f64 {
        self.with(|told| told.bus.now_s())
    }

    pub fn heard(&self) -> u64 {
        self.line(|line| line.heard)
    }

    /// Force at the first finger's tip, N: the truth, not what the controller senses.
    pub fn true_force_n(&self) -> f64 {
        true_force_n(&self.look())
    }
}

fn true_force_n(state: &str) -> f64 {
    let force = state.split("true force ").nth(1).and_then(|rest| rest.split(' ').next());
    force.and_then(|force| force.parse().ok()).unwrap_or_else(|| panic!("no force in {state}"))
}

impl Drop for Served {
    fn drop(&mut self) {
        self.stop.stop();
        let _ = std::fs::remove_dir_all(&self.folder);
    }
}

pub fn kill(child: &mut Child) {
    child.kill().expect("it runs");
    child.wait().expect("it ends");
}

pub fn program(arguments: &[&str]) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_fingertip"));
    command.env_remove("FINGERTIP_PORT").args(arguments);
    command
}

/// Reads lines up to one with this text, which is returned; later ones are read and dropped, so that nothing blocks.
pub fn line_with(text: &str, from: impl Read + Send + 'static) -> String {
    let (mut reader, mut line) = (BufReader::new(from), String::new());
    while !line.contains(text) {
        line.clear();
        assert!(reader.read_line(&mut line).expect("text") > 0, "no line with {text}");
    }
    std::thread::spawn(move || std::io::copy(&mut reader, &mut std::io::sink()));
    line
}

/// Exit code of a command, and what it said on standard error.
pub fn ended(output: &Output) -> (Option<i32>, String) {
    (output.status.code(), String::from_utf8_lossy(&output.stderr).into_owned())
}

/// Asserts that a command failed, and that its error has these words. Returns the error.
#[track_caller]
pub fn fails(output: &Output, words: &[&str]) -> String {
    let (code, said) = ended(output);
    assert!(code == Some(1) && words.iter().all(|word| said.contains(word)), "{output:?}");
    said
}
