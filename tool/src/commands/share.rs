//! `fingertip share`: owns the bus for any number of clients, one of which commands.
//!
//! A thread for each client passes its instruction packets on, one at a time, and returns the answers to that client
//! alone. The first client that writes commands until it leaves. Others read; once one of them writes goal 0 or torque
//! off to a finger of the commander, the commander writes no more, and its other fingers are stopped when it leaves.
//! Packets of the commander, and writes, go before reads of others: they wait for one exchange at most.

use super::{Interrupt, aside, say, stop};
use crate::client::{self, ID_MAX, Reach};
use crate::{Client, Error, table};
use fingertip::link::packet::{BROADCAST, Event, HEADER, Packet, Receiver, StatusError, instruction};
use fingertip::shipped::address;
use serde_json::json;
use std::collections::{BTreeMap, BTreeSet};
use std::io::{Read as _, Write as _};
use std::net::{Shutdown, SocketAddr, TcpListener, TcpStream};
use std::ops::RangeInclusive;
use std::sync::mpsc::{Sender as Outbox, channel};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::thread::ThreadId;
use std::time::{Duration, Instant};

const READS: [u8; 6] = [
    instruction::PING,
    instruction::READ,
    instruction::SYNC_READ,
    instruction::FAST_SYNC_READ,
    instruction::BULK_READ,
    instruction::FAST_BULK_READ,
];
/// Registers to which every client may write 0, to stop a finger.
const STOPS: [u16; 5] =
    [address::TORQUE_ENABLE, address::MEASURE, address::GOAL_FORCE_MN, address::SHORT_GOAL_MN, address::MIRROR_GOAL_MN];
/// Reason for a stop during which the bus watchdogs are not fed.
const SILENT: &str = "its client is silent";
const LEFT: &str = "its client left";
/// Longest release of a finger whose client left, s of the controller's clock. Other clients wait that long.
const RELEASE_S: f64 = 0.5;
/// Longest wait for a client that does not take its answers.
const SLOW: Duration = Duration::from_secs(1);
/// Average time between two repeated tries to stop a finger. The end of `share` takes two of them.
const RETRY: Duration = Duration::from_secs(1);
/// More bytes than any packet has: without a packet in them they are dropped.
const JUNK: usize = 4096;
/// Time after which a waiting packet checks again if it may go.
const YIELD: Duration = Duration::from_micros(200);
/// A read that has waited for this many time-outs of the bus (ten times `--timeout-ms`) is dropped: its client has given
/// up, and would take the answer for that of its next packet.
const STALE: u32 = 30;
/// Packets that wait for the bus, oldest first: instant of arrival, thread, and true for an urgent packet.
static WAITING: Mutex<Vec<(Instant, ThreadId, bool)>> = Mutex::new(Vec::new());

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

