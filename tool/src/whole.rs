//! Files that are in their place once they are whole: written beside it as `FILE.part`, by one program at a time. What is
//! there already, as a file or as what a killed program left of one, is written over only by force.

use crate::Error;
use rustix::fs::{FlockOperation, flock};
use std::fs::{self, File, Metadata, OpenOptions};
use std::io::{self, Write as _};
use std::os::unix::fs::MetadataExt as _;
use std::path::{Path, PathBuf};

fn is_same(there: &Metadata, file: &File) -> bool {
    file.metadata().is_ok_and(|own| (own.dev(), own.ino()) == (there.dev(), there.ino()))
}

pub struct Part {
    file: File,
    part: PathBuf,
    place: PathBuf,
    force: bool,
}

impl Part {
    /// Begins it: `FILE.part`, empty. What is at the place stays as it is until [`Self::place`]. Fails if something is there
    /// and `force` is not set, if it is no file, as a device or a pipe, and if another program is at it.
    pub fn begin(place: &Path, force: bool) -> Result<Self, Error> {
        let failed = |why: io::Error| Error::file("write", place, why);
        let is_file = fs::metadata(place).map_or(true, |there| there.is_file());
        let (Some(name), true) = (place.file_name(), is_file) else {
            return Err(Error::file("write", place, "it is no file"));
        };
        let mut part = name.to_owned();
        part.push(".part");
        let part = place.with_file_name(part);
        let file = OpenOptions::new().create(true).truncate(false).write(true).open(&part).map_err(failed)?;
        let locked = flock(&file, FlockOperation::NonBlockingLockExclusive).is_ok();
        // One that was put in its place before the lock was there is another's, and whole.
        if !locked || !fs::metadata(&part).is_ok_and(|there| is_same(&there, &file)) {
            return Err(Error::file("write", place, format_args!("another program is writing {}", part.display())));
        }
        let begun = Self { file, part, place: place.into(), force };
        if !force {
            free(place)?;
            if begun.file.metadata().map_err(failed)?.len() > 0 {
                let left = begun.part.display();
                let why = format!("an earlier command left {left} unfinished: rename it, or --force writes over it");
                return Err(why.into());
            }
        }
        begun.file.set_len(0).map_err(failed)?;
        Ok(begun)
    }

    pub fn file(&self) -> io::Result<File> {
        self.file.try_clone()
    }

    /// Moves the complete file to its place. Where another file took the place meanwhile, the part stays beside it.
    pub fn place(self) -> Result<(), Error> {
        let failed = |why: io::Error| Error::file("write", &self.place, why);
        self.file.sync_all().map_err(failed)?;
        if !self.force {
            free(&self.place).map_err(|why| format!("{why}; what was to be written is in {}", self.part.display()))?;
        }
        fs::rename(&self.part, &self.place).map_err(failed)
    }
}

impl Drop for Part {
    fn drop(&mut self) {
        // A failed command wrote nothing. Once the file was renamed, its old name may belong to another program.
        if fs::metadata(&self.part).is_ok_and(|there| there.len() == 0 && is_same(&there, &self.file)) {
            let _ = fs::remove_file(&self.part);
        }
    }
}

pub fn write(place: &Path, force: bool, bytes: &[u8]) -> Result<(), Error> {
    let mut part = Part::begin(place, force)?;
    part.file.write_all(bytes).map_err(|why| Error::file("write", place, why))?;
    part.place()
}

fn free(place: &Path) -> Result<(), Error> {
    if fs::symlink_metadata(place).is_err() {
        return Ok(());
    }
    Err(format!("{} is there already: --force writes over it", place.display()).into())
}
