//! `fingertip share`: owns the bus for any number of clients, one of which commands.
//!
//! A thread for each client passes its instruction packets on, one at a time, and returns the answers to that client
//! alone. The first client that writes commands until it leaves. Others read; where one of them writes goal 0 or torque
//! off, it stops the finger and takes the command from that client, whose other fingers are stopped once it leaves.
//! Packets of the commander, and writes, go before reads of others: they wait for one exchange at most.

use super::{Interrupt, aside, say, stop};
use crate::client::Reach;
use crate::{Client, Error};
use fingertip::link::Reply;
use fingertip::link::packet::{BROADCAST, Event, HEADER, Packet, Receiver, Sender, StatusError, instruction};
use fingertip::shipped::address;
use std::collections::{BTreeMap, BTreeSet};
use std::io::{Read as _, Write as _};
use std::net::{SocketAddr, TcpListener, TcpStream};
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::mpsc::{Sender as Outbox, channel};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

/// Instructions that change nothing.
const READS: [u8; 6] = [
    instruction::PING,
    instruction::READ,
    instruction::SYNC_READ,
    instruction::FAST_SYNC_READ,
    instruction::BULK_READ,
    instruction::FAST_BULK_READ,
];
/// Registers to which every client may write 0, to stop a finger.
const STOPS: [u16; 2] = [address::TORQUE_ENABLE, address::GOAL_FORCE_MN];
/// Longest release of a finger whose client left, s of the controller's clock. Other clients wait that long.
const RELEASE_S: f64 = 0.5;
/// Longest wait for a client that does not take its answers.
const SLOW: Duration = Duration::from_secs(1);
/// More bytes than any packet has: without a packet in them they are dropped.
const JUNK: usize = 4096;
/// Time between two looks of a read at whether it may go.
const YIELD: Duration = Duration::from_millis(1);
/// Packets that wait and go before reads.
static URGENT: AtomicUsize = AtomicUsize::new(0);

#[derive(Debug, clap::Args)]
#[command(after_help = "Examples:\n  \
    fingertip --port /dev/ttyUSB0 share\n  \
    fingertip --port tcp:127.0.0.1:7777 press 1     (in a second terminal)\n  \
    fingertip --port tcp:127.0.0.1:7777 view        (in a third)\n  \
    socat pty,raw,echo=0,link=/tmp/bus tcp:127.0.0.1:7777    (for clients that know only serial ports)")]
pub struct Args {
    /// Address and TCP port for the clients. Who can connect can move the finger: keep it on this machine
    #[arg(long, value_name = "ADDRESS:PORT", default_value = "127.0.0.1:7777")]
    listen: SocketAddr,
}

/// The bus, and the client that commands on it.
struct Bus {
    client: Client,
    commanders: BTreeMap<SocketAddr, Commander>,
}

/// A client that wrote.
struct Commander {
    /// Fingers that it wrote to, and nobody else after it: they are stopped once it leaves or is silent.
    ids: BTreeSet<u8>,
    /// Bus watchdogs that it set, by ID.
    watchdogs: BTreeMap<u8, Duration>,
    /// Instant of its last packet.
    heard: Instant,
    /// True once another client stopped one of its fingers: it writes no more.
    stopped: bool,
}

/// Serves until Ctrl-C, then stops what is still commanded.
pub fn run(args: &Args, reach: &Reach) -> Result<(), Error> {
    let interrupt = Interrupt::catch()?;
    let mut client = Client::open(reach)?;
    // An unanswered packet takes two thirds, half of that for a late answer: the next one is still answered in time.
    client.timeout = Duration::from_millis(reach.timeout_ms.div_ceil(3));
    let cannot = |why| Error::Other(format!("cannot listen at {}: {why}", args.listen));
    let listener = TcpListener::bind(args.listen).map_err(cannot)?;
    let address = listener.local_addr().map_err(cannot)?;
    say(format_args!("shares {} at tcp:{address}; Ctrl-C ends it", client.port));
    say(format_args!("next, in other terminals: fingertip --port tcp:{address} view"));
    let bus = Arc::new(Mutex::new(Bus { client, commanders: BTreeMap::new() }));
    let (lost, losses) = channel();
    let shared = Arc::clone(&bus);
    std::thread::spawn(move || {
        for stream in listener.incoming() {
            // Too many open files, for example: some will be closed.
            let Ok(stream) = stream else {
                std::thread::sleep(SLOW);
                continue;
            };
            let (bus, lost) = (Arc::clone(&shared), lost.clone());
            std::thread::spawn(move || converse(stream, &bus, &lost));
        }
    });
    let mut ended = Ok(());
    while !interrupt.came() && ended.is_ok() {
        if let Ok(why) = losses.recv_timeout(super::INTERRUPT_EVERY) {
            ended = Err(why);
        }
    }
    let mut bus = lock(&bus);
    for from in bus.commanders.keys().copied().collect::<Vec<_>>() {
        bus.end_command(from, "`fingertip share` ends");
    }
    ended
}