/// The bus, and the clients that sent a packet on it.
struct Bus {
    client: Client,
    connections: BTreeMap<SocketAddr, Connection>,
    answered: BTreeSet<u8>,
    /// Fingers that got goal 0 and are neither seen idle yet nor commanded again: why, and when the next try is due, if not
    /// at once.
    ending: BTreeMap<u8, (&'static str, Option<Instant>)>,
    urgent: bool,
}

#[derive(Default)]
struct Connection {
    /// IDs that it wrote to: they are stopped once it leaves or is silent, except those of the next commander.
    ids: BTreeSet<u8>,
    heard: Option<Instant>,
    /// Instant at which its silence is judged again; none before the first time.
    judged: Option<Instant>,
    /// True once another client stopped one of its fingers: it writes no more.
    stopped: bool,
}

/// Serves until Ctrl-C, then stops what is still commanded.
pub fn run(args: &Args, reach: &Reach, json: bool) -> Result<(), Error> {
    let interrupt = Interrupt::catch()?;
    let mut client = Client::open(reach)?;
    // An unanswered packet takes two thirds, half of that for a late answer: the next one is still answered in time.
    client.timeout = Duration::from_millis(reach.timeout_ms.div_ceil(3));
    let cannot = |why| Error::Other(format!("cannot listen at {}: {why}", args.listen));
    let listener = TcpListener::bind(args.listen).map_err(cannot)?;
    let address = listener.local_addr().map_err(cannot)?;
    if json {
        say(json!({ "port": client.port, "address": format!("tcp:{address}") }));
    } else {
        say(format_args!("shares {} at tcp:{address}; Ctrl-C ends it", client.port));
        say(format_args!("next, in other terminals: fingertip --port tcp:{address} view"));
    }
    let bus = Arc::new(Mutex::new(Bus {
        client,
        connections: BTreeMap::new(),
        answered: BTreeSet::new(),
        ending: BTreeMap::new(),
        urgent: false,
    }));
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
        // One try at a time: an absent one takes a time-out, and packets of clients go between them.
        let mut free = turn(&bus, false);
        free.end_commands(None);
        ended = free.due().map_or(Ok(()), |id| free.end(id));
        drop(free);
        if let Ok(why) = losses.recv_timeout(super::INTERRUPT_EVERY) {
            ended = Err(why);
        }
    }
    let mut bus = turn(&bus, true);
    // All fingers get goal 0: while an absent one is waited for, the watchdogs of the others shall not trip.
    bus.client.feeds = bus.ending.values().all(|(why, _)| *why != SILENT);
    for from in bus.connections.keys().copied().collect::<Vec<_>>() {
        bus.end_command(from, "`fingertip share` ends");
    }
    let (until, mut line) = (Instant::now() + 2 * RETRY, Ok(()));
    while line.is_ok() && !bus.ending.is_empty() && Instant::now() < until {
        let ids: Vec<u8> = bus.ending.keys().copied().collect();
        line = ids.into_iter().try_for_each(|id| bus.end(id));
    }
    if !bus.ending.is_empty() {
        let ids = bus.ending.keys().map(u8::to_string).collect::<Vec<_>>().join(", ");
        let why = ended.and(line).err().map_or(String::new(), |why| format!("{why}; "));
        ended = Err(format!("{why}could not stop ID {ids}: `fingertip stop` does once they answer").into());
    }
    // Until the process exits, no client may move what was stopped.
    std::mem::forget(bus);
    ended
}

fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Waits for the bus. Urgent packets go before reads of clients that do not command; but once a read has waited for a
/// time-out, it goes after the next urgent packet. Otherwise the oldest packet goes first.
fn turn(bus: &Mutex<Bus>, urgent: bool) -> MutexGuard<'_, Bus> {
    let own = (Instant::now(), std::thread::current().id(), urgent);
    lock(&WAITING).push(own);
    loop {
        let mut free = lock(bus);
        let rank = |(since, _, urgent): &(Instant, ThreadId, bool)| match urgent {
            false if free.urgent && since.elapsed() > free.client.timeout => 0,
            true => 1,
            false => 2,
        };
        let mut waiting = lock(&WAITING);
        if waiting.iter().min_by_key(|one| rank(one)) == Some(&own) {
            waiting.retain(|one| *one != own);
            free.urgent = urgent;
            return free;
        }
        drop((waiting, free));
        std::thread::sleep(YIELD);
    }
}

/// Serves one client until it leaves.
fn converse(mut stream: TcpStream, bus: &Mutex<Bus>, lost: &Outbox<Error>) {
    let Ok(from) = stream.peer_addr() else { return };
    let _ = stream.set_nodelay(true).and_then(|()| stream.set_write_timeout(Some(SLOW)));
    let (mut receiver, mut raw, mut buffer) = (Receiver::new(), Vec::new(), [0; JUNK]);
    // `gone` is true once an answer could not be delivered. Of the packets received before, only stops are passed then.
    let (mut commands, mut gone) = (false, false);
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
            let bytes = std::mem::take(&mut raw).split_off(begin);
            let packet = receiver.packet();
            if packet.instruction == instruction::STATUS || gone && !is_stop(&packet, &parts(&packet)) {
                continue;
            }
            let (reads, came) = (READS.contains(&packet.instruction), Instant::now());
            let mut free = turn(bus, commands || !reads);
            if reads && came.elapsed() > STALE * free.client.timeout {
                continue;
            }
            let answer = free.pass(from, &packet, &bytes);
            commands = free.commander() == Some(from);
            drop(free);
            match answer {
                Ok(answer) if stream.write_all(&answer).is_ok() => {}
                Ok(_) => {
                    gone = true;
                    // The bytes received so far can still be read; later ones are refused.
                    let _ = stream.shutdown(Shutdown::Both);
                }
                Err(why) => {
                    let _ = lost.send(why);
                    break 'client;
                }
            }
        }
    }
    let mut bus = turn(bus, commands);
    bus.end_command(from, LEFT);
    bus.connections.remove(&from);
}

