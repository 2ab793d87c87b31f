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

// Bytes of the flash: those that the emulated board runs, and that a probe would write.

/// Address of the first byte of flash.
const FLASH: u64 = 0x0800_0000;

#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Flashable {
    /// Bytes from the first address of the flash on.
    pub bytes: Vec<u8>,
}

impl Flashable {
    /// Reads the bytes that `cargo xtask build` writes beside an image.
    pub fn of(image: &Firmware) -> Result<Self, Error> {
        let path = image.path.with_extension("bin");
        let bytes = std::fs::read(&path).map_err(|why| Error::ReadImage(path, why))?;
        Ok(Self { bytes })
    }

    pub fn sha256(&self) -> String {
        rigless::snapshot::digest(&self.bytes).iter().map(|byte| format!("{byte:02x}")).collect()
    }

    /// Checks that the emulated flash holds exactly these bytes.
    pub fn check_loaded(&self, rig: &mut Rig) -> Result<(), Error> {
        let bytes = self.bytes.clone();
        let path = rig.image().path.clone();
        let differs = rig.with(move |stand| {
            let mut places = (FLASH..).zip(bytes);
            places.find(|(at, byte)| stand.host.read(*at, Width::W8).ok() != Some(u64::from(*byte)))
        })?;
        match differs {
            None => Ok(()),
            Some((at, _)) => Err(Error::NotAnImage(path, format!("the emulated flash differs from it at {at:#010x}"))),
        }
    }
}
