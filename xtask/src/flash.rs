//! Writing an image to a board: the firmware, and for the first hour with a board the image that checks a bare
//! NUCLEO-F446RE, or the emulated one, and its judge.

use crate::console::Console;
use crate::host::{self, Program};
use crate::image::{self, Image};
use crate::option_bytes::{self, PAUSE_MS, Probe};
use crate::{sim, timing};
use anyhow::{Context, Result, bail, ensure};
use clap::ValueEnum;
use std::io::{BufRead, BufReader, Read, Write};
use std::net::{TcpListener, TcpStream};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::time::Duration;
use std::{iter, thread};

/// The part on the board, in probe-rs's words.
const CHIP: &str = "STM32F446RETx";

#[derive(clap::Args)]
#[command(after_help = "Examples:\n  cargo xtask flash\n  cargo xtask flash --probe 0483:374b")]
pub struct Args {
    /// Which probe, where there are several: VID:PID or VID:PID:serial, as `probe-rs list` shows it
    #[arg(long, value_name = "PROBE")]
    probe: Option<String>,
}

/// Builds the flash image, prints its SHA-256, sees to the option bytes, writes and verifies it, and starts it.
pub fn run(args: &Args, console: &mut Console) -> Result<()> {
    need_probe_rs()?;
    let image = image::firmware(console)?;
    console.print(&image.summary());
    put(&image, args.probe.as_deref(), console)?;
    console.say("The board runs the image.");
    Ok(())
}

/// Looks for probe-rs before a build, so that nobody waits for an image that cannot be written.
pub fn need_probe_rs() -> Result<()> {
    if host::find_program("probe-rs").is_some() {
        return Ok(());
    }
    bail!(
        "probe-rs writes the image to the board, and is not in PATH.\n\
         Install it (`cargo install probe-rs-tools --locked`, or a package from https://probe.rs), or let any \
         other tool write the .bin file beside the image that `cargo xtask build` names, to the address printed there."
    );
}

/// Sees to the option bytes, writes and verifies an image, and starts it.
pub fn put(image: &Image, probe: Option<&str>, console: &mut Console) -> Result<()> {
    let command = |subcommand| {
        let mut command = Command::new("probe-rs");
        command.args([subcommand, "--chip", CHIP]).args(probe.iter().flat_map(|probe| ["--probe", probe]));
        command
    };
    // First, because this refuses another device.
    let mut session = Session::open(command("gdb"))?;
    if let Some(options) = option_bytes::check(&mut session)? {
        console.say(&format!("Programming brown-out level 3 into the option bytes ({options:#010x} before)."));
        option_bytes::program(&mut session, options)?;
    }
    drop(session);
    let mut download = command("download");
    download.args(["--verify", "--binary-format", "bin", "--base-address"]);
    console.run(download.arg(format!("{:#x}", image.base)).arg(&image.bin))?;
    console.run(&mut command("reset"))
}

// One session with a board: `probe-rs gdb`, spoken to in GDB's remote protocol.
//
// `probe-rs read` lets a halted core run when it ends, and other commands when they begin or end, as the version has
// it: no sequence of commands keeps the core halted. The GDB server does until it is killed, and needs no GDB. Its
// packet `M` writes bytes, but the option keys take words only (RM0390 3.8.3): so the core itself stores each word, by one
// stepped instruction in RAM. The library of probe-rs would do both, but adds minutes to the build of this program.

/// Any word of RAM. The reset at the end of the session frees it.
const RAM: u32 = 0x2000_0000;
/// `str r1, [r0]`, its bytes in order.
const STORE: &str = "0160";

/// The server; the core is left halted, whatever ends it.
struct Server(Child);

