//! Where clients come in.

use super::Stop;
use crate::Error;
use serial2::SerialPort;
use std::ffi::OsStr;
use std::io::{ErrorKind, Read, Write};
use std::net::{TcpListener, TcpStream};
use std::os::unix::ffi::OsStrExt;
use std::path::{Path, PathBuf};
use std::sync::mpsc::{self, Receiver, RecvTimeoutError, Sender};
use std::time::Duration;

/// Longer than anybody waits.
const FOR_EVER: Duration = Duration::from_secs(3600);
const BUFFER: usize = 512;

/// What comes in.
#[derive(Debug)]
pub(super) enum Event {
    Bytes(Vec<u8>),
    Client(TcpStream),
    Stop,
}

/// Where to offer the board.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Place {
    /// A pseudo-terminal, with a symbolic link to it where one is wanted.
    Pty(Option<PathBuf>),
    /// A TCP port of this machine; 0 takes any that is free.
    Tcp(u16),
}

/// The place where clients come in; gone, with its link, when dropped.
#[derive(Debug)]
pub struct Port {
    name: String,
    events: Receiver<Event>,
    stop: Sender<Event>,
    writer: Writer,
    link: Option<PathBuf>,
}

#[derive(Debug)]
enum Writer {
    /// The board's end, and the client's end held open so that clients may come and go.
    Pty {
        near: SerialPort,
        _far: SerialPort,
    },
    Tcp(Option<TcpStream>),
}

impl Port {
    /// Opens it.
    ///
    /// # Errors
    /// The link's name is taken by a file, or the TCP port by another program.
    pub fn open(place: &Place) -> Result<Self, Error> {
        match place {
            Place::Pty(link) => Self::pty(link.as_deref()),
            Place::Tcp(port) => Self::tcp(*port),
        }
    }

    /// What a client opens: a path, or address and port.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// Something that stops whoever serves this port.
    pub fn stopper(&self) -> Stop {
        Stop(self.stop.clone())
    }

    fn pty(link: Option<&Path>) -> Result<Self, Error> {
        let (near, far) = SerialPort::pair()?;
        let device = rustix::pty::ptsname(&near, Vec::new()).map_err(std::io::Error::from)?;
        let device = PathBuf::from(OsStr::from_bytes(device.as_bytes()));
        if let Some(link) = link {
            // A link that an earlier run left behind is replaced; a file is not.
            if link.is_symlink() {
                std::fs::remove_file(link)?;
            }
            std::os::unix::fs::symlink(&device, link).map_err(|why| {
                std::io::Error::new(why.kind(), format!("cannot make the link {}: {why}", link.display()))
            })?;
        }
        let (stop, events) = mpsc::channel();
        let mut reader = near.try_clone()?;
        reader.set_read_timeout(FOR_EVER)?;
        let sender = stop.clone();
        std::thread::spawn(move || listen(&reader, &sender));
        let name = link.unwrap_or(&device).display().to_string();
        Ok(Self { name, events, stop, writer: Writer::Pty { near, _far: far }, link: link.map(Path::to_owned) })
    }

    fn tcp(port: u16) -> Result<Self, Error> {
        let listener = TcpListener::bind(("127.0.0.1", port))
            .map_err(|why| std::io::Error::new(why.kind(), format!("cannot open TCP port {port}: {why}")))?;
        let name = listener.local_addr()?.to_string();
        let (stop, events) = mpsc::channel();
        let sender = stop.clone();
        std::thread::spawn(move || accept(&listener, &sender));
        Ok(Self { name, events, stop, writer: Writer::Tcp(None), link: None })
    }

    /// The next event, or none within this time.
    pub(super) fn next(&self, within: Duration) -> Result<Event, RecvTimeoutError> {
        self.events.recv_timeout(within)
    }

    /// Answers go to this client from now on.
    pub(super) fn attach(&mut self, client: TcpStream) {
        self.writer = Writer::Tcp(Some(client));
    }

    pub(super) fn write_all(&mut self, bytes: &[u8]) -> std::io::Result<()> {
        match &mut self.writer {
            Writer::Pty { near, .. } => near.write_all(bytes),
            Writer::Tcp(Some(client)) => client.write_all(bytes),
            Writer::Tcp(None) => Ok(()),
        }
    }
}

impl Drop for Port {
    fn drop(&mut self) {
        if let Some(link) = &self.link {
            // Somebody may have removed it already.
            let _ = std::fs::remove_file(link);
        }
    }
}

/// Passes on what comes in until nobody listens.
fn listen(near: &SerialPort, events: &Sender<Event>) {
    let mut buffer = [0; BUFFER];
    loop {
        match near.read(&mut buffer) {
            Ok(count) if events.send(Event::Bytes(buffer[..count].to_vec())).is_err() => return,
            Ok(_) => {}
            Err(why) if matches!(why.kind(), ErrorKind::Interrupted | ErrorKind::TimedOut | ErrorKind::WouldBlock) => {}
            Err(_) => return,
        }
    }
}

/// Serves one client after another.
fn accept(listener: &TcpListener, events: &Sender<Event>) {
    for client in listener.incoming() {
        let Ok(mut client) = client else { continue };
        // Small packets, each of which somebody waits for.
        let _ = client.set_nodelay(true);
        let Ok(writer) = client.try_clone() else { continue };
        if events.send(Event::Client(writer)).is_err() {
            return;
        }
        let mut buffer = [0; BUFFER];
        while let Ok(count @ 1..) = client.read(&mut buffer) {
            if events.send(Event::Bytes(buffer[..count].to_vec())).is_err() {
                return;
            }
        }
    }
}
