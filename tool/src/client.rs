//! The bus's host: an instruction out, its answer in, over a serial port, a pseudo-terminal, or TCP to a served finger.

use crate::{Error, table};
use fingertip::link::Reply;
use fingertip::link::packet::{BROADCAST, Event, Packet, REPLY_MAX, Receiver, Sender, instruction};
use fingertip::shipped::address;
use rustix::fs::{FlockOperation, flock};
use serial2::SerialPort;
use std::io::{self, ErrorKind, Read as _, Write as _};
use std::net::{Shutdown, TcpStream};
use std::time::{Duration, Instant};

/// The alert's bit of a status packet's error.
const ALERT: u8 = 0x80;
/// Wait for a device that is not expected to be there.
const PROBE: Duration = Duration::from_secs(1);
/// Attempts on a noisy line for requests that may be repeated.
const TRIES: usize = 3;
/// A status packet to a broadcast Ping, and bits of a byte: what each ID waits for those below.
const PING_BITS: u32 = 14 * 10;
/// No bus is slower: all IDs would take minutes to answer.
pub const BAUD_MIN: i64 = 1_200;
pub const ID_MAX: u8 = 252;
/// Number of devices to which one Sync Write carries four bytes each, beside 14 bytes: a finger takes no longer packet.
pub const LISTED: usize = (REPLY_MAX - 14) / 5;
/// Time between two keep-alive packets.
const FEED: Duration = Duration::from_millis(100);

/// Port, speed and ID of a controller.
#[derive(Clone, Debug, clap::Args)]
pub struct Reach {
    /// Serial port, pseudo-terminal, or tcp:ADDRESS:PORT of a served finger
    #[arg(long, short, global = true, env = "FINGERTIP_PORT")]
    pub port: Option<String>,
    /// Bus speed
    #[arg(long, short, global = true, default_value_t = 1_000_000)]
    #[arg(value_parser = clap::value_parser!(u32).range(BAUD_MIN..))]
    pub baud: u32,
    /// The controller's ID on the bus. `stop`, `info`, `tare` and `recover` also take several (1,2), or all
    #[arg(long = "id", short, global = true, value_name = "ID", value_delimiter = ',', default_value = "1")]
    #[arg(value_parser = id)]
    pub ids: Vec<u8>,
    /// Longest wait for an answer
    #[arg(long, global = true, default_value_t = 100, value_parser = clap::value_parser!(u64).range(1..))]
    pub timeout_ms: u64,
}

/// An ID, or the one for all.
fn id(text: &str) -> Result<u8, String> {
    let id = if text == "all" { Some(BROADCAST) } else { text.parse().ok().filter(|id| *id <= ID_MAX) };
    id.ok_or_else(|| format!("an ID is 0 to {ID_MAX}, or all"))
}

#[derive(Debug)]
pub struct Client {
    line: Line,
    pub port: String,
    pub baud: u32,
    pub id: u8,
    pub timeout: Duration,
    /// True if it sends keep-alive packets.
    pub feeds: bool,
    /// Instant of the last one.
    fed: Instant,
    /// An answer was not waited for: it may come yet.
    owed: bool,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Pong {
    pub id: u8,
    pub model: u16,
    pub firmware: u8,
}

impl Pong {
    pub fn is_fingertip(&self) -> bool {
        table::register_at(address::MODEL_NUMBER).is_some_and(|model| model.min == i64::from(self.model))
    }
}

impl Client {
    /// Opens the port; asks nothing yet.
    pub fn open(reach: &Reach) -> Result<Self, Error> {
        let (port, baud) = (reach.port.clone().ok_or(Error::NoPort)?, reach.baud);
        let (id, timeout) = (reach.ids[0], Duration::from_millis(reach.timeout_ms));
        let line = Line::open(&port, baud)?;
        Ok(Self { line, port, baud, id, timeout, feeds: false, fed: Instant::now(), owed: false })
    }

    /// Opens a port again that was lost.
    pub fn reopen(&mut self) -> Result<(), Error> {
        self.line = Line::open(&self.port, self.baud)?;
        self.owed = false;
        Ok(())
    }

    /// Opens the port and sees to it that one fingertip of a known table answers.
    pub fn connect(reach: &Reach) -> Result<Self, Error> {
        if reach.ids.len() > 1 || reach.ids.contains(&BROADCAST) {
            return Err(Error::NotUnderstood(
                "this command takes one --id; `stop`, `info`, `tare` and `recover` take several".into(),
            ));
        }
        let mut client = Self::open(reach)?;
        client.check()?;
        Ok(client)
    }

