//! The flash image: its bytes and its symbols.

use crate::Error;
use crate::rig::Rig;
use object::{Object, ObjectSymbol};
use rigless::soc::Width;
use std::path::{Path, PathBuf};

/// An ELF as the linker left it and as it is flashed.
#[derive(Clone, Debug)]
pub struct Firmware {
    pub path: PathBuf,
    pub elf: Vec<u8>,
    symbols: Vec<(String, u64)>,
}

impl Firmware {
    pub fn read(path: &Path) -> Result<Self, Error> {
        let elf = std::fs::read(path).map_err(|why| Error::ReadImage(path.into(), why))?;
        let file = object::File::parse(&*elf).map_err(|why| Error::NotAnImage(path.into(), why.to_string()))?;
        let symbols = file.symbols().filter_map(|symbol| Some((symbol.name().ok()?.to_owned(), symbol.address())));
        Ok(Self { path: path.into(), symbols: symbols.collect(), elf })
    }

    /// The address of an item of the firmware's, by the end of its path: module and name.
    pub fn item(&self, module: &str, name: &str) -> Option<u64> {
        // As both ways of mangling write it.
        let path = format!("{}{module}{}{name}", module.len(), name.len());
        self.symbols.iter().find(|(of, _)| of.contains(&path)).map(|(_, address)| *address)
    }

    pub fn symbol(&self, name: &str) -> Option<u64> {
        self.symbols.iter().find(|(of, _)| of == name).map(|(_, address)| *address)
    }
}

/// Address of the first byte of flash.
const FLASH: u64 = 0x0800_0000;

/// Bytes in hexadecimal.
pub fn hex(bytes: &[u8]) -> String {
    bytes.iter().map(|byte| format!("{byte:02x}")).collect()
}

impl Rig {
    /// Bytes from the first address of the flash on, which `cargo xtask build` writes beside an image. Fails if the
    /// emulated flash does not hold exactly these.
    pub fn flashed(&mut self) -> Result<Vec<u8>, Error> {
        let path = self.image.path.with_extension("bin");
        let bytes = std::fs::read(&path).map_err(|why| Error::ReadImage(path, why))?;
        let mut places = (FLASH..).zip(bytes.clone());
        let differs = self.with(move |stand| {
            places.find(|(at, byte)| stand.host.read(*at, Width::W8).ok() != Some(u64::from(*byte)))
        })?;
        differs.map_or(Ok(bytes), |(at, _)| {
            let why = format!("the emulated flash differs from it at {at:#010x}");
            Err(Error::NotAnImage(self.image.path.clone(), why))
        })
    }
}
