//! Images for the microcontroller: built, laid out as flashed, and checked against the limits of flash and RAM.

use crate::console;
use crate::host;
use crate::toolchain;
use anyhow::{Context, Result, ensure};
use object::elf::{FileHeader32, PT_LOAD, SHF_ALLOC};
use object::read::elf::{ElfFile, ProgramHeader};
use object::{LittleEndian, Object, ObjectSection, ObjectSymbol, SectionFlags};
use sha2::{Digest, Sha256};
use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

const ERASED: u8 = 0xff;
/// More than the largest part has: a larger span is a mistake in the linker script.
const SPAN_MAX: usize = 2 << 20;

/// An image, as linked and as flashed.
pub struct Image {
    pub elf: PathBuf,
    /// File of the flashable bytes, beside the linked image.
    pub bin: PathBuf,
    pub bytes: Vec<u8>,
    pub base: u32,
}

impl Image {
    /// Lays out the loadable segments of a linked image by their load addresses; gaps read as erased.
    pub fn read(elf: &Path) -> Result<Self> {
        let data = fs::read(elf).with_context(|| format!("cannot read the image {}", host::shown(elf)))?;
        let file = ElfFile::<FileHeader32<LittleEndian>>::parse(&*data)
            .with_context(|| format!("{} is no image for a 32-bit microcontroller", host::shown(elf)))?;
        let mut segments = Vec::new();
        for header in file.elf_program_headers() {
            if header.p_type(LittleEndian) == PT_LOAD && header.p_filesz(LittleEndian) > 0 {
                let bytes = header.data(LittleEndian, &*data).ok().context("a segment lies outside the file")?;
                segments.push((header.p_paddr(LittleEndian), bytes));
            }
        }
        let (base, bytes) = lay_out(&segments).with_context(|| host::shown(elf))?;
        let image = Self { elf: elf.into(), bin: elf.with_extension("bin"), bytes, base };
        image.names_no_folder()?;
        Ok(image)
    }

    /// SHA-256 of the flashable bytes, in hexadecimal.
    pub fn sha256(&self) -> String {
        Sha256::digest(&self.bytes).iter().map(|byte| format!("{byte:02x}")).collect()
    }

    /// Refuses an image with a path of this machine in it: a build on another machine would give other bytes.
    fn names_no_folder(&self) -> Result<()> {
        // With its subfolder: that of a checkout in `/src` alone is part of most paths.
        for folder in toolchain::sources().into_iter().chain([host::root().join("src")]) {
            let name = folder.as_os_str().as_encoded_bytes();
            let named = self.bytes.windows(name.len()).any(|bytes| bytes == name);
            ensure!(!named, "{} names {}: it would be other bytes elsewhere", host::shown(&self.elf), folder.display());
        }
        Ok(())
    }

    /// Path, size and SHA-256, a line each.
    pub fn summary(&self) -> String {
        format!(
            "image    {}\nflashed  {} bytes from {:#010x}\nsha-256  {}",
            host::shown(&self.elf),
            self.bytes.len(),
            self.base,
            self.sha256()
        )
    }
}

/// The lowest address, and all bytes from there on.
fn lay_out(segments: &[(u32, &[u8])]) -> Result<(u32, Vec<u8>)> {
    let base = segments.iter().map(|(start, _)| *start).min().context("the image loads nothing")?;
    let mut bytes = Vec::new();
    for (start, segment) in segments {
        let start = (start - base) as usize;
        let end = start + segment.len();
        ensure!(end <= SPAN_MAX, "the image loads to addresses {end:#x} bytes apart: no flash is that large");
        bytes.resize(bytes.len().max(end), ERASED);
        bytes[start..end].copy_from_slice(segment);
    }
    Ok((base, bytes))
}

pub fn firmware() -> Result<Image> {
    with_bytes("firmware", &["--package", "fingertip", "--features", "firmware"])
}

/// Builds an image that checks a board.
pub fn checking(name: &str) -> Result<Image> {
    with_bytes(name, &["--package", name, "--no-default-features", "--features", "image"])
}