impl Drop for Server {
    fn drop(&mut self) {
        // It ended by itself where it cannot be killed.
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}

pub struct Session {
    stream: BufReader<TcpStream>,
    _server: Option<Server>,
}

impl Session {
    /// Starts `probe-rs gdb` with the flags that name the probe, and connects to it.
    pub fn open(mut command: Command) -> Result<Self> {
        let address = TcpListener::bind("127.0.0.1:0")?.local_addr()?;
        command.args(["--gdb-connection-string", &address.to_string()]);
        let mut server = Server(command.stdin(Stdio::null()).stdout(Stdio::null()).spawn()?);
        // 20 s.
        for _ in 0..2000 {
            // Before the server listens, a connection can come about that is its own other end.
            match TcpStream::connect(address) {
                Ok(stream) if stream.local_addr()? != address => return Self::over(stream, Some(server)),
                _ => {}
            }
            if let Some(status) = server.0.try_wait()? {
                bail!("probe-rs gdb: {status}");
            }
            thread::sleep(Duration::from_millis(10));
        }
        bail!("probe-rs gdb does not listen on {address}")
    }

    fn over(stream: TcpStream, server: Option<Server>) -> Result<Self> {
        stream.set_read_timeout(Some(Duration::from_secs(5)))?;
        Ok(Self { stream: BufReader::new(stream), _server: server })
    }

    fn ask(&mut self, request: &str) -> Result<String> {
        let sum = request.bytes().fold(0, u8::wrapping_add);
        write!(self.stream.get_mut(), "${request}#{sum:02x}")?;
        self.reply().with_context(|| format!("probe-rs gdb does not answer {request}"))
    }

    fn reply(&mut self) -> Result<String> {
        let mut packed = Vec::new();
        self.stream.read_until(b'$', &mut Vec::new())?;
        self.stream.read_until(b'#', &mut packed)?;
        ensure!(packed.pop() == Some(b'#'), "the connection is closed");
        self.stream.read_exact(&mut [0; 2])?;
        self.stream.get_mut().write_all(b"+")?;
        let (mut text, mut packed) = (String::new(), packed.into_iter());
        while let Some(byte) = packed.next() {
            match (byte, text.chars().last()) {
                // A run: n - 29 more of the same.
                (b'*', Some(last)) => {
                    let count = packed.next().unwrap_or_default().saturating_sub(29);
                    text.extend(iter::repeat_n(last, count.into()));
                }
                _ => text.push(byte.into()),
            }
        }
        Ok(text)
    }

    fn order(&mut self, request: &str) -> Result<()> {
        let reply = self.ask(request)?;
        ensure!(reply == "OK", "probe-rs gdb answers {request} with {reply:?}");
        Ok(())
    }
}

impl Probe for Session {
    fn read(&mut self, address: u32) -> Result<u32> {
        let reply = self.ask(&format!("m{address:x},4"))?;
        let word = u32::from_str_radix(&reply, 16).ok().filter(|_| reply.len() == 8);
        Ok(word.with_context(|| format!("probe-rs gdb reads {reply:?} at {address:#x}, not a word"))?.swap_bytes())
    }

    fn write(&mut self, address: u32, value: u32) -> Result<()> {
        self.order(&format!("M{RAM:x},2:{STORE}"))?;
        for (register, word) in [(0, address), (1, value), (15, RAM)] {
            self.order(&format!("P{register:x}={:08x}", word.swap_bytes()))?;
        }
        let stop = self.ask("vCont;s:1")?;
        ensure!(stop.starts_with(['S', 'T']), "probe-rs gdb answers a step with {stop:?}");
        Ok(())
    }

    fn reset_and_halt(&mut self) -> Result<()> {
        let hex: String = "reset halt".bytes().map(|byte| format!("{byte:02x}")).collect();
        let mut reply = self.ask(&format!("qRcmd,{hex}"))?;
        let mut said = String::new();
        while let Some(text) = reply.strip_prefix('O').filter(|text| *text != "K") {
            let bytes =
                text.as_bytes().chunks(2).filter_map(|pair| u8::from_str_radix(str::from_utf8(pair).ok()?, 16).ok());
            said.extend(bytes.map(char::from));
            reply = self.reply()?;
        }
        ensure!(said.contains("Target halted"), "probe-rs gdb: {}", said.trim());
        Ok(())
    }

