//! The flash image against its limits: flash, static RAM, and who takes how much of them.

use crate::{
    console::Console,
    image::{self, Image},
    toolchain::Choice,
};
use anyhow::{Context, Result, bail};
use object::{Object, ObjectSection, ObjectSymbol, SectionFlags, elf::SHF_ALLOC};
use std::{collections::BTreeMap, fmt::Write as _, fs};

/// Flash that the image may take.
pub const FLASH_MAX_BYTES: u64 = 128 << 10;
/// RAM that statics may take, 44 KiB of it the memory for captures; the stack comes on top.
pub const RAM_MAX_BYTES: u64 = 76 << 10;
/// Where the microcontroller's RAM begins.
const RAM_BASE: u64 = 0x2000_0000;
/// Lines of the table of crates.
const CRATES_SHOWN: usize = 12;

/// What an image takes.
pub struct Sizes {
    /// Bytes of flash, gaps and initial values included.
    pub flash: u64,
    /// Bytes of RAM with a fixed address.
    pub ram: u64,
    /// Bytes reserved for the stack.
    pub stack: u64,
    /// Name, address, bytes of flash and bytes of RAM of each section.
    sections: Vec<(String, u64, u64, u64)>,
    /// Bytes of flash and of RAM, by crate.
    crates: BTreeMap<String, (u64, u64)>,
}

/// Builds the flash image and measures it.
pub fn run(choice: Choice, console: &mut Console) -> Result<()> {
    let image = image::firmware(choice, console)?;
    let sizes = Sizes::of(&image)?;
    console.print(&format!("{}\n\n{}\n{}", image.summary(), sizes.table(), sizes.verdict()));
    sizes.check()
}

impl Sizes {
    /// Measures a linked image.
    pub fn of(image: &Image) -> Result<Self> {
        let data = fs::read(&image.elf)?;
        let file = object::File::parse(&*data)?;
        let mut sections = Vec::new();
        for section in file.sections() {
            let SectionFlags::Elf { sh_flags } = section.flags() else { continue };
            if sh_flags & u64::from(SHF_ALLOC) == 0 || section.size() == 0 {
                continue;
            }
            let in_ram = section.address() >= RAM_BASE;
            let stored = section.kind() != object::SectionKind::UninitializedData && section.file_range().is_some();
            let bytes = |counts: bool| if counts { section.size() } else { 0 };
            sections.push((section.name()?.to_owned(), section.address(), bytes(stored), bytes(in_ram)));
        }
        let mut crates = BTreeMap::<String, (u64, u64)>::new();
        for symbol in file.symbols().filter(|symbol| symbol.size() > 0 && symbol.is_definition()) {
            let (flash, ram) = crates.entry(crate_of(symbol.name()?)).or_default();
            *if symbol.address() >= RAM_BASE { ram } else { flash } += symbol.size();
        }
        let address = |name: &str| {
            let symbol = file.symbol_by_name(name).with_context(|| format!("the image has no symbol {name}"));
            symbol.map(|symbol| symbol.address())
        };
        Ok(Self {
            flash: image.bytes.len() as u64,
            ram: sections.iter().map(|(_, _, _, ram)| ram).sum(),
            stack: address("_stack_start")?.saturating_sub(address("_stack_end")?),
            sections,
            crates,
        })
    }

    /// Fails beyond the limits.
    pub fn check(&self) -> Result<()> {
        for (what, bytes, limit) in [("flash", self.flash, FLASH_MAX_BYTES), ("static RAM", self.ram, RAM_MAX_BYTES)] {
            if bytes > limit {
                bail!("{what}: {bytes} bytes are {} more than the limit of {limit}", bytes - limit);
            }
        }
        Ok(())
    }

    /// Flash, static RAM and stack, a line each.
    pub fn verdict(&self) -> String {
        let share = |bytes: u64, limit: u64| 100.0 * bytes as f64 / limit as f64;
        format!(
            "flash       {:6} of {FLASH_MAX_BYTES} bytes ({:.0} %)\n\
             static RAM  {:6} of {RAM_MAX_BYTES} bytes ({:.0} %)\n\
             stack       {:6} bytes reserved",
            self.flash,
            share(self.flash, FLASH_MAX_BYTES),
            self.ram,
            share(self.ram, RAM_MAX_BYTES),
            self.stack
        )
    }

    /// Sections and crates, a line each.
    fn table(&self) -> String {
        let mut text = format!("{:<24} {:>10} {:>8} {:>8}\n", "section", "address", "flash", "RAM");
        for (name, address, flash, ram) in &self.sections {
            let _ = writeln!(text, "{name:<24} {address:#010x} {flash:>8} {ram:>8}");
        }
        let mut crates: Vec<_> = self.crates.iter().collect();
        crates.sort_by_key(|(_, (flash, ram))| std::cmp::Reverse(flash + ram));
        let _ = writeln!(text, "\n{:<35} {:>8} {:>8}", "crate (named symbols only)", "flash", "RAM");
        for (name, (flash, ram)) in crates.into_iter().take(CRATES_SHOWN) {
            let _ = writeln!(text, "{name:<35} {flash:>8} {ram:>8}");
        }
        text
    }
}

/// The crate that a symbol comes from, by its name.
fn crate_of(symbol: &str) -> String {
    let Ok(name) = rustc_demangle::try_demangle(symbol) else { return "(no Rust name)".into() };
    let name = format!("{name:#}");
    // `<crate::Type as other::Trait>::method` belongs to the type's crate.
    let path = name.trim_start_matches(['<', '&', '*', '(', '[']);
    path.split([':', ' ', '<', '>']).next().unwrap_or(path).to_owned()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn symbols_are_counted_for_the_crate_that_wrote_them() {
        assert_eq!(crate_of("_ZN9fingertip8pipeline8Pipeline4step17h0123456789abcdefE"), "fingertip");
        assert_eq!(crate_of("_RNvMs_NtCs1234_9fingertip8pipelineNtB4_8Pipeline4step"), "fingertip");
        assert_eq!(crate_of("__aeabi_memcpy"), "(no Rust name)");
    }

    #[test]
    fn a_byte_beyond_a_limit_fails() {
        let sizes = |flash, ram| Sizes { flash, ram, stack: 0, sections: Vec::new(), crates: BTreeMap::new() };
        assert!(sizes(FLASH_MAX_BYTES, RAM_MAX_BYTES).check().is_ok());
        assert!(
            sizes(FLASH_MAX_BYTES + 1, 0).check().unwrap_err().to_string().contains("flash: 131073 bytes are 1 more")
        );
        assert!(sizes(0, RAM_MAX_BYTES + 1).check().unwrap_err().to_string().contains("static RAM"));
    }
}