impl Bus {
    /// Ends the command of clients that are silent, except the one whose packet is next.
    fn end_commands(&mut self, next: Option<SocketAddr>) {
        let others = self.connections.iter().filter(|(from, one)| Some(**from) != next && !one.ids.is_empty());
        for from in others.map(|(from, _)| *from).collect::<Vec<_>>() {
            if self.is_silent(from) {
                self.end_command(from, SILENT);
            }
        }
    }

    /// True once a client has been silent for longer than the bus watchdog of one of its fingers, which reads of others feed.
    /// Asks the fingers: it does not matter who set the watchdog, nor by which instruction.
    fn is_silent(&mut self, from: SocketAddr) -> bool {
        let Connection { ids, heard: Some(heard), judged, .. } = &self.connections[&from] else { return false };
        let from_then = *heard + self.client.timeout + Duration::from_secs_f64(RELEASE_S);
        if judged.unwrap_or(from_then) > Instant::now() {
            return false;
        }
        if judged.is_none() && !ids.is_subset(&self.answered) {
            // A client that writes in group packets: absent IDs would take a time-out each.
            self.answered.extend(self.client.ping_all().unwrap_or_default().iter().map(|pong| pong.id));
        }
        let steps = ids.intersection(&self.answered).filter_map(|id| {
            self.client.id = *id;
            self.client.number(address::BUS_WATCHDOG).ok().filter(|steps| *steps > 0)
        });
        // Without a watchdog it may be set yet.
        let within = |steps: i64| Duration::from_millis((stop::WATCHDOG_UNIT_MS * steps) as u64);
        let next = steps.min().map_or(Instant::now() + RETRY, |steps| from_then + within(steps));
        self.connections.entry(from).or_default().judged = Some(next);
        next <= Instant::now()
    }

