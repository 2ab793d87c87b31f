//! Ports for clients.

use output::kept::Lock;
use output::say;
use rustix::event::{PollFd, PollFlags, Timespec, poll};
use rustix::fd::{AsFd, BorrowedFd};
use rustix::fs::{OFlags, fcntl_getfl, fcntl_setfl};
use rustix::io::Errno;
use rustix::process::getpgrp;
use rustix::termios::{tcgetattr, tcgetpgrp};
use serial2::SerialPort;
use std::ffi::OsStr;
use std::io::{self, ErrorKind, IsTerminal as _, PipeReader, PipeWriter, Write as _};
use std::net::{Shutdown, SocketAddr, TcpListener, TcpStream};
use std::os::unix::ffi::OsStrExt;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::Duration;

const BUFFER: usize = 4096;

#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Place {
    /// A pseudo-terminal, with a symbolic link to it where one is wanted.
    Pty(Option<PathBuf>),
    /// A TCP port of this machine; 0 takes any that is free.
    Tcp(u16),
}

#[derive(Debug, PartialEq, Eq)]
pub enum Event {
    Bytes(Vec<u8>),
    /// Command from the standard input.
    Command(String),
    Stop,
    Nothing,
}

/// Ends [`serve`](crate::serve) from another thread.
#[derive(Clone, Debug)]
pub struct Stop(Arc<PipeWriter>);

impl Stop {
    /// Ends the server at once; does nothing after its end.
    pub fn stop(&self) {
        let _ = (&*self.0).write(&[0]);
    }
}

/// The place where clients come in; gone, with its link, when dropped.
pub struct Port {
    name: String,
    place: Opened,
    stopped: PipeReader,
    stop: Stop,
    side: Option<Side>,
}

enum Opened {
    Pty(Pty),
    Tcp(Tcp),
}

/// Commands, a line each.
#[derive(Default)]
struct Side {
    /// Bytes of the lines that were not passed on yet.
    bytes: Vec<u8>,
    ended: bool,
}

impl Port {
    pub fn open(place: &Place) -> io::Result<Self> {
        let (name, place) = match place {
            Place::Pty(link) => Pty::open(link.as_deref()).map(|(name, pty)| (name, Opened::Pty(pty)))?,
            Place::Tcp(port) => Tcp::open(*port).map(|(name, tcp)| (name, Opened::Tcp(tcp)))?,
        };
        let (stopped, stop) = io::pipe()?;
        Ok(Self { name, place, stopped, stop: Stop(Arc::new(stop)), side: None })
    }

    /// Takes commands too, a line each on the standard input.
    pub fn with_commands(mut self) -> Self {
        self.side = Some(Side::default());
        self
    }

    /// Name that a client opens: a path, or address and port.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// Something that stops whoever serves this port.
    pub fn stopper(&self) -> Stop {
        self.stop.clone()
    }

    /// Waits for input, at most for this time. Drops bytes at another speed, if the port has one.
    pub fn wait(&mut self, within: Duration, baud: Option<u32>) -> Event {
        if let Some(line) = self.side.as_mut().and_then(Side::line) {
            return Event::Command(line);
        }
        let input = io::stdin();
        let mut watched = vec![PollFd::new(&self.stopped, PollFlags::IN)];
        match &self.place {
            Opened::Pty(pty) => watched.push(PollFd::new(&pty.near, PollFlags::IN)),
            Opened::Tcp(tcp) => watched.extend(tcp.watched().map(|fd| PollFd::from_borrowed_fd(fd, PollFlags::IN))),
        }
        // The system stops a background process that reads its terminal.
        let in_front = || tcgetpgrp(&input).is_ok_and(|group| group == getpgrp()) || !input.is_terminal();
        let side = self.side.as_ref().is_some_and(|side| !side.ended) && in_front();
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
        if side && let Some(side) = &mut self.side {
            side.read();
        }
        let bytes = match &mut self.place {
            Opened::Pty(pty) if first => pty.read(baud),
            Opened::Tcp(tcp) => tcp.read(first, second),
            Opened::Pty(_) => Vec::new(),
        };
        if bytes.is_empty() { Event::Nothing } else { Event::Bytes(bytes) }
    }

    /// Sends to the client. Bytes that do not fit are lost, as on a line without a listener.
    pub fn send(&mut self, bytes: &[u8]) {
        match &mut self.place {
            Opened::Pty(pty) => pty.write(bytes),
            Opened::Tcp(tcp) => tcp.write(bytes),
        }
    }
}

impl Side {
    fn read(&mut self) {
        let bytes = read(io::stdin()).unwrap_or_default();
        self.ended = bytes.is_empty();
        self.bytes.extend(bytes);
        if self.ended {
            // The last line may lack its end.
            self.bytes.push(b'\n');
        }
    }

    fn line(&mut self) -> Option<String> {
        let end = self.bytes.iter().position(|byte| *byte == b'\n')?;
        let line: Vec<u8> = self.bytes.drain(..=end).collect();
        Some(String::from_utf8_lossy(&line).trim().to_owned())
    }
}

/// Reads from a source that has input.
fn read(from: impl AsFd) -> io::Result<Vec<u8>> {
    let mut buffer = [0; BUFFER];
    let count = rustix::io::read(from, &mut buffer)?;
    Ok(buffer[..count].to_vec())
}

// A pseudo-terminal, and a link to it that one process holds.

struct Pty {
    /// The finger's end, and the client's end held open so that clients may come and go.
    near: SerialPort,
    far: SerialPort,
    _link: Option<Link>,
    /// Baud rate at which bytes were ignored, once that was reported.
    unheard: Option<u32>,
}

/// A link to the terminal; gone when dropped.
struct Link {
    path: PathBuf,
    device: PathBuf,
    _lock: Lock,
}

