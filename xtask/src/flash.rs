//! Writing the flash image to a board.

use crate::{
    console::{self, Console},
    image::{self, Image},
    paths,
    toolchain::Choice,
};
use anyhow::{Context, Result, bail};
use std::process::Command;

/// The part on the board, in probe-rs's words.
const CHIP: &str = "STM32F446RETx";

/// Flags of `cargo xtask flash`.
#[derive(clap::Args)]
#[command(after_help = "Examples:\n  cargo xtask flash\n  cargo xtask flash --probe 0483:374b")]
pub struct Args {
    /// Which probe, where there are several: VID:PID or VID:PID:serial, as `probe-rs list` shows it
    #[arg(long, value_name = "PROBE")]
    probe: Option<String>,
}

/// Registers of the flash interface (RM0390 3.8): the option bytes' keys, and the option bytes.
const OPTKEYR: u32 = 0x4002_3c08;
const OPTCR: u32 = 0x4002_3c14;
const KEYS: [u32; 2] = [0x0819_2a3b, 0x4c5d_6e7f];
const OPTLOCK: u32 = 1 << 0;
const OPTSTRT: u32 = 1 << 1;
/// Zero is level 3: a reset below 2.7 V. The factory leaves it off.
const BOR_LEV: u32 = 0b11 << 2;

/// Builds the flash image, prints its SHA-256, writes and verifies it, sees to the option bytes, and starts it.
///
/// # Errors
/// The image does not build, probe-rs is missing, or there is no board.
pub fn run(args: &Args, choice: Choice, console: &mut Console) -> Result<()> {
    need_probe_rs()?;
    let image = image::firmware(choice, console)?;
    console.print(&image.summary());
    put(&image, args.probe.as_deref(), console)?;
    console.say("The board runs the image.");
    Ok(())
}

/// Looks for probe-rs before a build, so that nobody waits for an image that cannot be written.
///
/// # Errors
/// probe-rs is not in PATH.
pub fn need_probe_rs() -> Result<()> {
    if paths::find_program("probe-rs").is_some() {
        return Ok(());
    }
    bail!(
        "probe-rs writes the image to the board, and is not in PATH.\n\
         Install it (`cargo install probe-rs-tools --locked`, or a package from https://probe.rs), or let any \
         other tool write the .bin file beside the image that `cargo xtask build` names, to the address printed there."
    );
}

/// Writes and verifies an image, sees to the option bytes, and starts it.
///
/// # Errors
/// There is no board.
pub fn put(image: &Image, probe: Option<&str>, console: &mut Console) -> Result<()> {
    let probe = Probe(probe);
    let mut download = probe.command("download");
    download.args(["--verify", "--binary-format", "bin", "--base-address"]);
    console.run(download.arg(format!("{:#x}", image.base)).arg(&image.bin))?;
    set_brown_out_level(&probe, console)?;
    console.run(&mut probe.command("reset"))
}

/// Programs brown-out level 3 where the option bytes have another: the image refuses torque without it.
fn set_brown_out_level(probe: &Probe, console: &mut Console) -> Result<()> {
    let options = probe.read(OPTCR)?;
    if options & BOR_LEV == 0 {
        return Ok(());
    }
    console.say(&format!("Programming brown-out level 3 into the option bytes ({options:#010x} before)."));
    for (address, value) in writes(options) {
        let (address, value) = (format!("{address:#x}"), format!("{value:#x}"));
        console.run(probe.command("write").args(["b32", &address, &value]))?;
    }
    // They count from the next reset on.
    console.run(&mut probe.command("reset"))?;
    let options = probe.read(OPTCR)?;
    if options & BOR_LEV != 0 {
        bail!(
            "the option bytes still read {options:#010x}: brown-out level 3 was not taken, and the image refuses \
             torque (fault 18).\nSet BOR level 3 with another tool, such as STM32CubeProgrammer."
        );
    }
    Ok(())
}

/// What unlocks the option bytes, gives them level 3, and starts their programming (RM0390 3.6.2); all other bits stay.
fn writes(options: u32) -> [(u32, u32); 4] {
    let wanted = options & !(OPTLOCK | OPTSTRT | BOR_LEV);
    [(OPTKEYR, KEYS[0]), (OPTKEYR, KEYS[1]), (OPTCR, wanted), (OPTCR, wanted | OPTSTRT)]
}

/// The probe that the user named, or the only one.
struct Probe<'a>(Option<&'a str>);

impl Probe<'_> {
    fn command(&self, subcommand: &str) -> Command {
        let mut command = Command::new("probe-rs");
        command.args([subcommand, "--chip", CHIP]).args(self.0.iter().flat_map(|probe| ["--probe", probe]));
        command
    }

    fn read(&self, address: u32) -> Result<u32> {
        let text = console::output(self.command("read").args(["b32", &format!("{address:#x}"), "1"]))?;
        let word = text.split_whitespace().last().unwrap_or_default();
        let digits = word.trim_start_matches("0x");
        u32::from_str_radix(digits, 16).with_context(|| format!("probe-rs read {text:?} at {address:#x}, not a word"))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_the_brown_out_level_of_the_option_bytes_changes() {
        // As they come from the factory: read protection off, no sector protected, software watchdog.
        let [.., (address, set), (_, start)] = writes(0x0fff_aaed);
        assert_eq!((address, set, start), (OPTCR, 0x0fff_aae0, 0x0fff_aae2));
    }
}
