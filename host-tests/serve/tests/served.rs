//! The program behind its port: judged by bytes and words, never by the clock. And the Python package with its
//! examples on a served finger: `FINGERTIP_PYTHON` names a Python with `dynamixel-sdk`; `cargo xtask test` makes it.

use serial2::SerialPort;
use std::io::{BufRead as _, BufReader, Read, Write};
use std::net::TcpStream;
use std::path::{Path, PathBuf};
use std::process::{Child, ChildStdin, Command, Stdio};

/// As patient as it takes on the slowest machine.
const PATIENCE: std::time::Duration = std::time::Duration::from_secs(3600);
const PING: [u8; 10] = [0xff, 0xff, 0xfd, 0x00, 0x01, 0x03, 0x00, 0x01, 0x19, 0x4e];
/// Model number from the letters FT, and the firmware's version.
const PONG: [u8; 12] = [0xff, 0xff, 0xfd, 0x00, 0x01, 0x07, 0x00, 0x55, 0x00, b'F', b'T', 0x01];

fn link(name: &str) -> PathBuf {
    std::env::temp_dir().join(format!("fingertip-served-{}-{name}", std::process::id()))
}

fn text(path: &Path) -> &str {
    path.to_str().expect("a plain path")
}

fn terminal(served: &Served, baud: u32) -> SerialPort {
    let mut port = SerialPort::open(&served.name, baud).expect("it is there");
    port.set_read_timeout(PATIENCE).expect("a time-out");
    port
}

fn pings(port: &mut (impl Read + Write)) {
    port.write_all(&PING).expect("it listens");
    let mut reply = [0; 14];
    port.read_exact(&mut reply).expect("it answers");
    assert_eq!(reply[..12], PONG);
}

/// The complaint of a program that refuses its arguments.
fn refused(arguments: &[&str]) -> String {
    let output = program(arguments).output().expect("it starts");
    assert_eq!(output.status.code(), Some(2));
    String::from_utf8_lossy(&output.stderr).into_owned()
}

#[test]
fn a_link_is_served_by_one_and_gone_with_it() {
    let path = link("one");
    // What an earlier run left behind is replaced.
    std::os::unix::fs::symlink("/dev/null", &path).expect("a link");
    let served = Served::begin(Stdio::piped(), &["--pty", text(&path)]);
    assert_eq!(Path::new(&served.name), path);
    let second = refused(&["--pty", text(&path)]);
    let holder = format!("process {} serves a finger at {}", served.child.0.id(), path.display());
    assert!(second.contains(&holder) && second.contains("name another link"), "{second}");
    // The first one is as it was.
    pings(&mut terminal(&served, 1_000_000));
    pings(&mut terminal(&served, 1_000_000));
    let (well, last, complained) = served.interrupt();
    assert!(well, "{complained}");
    assert!(last.starts_with("served ") && last.contains("20 bytes in, 28 out, 2 answers"), "{last}");
    assert!(!path.is_symlink(), "the link is gone");
    assert!(!output::kept::beside(&path, "lock").exists(), "the lock is gone");
}

#[test]
fn a_file_is_no_link() {
    let path = link("file");
    std::fs::write(&path, "mine").expect("a file");
    let why = refused(&["--pty", text(&path)]);
    assert!(why.contains(&format!("cannot make the link {}", path.display())), "{why}");
    assert!(why.contains("name another link, or remove the file"), "{why}");
    assert_eq!(std::fs::read_to_string(&path).expect("it is there"), "mine");
    std::fs::remove_file(&path).expect("it is there");
}

#[test]
fn another_speed_is_not_heard() {
    let mut served = Served::begin(Stdio::piped(), &[]);
    let port = terminal(&served, 57_600);
    port.write_all(&PING).expect("a terminal takes it");
    // The first client notices the loss later: the answer goes only to the second.
    let mut complaints = BufReader::new(served.child.0.stderr.take().expect("it was asked for")).lines();
    let line = complaints.find_map(|line| line.ok().filter(|line| line.contains("unheard"))).expect("a line");
    assert!(line.contains("a client sends at 57600 baud, the finger listens at 1000000"), "{line}");
    drop(port);
    pings(&mut terminal(&served, 1_000_000));
}

#[test]
fn tcp_takes_one_client_after_another_and_says_so() {
    let served = Served::begin(Stdio::piped(), &["--tcp", "0"]);
    let mut first = TcpStream::connect(&served.name).expect("it listens");
    pings(&mut first);
    for speaks_first in [false].into_iter().chain([true; 50]) {
        let (mut words, mut second) = (String::new(), TcpStream::connect(&served.name).expect("it listens"));
        if speaks_first {
            second.write_all(&PING).expect("the system takes it");
        }
        // The system may report a reset after the words of a connection that was closed with bytes unread.
        let _ = second.read_to_string(&mut words);
        assert!(words.starts_with("busy: 127.0.0.1:") && words.ends_with("one client at a time\n"), "{words}");
    }
    pings(&mut first);
    drop(first);
    // The first client's end may be reported after the second one's connection.
    loop {
        let mut next = TcpStream::connect(&served.name).expect("it listens");
        let mut reply = [0; 14];
        if next.write_all(&PING).is_ok() && next.read_exact(&mut reply).is_ok() && reply[..12] == PONG {
            break;
        }
    }
    let (well, _, complained) = served.interrupt();
    assert!(well && complained.contains("refused "), "{complained}");
}

