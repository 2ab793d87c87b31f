//! Ways to interrupt a command. Each strikes at a number of bytes, never after a time.

use crate::jobs::Job;
use fastrand::Rng;
use rustix::process::{Pid, Signal, kill_process};
use std::collections::BTreeMap;
use std::fs::{self, File};
use std::io::Read;
use std::os::unix::process::ExitStatusExt;
use std::process::{Child, Command, Stdio};
use std::thread;
use std::time::Duration;

/// What happens to a command.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Kind {
    /// The system kills it within a write, to the byte.
    CutWrite,
    /// A write fails from a byte on, as on a full disk.
    FullDisk,
    /// It is killed once a file has so many bytes.
    Killed,
    /// The same by Ctrl-C.
    CtrlC,
    /// Who reads its output goes away after some bytes.
    ClosedPipe,
    /// Its output goes to a full disk.
    FullOutput,
    /// A second one is started beside it, and refused.
    TwoAtOnce,
    /// The first of two is killed, and the second takes over.
    TakenOver,
}

impl Kind {
    pub const ALL: [Self; 8] = [
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

/// Interrupts a job at so many bytes, and checks how it ends. Returns whether it was interrupted: a command may be done
/// before.
pub fn strike(job: &Job, kind: Kind, at: u64) -> bool {
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

/// Waits until a file of the command has so many bytes; false where it ends before.
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

/// A child that nobody has waited for can be signalled, also when it has ended.
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

/// Who reads goes away at once, or after some bytes: by then a quick command may have written all.
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

/// Ends with the test, also where that fails while it is stopped.
struct Ends(Child);

impl Drop for Ends {
    fn drop(&mut self) {
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}

/// The first is stopped while it holds the lock, so that the second comes meanwhile on any machine.
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

// Interruptions by the hundred: nothing that was whole is lost or changed, and what goes on ends as if nothing had
// happened.

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

/// Strikes each job in each way so many times.
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
        // Struck again on its way: what was done by then stays.
        strike(job, Kind::CutWrite, rng.u64(1..job.bytes));
        let still = job.check_parts("a second strike");
        assert!(still >= done, "{}: {still} of {done} are left after {after} and a cut", job.name);
    }
    job.check_whole(&after);
    job.clear();
    interrupted
}
