//! A finger that is served from a thread, and `fingertip` set on it.

use fingertip::link::packet::BROADCAST;
use fingertip::link::packet::instruction::REBOOT;
use fingertip::shipped::address;
use fingertip_cli::Client;
use fingertip_cli::client::{Reach, packet};
use rustix::process::{Pid, Signal};
use serve::native::Native;
use serve::{Finger as _, Place, Port, Stop};
use signal_hook::consts::SIGHUP;
use sim::native::served::Bus;
use std::cell::RefCell;
use std::io::{BufRead as _, BufReader, Read};
use std::path::PathBuf;
use std::process::{Child, Command, Output, Stdio};
use std::sync::Arc;
use std::sync::mpsc::{Receiver, Sender, channel};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

/// Patience on the slowest machine, where an answer is expected.
const PATIENCE: &str = "600000";

type Asked = (String, Sender<Result<String, String>>);

pub struct Served {
    pub port: String,
    folder: PathBuf,
    stop: Stop,
    commands: Sender<Asked>,
    thread: RefCell<Option<JoinHandle<()>>>,
}

/// A finger that executes commands between two polls.
struct Told {
    native: Native,
    commands: Receiver<Asked>,
    line: Line,
}

/// What happens to packets before the finger hears them.
#[derive(Default)]
struct Line {
    /// Packets until it stops receiving, packets that it misses then, and packets that came.
    ears: Option<(u64, u64, u64)>,
    /// An instruction to all that comes as soon as the finger's state has this word.
    trap: Option<(String, u8)>,
    /// A word of the finger's state and a force, N: the line stalls as soon as it has the word and presses so hard.
    stall_at: Option<(String, f64)>,
    stalled: Option<Vec<Vec<u8>>>,
    /// Number of packets before it restarts.
    restart: Option<u64>,
    /// Its clock goes on for `PATIENT_S` after each packet, so that no watchdog outruns a slow program under test.
    patient: bool,
    /// Time of the last packet, s, and the number of packets.
    heard_s: f64,
    heard: u64,
    /// Time by which a patient finger's clock differs from the one that its server sees, s: more while it waits, less with
    /// each packet, behind which it is late and thus as fast as the machine.
    waited_s: f64,
}

/// Simulated time that a patient finger goes on after a packet, s.
const PATIENT_S: f64 = 0.1;

impl Told {
    /// Inputs that are not commands of a served finger.
    fn told(&mut self, command: &str) -> Option<Result<String, String>> {
        let words: Vec<&str> = command.split_whitespace().collect();
        let number = |text: &str| text.parse().expect("a number");
        let line = &mut self.line;
        match words[..] {
            // As another host on the bus would.
            ["raw", instruction_number] => self.native.0.hear(&instruction(number(instruction_number) as u8)),
            ["trap", word, instruction_number] => line.trap = Some((word.into(), number(instruction_number) as u8)),
            ["restart", "after", packets] => line.restart = Some(number(packets)),
            ["patient", patient] => line.patient = patient == "on",
            ["deaf", "after", packets, "for", lost] => line.ears = Some((number(packets), number(lost), 0)),
            ["deaf", "no", "more"] => line.ears = None,
            ["stall"] => line.stalled = Some(Vec::new()),
            ["stall", "at", word, force_n] => line.stall_at = Some((word.into(), force_n.parse().expect("a force"))),
            ["go", "on"] => line.stalled.take().into_iter().flatten().for_each(|bytes| self.native.0.hear(&bytes)),
            // These look on, and leave the finger's clock alone.
            ["look"] => return Some(self.native.command("state")),
            ["now"] => return Some(Ok(self.native.now_s().to_string())),
            ["heard"] => return Some(Ok(line.heard.to_string())),
            ["stalled"] => return Some(Ok(line.stalled.is_some().to_string())),
            ["held"] => return Some(Ok(line.stalled.as_ref().map_or(0, Vec::len).to_string())),
            ["restarted"] => return Some(Ok(line.restart.is_none().to_string())),
            ["unheard"] => return Some(Ok(line.ears.map_or(0, |(.., unheard)| unheard).to_string())),
            _ => return None,
        }
        Some(Ok(String::new()))
    }
}