#[test]
fn who_has_gone_keeps_nobody_out() {
    let mut served = Served::begin(Stdio::piped(), &["--tcp", "0"]);
    let pid = served.pid();
    let signal = |signal| rustix::process::kill_process(pid, signal).expect("it runs");
    for _ in 0..20 {
        // The server is paused while one client leaves and the next connects, as on a busy machine.
        let mut first = TcpStream::connect(&served.name).expect("it listens");
        served.ask("fault");
        signal(rustix::process::Signal::STOP);
        first.write_all(&PING).expect("the system takes it");
        drop(first);
        let mut next = TcpStream::connect(&served.name).expect("the system takes it");
        signal(rustix::process::Signal::CONT);
        pings(&mut next);
    }
}

#[test]
fn what_is_there_is_told() {
    let why = refused(&["wal"]);
    assert!(why.contains("no scene wal") && why.contains("did you mean `wall`?") && why.contains("raspberry"), "{why}");
    let taken = std::net::TcpListener::bind("127.0.0.1:0").expect("some port is free");
    let port = taken.local_addr().expect("it is bound").port();
    let why = refused(&["--tcp", &port.to_string()]);
    assert!(why.contains(&format!("cannot open TCP port {port}")), "{why}");
}

#[test]
fn commands_change_the_scene() {
    let mut served = Served::begin(Stdio::piped(), &[]);
    assert_eq!(served.ask("move 3"), "the object moves to 3.00 mm at 20.000 mm/s\n");
    assert_eq!(served.ask("remove"), "the object is taken away\n");
    assert!(served.ask("state").starts_with("finger 1: Off: travel 0.000 mm, true force 0.000 N"));
    assert_eq!(served.line(), "the object is away\n");
    assert_eq!(served.ask("put"), "the object is at 5.00 mm\n");
    assert_eq!(served.ask("fault bridge"), "finger 1: bridge from now on; `mend` ends it\n");
    assert!(served.ask("fault").contains("row-stuck, array-frozen"));
    assert_eq!(served.ask("mend"), "all is mended\n");
    for wrong in ["move far", "fault nothing", "fault bridge 2", "jump"] {
        writeln!(served.side.as_mut().expect("it was asked for"), "{wrong}").expect("it listens");
    }
    assert!(served.ask("help").starts_with("remove "));
    // Without anybody at its side it serves on.
    served.side = None;
    pings(&mut terminal(&served, 1_000_000));
    let (well, _, complained) = served.interrupt();
    assert!(well);
    for wrong in ["MM of `far`", "no fault `nothing`", "no finger `2`: 1 to 1", "`jump` is no command"] {
        assert!(complained.contains(wrong), "{complained}");
    }
}

#[test]
fn a_last_line_needs_no_end() {
    let mut served = Served::begin(Stdio::piped(), &[]);
    write!(served.side.as_mut().expect("it was asked for"), "state").expect("it listens");
    served.side = None;
    assert!(served.line().starts_with("finger 1: Off"));
}

#[test]
fn time_counts_on_where_the_clock_of_a_finger_begins_again() {
    let mut pace = serve::Pace::new(3.0, PATIENCE, true);
    let clocks_s = [10.0, 0.0, 1.0].map(|now_s| pace.clock_s(now_s));
    assert!(clocks_s[1] < 0.2, "it is not asked to catch up: {clocks_s:?}");
    assert_eq!(pace.end().virtual_s, 8.0);
}

/// A job in the background that reads from its terminal is stopped by the system.
#[test]
fn behind_a_terminal_it_serves_on_while_somebody_types() {
    let path = link("behind");
    let (program, shown) = (env!("CARGO_BIN_EXE_serve"), path.display());
    let job = format!("set -m; {program} --pty {shown} > /dev/null 2>&1 & sleep 3600");
    let mut script = Command::new("script");
    script.args(["-qc", &job, "/dev/null"]).env("SHELL", "/bin/sh").stdin(Stdio::piped()).stdout(Stdio::piped());
    let mut script = Killed(script.spawn().expect("Debian has it (bsdutils)"));
    let mut typed = script.0.stdin.take().expect("it was asked for");
    wait_for(|| path.exists());
    typed.write_all(b"typed\n").expect("it takes it");
    // The terminal shows what it has.
    let (mut shown, mut byte) = (Vec::new(), [0]);
    while !shown.ends_with(b"typed") {
        script.0.stdout.as_mut().expect("it was asked for").read_exact(&mut byte).expect("a terminal");
        shown.push(byte[0]);
    }
    let lock = std::fs::read_to_string(output::kept::beside(&path, "lock")).expect("it is held");
    let pid: i32 = lock.split(' ').next().and_then(|pid| pid.parse().ok()).expect("its process");
    let mut port = SerialPort::open(&path, 1_000_000).expect("it is there");
    port.set_read_timeout(std::time::Duration::from_secs(1)).expect("a time-out");
    for _ in 0..200 {
        port.write_all(&PING).expect("it listens");
        let mut reply = [0; 14];
        while let Err(why) = port.read_exact(&mut reply) {
            assert_eq!(why.kind(), std::io::ErrorKind::TimedOut);
            let state = std::fs::read_to_string(format!("/proc/{pid}/stat")).expect("it runs");
            assert!(!state.contains(") T "), "it was stopped: {state}");
        }
        assert_eq!(reply[..12], PONG);
    }
    let pid = rustix::process::Pid::from_raw(pid).expect("a process number");
    rustix::process::kill_process(pid, rustix::process::Signal::INT).expect("it runs");
    wait_for(|| !path.is_symlink());
}