impl Pty {
    fn open(link: Option<&Path>) -> io::Result<(String, Self)> {
        let (near, far) = SerialPort::pair()?;
        let device = rustix::pty::ptsname(&near, Vec::new())?;
        let device = PathBuf::from(OsStr::from_bytes(device.as_bytes()));
        fcntl_setfl(&near, fcntl_getfl(&near)? | OFlags::NONBLOCK)?;
        let name = link.unwrap_or(&device).display().to_string();
        let link = link.map(|link| Link::make(link, device)).transpose()?;
        Ok((name, Self { near, far, _link: link, unheard: None }))
    }

    fn read(&mut self, baud: Option<u32>) -> Vec<u8> {
        let bytes = read(&self.near).unwrap_or_default();
        let settings = tcgetattr(&self.far).ok();
        let (Some(baud), Some(set)) = (baud, settings.map(|settings| settings.output_speed())) else { return bytes };
        if set == baud {
            self.unheard = None;
            return bytes;
        }
        if self.unheard.replace(set) != Some(set) {
            say::aside(format_args!("unheard  a client sends at {set} baud, the finger listens at {baud}"));
        }
        Vec::new()
    }

    fn write(&mut self, bytes: &[u8]) {
        // Without a reader it is lost.
        let _ = rustix::io::write(&self.near, bytes);
    }
}

impl Link {
    fn make(path: &Path, device: PathBuf) -> io::Result<Self> {
        let taken = |who: &str, lock: &Path| {
            let (path, lock) = (path.display(), lock.display());
            format!("{who} serves a finger at {path} and holds {lock}: end it, or name another link")
        };
        let lock = Lock::take_or(path, taken).map_err(|why| cannot_make(path, &why))?;
        // A link that an earlier run left behind is replaced; a file is not.
        if path.is_symlink() {
            std::fs::remove_file(path)?;
        } else if path.exists() {
            let why = io::Error::other("a file of this name is there: name another link, or remove the file");
            return Err(cannot_make(path, &why));
        }
        std::os::unix::fs::symlink(&device, path).map_err(|why| cannot_make(path, &why))?;
        Ok(Self { path: path.into(), device, _lock: lock })
    }
}

impl Drop for Link {
    fn drop(&mut self) {
        // Somebody may have put another thing there.
        if std::fs::read_link(&self.path).is_ok_and(|device| device == self.device) {
            let _ = std::fs::remove_file(&self.path);
        }
    }
}

fn cannot_make(path: &Path, why: &io::Error) -> io::Error {
    io::Error::new(why.kind(), format!("cannot make the link {}: {why}", path.display()))
}

// A TCP port with one client at a time.

struct Tcp {
    listener: TcpListener,
    client: Option<(TcpStream, SocketAddr)>,
    /// Client that was refused last; kept open until the next one.
    refused: Option<TcpStream>,
}

/// More than a client can have sent that is not there any more.
const LAST_READS: usize = 64;

impl Tcp {
    fn open(port: u16) -> io::Result<(String, Self)> {
        let listener = TcpListener::bind(("127.0.0.1", port))
            .map_err(|why| io::Error::new(why.kind(), format!("cannot open TCP port {port}: {why}")))?;
        listener.set_nonblocking(true)?;
        let name = listener.local_addr()?.to_string();
        Ok((name, Self { listener, client: None, refused: None }))
    }

    /// The listener, and the client where there is one.
    fn watched(&self) -> impl Iterator<Item = BorrowedFd<'_>> {
        [self.listener.as_fd()].into_iter().chain(self.client.iter().map(|(client, _)| client.as_fd()))
    }

    /// Accepts a new client, and reads bytes of the present one.
    fn read(&mut self, new: bool, bytes: bool) -> Vec<u8> {
        let mut heard = if bytes { self.hear() } else { Vec::new() };
        if new && let Ok((client, from)) = self.listener.accept() {
            // The present client may have closed the connection after its last bytes.
            let last = std::iter::repeat_with(|| self.hear()).take(LAST_READS);
            heard.extend(last.take_while(|bytes| !bytes.is_empty()).flatten());
            self.welcome(client, from);
        }
        heard
    }

    fn hear(&mut self) -> Vec<u8> {
        let Some((client, from)) = &self.client else { return Vec::new() };
        match read(client) {
            Ok(bytes) if !bytes.is_empty() => bytes,
            Err(why) if matches!(why.kind(), ErrorKind::WouldBlock | ErrorKind::Interrupted) => Vec::new(),
            _ => {
                say::aside(format_args!("client   {from} went away"));
                self.client = None;
                Vec::new()
            }
        }
    }

    fn welcome(&mut self, mut client: TcpStream, from: SocketAddr) {
        // Small packets, for each of which a client waits.
        let ready = client.set_nodelay(true).and_then(|()| client.set_nonblocking(true));
        match &self.client {
            Some((_, first)) => {
                // One bus has one host. A refused client gets a text that no client takes for a packet.
                let words = format!("busy: {first} is connected to this fingertip, one client at a time\n");
                // In one piece: clients read once.
                let _ = client.write(words.as_bytes());
                // Were it closed with something unread, the words would be lost.
                let _ = client.shutdown(Shutdown::Write);
                self.refused = Some(client);
                say::aside(format_args!("refused  {from}: {first} is connected, one client at a time"));
            }
            None if ready.is_ok() => {
                say::aside(format_args!("client   {from} is connected"));
                self.client = Some((client, from));
            }
            None => {}
        }
    }

    fn write(&mut self, bytes: &[u8]) {
        if let Some((client, _)) = &mut self.client {
            // Without a reader it is lost; a client that left is noticed at the next read.
            let _ = client.write(bytes);
        }
    }
}