impl serve::Finger for Told {
    type Error = std::convert::Infallible;

    fn now_s(&self) -> f64 {
        self.native.now_s() + self.line.waited_s
    }

    fn run_until(&mut self, time_s: f64) -> Result<(), Self::Error> {
        while let Ok((command, answer)) = self.commands.try_recv() {
            let done = self.told(&command).unwrap_or_else(|| self.native.command(&command));
            // What was broken or mended acts on the next frames; whoever asks then finds it so.
            if !["look", "now", "heard", "stalled", "held"].contains(&command.as_str()) {
                (0..20).for_each(|_| self.native.0.frame());
            }
            answer.send(done).expect("somebody waits for it");
        }
        let line = &mut self.line;
        let mut reached = |word: &str, force_n: f64| {
            self.native.command("state").is_ok_and(|state| state.contains(word) && true_force_n(&state) >= force_n)
        };
        if line.stall_at.take_if(|(word, force_n)| reached(word, *force_n)).is_some() {
            line.stalled = Some(Vec::new());
        }
        if let Some((_, number)) = line.trap.take_if(|(word, _)| reached(word, f64::NEG_INFINITY)) {
            self.native.0.hear(&instruction(number));
        }
        let last_s = if line.patient { line.heard_s + PATIENT_S } else { f64::INFINITY };
        self.native.run_until(last_s.min(time_s - line.waited_s))?;
        // While it waits it keeps up, so that its server sleeps.
        if time_s - line.waited_s > last_s {
            line.waited_s = time_s - self.native.now_s();
        }
        Ok(())
    }

    fn hear(&mut self, bytes: &[u8]) -> Result<(), Self::Error> {
        let line = &mut self.line;
        if let Some(stalled) = &mut line.stalled {
            stalled.push(bytes.to_vec());
            return Ok(());
        }
        line.heard_s = self.native.now_s();
        line.heard += 1;
        line.waited_s -= if line.patient { PATIENT_S } else { 0.0 };
        if let Some((left, lost, unheard)) = &mut line.ears {
            if *left > 0 {
                *left -= 1;
            } else if *unheard < *lost {
                *unheard += 1;
                return Ok(());
            }
        }
        if line.restart.take_if(|left| *left == 0).is_some() {
            self.native.0.hear(&instruction(REBOOT));
            (0..20).for_each(|_| self.native.0.frame());
        }
        line.restart = line.restart.map(|left| left - 1);
        self.native.hear(bytes)
    }

    fn answer(&mut self) -> Result<Vec<u8>, Self::Error> {
        self.native.answer()
    }

    fn due_s(&self) -> Option<f64> {
        self.native.due_s().map(|due_s| due_s + self.line.waited_s)
    }

    fn baud(&self) -> Option<u32> {
        self.native.baud()
    }

    fn command(&mut self, text: &str) -> Result<String, String> {
        self.native.command(text)
    }
}

impl Served {
    /// Pause between two looks at a finger that a program moves.
    pub const LOOK: Duration = Duration::from_millis(2);

    pub fn begin(scene: &str) -> Self {
        // Under `nohup` the programs would ignore it too. A handler, which they do not inherit, ends that.
        signal_hook::flag::register(SIGHUP, Arc::default()).expect("a handler");
        let scene = sim::cli::load(scene, &[], None).expect("a scene");
        let mut port = Port::open(&Place::Pty(None)).expect("a pseudo-terminal");
        let (name, stop) = (port.name().to_owned(), port.stopper());
        let (commands, commanded) = channel();
        let thread = std::thread::spawn(move || {
            let native = Native(Bus::new(&scene).expect("a world"));
            let mut told = Told { native, commands: commanded, line: Line::default() };
            let Ok(_) = serve::serve(&mut told, &mut port, Duration::from_secs(3600), false);
        });
        let folder =
            std::env::temp_dir().join(format!("fingertip-cli-{}-{}", std::process::id(), name.replace('/', "-")));
        std::fs::create_dir_all(&folder).expect("a folder");
        Self { port: name, folder, stop, commands, thread: RefCell::new(Some(thread)) }
    }

