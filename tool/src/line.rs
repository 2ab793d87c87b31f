//! Connections: a serial port, a pseudo-terminal, or TCP to a served finger.

use rustix::fs::{FlockOperation, flock};
use serial2::SerialPort;
use std::io::{self, ErrorKind, Read as _, Write as _};
use std::net::TcpStream;
use std::time::Duration;

/// Prefix of a TCP port's name: `tcp:127.0.0.1:7000`.
const TCP: &str = "tcp:";
const BUFFER: usize = 1024;
/// Error of the system for a file that is not a terminal.
const NO_TERMINAL: i32 = rustix::io::Errno::NOTTY.raw_os_error();
/// Beginning of a served finger's message to a second client.
const BUSY: &[u8] = b"busy: ";

/// Connection to the bus.
#[derive(Debug)]
pub enum Line {
    /// A serial port or a pseudo-terminal.
    Serial(SerialPort),
    /// A served finger's port.
    Tcp(TcpStream),
}

/// The serial ports of this machine.
pub fn ports() -> Vec<String> {
    let ports = SerialPort::available_ports().unwrap_or_default();
    let mut names: Vec<String> = ports.iter().map(|path| path.display().to_string()).collect();
    names.sort();
    names
}

impl Line {
    pub fn open(port: &str, baud: u32) -> io::Result<Self> {
        if let Some(address) = port.strip_prefix(TCP) {
            let stream = TcpStream::connect(address)?;
            stream.set_nodelay(true)?;
            return Ok(Self::Tcp(stream));
        }
        let serial = SerialPort::open(port, baud).map_err(|why| match why.raw_os_error() {
            Some(NO_TERMINAL) => io::Error::new(ErrorKind::InvalidInput, "it is no serial port"),
            _ => why,
        })?;
        // Two hosts on one line take each other's answers.
        flock(&serial, FlockOperation::NonBlockingLockExclusive)
            .map_err(|_| io::Error::new(ErrorKind::ResourceBusy, "another program has it open"))?;
        Ok(Self::Serial(serial))
    }

    /// Changes the speed, where there is one.
    pub fn set_baud(&mut self, baud: u32) -> io::Result<()> {
        let Self::Serial(port) = self else { return Ok(()) };
        let mut settings = port.get_configuration()?;
        settings.set_baud_rate(baud)?;
        port.set_configuration(&settings)
    }

    pub fn write(&mut self, bytes: &[u8]) -> io::Result<()> {
        match self {
            Self::Serial(port) => port.write_all(bytes),
            Self::Tcp(stream) => stream.write_all(bytes),
        }
    }

    /// Reads within this time; empty after it.
    pub fn read(&mut self, within: Duration) -> io::Result<Vec<u8>> {
        let mut buffer = [0; BUFFER];
        // A time of 0 means for ever, to some.
        let within = within.max(Duration::from_millis(1));
        let count = match self {
            Self::Serial(port) => port.set_read_timeout(within).and_then(|()| port.read(&mut buffer)),
            Self::Tcp(stream) => stream.set_read_timeout(Some(within)).and_then(|()| stream.read(&mut buffer)),
        };
        match count {
            Ok(0) => Err(io::Error::new(ErrorKind::UnexpectedEof, "the other end closed it")),
            Ok(count) => not_busy(&buffer[..count]).map(|()| buffer[..count].to_vec()),
            Err(why) if matches!(why.kind(), ErrorKind::TimedOut | ErrorKind::WouldBlock | ErrorKind::Interrupted) => {
                Ok(Vec::new())
            }
            Err(why) => Err(why),
        }
    }

    /// Drops what came in so far.
    pub fn discard(&mut self) -> io::Result<()> {
        match self {
            Self::Serial(port) => {
                // Remaining bytes belong to no present request, and are dropped by their ID or length.
                let _ = port.discard_input_buffer();
            }
            Self::Tcp(stream) => {
                let mut buffer = [0; BUFFER];
                stream.set_nonblocking(true)?;
                while let Ok(count @ 1..) = stream.read(&mut buffer) {
                    not_busy(&buffer[..count])?;
                }
                stream.set_nonblocking(false)?;
            }
        }
        Ok(())
    }
}

/// Fails if a served finger reports that another client is connected.
fn not_busy(bytes: &[u8]) -> io::Result<()> {
    if !bytes.starts_with(BUSY) {
        return Ok(());
    }
    Err(io::Error::new(ErrorKind::ResourceBusy, String::from_utf8_lossy(bytes).trim_end()))
}
