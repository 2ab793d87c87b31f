//! What a board begins with: what a run may be told, and what stands in its memory.

use crate::error::Error;
use crate::flash::SECTOR;
use crate::image::Firmware;
use crate::inside;
use fingertip::chip::Factory;
use fingertip::params::Params;
use fingertip::shipped::Record;
use rigless::image::Image;
use std::num::NonZeroU64;
use std::path::Path;

/// What a run may be told beforehand.
#[derive(Clone, Debug)]
pub struct Options {
    /// Instructions that the core retires in a second, flat: 125 million is a CPI of 1.34 at 168 MHz, what the
    /// cycle estimate of the control step comes to.
    pub instructions_per_second: NonZeroU64,
    /// Bytes that stand in memory beside the image, at their addresses: a parameter sector for example.
    pub presets: Vec<(u64, Vec<u8>)>,
    /// Bits 3:2 of the option bytes: 0 is the brown-out level 3, as `cargo xtask flash` leaves them, and 3 is off, as
    /// the factory does.
    pub brown_out_bits: u8,
    /// What the factory kept of the reference and of the sensor.
    pub factory: Factory,
}

impl Options {
    /// A board whose flash holds that its motor goes the right way: torque is refused before that is known.
    pub fn confirmed() -> Self {
        let params = Params { direction_confirmed: 1, ..Params::DEFAULT };
        let record = sim::encode(&Record { params, ..Record::DEFAULT }, 0);
        Self { presets: vec![(SECTOR.start, record)], ..Self::default() }
    }
}

impl Default for Options {
    fn default() -> Self {
        Self {
            instructions_per_second: NonZeroU64::new(125_000_000).expect("the core runs"),
            presets: Vec::new(),
            brown_out_bits: 0,
            factory: inside::factory(),
        }
    }
}

/// The image, the factory's calibration, and the presets.
pub(super) fn images(image: &Firmware, options: &Options) -> Result<Vec<Image>, Error> {
    let read = |path: &Path, bytes: Vec<u8>, at| {
        Image::new(path, bytes, at).map_err(|why| Error::NotAnImage { path: path.into(), why: why.to_string() })
    };
    let mut images = vec![read(image.path(), image.elf().to_vec(), None)?];
    let Factory { reference, sensor: [cold, hot] } = options.factory;
    let factory = [reference, cold, hot].map(u16::to_le_bytes).concat();
    images.push(read(Path::new("factory"), factory, Some(inside::FACTORY_AT))?);
    for (address, bytes) in &options.presets {
        images.push(read(Path::new("preset"), bytes.clone(), Some(*address))?);
    }
    Ok(images)
}
