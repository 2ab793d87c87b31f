//! A TCP port with one client at a time.

use output::say;
use rustix::fd::{AsFd, BorrowedFd};
use std::io::{self, ErrorKind, Write as _};
use std::net::{Shutdown, SocketAddr, TcpListener, TcpStream};

#[derive(Debug)]
pub(super) struct Tcp {
    pub name: String,
    listener: TcpListener,
    client: Option<(TcpStream, SocketAddr)>,
    /// Who was refused last, open until the next one comes.
    refused: Option<TcpStream>,
}

/// More than a client can have sent that is not there any more.
const LAST_READS: usize = 64;

impl Tcp {
    pub fn open(port: u16) -> io::Result<Self> {
        let listener = TcpListener::bind(("127.0.0.1", port))
            .map_err(|why| io::Error::new(why.kind(), format!("cannot open TCP port {port}: {why}")))?;
        listener.set_nonblocking(true)?;
        let name = listener.local_addr()?.to_string();
        Ok(Self { name, listener, client: None, refused: None })
    }

    /// The listener, and the client where there is one.
    pub fn watched(&self) -> impl Iterator<Item = BorrowedFd<'_>> {
        [self.listener.as_fd()].into_iter().chain(self.client.iter().map(|(client, _)| client.as_fd()))
    }

    /// Takes a client in, and what the one that is there sends.
    pub fn read(&mut self, new: bool, bytes: bool) -> Vec<u8> {
        let mut heard = if bytes { self.hear() } else { Vec::new() };
        if new && let Ok((client, from)) = self.listener.accept() {
            // The one that is there may have gone since, behind what it sent last.
            for _ in 0..LAST_READS {
                let last = self.hear();
                if last.is_empty() {
                    break;
                }
                heard.extend(last);
            }
            self.welcome(client, from);
        }
        heard
    }

    fn hear(&mut self) -> Vec<u8> {
        let Some((client, from)) = &self.client else { return Vec::new() };
        match super::read(client) {
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
        // Small packets, each of which somebody waits for.
        let ready = client.set_nodelay(true).and_then(|()| client.set_nonblocking(true));
        match &self.client {
            Some((_, first)) => {
                // One bus has one host. Who is refused is told, in words that no client takes for a packet.
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

    pub fn write(&mut self, bytes: &[u8]) {
        if let Some((client, _)) = &mut self.client {
            // Where nobody reads it is lost; one that went away is seen at the next read.
            let _ = client.write(bytes);
        }
    }
}
