//! Writing an image to a board: the firmware, and for the first hour with a board the image that checks a bare
//! NUCLEO-F446RE, or the emulated one, and its judge.

use crate::console;
use crate::host::{self, Program};
use crate::image::{self, Image};
use crate::{sim, timing};
use anyhow::{Context, Result, bail, ensure};
use std::path::{Path, PathBuf};
use std::process::Command;

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
pub fn run(args: &Args) -> Result<()> {
    need_probe_rs()?;
    let image = image::firmware()?;
    console::print(&image.summary());
    put(&image, args.probe.as_deref())?;
    console::say("The board runs the image.");
    Ok(())
}

/// Looks for probe-rs before a build, so that nobody waits for an image that cannot be written.
pub fn need_probe_rs() -> Result<()> {
    ensure!(
        host::find_program("probe-rs").is_some(),
        "probe-rs writes the image to the board, and is not in PATH.\n\
         Install it (`cargo install probe-rs-tools --locked`, or a package from https://probe.rs), or let any \
         other tool write the .bin file beside the image that `cargo xtask build` names, to the address printed there."
    );
    Ok(())
}

/// Sees to the option bytes, writes and verifies an image, and starts it.
pub fn put(image: &Image, probe: Option<&str>) -> Result<()> {
    let command = |subcommand| {
        let mut command = Command::new("probe-rs");
        command.args([subcommand, "--chip", CHIP]).args(probe.iter().flat_map(|probe| ["--probe", probe]));
        command
    };
    let read = |address: u32| {
        let text = console::output(command("read").args(["b32", &format!("{address:#x}"), "1"]))?;
        u32::from_str_radix(text.trim(), 16).with_context(|| format!("probe-rs reads {text:?}, not a word"))
    };
    // First, because this refuses another device.
    if set_brown_out_level(read, |options| write_options(options, probe))? {
        console::say("Programmed brown-out level 3 into the option bytes.");
    }
    let mut download = command("download");
    download.args(["--verify", "--binary-format", "bin", "--base-address"]);
    console::run(download.arg(format!("{:#x}", image.base)).arg(&image.bin))?;
    console::run(&mut command("reset"))
}

// The option bytes (RM0390 3.6, 3.8). A write that a reset or a power loss cuts short can leave the device at read protection
// level 1, and leaving level 1 erases the whole flash. The image's watchdogs reset a halted core too: so OpenOCD writes after
// a reset that halts the core before its first instruction, with the watchdogs stopped.

/// Device identifier in its lowest twelve bits (RM0390 33.6.1).
const DBGMCU_IDCODE: u32 = 0xe004_2000;
const STM32F446: u32 = 0x421;
const OPTCR: u32 = 0x4002_3c14;
/// Brown-out level: zero is level 3, the highest threshold. Parts leave the factory with brown-out reset off.
const BOR_LEV: u32 = 0b11 << 2;
/// Read protection, and its level 0. Any other byte but 0xCC is level 1; 0xCC is level 2, for ever.
const RDP: u32 = 0xff << 8;
const RDP_LEVEL_0: u32 = 0xaa << 8;
/// One while only software starts the independent watchdog; zero starts it at reset, and 0.5 s later it resets.
const WDG_SW: u32 = 1 << 5;
/// The bits that OpenOCD takes. It keeps the protection of reads and writes, but not [`SPRMOD`].
const USER: u32 = 0xfc;
/// One where the sectors are protected from reads instead of writes; the factory leaves it zero.
const SPRMOD: u32 = 1 << 31;
/// All bits of the register that are option bytes.
const OPTIONS: u32 = 0x80ff_ffec;
/// Flash status register, and its bit that is set while the flash writes.
const FLASH_SR: u32 = 0x4002_3c0c;
const BSY: u32 = 1 << 16;

/// Programs brown-out level 3, without which the image refuses torque; all other option bytes stay. False if it is set.
fn set_brown_out_level(read: impl Fn(u32) -> Result<u32>, write: impl FnOnce(u32) -> Result<()>) -> Result<bool> {
    let device = read(DBGMCU_IDCODE)? & 0xfff;
    ensure!(device == STM32F446, "the device has the identifier {device:#x}, an STM32F446 has {STM32F446:#x}");
    let options = read(OPTCR)?;
    if options & BOR_LEV == 0 {
        return Ok(false);
    }
    ensure!(
        options & (RDP | WDG_SW | SPRMOD) == RDP_LEVEL_0 | WDG_SW,
        "the option bytes are {options:#010x}: set read protection level 0, no PCROP and a software watchdog with \
         STM32CubeProgrammer"
    );
    write(options)?;
    let written = read(OPTCR)?;
    ensure!(
        written & OPTIONS == options & OPTIONS & !BOR_LEV,
        "the option bytes are {written:#010x}, they were {options:#010x}: set brown-out level 3 with STM32CubeProgrammer"
    );
    Ok(true)
}

/// Writes brown-out level 3 by OpenOCD to the device that has these option bytes.
fn write_options(options: u32, probe: Option<&str>) -> Result<()> {
    ensure!(
        host::find_program("openocd").is_some(),
        "the board needs brown-out level 3 once, which OpenOCD programs, and it is not in PATH.\n\
         Install it (`apt install openocd`), or set BOR level 3 with STM32CubeProgrammer; then try again."
    );
    let serial = match probe.map(|probe| probe.splitn(3, ':').nth(2)) {
        Some(None) => bail!("give --probe as VID:PID:serial: by that OpenOCD finds the same board"),
        serial => serial.flatten(),
    };
    let openocd = |script: &str| {
        let mut command = Command::new("openocd");
        command.args(["-f", "board/st_nucleo_f4.cfg"]);
        command.args(serial.iter().flat_map(|serial| ["-c".into(), format!("adapter serial {serial}")]));
        console::output(command.args(["-c", script])).map(drop)
    };
    let [check, write] = scripts(options);
    openocd(&format!("{check}; shutdown")).context(
        "No option byte was changed. OpenOCD needs an ST-LINK, and version 0.12 or newer; or set BOR level 3 with \
         STM32CubeProgrammer.",
    )?;
    openocd(&format!("{check}; {write}; shutdown")).context(
        "OpenOCD did not end well: the flash may still be writing, and an interrupted write can lock the device.\n\
         Do not press reset, and leave the board powered for 2 s more. Then try again.",
    )
}

