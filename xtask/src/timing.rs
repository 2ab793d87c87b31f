//! Estimated cycles on a Cortex-M4F, by QEMU with the timing plugin. Their worth: `docs/timing.md`.

use crate::console;
use crate::cores::M4_EMULATOR;
use crate::host::{self, Program};
use crate::toolchain;
use crate::{cores, image};
use anyhow::{Context, Result, bail, ensure};
use m4_timing::meter::{Measured, json_lines, parse};
use std::env::consts::{DLL_PREFIX, DLL_SUFFIX};
use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

#[derive(clap::Args)]
#[command(
    after_help = "Examples:\n  cargo xtask timing my-image.elf\n  cargo xtask timing my-image.elf --json kernels.json\n  \
    cargo xtask timing --check"
)]
pub struct Args {
    /// An image of your own with marked regions
    #[arg(required_unless_present = "check", conflicts_with = "check")]
    image: Option<PathBuf>,
    /// Write the figures to a file, an object a line
    #[arg(long, value_name = "FILE", conflicts_with = "check")]
    json: Option<PathBuf>,
    /// Compare the model with published measurements instead
    #[arg(long)]
    check: bool,
}

/// Measures an image, or checks the model.
pub fn run(args: &Args) -> Result<()> {
    let Some(image) = &args.image else {
        console::print(&check()?);
        return Ok(());
    };
    let image = fs::canonicalize(image).with_context(|| host::shown(image))?;
    let (_, regions) = measure(&image, None)?;
    console::print(&table(&regions));
    args.json.iter().try_for_each(|path| host::write(path, json_lines(&regions)))
}