fn lock(bus: &Mutex<Bus>) -> MutexGuard<'_, Bus> {
    bus.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Waits for the bus; a read of a client that does not command waits for all that is urgent.
fn turn(bus: &Mutex<Bus>, urgent: bool) -> MutexGuard<'_, Bus> {
    URGENT.fetch_add(usize::from(urgent), Ordering::SeqCst);
    loop {
        let free = lock(bus);
        if urgent || URGENT.load(Ordering::SeqCst) == 0 {
            URGENT.fetch_sub(usize::from(urgent), Ordering::SeqCst);
            return free;
        }
        drop(free);
        std::thread::sleep(YIELD);
    }
}

/// Serves one client until it leaves.
fn converse(mut stream: TcpStream, bus: &Mutex<Bus>, lost: &Outbox<Error>) {
    let Ok(from) = stream.peer_addr() else { return };
    let _ = stream.set_nodelay(true).and_then(|()| stream.set_write_timeout(Some(SLOW)));
    let (mut receiver, mut raw, mut buffer) = (Receiver::new(), Vec::new(), [0; JUNK]);
    let mut commands = false;
    'client: while let Ok(count @ 1..) = stream.read(&mut buffer) {
        for byte in &buffer[..count] {
            raw.push(*byte);
            if receiver.push(*byte) != Some(Event::Packet) {
                if raw.len() > 2 * JUNK {
                    raw.drain(..JUNK);
                }
                continue;
            }
            // Stuffing keeps the header out of a packet's inside, but not out of its last bytes, the check sum.
            let inside = &raw[..raw.len() - 2];
            let begin = inside.windows(HEADER.len()).rposition(|window| window == HEADER).unwrap_or_default();
            let packet = receiver.packet();
            let mut free = turn(bus, commands || !READS.contains(&packet.instruction));
            let answer = free.pass(from, &packet, &raw[begin..]);
            commands = free.commander() == Some(from);
            drop(free);
            raw.clear();
            match answer {
                Ok(answer) if stream.write_all(&answer).is_ok() => {}
                Ok(_) => break 'client,
                Err(why) => {
                    let _ = lost.send(why);
                    break 'client;
                }
            }
        }
    }
    let mut bus = turn(bus, commands);
    bus.end_command(from, "its client left");
    bus.commanders.remove(&from);
}

impl Bus {
    /// Passes a client's packet on, where it may, and returns the answers.
    fn pass(&mut self, from: SocketAddr, packet: &Packet<'_>, raw: &[u8]) -> Result<Vec<u8>, Error> {
        if packet.instruction == instruction::STATUS {
            return Ok(Vec::new());
        }
        // Reads of others would feed the watchdogs of a silent client.
        let slack = self.client.timeout;
        let silent = |(other, commander): (&SocketAddr, &Commander)| {
            let most = commander.watchdogs.values().min();
            (*other != from && most.is_some_and(|most| commander.heard.elapsed() > *most + slack)).then_some(*other)
        };
        for other in self.commanders.iter().filter_map(silent).collect::<Vec<_>>() {
            self.end_command(other, "its client is silent");
        }
        let commander = self.commander();
        if commander != Some(from) && is_stop(packet) {
            if let Some(stopped) = commander.and_then(|other| self.commanders.get_mut(&other)) {
                stopped.stopped = true;
            }
        } else if !READS.contains(&packet.instruction) {
            let stopped = self.commanders.get(&from).is_some_and(|commander| commander.stopped);
            if stopped || commander.is_some_and(|other| other != from) || covers(packet, address::BAUD_RATE) {
                return Ok(if packet.id == BROADCAST { Vec::new() } else { refusal(packet.id) });
            }
            let ids = targets(packet);
            self.commanders.values_mut().for_each(|other| other.ids.retain(|id| !ids.contains(id)));
            let new = || Commander {
                ids: BTreeSet::new(),
                watchdogs: BTreeMap::new(),
                heard: Instant::now(),
                stopped: false,
            };
            let commander = self.commanders.entry(from).or_insert_with(new);
            commander.ids.extend(ids);
            if covers(packet, address::BUS_WATCHDOG) {
                commander.watchdogs.remove(&packet.id);
                let set = packet.params.get(2).filter(|steps| **steps > 0);
                let set = set.map(|steps| (packet.id, Duration::from_millis(20 * u64::from(*steps))));
                commander.watchdogs.extend(set);
            }
        }
        if let Some(commander) = self.commanders.get_mut(&from) {
            commander.heard = Instant::now();
        }
        self.client.pass(raw, Some(packet.id).filter(|id| *id != BROADCAST), answers(packet))
    }