    fn pause(&mut self) {
        thread::sleep(Duration::from_millis(PAUSE_MS));
    }
}

pub const BRINGUP: &str = "bringup";
/// Folder in which Linux names the ST-LINK's port.
const BY_ID: &str = "/dev/serial/by-id";
const ST_LINK: &str = "STLINK";

#[derive(clap::Args)]
#[command(after_help = "Examples:\n  cargo xtask bringup --json board.json\n  cargo xtask bringup --board virtual\n\n\
    docs/bringup.md goes on from there. `cargo xtask flash` puts the firmware back.")]
pub struct BringupArgs {
    /// A NUCLEO-F446RE with nothing attached, or the emulated board
    #[arg(long, value_enum, default_value_t = Board::Nucleo)]
    board: Board,
    /// Number of frames for which the rows are read back; a million on a NUCLEO, which takes 100 s, a thousand emulated
    #[arg(long)]
    frames: Option<u32>,
    /// Write the figures to this file, as JSON
    #[arg(long, value_name = "FILE")]
    json: Option<PathBuf>,
    /// The ST-LINK's serial port, where it is not found by its name
    #[arg(long, value_name = "PORT")]
    port: Option<PathBuf>,
    /// Which probe, where there are several, as `probe-rs list` shows it
    #[arg(long, value_name = "PROBE")]
    probe: Option<String>,
    /// Write nothing to the board: the image is on it already, copied to the NUCLEO's drive for example
    #[arg(long)]
    flashed: bool,
    /// Leave the kernels' estimates out: they take QEMU, and another image
    #[arg(long)]
    without_estimates: bool,
}

#[derive(Clone, Copy, PartialEq, Eq, ValueEnum)]
enum Board {
    /// The board on the desk
    Nucleo,
    /// The emulated board
    Virtual,
}

/// Builds the image, runs it and judges what it reports. This process ends as the judge does.
pub fn bringup(args: &BringupArgs, console: &mut Console) -> Result<()> {
    // First, as it takes no time: without a board there is no wait for a build.
    let port = (args.board == Board::Nucleo).then(|| args.port.clone().map_or_else(find_port, Ok)).transpose()?;
    if port.is_some() && !args.flashed {
        need_probe_rs()?;
    }
    let image = image::checking(BRINGUP, console)?;
    console.say(&image.summary());
    let estimates = if args.without_estimates { None } else { Some(estimates(console)?) };
    let mut command = match port {
        None => {
            let mut command = host::SCENE_BOARD.build(console)?;
            command.arg(BRINGUP).arg("--image").arg(std::path::absolute(&image.elf)?);
            command
        }
        Some(port) => {
            let mut command = Program { package: BRINGUP, name: "bringup-host", with: host::SHARED }.build(console)?;
            if !args.flashed {
                put(&image, args.probe.as_deref(), console)?;
            }
            command.arg("--port").arg(port).arg("--sha256").arg(image.sha256());
            command
        }
    };
    if let Some(frames) = args.frames {
        command.arg("--frames").arg(frames.to_string());
    }
    host::give_files(&mut command, [("--json", &args.json), ("--estimates", &estimates)])?;
    sim::start(&mut command)
}

/// The kernels' estimated cycles, with the flash's wait states, for the image's inputs: a file with a line each.
fn estimates(console: &mut Console) -> Result<PathBuf> {
    let folder = host::made("study")?;
    let [kept, full, file] = ["kept.bin", "few.bin", "few.txt"].map(|name| folder.join(name));
    let mut inputs = Program::tool("study").build(console)?;
    console.run(inputs.arg("few").arg(&kept).arg(&full))?;
    let study = image::build("study", "study", console)?;
    let (_, regions) = timing::measure(&study, Some(&full), console)?;
    let call = regions.first().map_or(0, |region| region.flash.median);
    let mut text = String::new();
    for region in &regions {
        text += &format!("{} {}\n", region.flash.median.saturating_sub(call), region.name);
    }
    host::write(&file, text)?;
    Ok(file)
}

fn find_port() -> Result<PathBuf> {
    let folder = Path::new(BY_ID);
    let names = folder.read_dir().into_iter().flatten().flatten().map(|entry| entry.path());
    let ports: Vec<_> = names.filter(|path| path.to_string_lossy().contains(ST_LINK)).collect();
    match &ports[..] {
        [port] => Ok(port.clone()),
        [] => bail!(
            "no ST-LINK in {BY_ID}: connect the NUCLEO by its USB cable, or name its port with --port.\n\
             Without a board, --board virtual runs the same image in the emulator."
        ),
        several => {
            let names = several.iter().map(|port| port.display().to_string()).collect::<Vec<_>>();
            bail!("{} ST-LINKs: name one with --port and --probe: {}", several.len(), names.join(", "))
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    use std::net::Shutdown;

    /// A session with a server that answers each request with the next of these packets, then no more.
    fn session(packets: &'static [&'static str]) -> (Session, thread::JoinHandle<Vec<String>>) {
        let listener = TcpListener::bind("127.0.0.1:0").expect("a port");
        let stream = TcpStream::connect(listener.local_addr().expect("its number")).expect("a connection");
        let server = thread::spawn(move || {
            let mut stream = BufReader::new(listener.accept().expect("a connection").0);
            let answer = |packets: &&str| {
                let mut request = Vec::new();
                stream.read_until(b'#', &mut request).expect("a request");
                stream.read_exact(&mut [0; 2]).expect("its sum");
                stream.get_mut().write_all(format!("+{packets}").as_bytes()).expect("an answer");
                String::from_utf8(request).expect("text").trim_start_matches('+').into()
            };
            let requests = packets.iter().map(answer).collect();
            stream.get_ref().shutdown(Shutdown::Write).expect("an end");
            stream.read_to_end(&mut Vec::new()).expect("the end of the session");
            requests
        });
        (Session::over(stream, None).expect("a session"), server)
    }

    #[test]
    fn a_server_that_finds_no_board_is_told() {
        let error = Session::open(Command::new("false")).err().expect("an error").to_string();
        assert_eq!(error, "probe-rs gdb: exit status: 1");
    }

    #[test]
    fn a_word_is_read_low_byte_first_with_its_runs() {
        let (mut session, server) = session(&["$21640010#00", "$0*\"00#00", "$E01#00"]);
        assert_eq!(session.read(0xe004_2000).expect("a word"), 0x1000_6421);
        assert_eq!(session.read(0x4002_3c0c).expect("a word"), 0);
        assert!(session.read(0).is_err());
        let error = format!("{:#}", session.read(0).expect_err("a closed connection"));
        assert!(error.contains("does not answer m0,4: the connection is closed"), "{error}");
        drop(session);
        assert_eq!(server.join().expect("requests"), ["$me0042000,4#", "$m40023c0c,4#", "$m0,4#"]);
    }

    #[test]
    fn the_core_stores_a_word_by_one_instruction_in_ram() {
        let (mut session, server) = session(&["$OK#00", "$OK#00", "$OK#00", "$OK#00", "$T05thread:01;#00", "$E01#00"]);
        session.write(0x4002_3c08, 0x0819_2a3b).expect("a write");
        assert!(session.write(0x4002_3c08, 0).is_err());
        drop(session);
        let requests = server.join().expect("requests");
        let [store, address, value, place, step, _] = &requests[..] else { panic!("{requests:?}") };
        assert_eq!([store, address], ["$M20000000,2:0160#", "$P0=083c0240#"]);
        assert_eq!([value, place, step], ["$P1=3b2a1908#", "$Pf=00000020#", "$vCont;s:1#"]);
    }

    #[test]
    fn a_reset_that_does_not_halt_is_told() {
        let (mut session, server) = session(&[
            "$O54617267657420#00$O68616c7465640a#00$OK#00",
            "$O4572726f72207768696c652068616c74696e67#00$OK#00",
        ]);
        session.reset_and_halt().expect("a halted core");
        let error = session.reset_and_halt().expect_err("an error").to_string();
        assert_eq!(error, "probe-rs gdb: Error while halting");
        drop(session);
        assert_eq!(server.join().expect("requests")[0], "$qRcmd,72657365742068616c74#");
    }
}