/// A kernel: its name, the cycles published without wait states, blocks a call, the cycles published at 5 wait states.
type Published = (&'static str, f64, f64, Option<f64>);

/// Kernels of `m4-timing/tests/kernels`, in the order of the regions, from 1 on. Assembly, so no compiler changes these
/// figures. What was measured there is the call with its arguments in place: so it is here.
///
/// The first seven: P. Schwabe and K. Stoffelen, "All the AES You Need on Cortex-M3 and M4" (SAC 2016), means over many
/// runs on an STM32F407 at 24 MHz. The others: J. Oleksiewicz, cortexm-AES, `doc/aes/CM3_CM4_details.md`, an STM32F4.
const PUBLISHED: [Published; 23] = [
    ("AES-128 key expansion, S+S", 244.9, 1.0, None),
    ("AES-128 block, S+S", 634.7, 1.0, None),
    ("AES-128 CTR, S+S", 527.9, 256.0, None),
    ("AES-192 key expansion, S+S", 232.2, 1.0, None),
    ("AES-192 CTR, S+S", 644.0, 256.0, None),
    ("AES-256 key expansion, S+S", 309.9, 1.0, None),
    ("AES-256 CTR, S+S", 760.7, 256.0, None),
    ("AES-128 key expansion, J.O.", 302.0, 1.0, None),
    ("AES-256 key expansion, J.O.", 378.0, 1.0, None),
    ("AES-128 encryption, J.O.", 626.0, 1.0, None),
    ("AES-256 encryption, J.O.", 858.0, 1.0, None),
    ("AES-128 encryption, unrolled, J.O.", 601.0, 1.0, Some(715.0)),
    ("AES-256 encryption, unrolled, J.O.", 821.0, 1.0, Some(975.0)),
    ("AES-128 inverse keys, J.O.", 811.0, 1.0, None),
    ("AES-256 inverse keys, J.O.", 1164.0, 1.0, None),
    ("AES-128 decryption, J.O.", 629.0, 1.0, None),
    ("AES-256 decryption, J.O.", 863.0, 1.0, None),
    ("AES-128 decryption, unrolled, J.O.", 602.0, 1.0, Some(716.0)),
    ("AES-256 decryption, unrolled, J.O.", 822.0, 1.0, Some(978.0)),
    ("AES-128 encryption by DSP, J.O.", 844.0, 1.0, None),
    ("AES-256 encryption by DSP, J.O.", 1172.0, 1.0, None),
    ("AES-128 decryption by DSP, J.O.", 1240.0, 1.0, None),
    ("AES-256 decryption by DSP, J.O.", 1744.0, 1.0, None),
];

const MEAN_MAX: f64 = 0.02;
const WORST_MAX: f64 = 0.10;

/// Compares the model with published measurements; returns each figure beside the published one, as text.
pub fn check() -> Result<String> {
    let image = image::build("timing-check", "timing")?;
    let measured = |word: &str| measure(&image, Some(Path::new(word)));
    let [(_, regions), second, third] = [measured("measure")?, measured("measure")?, measured("measure")?];
    ensure!(regions == second.1 && regions == third.1, "three runs give other figures");
    ensure!(regions.len() == PUBLISHED.len(), "{} regions of {} were measured", regions.len(), PUBLISHED.len());
    let unknown = measured("unknown").map_or_else(|error| error.to_string(), |_| "measured".into());
    let refused = unknown.contains("exit status: 3") && unknown.contains("unknown instruction ee31 0b02 at 0x08");
    ensure!(refused, "an unknown instruction does not end the measurement: {unknown}");

    let head = |what: &str| format!("{what:<36} {:>9} {:>9} {:>7}\n", "published", "estimate", "error");
    let line = |name: &str, published: f64, estimate: f64, error: f64| {
        format!("{name:<36} {published:>9.1} {estimate:>9.1} {:>6.1} %\n", 100.0 * error)
    };
    let (mut plain, mut flash) = (head("cycles without wait states"), head("cycles with five wait states"));
    let (mut errors, mut wrong) = (Vec::new(), Vec::new());
    for (region, (name, cycles, blocks, waiting)) in regions.iter().zip(PUBLISHED) {
        let [low, estimate, high, with_flash] =
            [&region.low, &region.estimate, &region.high, &region.flash].map(|figure| figure.median as f64);
        let error = estimate / blocks / cycles - 1.0;
        plain += &line(name, cycles, estimate / blocks, error);
        errors.push(error.abs());
        let mut holds = low <= estimate && estimate <= high;
        if let Some(cycles) = waiting {
            let error = with_flash / cycles - 1.0;
            flash += &line(name, cycles, with_flash, error);
            // The wait states are most of what is to be told apart: a model without them would be off by 16 %.
            holds &= error.abs() <= MEAN_MAX && with_flash > 1.1 * estimate;
        }
        wrong.extend((!holds).then_some(name));
    }
    let mean = errors.iter().sum::<f64>() / errors.len() as f64;
    let worst = errors.iter().copied().fold(0.0, f64::max);
    let text = format!("{plain}mean absolute error {:.2} %, worst {:.2} %\n{flash}", 100.0 * mean, 100.0 * worst);
    ensure!(wrong.is_empty(), "{text}wrong: {}", wrong.join(", "));
    // Two-sided: to agree exactly would mean that the figures were copied.
    let close = mean > 0.0 && mean <= MEAN_MAX && worst <= WORST_MAX;
    ensure!(close, "{text}at most {MEAN_MAX} in the mean and {WORST_MAX} at the worst are allowed");
    Ok(text)
}

/// Runs an image to its end under the plugin; `argument` is its command line. Returns its standard output, and the regions in
/// order of their numbers, with the names of the output's lines `region NUMBER NAME`.
pub fn measure(image: &Path, argument: Option<&Path>) -> Result<(String, Vec<Measured>)> {
    cores::ensure_m4()?;
    let plugin = plugin()?;
    let name = image.file_stem().unwrap_or_default().display();
    let file = host::made("timing")?.join(format!("{name}.{}.json", std::process::id()));
    let argument = argument.map_or_else(String::new, |argument| format!(",arg={}", argument.display()));
    let mut command = Command::new(M4_EMULATOR);
    command.args(["-M", "netduinoplus2", "-display", "none", "-monitor", "none", "-serial", "none"]);
    command.arg("-semihosting-config").arg(format!("enable=on,target=native{argument}"));
    command.arg("-plugin").arg(format!("{},out={}", plugin.display(), file.display()));
    command.arg("-kernel").arg(image).stdin(Stdio::null());
    let ended = command.output().with_context(|| format!("cannot start {M4_EMULATOR}"))?;
    let output = String::from_utf8_lossy(&ended.stdout).into_owned();
    if !ended.status.success() {
        let errors = String::from_utf8_lossy(&ended.stderr);
        bail!("{}: {}\n{output}{errors}", ended.status, console::show(&command));
    }
    let text = fs::read_to_string(&file).with_context(|| format!("{} wrote no figures", host::shown(&file)))?;
    // Only a copy of what is returned.
    let _ = fs::remove_file(&file);
    let mut regions = parse(&text).context("the plugin's figures cannot be read")?;
    for measured in &mut regions {
        let start = format!("region {} ", measured.region);
        let name = output.lines().find_map(|line| line.strip_prefix(&start));
        measured.name = name.map_or(format!("region {}", measured.region), Into::into);
    }
    Ok((output, regions))
}

fn plugin() -> Result<PathBuf> {
    console::prepare(host::cargo("build", "m4-timing").args(["--features", "plugin"]))?;
    let file = host::target().join(host::PROGRAMS).join(format!("{DLL_PREFIX}m4_timing{DLL_SUFFIX}"));
    fs::canonicalize(&file).with_context(|| host::shown(&file))
}

fn table(regions: &[Measured]) -> String {
    let mut text = format!(
        "{:<34}{:>8}{:>8}{:>8}{:>9}{:>8}{:>8}{:>10}\n",
        "cycles a pass, medians", "passes", "insn", "low", "estimate", "high", "flash", "flash max"
    );
    for measured in regions {
        let Measured { name, passes, instructions, low, estimate, high, flash, .. } = measured;
        text += &format!(
            "{name:<34}{passes:>8}{:>8}{:>8}{:>9}{:>8}{:>8}{:>10}\n",
            instructions.median, low.median, estimate.median, high.median, flash.median, flash.max
        );
    }
    text
}

// Cost of accuracy in time: every variant of every kernel on the emulated Cortex-M4F, judged on this machine.

/// The image and its feature.
const STUDY: &str = "study";
/// The profile of everything but the firmware's own code.
const STUDY_PROFILE: &str = "study";
const FINGERS: &str = "12";

#[derive(clap::Args)]
#[command(after_help = "Examples:\n  cargo xtask study\n  cargo xtask study --check\n  \
    cargo xtask study --json study.json")]
pub struct StudyArgs {
    /// Change nothing; fail where a figure of docs/study.md, the README or a picture is stale
    #[arg(long)]
    check: bool,
    /// Write the figures to a file, an object a line
    #[arg(long, value_name = "FILE")]
    json: Option<PathBuf>,
}

/// Runs the study and renews or checks its page, its table in the README and its pictures.
pub fn study(args: &StudyArgs) -> Result<()> {
    let folder = host::made("study")?;
    let inputs = folder.join("inputs.bin");
    let judge = Program::tool("study");
    console::run(judge.build()?.arg("inputs").arg(&inputs))?;
    let shipped = image::build(STUDY, STUDY)?;
    let shipped = measured(&shipped, &inputs, &folder.join("shipped.txt"))?;
    let quick = measured(&build_quick()?, &inputs, &folder.join("quick.txt"))?;
    let held = console::output(Program::sim("budget").build()?.args(["--whole-loop", "--fingers", FINGERS]))?;
    let whole_loop = folder.join("whole-loop.txt");
    host::write(&whole_loop, held)?;
    let mut command = judge.build()?;
    command.arg("report").arg(&shipped).arg(&quick).arg(&whole_loop).args(args.check.then_some("--check"));
    host::give_files(&mut command, [("--json", &args.json)])?;
    console::run(&mut command)
}

/// The image as quick as the compiler makes it, without what keeps the firmware's small.
fn build_quick() -> Result<PathBuf> {
    let mut command = image::emulated(STUDY, STUDY);
    command.args(["--profile", STUDY_PROFILE]);
    // Instead of the flags that `.cargo/config.toml` has for the target.
    let flags = ["-C", "opt-level=3"].map(String::from).into_iter().chain(toolchain::short_paths());
    // Flags may hold blanks: a separator that no path has.
    command.env("CARGO_ENCODED_RUSTFLAGS", flags.collect::<Vec<_>>().join("\u{1f}"));
    console::prepare(&mut command)?;
    Ok(toolchain::images().with_file_name(STUDY_PROFILE).join(STUDY))
}

/// Runs an image; what it said and what it cost, in a file.
fn measured(image: &Path, inputs: &Path, file: &Path) -> Result<PathBuf> {
    let (mut text, regions) = measure(image, Some(inputs))?;
    for measured in &regions {
        text += &format!("cost {}", measured.region);
        for figure in [&measured.instructions, &measured.low, &measured.estimate, &measured.high, &measured.flash] {
            text += &format!(" {} {}", figure.median, figure.max);
        }
        text.push('\n');
    }
    host::write(file, text)?;
    Ok(file.into())
}