    /// The client that may write.
    fn commander(&self) -> Option<SocketAddr> {
        self.commanders.iter().find(|(_, commander)| !commander.stopped).map(|(from, _)| *from)
    }

    /// Ends the command of a client: what it left with torque on is released and stopped.
    fn end_command(&mut self, from: SocketAddr, why: &str) {
        let Some(commander) = self.commanders.get_mut(&from) else { return };
        let ids = std::mem::take(&mut commander.ids);
        commander.watchdogs.clear();
        if !commander.stopped {
            self.commanders.remove(&from);
        }
        let own = self.client.id;
        let all = ids.contains(&BROADCAST);
        let found = if all { self.client.ping_all().unwrap_or_default() } else { Vec::new() };
        for id in found.iter().map(|pong| pong.id).chain(ids).filter(|id| *id != BROADCAST) {
            self.client.id = id;
            match stop(&mut self.client) {
                Ok(true) => aside(format_args!("ID {id} was stopped: {why}")),
                Ok(false) => {}
                Err(error) => aside(format_args!("stopping ID {id} failed ({why}): {error}")),
            }
        }
        self.client.id = own;
    }
}

/// Stops a device that is driven. Returns whether it was.
fn stop(client: &mut Client) -> Result<bool, Error> {
    if client.again(Client::ping)?.is_fingertip() {
        if stop::is_idle(client.again(|client| client.number(address::PRESENT_MODE))?) {
            return Ok(false);
        }
        let released = stop::release(RELEASE_S, client);
        stop::halt(client)?;
        return released.map(|_| true);
    }
    let drives = client.again(|client| client.number(address::TORQUE_ENABLE))? != 0;
    if drives {
        client.again(|client| client.set(address::TORQUE_ENABLE, 0))?;
    }
    Ok(drives)
}

/// True if a packet only stops fingers.
fn is_stop(packet: &Packet<'_>) -> bool {
    let zero = |data: &[u8]| !data.is_empty() && data.iter().all(|byte| *byte == 0);
    let stops = STOPS.iter().any(|register| packet.params.starts_with(&register.to_le_bytes()));
    stops
        && match (packet.instruction, packet.params) {
            (instruction::WRITE, [_, _, data @ ..]) => zero(data),
            // An ID and its data for each finger.
            (instruction::SYNC_WRITE, [_, _, low, high, all @ ..]) => {
                let length = usize::from(u16::from_le_bytes([*low, *high]));
                !all.is_empty() && all.chunks(1 + length).all(|one| zero(&one[1..]))
            }
            _ => false,
        }
}

/// True if a packet writes a register from its first byte on.
fn covers(packet: &Packet<'_>, register: u16) -> bool {
    packet.instruction == instruction::WRITE && packet.params.starts_with(&register.to_le_bytes())
}

fn targets(packet: &Packet<'_>) -> Vec<u8> {
    let Packet { id, instruction, params, .. } = *packet;
    let entry =
        |at: usize| params.get(at..at + 2).map_or(0, |length| usize::from(u16::from_le_bytes([length[0], length[1]])));
    match instruction {
        instruction::SYNC_WRITE => params.iter().skip(4).step_by(1 + entry(2)).copied().collect(),
        instruction::BULK_WRITE => {
            let places = std::iter::successors(Some(0), |at| Some(at + 5 + entry(at + 3)));
            places.map_while(|at| params.get(at).copied()).collect()
        }
        _ => vec![id],
    }
}

fn answers(packet: &Packet<'_>) -> usize {
    match packet.instruction {
        instruction::SYNC_READ => packet.params.len().saturating_sub(4),
        instruction::BULK_READ => packet.params.len() / 5,
        instruction::FAST_SYNC_READ | instruction::FAST_BULK_READ => 1,
        instruction::PING if packet.id == BROADCAST => usize::MAX,
        _ => usize::from(packet.id != BROADCAST),
    }
}

/// The answer to a write while another client commands.
fn refusal(id: u8) -> Vec<u8> {
    let mut reply = Reply::new();
    Sender::status(&mut reply, id, Some(StatusError::Access), false).finish();
    reply.to_vec()
}
