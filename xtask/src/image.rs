//! Images for the microcontroller: built, and laid out as the bytes that the flash gets.

use crate::console::{Console, IMAGE};
use crate::paths;
use crate::toolchain::{self, Choice, Toolchain};
use anyhow::{Context, Result, bail};
use object::LittleEndian;
use object::elf::{FileHeader32, PT_LOAD};
use object::read::elf::{ElfFile, ProgramHeader};
use sha2::{Digest, Sha256};
use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

/// Value of an erased byte of flash.
const ERASED: u8 = 0xff;
/// More than the largest part has: a larger span is a mistake in the linker script.
const SPAN_MAX: usize = 2 << 20;

/// An image, as linked and as flashed.
pub struct Image {
    /// The linked image, with symbols.
    pub elf: PathBuf,
    /// The flashable bytes, as a file beside it.
    pub bin: PathBuf,
    /// The flashable bytes.
    pub bytes: Vec<u8>,
    /// The address of the first byte.
    pub base: u32,
}

impl Image {
    /// Lays out the loadable segments of a linked image by their load addresses; gaps read as erased.
    ///
    /// # Errors
    /// The file is missing, no image for the target, loads nothing, or names a folder of this machine.
    pub fn read(elf: &Path) -> Result<Self> {
        let data = fs::read(elf).with_context(|| format!("cannot read the image {}", paths::shown(elf)))?;
        let file = ElfFile::<FileHeader32<LittleEndian>>::parse(&*data)
            .with_context(|| format!("{} is no image for a 32-bit microcontroller", paths::shown(elf)))?;
        let mut segments = Vec::new();
        for header in file.elf_program_headers() {
            if header.p_type(LittleEndian) == PT_LOAD && header.p_filesz(LittleEndian) > 0 {
                let bytes = header.data(LittleEndian, &*data).ok().context("a segment lies outside the file")?;
                segments.push((header.p_paddr(LittleEndian), bytes));
            }
        }
        let (base, bytes) = lay_out(&segments).with_context(|| paths::shown(elf))?;
        let image = Self { elf: elf.into(), bin: elf.with_extension("bin"), bytes, base };
        image.names_no_folder()?;
        Ok(image)
    }

    /// SHA-256 of the flashable bytes, in hexadecimal.
    pub fn sha256(&self) -> String {
        Sha256::digest(&self.bytes).iter().map(|byte| format!("{byte:02x}")).collect()
    }

    /// Refuses an image with a path of this machine in it: a build on another machine would give other bytes.
    ///
    /// # Errors
    /// Names the path: where the sources of the core lie, or those of other crates.
    fn names_no_folder(&self) -> Result<()> {
        // With its subfolder: that of a checkout in `/src` alone is part of most paths.
        for folder in toolchain::sources().into_iter().chain([paths::root().join("src")]) {
            let name = folder.as_os_str().as_encoded_bytes();
            if self.bytes.windows(name.len()).any(|bytes| bytes == name) {
                bail!("{} names {}: it would be other bytes elsewhere", paths::shown(&self.elf), folder.display());
            }
        }
        Ok(())
    }

    /// Path, size and SHA-256, a line each.
    pub fn summary(&self) -> String {
        format!(
            "image    {}\nflashed  {} bytes from {:#010x}\nsha-256  {}",
            paths::shown(&self.elf),
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
        if end > SPAN_MAX {
            bail!("the image loads to addresses {end:#x} bytes apart: no flash is that large");
        }
        bytes.resize(bytes.len().max(end), ERASED);
        bytes[start..end].copy_from_slice(segment);
    }
    Ok((base, bytes))
}

/// Builds the flash image.
///
/// # Errors
/// No compiler, or the firmware does not compile.
pub fn firmware(choice: Choice, console: &mut Console) -> Result<Image> {
    let toolchain = toolchain::ensure(choice, console)?;
    let mut command = toolchain.cargo("build");
    command.args(["--package", "fingertip", "--bin", "firmware", "--features", "firmware"]);
    with_bytes(&mut command, toolchain, "firmware", console)
}

/// Builds an image that checks a board.
///
/// # Errors
/// The image does not compile or link.
pub fn checking(toolchain: Toolchain, name: &str, console: &mut Console) -> Result<Image> {
    let mut command = toolchain.cargo("build");
    command.args(["--package", name, "--bin", name, "--no-default-features", "--features", "image"]);
    with_bytes(&mut command, toolchain, name, console)
}

/// Builds an image, with the flashable bytes beside it.
fn with_bytes(command: &mut Command, toolchain: Toolchain, name: &str, console: &mut Console) -> Result<Image> {
    let image = Image::read(&built(command.arg("--release"), toolchain, name, console)?)?;
    fs::write(&image.bin, &image.bytes).with_context(|| format!("cannot write {}", paths::shown(&image.bin)))?;
    Ok(image)
}

/// Builds an image for the emulated core and returns where it lies.
///
/// # Errors
/// The image does not compile or link.
pub fn build(toolchain: Toolchain, name: &str, feature: &str, console: &mut Console) -> Result<PathBuf> {
    built(emulated(toolchain, name, feature).arg("--release"), toolchain, name, console)
}

fn built(command: &mut Command, toolchain: Toolchain, name: &str, console: &mut Console) -> Result<PathBuf> {
    console.build(command, &format!("the image {name}"), IMAGE)?;
    Ok(toolchain.images().join(name))
}

/// `cargo build` of an image for the emulated core.
pub fn emulated(toolchain: Toolchain, name: &str, feature: &str) -> Command {
    let mut command = toolchain.cargo("build");
    command.args(["--package", "images", "--bin", name, "--features", feature]);
    command
}

/// `cargo <subcommand>` of a program that is a workspace of its own in this folder, for a target with flags.
pub fn apart(toolchain: Toolchain, subcommand: &str, folder: &str, target: &str, flags: &[&str]) -> Command {
    let mut command = toolchain.cargo_for(subcommand, target, flags);
    command.args(["--manifest-path", &format!("{folder}/Cargo.toml"), "--locked"]);
    command
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn segments_lie_at_their_addresses_and_gaps_read_as_erased() {
        let (base, bytes) = lay_out(&[(0x0800_0006, &[3, 4]), (0x0800_0000, &[1, 2])]).unwrap();
        assert_eq!((base, bytes), (0x0800_0000, vec![1, 2, 0xff, 0xff, 0xff, 0xff, 3, 4]));
    }

    #[test]
    fn an_image_without_bytes_and_one_in_two_memories_are_refused() {
        assert!(lay_out(&[]).is_err());
        assert!(lay_out(&[(0x0800_0000, &[1]), (0x2000_0000, &[1])]).is_err());
    }
}