    /// Sees to it that a fingertip of a known table answers.
    pub fn check(&mut self) -> Result<(), Error> {
        let pong = self.ping()?;
        if !pong.is_fingertip() {
            return Err(format!("ID {} is no fingertip: its model number is {}", self.id, pong.model).into());
        }
        Ok(())
    }

    pub fn set_baud(&mut self, baud: u32) -> Result<(), Error> {
        self.line.set_baud(baud).map_err(|why| Error::Open(format!("{} at {baud} baud", self.port), why))?;
        self.baud = baud;
        Ok(())
    }

    pub fn ping(&mut self) -> Result<Pong, Error> {
        let data = self.ask("ping", instruction::PING, &[], 3)?;
        Ok(Pong { id: self.id, model: u16::from_le_bytes([data[0], data[1]]), firmware: data[2] })
    }

    /// Returns true if a device answers to an ID; two devices at once answer with a damaged packet.
    pub fn is_taken(&mut self, id: u8) -> Result<bool, Error> {
        let (own, timeout) = (self.id, self.timeout);
        (self.id, self.timeout) = (id, timeout.min(PROBE));
        let pong = self.ping();
        // A late answer is waited for here, for as long.
        let settled = self.settle();
        (self.id, self.timeout) = (own, timeout);
        settled?;
        match pong {
            Ok(_) | Err(Error::Damaged(_) | Error::Refused(..)) => Ok(true),
            Err(Error::Silent(_)) => Ok(false),
            Err(why) => Err(why),
        }
    }

    pub fn ping_all(&mut self) -> Result<Vec<Pong>, Error> {
        let mut found = Vec::new();
        self.exchange(&packet(BROADCAST, instruction::PING, &[]), usize::MAX, |event, answer| {
            if let (Event::Packet, &[_, low, high, firmware]) = (event, answer.params) {
                found.push(Pong { id: answer.id, model: u16::from_le_bytes([low, high]), firmware });
            }
            true
        })?;
        Ok(found)
    }

    /// Asks again where the line was at fault. What is asked must do no harm a second time.
    pub fn again<T>(&mut self, ask: impl Fn(&mut Self) -> Result<T, Error>) -> Result<T, Error> {
        for _ in 1..TRIES {
            match ask(self) {
                Err(why) if why.is_noise() => {}
                other => return other,
            }
        }
        ask(self)
    }

    pub fn read(&mut self, address: u16, length: u16) -> Result<Vec<u8>, Error> {
        let doing = format!("read {}", table::place(address));
        let params = [address.to_le_bytes(), length.to_le_bytes()].concat();
        self.ask(&doing, instruction::READ, &params, usize::from(length))
    }

    /// Reads registers side by side, from the first to the last.
    pub fn block(&mut self, first: u16, last: u16) -> Result<table::Block, Error> {
        let end = table::register_at(last).map_or(last + 1, table::end);
        Ok(table::Block { first, bytes: self.read(first, end - first)? })
    }

    pub fn number(&mut self, address: u16) -> Result<i64, Error> {
        Ok(self.block(address, address)?.number(address))
    }

    pub fn write(&mut self, address: u16, data: &[u8]) -> Result<(), Error> {
        let doing = format!("write {}", table::place(address));
        self.ask(&doing, instruction::WRITE, &[&address.to_le_bytes(), data].concat(), 0).map(drop)
    }

    /// Writes a register of one number.
    pub fn set(&mut self, address: u16, value: i64) -> Result<(), Error> {
        let doing = format!("set {} to {value}", table::place(address));
        self.ask(&doing, instruction::WRITE, &assignment(address, value)?, 0).map(drop)
    }

    /// Writes a register of one number of all devices on the bus. None of them answers.
    pub fn set_all(&mut self, address: u16, value: i64) -> Result<(), Error> {
        self.transmit(&packet(BROADCAST, instruction::WRITE, &assignment(address, value)?))
    }

