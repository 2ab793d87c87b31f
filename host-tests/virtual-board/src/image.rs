//! The flash image: its bytes, its symbols, its log table.

use crate::Error;
use crate::rig::Rig;
use object::elf::{FileHeader32, PT_LOAD};
use object::read::elf::{ElfFile, ProgramHeader};
use object::{LittleEndian, Object, ObjectSymbol};
use rigless::soc::Width;
use std::path::{Path, PathBuf};

/// An ELF as the linker left it and as it is flashed.
#[derive(Clone, Debug)]
pub struct Firmware {
    pub path: PathBuf,
    /// The file's bytes.
    pub elf: Vec<u8>,
    symbols: Vec<(String, u64)>,
}

impl Firmware {
    /// Reads an image.
    pub fn read(path: &Path) -> Result<Self, Error> {
        let elf = std::fs::read(path).map_err(|why| Error::ReadImage(path.into(), why))?;
        let file =
            object::File::parse(elf.as_slice()).map_err(|why| Error::NotAnImage(path.into(), why.to_string()))?;
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

/// Value of an erased byte of flash.
const ERASED: u8 = 0xff;
/// Upper bound of the flash size, bytes: more than the largest part has.
const SPAN_MAX: usize = 2 << 20;

/// The flash's content.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Flashable {
    /// Address of the first byte.
    pub base: u32,
    /// Bytes from the base address on; gaps between segments read as erased.
    pub bytes: Vec<u8>,
}

impl Flashable {
    /// Lays out the loadable segments of an image by their load addresses.
    pub fn of(image: &Firmware) -> Result<Self, Error> {
        let fail = |why: &str| Error::NotAnImage(image.path.clone(), why.to_owned());
        let file = ElfFile::<FileHeader32<LittleEndian>>::parse(&*image.elf).map_err(|why| fail(&why.to_string()))?;
        let mut segments = Vec::new();
        for header in file.elf_program_headers() {
            if header.p_type(LittleEndian) == PT_LOAD && header.p_filesz(LittleEndian) > 0 {
                let bytes =
                    header.data(LittleEndian, &*image.elf).map_err(|()| fail("a segment lies outside the file"))?;
                segments.push((header.p_paddr(LittleEndian), bytes));
            }
        }
        let base = segments.iter().map(|(start, _)| *start).min().ok_or_else(|| fail("it loads nothing"))?;
        let mut bytes = Vec::new();
        for (start, segment) in segments {
            let start = (start - base) as usize;
            let end = start + segment.len();
            if end > SPAN_MAX {
                return Err(fail("its segments lie farther apart than any flash is large"));
            }
            bytes.resize(bytes.len().max(end), ERASED);
            bytes[start..end].copy_from_slice(segment);
        }
        Ok(Self { base, bytes })
    }

    /// SHA-256, in hexadecimal.
    pub fn sha256(&self) -> String {
        rigless::snapshot::digest(&self.bytes).iter().map(|byte| format!("{byte:02x}")).collect()
    }

    /// Checks that the emulated flash holds exactly these bytes.
    pub fn check_loaded(&self, rig: &mut Rig) -> Result<(), Error> {
        let Self { base, bytes } = self.clone();
        let path = rig.image().path.clone();
        let differs = rig.with(move |stand| {
            let at = |place: usize| u64::from(base) + place as u64;
            let mut places = bytes.iter().enumerate();
            let mut same =
                |place, byte| stand.host.read(at(place), Width::W8).is_ok_and(|read| read == u64::from(byte));
            let wrong = places.find(|(place, byte)| !same(*place, **byte));
            wrong.map(|(place, _)| at(place))
        })?;
        match differs {
            None => Ok(()),
            Some(at) => Err(Error::NotAnImage(path, format!("the emulated flash differs from it at {at:#010x}"))),
        }
    }
}