    /// A finger that does not outrun its host on a loaded machine.
    pub fn patient(scene: &str) -> Self {
        let finger = Self::begin(scene);
        finger.command("patient on");
        finger
    }

    pub fn client(&self) -> Client {
        client(&self.port)
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

    pub fn command(&self, text: &str) -> String {
        let (answer, answered) = channel();
        self.commands.send((text.into(), answer)).expect("it is served");
        answered.recv().expect("it is served").expect("a command")
    }

    pub fn end(&self) {
        self.stop.stop();
        if let Some(thread) = self.thread.borrow_mut().take() {
            thread.join().expect("it did not panic");
        }
    }

    pub fn file(&self, name: &str) -> String {
        self.folder.join(name).display().to_string()
    }

    /// Kills a command once the finger received `packets` of its packets; false if it ended before.
    pub fn killed_after(&self, packets: u64, arguments: &[&str]) -> bool {
        self.command(&format!("deaf after {packets} for {}", u64::MAX));
        let mut child = self.start(arguments);
        let killed = loop {
            if self.command("unheard") != "0" {
                break true;
            }
            if child.try_wait().expect("it was started").is_some() {
                break false;
            }
            std::thread::sleep(Self::LOOK);
        };
        let _ = child.kill();
        child.wait().expect("it ends");
        self.command("deaf no more");
        killed
    }

    pub fn kill(child: &mut Child) {
        child.kill().expect("it runs");
        child.wait().expect("it ends");
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
        command.env("FINGERTIP_PORT", &self.port);
        if !arguments.contains(&"--timeout-ms") && !arguments.contains(&"scan") {
            command.args(["--timeout-ms", PATIENCE]);
        }
        command
    }

    /// Output of a command that succeeds.
    pub fn done(&self, arguments: &[&str]) -> String {
        let output = self.fingertip(arguments).output().expect("it starts");
        assert!(output.status.success(), "{output:?}");
        String::from_utf8_lossy(&output.stdout).into_owned()
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

    /// Waits for what another program does, and leaves the core to it between two looks.
    pub fn wait_for(mut happened: impl FnMut() -> bool) {
        while !happened() {
            std::thread::sleep(Self::LOOK);
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
        self.until_by("look", word);
    }

    /// The same for a patient finger without requests: each poll moves its clock on.
    pub fn until_alone(&self, word: &str) {
        self.until_by("state", word);
    }

    fn until_by(&self, look: &str, word: &str) {
        let begun = Instant::now();
        while !self.command(look).contains(word) {
            assert!(begun.elapsed() < Duration::from_secs(600), "no {word} in {}", self.command(look));
            std::thread::sleep(Self::LOOK);
        }
    }

    pub fn now_s(&self) -> f64 {
        self.command("now").parse().expect("a time")
    }

    pub fn heard(&self) -> u64 {
        self.command("heard").parse().expect("a number")
    }

    /// Force at the first finger's tip, N: the truth, not what the controller senses.
    pub fn true_force_n(&self) -> f64 {
        true_force_n(&self.command("look"))
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

pub fn program(arguments: &[&str]) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_fingertip"));
    command.env_remove("FINGERTIP_PORT").args(arguments);
    command
}

/// A client of a port whose answers come in the end.
pub fn client(port: &str) -> Client {
    let reach = Reach { port: Some(port.into()), baud: 1_000_000, ids: vec![1], timeout_ms: 600_000 };
    Client::open(&reach).expect("it listens")
}

/// An instruction to all devices without parameters; no device answers.
fn instruction(number: u8) -> Vec<u8> {
    packet(BROADCAST, number, &[]).to_vec()
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