/// Builds an image, with the flashable bytes beside it.
fn with_bytes(name: &str, words: &[&str]) -> Result<Image> {
    let mut command = toolchain::cargo("build");
    let image = Image::read(&built(command.args(["--release", "--bin", name]).args(words), name)?)?;
    host::write(&image.bin, &image.bytes)?;
    Ok(image)
}

/// Builds an image for the emulated core and returns where it lies.
pub fn build(name: &str, feature: &str) -> Result<PathBuf> {
    built(emulated(name, feature).arg("--release"), name)
}

fn built(command: &mut Command, name: &str) -> Result<PathBuf> {
    toolchain::ensure()?;
    console::prepare(command)?;
    Ok(toolchain::images().join(name))
}

/// `cargo build` of an image for the emulated core.
pub fn emulated(name: &str, feature: &str) -> Command {
    let mut command = toolchain::cargo("build");
    command.args(["--package", "images", "--bin", name, "--features", feature]);
    command
}

/// `cargo <subcommand>` of a program that is a workspace of its own in this folder, for a target with flags.
pub fn apart(subcommand: &str, folder: &str, target: &str, flags: &[&str]) -> Command {
    let mut command = toolchain::cargo_for(subcommand, target, flags);
    command.args(["--manifest-path", &format!("{folder}/Cargo.toml"), "--locked"]);
    command
}

/// Flash that the image may take.
const FLASH_MAX_BYTES: u64 = 128 << 10;
/// RAM that statics may take, 44 KiB of it the memory for captures; the stack comes on top.
const RAM_MAX_BYTES: u64 = 76 << 10;
/// First address of the microcontroller's RAM.
const RAM_BASE: u64 = 0x2000_0000;

/// Flash with gaps and initial values, RAM with a fixed address, and stack, a line each. Fails beyond a limit.
pub fn sizes(image: &Image) -> Result<String> {
    let data = fs::read(&image.elf)?;
    let file = object::File::parse(&*data)?;
    let in_ram = file.sections().filter(|section| {
        let SectionFlags::Elf { sh_flags } = section.flags() else { return false };
        sh_flags & u64::from(SHF_ALLOC) != 0 && section.address() >= RAM_BASE
    });
    let address = |name: &str| {
        let symbol = file.symbol_by_name(name).with_context(|| format!("the image has no symbol {name}"));
        symbol.map(|symbol| symbol.address())
    };
    let flash = share("flash", image.bytes.len() as u64, FLASH_MAX_BYTES)?;
    let ram = share("static RAM", in_ram.map(|section| section.size()).sum(), RAM_MAX_BYTES)?;
    let stack = address("_stack_start")?.saturating_sub(address("_stack_end")?);
    Ok(format!("{flash}\n{ram}\nstack       {stack:6} bytes reserved"))
}

fn share(what: &str, bytes: u64, limit: u64) -> Result<String> {
    ensure!(bytes <= limit, "{what}: {bytes} bytes are {} more than the limit of {limit}", bytes - limit);
    Ok(format!("{what:<12}{bytes:6} of {limit} bytes ({:.0} %)", 100.0 * bytes as f64 / limit as f64))
}

// The panic-free proof: an image of the control step alone, which a reachable panic keeps from linking.

const NAME: &str = "panic-free";
/// Undefined symbol that the proof's panic handler calls.
const UNDEFINED: &str = "fingertip_step_can_panic";

/// Builds the proof and its two controls.
pub fn prove_panic_free() -> Result<()> {
    let linked = build(NAME, "proof");
    let elf = linked
        .with_context(|| format!("the proof does not link; if {UNDEFINED} is missing above, the step can panic"))?;
    console::print("The control step links without a panic handler: no panic is reachable.");
    let calls = float_calls(&elf)?;
    ensure!(calls.is_empty(), "the control step calls floating-point routines: {}", calls.join(", "));
    console::print("It calls no floating-point routine.");
    // Shows that the proof can fail.
    let mut control = emulated(NAME, "proof-control-panic");
    let output = control.arg("--release").current_dir(host::root()).output().context("cannot start cargo")?;
    let errors = String::from_utf8_lossy(&output.stderr);
    let caught = !output.status.success() && errors.contains(UNDEFINED);
    ensure!(caught, "the control that panics links, or fails for another reason:\n{errors}");
    let elf = build(NAME, "proof-control-float")?;
    let calls = float_calls(&elf)?;
    ensure!(!calls.is_empty(), "the control that computes in f64 shows no such routine in {}", host::shown(&elf));
    console::print("The controls, a step that can panic and one that computes in f64, are caught.");
    Ok(())
}