    /// Passes a client's packet on, where it may, and returns the answers. A finger is stopped before its next commander's
    /// first write.
    fn pass(&mut self, from: SocketAddr, packet: &Packet<'_>, raw: &[u8]) -> Result<Vec<u8>, Error> {
        self.end_commands(Some(from));
        let (reads, parts) = (READS.contains(&packet.instruction), parts(packet));
        let (stops, commander) = (is_stop(packet, &parts), self.commander());
        if !reads && !stops && commander.is_none_or(|other| other == from) {
            self.end(packet.id)?;
        }
        let mut ids = parts.iter().flat_map(|part| part.ids.clone());
        let own = self.connections.entry(from).or_default();
        (own.heard, own.judged) = (Some(Instant::now()), None);
        if commander != Some(from) && stops {
            // A stopped client stops its own fingers before it exits, torque off last. That takes the command from nobody;
            // what it stops later does.
            let cleans = ids.clone().all(|id| own.ids.contains(&id));
            let last = |part: &Part<'_>, id: &u8| part.address == address::TORQUE_ENABLE && part.ids.contains(id);
            own.ids.retain(|id| !parts.iter().any(|part| last(part, id)));
            if let Some(other) = commander.and_then(|other| self.connections.get_mut(&other)) {
                other.stopped = !cleans && ids.any(|id| other.ids.contains(&id));
            }
        } else if !reads {
            let stopped = own.stopped || commander.is_some_and(|other| other != from);
            // The bus speed is fixed, and a finger without answers is not seen to stop.
            let fixed = |part: &Part<'_>| {
                let level = part.byte(address::STATUS_RETURN_LEVEL);
                part.byte(address::BAUD_RATE).is_some()
                    || level.is_some_and(|level| i64::from(level) != stop::ALL_ANSWERED)
            };
            // A write to no device feeds the watchdogs. A stopped client keeps its other fingers alive by it.
            let refused = if parts.is_empty() { own.ids.is_empty() } else { stopped || parts.iter().any(fixed) };
            // All of these but the one that keeps ID and speed change the speed.
            let resets = packet.instruction == instruction::FACTORY_RESET && packet.params != [2];
            if refused || resets {
                let refusal = client::packet(packet.id, instruction::STATUS, &[StatusError::Access as u8]);
                return Ok(if packet.id == BROADCAST { Vec::new() } else { refusal.to_vec() });
            }
            // From now on this client's end stops these fingers.
            self.ending.retain(|id, _| !ids.clone().any(|own| own == *id));
            own.ids.extend(ids);
        }
        let answer = self.client.pass(raw, Some(packet.id).filter(|id| *id != BROADCAST), answers(packet))?;
        // Byte 8 of an answer is its error, whose top bit is the alert. A packet to all IDs is no finger's.
        let Some(error) = answer.get(8).filter(|_| packet.id != BROADCAST) else { return Ok(answer) };
        let mut id = packet.id;
        // Once a write of the ID is accepted, only the new ID answers.
        if packet.instruction == instruction::WRITE
            && error & 0x7F == 0
            && let Some(new) = parts.iter().find_map(|part| part.byte(address::ID))
        {
            for one in self.connections.values_mut() {
                one.ids = one.ids.iter().map(|known| if *known == id { new } else { *known }).collect();
            }
            self.answered.remove(&id);
            id = new;
        }
        self.answered.insert(id);
        // It can be stopped now, and reads would feed its watchdog.
        if let Some((_, due)) = self.ending.get_mut(&id) {
            *due = None;
        }
        Ok(answer)
    }

    /// The client that may write: it wrote and was not stopped.
    fn commander(&self) -> Option<SocketAddr> {
        self.connections.iter().find(|(_, one)| !one.stopped && !one.ids.is_empty()).map(|(from, _)| *from)
    }

    /// Ends the command of a client: its fingers get goal 0 at once, and are to be stopped.
    fn end_command(&mut self, from: SocketAddr, why: &'static str) {
        let ids = self.connections.get_mut(&from).map(|one| std::mem::take(&mut one.ids)).unwrap_or_default();
        let next = self.commander().map(|next| &self.connections[&next].ids);
        let mut ids: Vec<u8> = ids.into_iter().filter(|id| next.is_none_or(|next| !next.contains(id))).collect();
        // A port that is lost ends `share` at the next try.
        let _ = self.client.set_each(&ids, address::GOAL_FORCE_MN, 0);
        // A client that wrote by broadcast: absent IDs would take a time-out each.
        if ids.len() > client::LISTED {
            self.answered.extend(self.client.ping_all().unwrap_or_default().iter().map(|pong| pong.id));
            ids.retain(|id| self.answered.contains(id));
        }
        self.ending.extend(ids.into_iter().map(|id| (id, (why, None))));
    }

    /// The finger to be stopped whose next try is due first.
    fn due(&self) -> Option<u8> {
        let due = self.ending.iter().filter(|(_, (_, due))| due.is_none_or(|due| due <= Instant::now()));
        due.min_by_key(|(_, (_, due))| *due).map(|(id, _)| *id)
    }

    /// Tries to stop a finger whose client's command ended; does nothing with another one. Fails once the port is lost.
    fn end(&mut self, id: u8) -> Result<(), Error> {
        let Some((why, due)) = self.ending.get(&id).copied() else { return Ok(()) };
        // Keep-alive packets reach all fingers. While this one may be absent, they are sent for a commander just heard.
        let heard = self.commander().and_then(|from| self.connections[&from].heard);
        let client = &mut self.client;
        let fed = client.feeds;
        client.feeds |= heard.is_some_and(|heard| heard.elapsed().as_secs_f64() < RELEASE_S);
        client.id = id;
        let stopped = client.ping().and_then(|pong| {
            client.feeds = why != SILENT;
            stop(client, pong.is_fingertip())
        });
        client.feeds = fed;
        let Err(error) = stopped else {
            self.ending.remove(&id);
            if stopped.is_ok_and(|driven| driven || due.is_some()) {
                aside(format_args!("ID {id} was stopped: {why}"));
            }
            return Ok(());
        };
        if due.is_none() {
            aside(format_args!("ID {id} is not stopped yet ({why}): {error}"));
        }
        self.ending.insert(id, (why, Some(Instant::now() + RETRY * self.ending.len() as u32)));
        if matches!(error, Error::Port(..)) { Err(error) } else { Ok(()) }
    }
}