fn wait_for(mut happened: impl FnMut() -> bool) {
    while !happened() {
        std::thread::sleep(std::time::Duration::from_millis(1));
    }
}

/// Runs a program under the longest bus watchdog: a busy machine stops programs for longer than the 0.5 s of the examples.
const RUN: &str = "import runpy, sys
from fingertip import Bus
watch = Bus.watch
Bus.watch = lambda bus, ids, silence_s: watch(bus, ids, 2.54)
del sys.argv[0]
runpy.run_path(sys.argv[0], run_name='__main__')";

fn example(served: &Served, name: &str, arguments: &[&str]) -> String {
    let example = Path::new(env!("FINGERTIP_ROOT")).join("python/examples").join(name);
    let mut command = python();
    command.args(["-c", RUN]).arg(example).args(["--port", &served.name, "--timeout-ms", "600000"]);
    said(command.args(arguments))
}

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
    // `cargo xtask package` runs `test_package.py`.
    names.retain(|name| name.starts_with("test_") && name.ends_with(".py") && name != "test_package.py");
    assert!(names.len() >= 4, "{names:?}");
    std::thread::scope(|scope| {
        for name in names {
            scope.spawn(move || said(&mut tests_of(&name)));
        }
    });
}

#[test]
#[ignore = "long: cargo xtask test --long"]
fn long_every_end_of_a_python_program_leaves_no_force() {
    said(tests_of("test_interrupted.py").env("INSTANTS", "1"));
}

fn tests_of(name: &str) -> Command {
    let mut command = python();
    command.env("FINGERTIP_SERVE", env!("CARGO_BIN_EXE_serve")).args(["-m", "unittest", "discover", "--pattern", name]);
    command.arg(Path::new(env!("FINGERTIP_ROOT")).join("python/tests"));
    command
}

fn program(arguments: &[&str]) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_serve"));
    command.args(arguments);
    command
}

/// A process with all programs in its terminal, ended when dropped.
struct Killed(Child);

impl Drop for Killed {
    fn drop(&mut self) {
        // One that has ended already needs no more.
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}

/// A served finger, stopped when dropped.
struct Served {
    child: Killed,
    name: String,
    side: Option<ChildStdin>,
    said: BufReader<std::process::ChildStdout>,
}

impl Served {
    /// One that complains there.
    fn begin(complaints: Stdio, arguments: &[&str]) -> Self {
        let mut command = program(arguments);
        command.stdin(Stdio::piped()).stdout(Stdio::piped()).stderr(complaints);
        let mut child = command.spawn().expect("it starts");
        let (side, said) = (child.stdin.take(), BufReader::new(child.stdout.take().expect("it was asked for")));
        let mut served = Self { child: Killed(child), name: String::new(), side, said };
        let line = served.line();
        served.name = line.split_whitespace().nth(1).unwrap_or_else(|| panic!("says where it is: {line:?}")).to_owned();
        assert!(served.line().starts_with("scene    "));
        served
    }

    fn pid(&self) -> rustix::process::Pid {
        rustix::process::Pid::from_child(&self.child.0)
    }

    fn line(&mut self) -> String {
        let mut line = String::new();
        self.said.read_line(&mut line).expect("a line");
        line
    }

    /// Has a command carried out, and hears of it.
    fn ask(&mut self, command: &str) -> String {
        writeln!(self.side.as_mut().expect("it was asked for"), "{command}").expect("it listens");
        self.line()
    }

    /// Sends Ctrl-C; returns success, the last output, and standard error.
    fn interrupt(mut self) -> (bool, String, String) {
        rustix::process::kill_process(self.pid(), rustix::process::Signal::INT).expect("it runs");
        let (mut last, mut complained) = (String::new(), String::new());
        self.said.read_to_string(&mut last).expect("words");
        let stderr = self.child.0.stderr.as_mut().expect("it was asked for");
        stderr.read_to_string(&mut complained).expect("words");
        (self.child.0.wait().expect("it ends").success(), last, complained)
    }
}