fn float_calls(elf: &Path) -> Result<Vec<String>> {
    let data = fs::read(elf)?;
    let file = object::File::parse(&*data)?;
    let names = file.symbols().filter_map(|symbol| symbol.name().ok().map(str::to_owned));
    let mut calls: Vec<_> = names.filter(|name| is_float_routine(name)).collect();
    calls.sort();
    calls.dedup();
    Ok(calls)
}

/// True if a symbol is a routine of soft floating point or of libm.
fn is_float_routine(symbol: &str) -> bool {
    let demangled = format!("{:#}", rustc_demangle::demangle(symbol));
    if demangled.starts_with("libm::") || demangled.contains("compiler_builtins::float::") {
        return true;
    }
    let name = demangled.rsplit("::").next().unwrap_or(&demangled);
    if let Some(routine) = name.strip_prefix("__aeabi_") {
        // fadd, dmul, cdcmple, f2iz, d2f ..., and the conversions from integers: i2f, ui2d, l2f, ul2d.
        let from_integer = ["i2f", "i2d", "ui2f", "ui2d", "l2f", "l2d", "ul2f", "ul2d"];
        return routine.starts_with(['f', 'd', 'h'])
            || routine.starts_with("cf")
            || routine.starts_with("cd")
            || from_integer.contains(&routine);
    }
    // __addsf3, __muldf3, __extendsfdf2, __fixdfsi, __floatsisf, __powisf2, ...
    if let Some(routine) = name.strip_prefix("__") {
        let operand = ["sf2", "sf3", "df2", "df3", "hf2", "tf2", "tf3"].iter().any(|end| routine.ends_with(end));
        return operand || routine.starts_with("fix") || routine.starts_with("float");
    }
    const LIBM: [&str; 24] = [
        "acos", "asin", "atan", "atan2", "cbrt", "ceil", "copysign", "cos", "exp", "exp2", "fabs", "floor", "fma",
        "fmax", "fmin", "fmod", "hypot", "log", "pow", "rint", "round", "sin", "sqrt", "tan",
    ];
    LIBM.contains(&name) || name.strip_suffix('f').is_some_and(|name| LIBM.contains(&name))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn segments_lie_at_their_addresses_and_gaps_read_as_erased() {
        let (base, bytes) = lay_out(&[(0x0800_0006, &[3, 4]), (0x0800_0000, &[1, 2])]).unwrap();
        assert_eq!((base, bytes), (0x0800_0000, vec![1, 2, 0xff, 0xff, 0xff, 0xff, 3, 4]));
        // Without bytes, and in two memories.
        assert!(lay_out(&[]).is_err());
        assert!(lay_out(&[(0x0800_0000, &[1]), (0x2000_0000, &[1])]).is_err());
    }

    #[test]
    fn a_byte_beyond_a_limit_fails() {
        assert!(share("flash", 1_000, 1_000).is_ok());
        let error = share("flash", 1_001, 1_000).unwrap_err().to_string();
        assert_eq!(error, "flash: 1001 bytes are 1 more than the limit of 1000");
    }

    #[test]
    fn floating_point_routines_are_told_from_the_rest() {
        for symbol in ["__aeabi_dmul", "__aeabi_fadd", "__aeabi_ul2d", "__aeabi_cdcmple", "__adddf3", "__extendsfdf2"] {
            assert!(is_float_routine(symbol), "{symbol}");
        }
        for symbol in ["sqrtf", "sqrt", "__fixdfsi", "_ZN17compiler_builtins5float3add8__adddf317h0123456789abcdefE"] {
            assert!(is_float_routine(symbol), "{symbol}");
        }
        for symbol in ["__aeabi_memcpy", "__aeabi_uldivmod", "__aeabi_lmul", "__udivmoddi4", "main", "Reset", "_exp"] {
            assert!(!is_float_routine(symbol), "{symbol}");
        }
    }
}