/// Stops a device that is driven. Returns whether it was.
fn stop(client: &mut Client, is_fingertip: bool) -> Result<bool, Error> {
    if is_fingertip {
        // The level before decides whether this write is answered.
        let _ = client.set(address::STATUS_RETURN_LEVEL, stop::ALL_ANSWERED);
    }
    let drives = client.again(|client| client.number(address::TORQUE_ENABLE))? != 0;
    if !is_fingertip {
        if drives {
            client.again(|client| client.set(address::TORQUE_ENABLE, 0))?;
        }
        return Ok(drives);
    }
    if !drives && stop::is_idle(client.again(|client| client.number(address::PRESENT_MODE))?) {
        return Ok(false);
    }
    match stop::release(RELEASE_S, client) {
        // The next try releases it: with torque off, friction would keep the force.
        Err(why) if why.is_noise() => Err(why),
        _ => stop::halt(client).map(|()| true),
    }
}

/// True if a packet with these parts only stops fingers.
fn is_stop(packet: &Packet<'_>, parts: &[Part<'_>]) -> bool {
    let stops = |part: &Part<'_>| {
        let register = table::register_at(part.address).filter(|register| STOPS.contains(&register.address));
        register.is_some_and(|register| table::encode(register, 0) == part.data)
    };
    packet.instruction != instruction::REG_WRITE && !parts.is_empty() && parts.iter().all(stops)
}

/// Part of a packet for one device, or for all.
struct Part<'a> {
    ids: RangeInclusive<u8>,
    /// Address of the first register written, and the data. A packet that writes nothing has no data.
    address: u16,
    data: &'a [u8],
}

impl Part<'_> {
    fn byte(&self, address: u16) -> Option<u8> {
        self.data.get(usize::from(address.checked_sub(self.address)?)).copied()
    }
}

fn parts<'a>(packet: &Packet<'a>) -> Vec<Part<'a>> {
    let Packet { id, instruction, params, .. } = *packet;
    let ids = |id| if id == BROADCAST { 0..=ID_MAX } else { id..=id };
    let word = |low: &u8, high: &u8| u16::from_le_bytes([*low, *high]);
    match (instruction, params) {
        (instruction::WRITE | instruction::REG_WRITE, [low, high, data @ ..]) => {
            vec![Part { ids: ids(id), address: word(low, high), data }]
        }
        (instruction::SYNC_WRITE, [low, high, short, long, all @ ..]) => {
            let each = all.chunks(1 + usize::from(word(short, long)));
            each.map(|one| Part { ids: ids(one[0]), address: word(low, high), data: &one[1..] }).collect()
        }
        (instruction::BULK_WRITE, mut rest) => {
            let mut parts = Vec::new();
            while let [id, low, high, short, long, all @ ..] = rest {
                let (data, behind) = all.split_at(all.len().min(usize::from(word(short, long))));
                parts.push(Part { ids: ids(*id), address: word(low, high), data });
                rest = behind;
            }
            parts
        }
        _ => vec![Part { ids: ids(id), address: 0, data: &[] }],
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
