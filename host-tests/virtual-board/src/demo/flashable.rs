//! Bytes of the flash: those that the emulated board runs, and that a probe would write.

use crate::image::Firmware;
use crate::{Error, Rig};
use object::LittleEndian;
use object::elf::{FileHeader32, PT_LOAD};
use object::read::elf::{ElfFile, ProgramHeader};
use rigless::soc::Width;

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
    ///
    /// # Errors
    /// The image is not for a 32-bit microcontroller, or loads nothing.
    pub fn of(image: &Firmware) -> Result<Self, Error> {
        let fail = |why: &str| Error::NotAnImage { path: image.path().into(), why: why.to_owned() };
        let file = ElfFile::<FileHeader32<LittleEndian>>::parse(image.elf()).map_err(|why| fail(&why.to_string()))?;
        let mut segments = Vec::new();
        for header in file.elf_program_headers() {
            if header.p_type(LittleEndian) == PT_LOAD && header.p_filesz(LittleEndian) > 0 {
                let bytes =
                    header.data(LittleEndian, image.elf()).map_err(|()| fail("a segment lies outside the file"))?;
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
    ///
    /// # Errors
    /// Some byte differs.
    pub fn check_loaded(&self, rig: &mut Rig) -> Result<(), Error> {
        let Self { base, bytes } = self.clone();
        let path = rig.image().path().to_owned();
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
            Some(at) => {
                Err(Error::NotAnImage { path, why: format!("the emulated flash differs from it at {at:#010x}") })
            }
        }
    }
}