    /// Writes a register of one number of these devices, in as few packets as a device can receive. None of them answers.
    pub fn set_each(&mut self, ids: &[u8], address: u16, value: i64) -> Result<(), Error> {
        let assigned = assignment(address, value)?;
        let (register, data) = assigned.split_at(2);
        ids.chunks(LISTED).try_for_each(|ids| {
            let entries = ids.iter().flat_map(|id| [&[*id], data].concat());
            let params: Vec<u8> = register.iter().copied().chain([data.len() as u8, 0]).chain(entries).collect();
            self.transmit(&packet(BROADCAST, instruction::SYNC_WRITE, &params))
        })
    }

    /// Sends a packet unchanged. Returns the bytes received until this number of status packets arrived, or until the
    /// time-out. Of a packet for one device, `from`, only answers of that device count.
    pub fn pass(&mut self, packet: &[u8], from: Option<u8>, answers: usize) -> Result<Vec<u8>, Error> {
        self.exchange(packet, answers, |_, answer| from.is_none_or(|id| id == answer.id))
    }

    /// Does the same with the answers that `counts`, which gets each status packet, whole or damaged, in turn. On a line that
    /// echoes, the instruction comes back too.
    fn exchange(
        &mut self,
        packet: &[u8],
        mut answers: usize,
        mut counts: impl FnMut(Event, &Packet<'_>) -> bool,
    ) -> Result<Vec<u8>, Error> {
        self.transmit(packet)?;
        let all = answers == usize::MAX;
        let until = Instant::now() + self.timeout + if all { self.ping_slots() } else { Duration::ZERO };
        let (mut receiver, mut heard, mut damaged) = (Receiver::new(), Vec::new(), false);
        while answers > 0
            && let Some(left) = until.checked_duration_since(Instant::now())
        {
            let bytes = self.receive(left)?;
            for byte in &bytes {
                let event = receiver.push(*byte).filter(|event| *event != Event::Framing);
                let packet = receiver.packet();
                if let Some(event) = event
                    && packet.instruction == instruction::STATUS
                    && counts(event, &packet)
                {
                    damaged |= event == Event::BadCrc;
                    answers = answers.saturating_sub(1);
                }
            }
            heard.extend(bytes);
        }
        self.owed = (answers > 0 || damaged) && !all;
        Ok(heard)
    }

    /// Time in which all IDs answer a broadcast Ping, one behind the other.
    fn ping_slots(&self) -> Duration {
        Duration::from_secs_f64(f64::from(u32::from(BROADCAST) * PING_BITS) / f64::from(self.baud))
    }

    /// Sends an instruction and waits for its answer: the error and `length` bytes, or the error alone. An answer of another
    /// length is passed over: it is that to the last request of a program that was killed.
    fn ask(&mut self, doing: &str, instruction: u8, params: &[u8], length: usize) -> Result<Vec<u8>, Error> {
        let (id, mut answered, mut other_length) = (self.id, None, None);
        self.exchange(&packet(id, instruction, params), 1, |event, answer| {
            let answer = match (event, answer.params) {
                _ if answer.id != id => return false,
                (Event::Packet, [error, data @ ..]) if data.len() == length || error & !ALERT != 0 => {
                    Ok((error & !ALERT, data.to_vec()))
                }
                (Event::Packet, _) => {
                    other_length = Some(Err("it has another length than what was asked for"));
                    return false;
                }
                _ => Err("its check sum is wrong"),
            };
            answered.get_or_insert(answer);
            true
        })?;
        match answered.or(other_length) {
            Some(Ok((0, data))) => return Ok(data),
            Some(Ok((number, _))) => {
                let meaning = table::meaning_of_error(number);
                let text = format!("{doing}: refused by ID {id} with error {number}: {meaning}");
                return Err(Error::Refused(text, number));
            }
            Some(Err(what)) => {
                let cause = "is the line noisy, or are there two devices with this ID?";
                return Err(Error::Damaged(format!("{doing}: a damaged answer of ID {id} ({what}); {cause}")));
            }
            None => {}
        }
        let (port, baud, waited_ms) = (&self.port, self.baud, self.timeout.as_millis());
        // A ping is answered at every level.
        let level = match instruction {
            instruction::PING => "",
            _ => "; if scan finds it, its status_return_level is too low, and `fingertip stop` raises it",
        };
        Err(Error::Silent(format!(
            "{doing}: no answer of ID {id} on {port} at {baud} baud within {waited_ms} ms; `fingertip scan` looks for it, \
             --timeout-ms waits longer{level}"
        )))
    }

    fn transmit(&mut self, packet: &[u8]) -> Result<(), Error> {
        self.settle()?;
        self.line.discard().and_then(|()| self.feed()).map_err(|why| self.lost(why))?;
        self.line.write(packet).map_err(|why| self.lost(why))
    }

    /// Sends a keep-alive packet once one is due.
    fn feed(&mut self) -> io::Result<()> {
        if !self.feeds || self.fed.elapsed() < FEED {
            return Ok(());
        }
        self.fed = Instant::now();
        // A Sync Write to no device is a broadcast: it feeds all bus watchdogs.
        self.line.write(&packet(BROADCAST, instruction::SYNC_WRITE, &[0; 4]))
    }

    /// Reads within this time; empty after it. Keep-alive packets are sent meanwhile, except while an answer to a
    /// broadcast Ping may be on the line.
    fn receive(&mut self, mut within: Duration) -> Result<Vec<u8>, Error> {
        let pause = FEED.max(self.ping_slots());
        loop {
            let bytes = self.line.read(within.min(pause)).map_err(|why| self.lost(why))?;
            if !bytes.is_empty() || within <= pause {
                return Ok(bytes);
            }
            within -= pause;
            self.feed().map_err(|why| self.lost(why))?;
        }
    }

    /// Waits until the line is silent where an answer may come yet: the protocol does not number its packets, so a late
    /// one would be taken for the next one.
    fn settle(&mut self) -> Result<(), Error> {
        // A line that babbles does not fall silent.
        let until = Instant::now() + 3 * self.timeout;
        while std::mem::take(&mut self.owed) {
            let heard = !self.receive(self.timeout)?.is_empty();
            self.owed = heard && Instant::now() < until;
        }
        Ok(())
    }

    fn lost(&self, why: std::io::Error) -> Error {
        Error::Port(self.port.clone(), why)
    }
}

/// Parameters of an instruction that writes a register of one number.
fn assignment(address: u16, value: i64) -> Result<Vec<u8>, Error> {
    let register = table::register_at(address).ok_or_else(|| format!("no register at {address}"))?;
    Ok([&address.to_le_bytes()[..], &table::encode(register, value)].concat())
}

pub fn packet(id: u8, instruction: u8, params: &[u8]) -> Reply {
    let mut packet = Reply::new();
    let mut sender = Sender::new(&mut packet, id, instruction);
    params.iter().for_each(|byte| sender.push(*byte));
    sender.finish();
    packet
}

/// Prefix of a TCP port's name: `tcp:127.0.0.1:7000`.
const TCP: &str = "tcp:";
const BUFFER: usize = 1024;
/// Longest wait for the other end of a TCP port to close it.
const LEAVING: Duration = Duration::from_secs(1);
/// Error of the system for a file that is not a terminal.
const NO_TERMINAL: i32 = rustix::io::Errno::NOTTY.raw_os_error();
/// Beginning of a served finger's message to a second client.
const BUSY: &[u8] = b"busy: ";

#[derive(Debug)]
pub enum Line {
    Serial(SerialPort),
    /// A served finger's port.
    Tcp(TcpStream),
}

pub fn ports() -> Vec<String> {
    let ports = SerialPort::available_ports().unwrap_or_default();
    let mut names: Vec<String> = ports.iter().map(|path| path.display().to_string()).collect();
    names.sort();
    names
}

impl Line {
    fn open(port: &str, baud: u32) -> Result<Self, Error> {
        Self::of(port, baud).map_err(|why| Error::Open(port.into(), why))
    }

    fn of(port: &str, baud: u32) -> io::Result<Self> {
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

impl Drop for Line {
    fn drop(&mut self) {
        match self {
            Self::Serial(port) => {
                // A lock lasts as long as any copy of its file: a process that another thread starts just now has one.
                let _ = flock(port, FlockOperation::Unlock);
            }
            Self::Tcp(stream) => {
                // Until the other end has closed it too, the next program would be a second client.
                let _ = stream.shutdown(Shutdown::Write).and_then(|()| stream.set_read_timeout(Some(LEAVING)));
                while matches!(stream.read(&mut [0; BUFFER]), Ok(1..)) {}
            }
        }
    }
}

/// Fails if a served finger reports that another client is connected.
fn not_busy(bytes: &[u8]) -> io::Result<()> {
    if !bytes.starts_with(BUSY) {
        return Ok(());
    }
    Err(io::Error::new(ErrorKind::ResourceBusy, String::from_utf8_lossy(bytes).trim_end()))
}