/// What OpenOCD does: a check that it is the same device, halted; and the write, whose end it awaits before it resets.
fn scripts(options: u32) -> [String; 2] {
    let (known, user) = (options & OPTIONS, options & USER & !BOR_LEV);
    [
        format!(
            "init; reset halt; if {{([mrw {DBGMCU_IDCODE:#x}] & 0xfff) != {STM32F446:#x} || \
             ([mrw {OPTCR:#x}] & {OPTIONS:#x}) != {known:#x}}} {{error {{another board}}}}"
        ),
        format!(
            "stm32f2x options_write 0 {user:#04x}; while {{[mrw {FLASH_SR:#x}] & {BSY:#x}}} {{sleep 10}}; reset halt"
        ),
    ]
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
    #[arg(long, value_parser = ["nucleo", "virtual"], default_value = "nucleo")]
    board: String,
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

/// Builds the image, runs it and judges what it reports. This process ends as the judge does.
pub fn bringup(args: &BringupArgs) -> Result<()> {
    // First, as it takes no time: without a board there is no wait for a build.
    let port = (args.board == "nucleo").then(|| args.port.clone().map_or_else(find_port, Ok)).transpose()?;
    if port.is_some() && !args.flashed {
        need_probe_rs()?;
    }
    let image = image::checking(BRINGUP)?;
    console::say(&image.summary());
    let estimates = if args.without_estimates { None } else { Some(estimates()?) };
    let mut command = match port {
        None => {
            let mut command = host::SCENE_BOARD.build()?;
            command.arg(BRINGUP).arg("--image").arg(std::path::absolute(&image.elf)?);
            command
        }
        Some(port) => {
            let mut command = Program { package: BRINGUP, name: "bringup-host", with: host::SHARED }.build()?;
            if !args.flashed {
                put(&image, args.probe.as_deref())?;
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
fn estimates() -> Result<PathBuf> {
    let folder = host::made("study")?;
    let [kept, full, file] = ["kept.bin", "few.bin", "few.txt"].map(|name| folder.join(name));
    console::run(Program::tool("study").build()?.arg("few").arg(&kept).arg(&full))?;
    let study = image::build("study", "study")?;
    let (_, regions) = timing::measure(&study, Some(&full))?;
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
    use std::cell::Cell;

    /// Factory setting: brown-out reset off, read protection off, no sector protected, software watchdog.
    const FACTORY: u32 = 0x0fff_aaed;

    /// Tries it on a device whose options become `after` by a write: the script of the write, and the result.
    fn tried(device: u32, before: u32, after: u32) -> (Option<String>, Result<bool>) {
        let (options, mut script) = (Cell::new(before), None);
        let read = |address| Ok(if address == DBGMCU_IDCODE { device } else { options.get() });
        let result = set_brown_out_level(read, |found| {
            script = Some(scripts(found).concat());
            options.set(after);
            Ok(())
        });
        (script, result)
    }

    /// Programs brown-out level 3 in place of these options; the script has these words in this order.
    fn programs(before: u32, words: [&str; 6]) {
        let (script, result) = tried(0x1000_6421, before, before & !BOR_LEV & !1);
        let script = script.expect("a script");
        let mut rest = &script[..];
        for word in words {
            rest = rest.split_once(word).unwrap_or_else(|| panic!("{word} is not where it belongs: {script}")).1;
        }
        assert!(result.is_ok_and(|written| written));
    }

    #[test]
    fn only_the_brown_out_level_changes() {
        const AWAITED: &str = "[mrw 0x40023c0c] & 0x10000";
        programs(
            FACTORY,
            ["reset halt", "!= 0xffaaec", "another board", "options_write 0 0xe0;", AWAITED, "reset halt"],
        );
        // Sectors 1 and 2 are write-protected, and the bit for stop mode is cleared; bit 0 locks the register and is no option byte.
        let protected = 0x0ff9_aaac;
        programs(
            protected,
            ["reset halt", "!= 0xf9aaac", "another board", "options_write 0 0xa0;", AWAITED, "reset halt"],
        );
        let (script, result) = tried(0x1000_6421, FACTORY & !BOR_LEV, 0);
        assert!(result.is_ok_and(|written| !written) && script.is_none());
    }

    #[test]
    fn another_device_or_a_protected_one_is_left_alone() {
        for (device, options, expected) in [
            (0x2003_6411, FACTORY, "an STM32F446 has 0x421"),
            (0x421, FACTORY & !RDP, "set read protection level 0"),
            (0x421, FACTORY & !WDG_SW, "a software watchdog"),
            (0x421, FACTORY | SPRMOD, "no PCROP"),
        ] {
            let (script, result) = tried(device, options, options);
            let error = result.expect_err("refused").to_string();
            assert!(script.is_none() && error.contains(expected), "{error}");
        }
    }

    #[test]
    fn a_write_that_changes_nothing_or_more_is_told() {
        for after in [FACTORY, FACTORY & !BOR_LEV & !RDP] {
            let error = tried(0x421, FACTORY, after).1.expect_err("told").to_string();
            assert!(error.contains("set brown-out level 3 with STM32CubeProgrammer"), "{error}");
        }
    }
}
