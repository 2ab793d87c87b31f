//! Where clients come in.

mod pty;
mod tcp;

use output::say;
use pty::Pty;
use rustix::event::{PollFd, PollFlags, Timespec, poll};
use rustix::fd::AsFd;
use rustix::io::Errno;
use rustix::process::getpgrp;
use rustix::termios::tcgetpgrp;
use std::collections::VecDeque;
use std::io::{self, IsTerminal as _, PipeReader, PipeWriter, Write as _};
use std::path::PathBuf;
use std::sync::Arc;
use std::time::Duration;
use tcp::Tcp;

/// More than any packet.
const BUFFER: usize = 4096;
/// A longer line at the side is none.
const LINE_MAX: usize = 1000;

/// Where to offer a finger.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Place {
    /// A pseudo-terminal, with a symbolic link to it where one is wanted.
    Pty(Option<PathBuf>),
    /// A TCP port of this machine; 0 takes any that is free.
    Tcp(u16),
}

/// What comes in.
#[derive(Debug, PartialEq, Eq)]
pub enum Event {
    /// From the client.
    Bytes(Vec<u8>),
    /// A line at the side.
    Command(String),
    /// Somebody wants it to end.
    Stop,
    /// The time is over.
    Nothing,
}

/// Ends [`serve`](crate::serve) from another thread.
#[derive(Clone, Debug)]
pub struct Stop(Arc<PipeWriter>);

impl Stop {
    /// It ends at once; where it has ended already, nothing happens.
    pub fn stop(&self) {
        let _ = (&*self.0).write(&[0]);
    }
}

/// The place where clients come in; gone, with its link, when dropped.
#[derive(Debug)]
pub struct Port {
    place: Opened,
    stopped: PipeReader,
    stop: Stop,
    side: Option<Side>,
}

#[derive(Debug)]
enum Opened {
    Pty(Pty),
    Tcp(Tcp),
}

/// Commands, a line each.
#[derive(Debug, Default)]
struct Side {
    begun: Vec<u8>,
    lines: VecDeque<String>,
    /// Nothing more comes.
    ended: bool,
}

impl Port {
    /// Opens it.
    ///
    /// # Errors
    /// The link's name is taken by a file, or by another process that serves there, or the TCP port by another program.
    pub fn open(place: &Place) -> io::Result<Self> {
        let place = match place {
            Place::Pty(link) => Opened::Pty(Pty::open(link.as_deref())?),
            Place::Tcp(port) => Opened::Tcp(Tcp::open(*port)?),
        };
        let (stopped, stop) = io::pipe()?;
        Ok(Self { place, stopped, stop: Stop(Arc::new(stop)), side: None })
    }

    /// Takes commands too, a line each on the standard input.
    pub fn with_commands(mut self) -> Self {
        self.side = Some(Side::default());
        self
    }

    /// What a client opens: a path, or address and port.
    pub fn name(&self) -> &str {
        match &self.place {
            Opened::Pty(pty) => &pty.name,
            Opened::Tcp(tcp) => &tcp.name,
        }
    }

    /// Something that stops whoever serves this port.
    pub fn stopper(&self) -> Stop {
        self.stop.clone()
    }

    /// What comes in within this time. Bytes at another speed than this one are not heard, where the port can tell.
    pub fn wait(&mut self, within: Duration, baud: Option<u32>) -> Event {
        if let Some(line) = self.side.as_mut().and_then(|side| side.lines.pop_front()) {
            return Event::Command(line);
        }
        let input = io::stdin();
        let mut watched = vec![PollFd::new(&self.stopped, PollFlags::IN)];
        match &self.place {
            Opened::Pty(pty) => watched.push(PollFd::new(pty.near(), PollFlags::IN)),
            Opened::Tcp(tcp) => watched.extend(tcp.watched().map(|fd| PollFd::from_borrowed_fd(fd, PollFlags::IN))),
        }
        let side = self.side.as_ref().is_some_and(|side| !side.ended) && in_front(&input);
        if side {
            watched.push(PollFd::from_borrowed_fd(input.as_fd(), PollFlags::IN));
        }
        let until = Timespec { tv_sec: within.as_secs() as i64, tv_nsec: within.subsec_nanos().into() };
        match poll(&mut watched, Some(&until)) {
            Ok(0) | Err(Errno::INTR) => return Event::Nothing,
            Ok(_) => {}
            Err(_) => return Event::Stop,
        }
        let ready = |place: usize| watched.get(place).is_some_and(|fd| !fd.revents().is_empty());
        let side = side && ready(watched.len() - 1);
        let (stopped, first, second) = (ready(0), ready(1), watched.len() > 2 && ready(2));
        drop(watched);
        if stopped {
            return Event::Stop;
        }
        if side {
            self.read_side();
        }
        let bytes = match &mut self.place {
            Opened::Pty(pty) if first => pty.read(baud),
            Opened::Tcp(tcp) => tcp.read(first, second),
            Opened::Pty(_) => Vec::new(),
        };
        if bytes.is_empty() { Event::Nothing } else { Event::Bytes(bytes) }
    }

    /// Sends to the client. What does not fit is lost, as on a line to which nobody listens.
    pub fn send(&mut self, bytes: &[u8]) {
        match &mut self.place {
            Opened::Pty(pty) => pty.write(bytes),
            Opened::Tcp(tcp) => tcp.write(bytes),
        }
    }

    fn read_side(&mut self) {
        let mut buffer = [0; BUFFER];
        let count = rustix::io::read(io::stdin(), &mut buffer).unwrap_or(0);
        let Some(side) = &mut self.side else { return };
        buffer[..count].iter().for_each(|byte| side.take(*byte));
        if count == 0 {
            // The last line may lack its end.
            side.take(b'\n');
            side.ended = true;
        }
    }
}

impl Side {
    fn take(&mut self, byte: u8) {
        if byte != b'\n' {
            // What is too long is kept as far as it takes to tell.
            if self.begun.len() <= LINE_MAX {
                self.begun.push(byte);
            }
            return;
        }
        let line = std::mem::take(&mut self.begun);
        if line.len() > LINE_MAX {
            say::aside(format_args!("a line of more than {LINE_MAX} bytes is no command"));
        } else {
            self.lines.push_back(String::from_utf8_lossy(&line).trim().to_owned());
        }
    }
}

/// Whether this may read what is typed: who does so from the background is stopped by the system.
fn in_front(input: impl AsFd) -> bool {
    tcgetpgrp(input).is_ok_and(|group| group == getpgrp()) || !io::stdin().is_terminal()
}

/// What is there to read.
fn read(from: impl AsFd) -> io::Result<Vec<u8>> {
    let mut buffer = [0; BUFFER];
    let count = rustix::io::read(from, &mut buffer)?;
    Ok(buffer[..count].to_vec())
}
