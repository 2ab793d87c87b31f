//! The flash image: its bytes, its symbols, its log table.

use crate::error::Error;
use object::{Object, ObjectSymbol};
use std::path::{Path, PathBuf};

/// An ELF as the linker left it and as it is flashed.
#[derive(Clone, Debug)]
pub struct Firmware {
    path: PathBuf,
    elf: Vec<u8>,
    symbols: Vec<(String, u64)>,
}

impl Firmware {
    /// Reads an image.
    ///
    /// # Errors
    /// The file is missing, or is no ELF.
    pub fn read(path: &Path) -> Result<Self, Error> {
        let elf = std::fs::read(path).map_err(|source| Error::ReadImage { path: path.into(), source })?;
        let file = object::File::parse(elf.as_slice())
            .map_err(|source| Error::NotAnImage { path: path.into(), why: source.to_string() })?;
        let symbols = file.symbols().filter_map(|symbol| Some((symbol.name().ok()?.to_owned(), symbol.address())));
        let symbols = symbols.collect();
        Ok(Self { path: path.into(), elf, symbols })
    }

    /// Path of the image file.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// The file's bytes.
    pub fn elf(&self) -> &[u8] {
        &self.elf
    }

    /// The address of an item of the firmware's, by the end of its path: module and name.
    pub fn item(&self, module: &str, name: &str) -> Option<u64> {
        // As both ways of mangling write it.
        let path = format!("{}{module}{}{name}", module.len(), name.len());
        self.symbols.iter().find(|(of, _)| of.contains(&path)).map(|(_, address)| *address)
    }

    /// The address of a symbol.
    pub fn symbol(&self, name: &str) -> Option<u64> {
        self.symbols.iter().find(|(of, _)| of == name).map(|(_, address)| *address)
    }
}
