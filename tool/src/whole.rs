//! Files that are in their place once they are whole: written beside it, by one program at a time.

use crate::Error;
use rustix::fs::{FlockOperation, flock};
use std::fs::{self, File, Metadata, OpenOptions};
use std::io;
use std::os::unix::fs::MetadataExt as _;
use std::path::{Path, PathBuf};

fn is_same(there: &Metadata, file: &File) -> bool {
    file.metadata().is_ok_and(|own| (own.dev(), own.ino()) == (there.dev(), there.ino()))
}

/// A file on its way.
#[derive(Debug)]
pub struct Part {
    file: File,
    part: PathBuf,
    place: PathBuf,
}

impl Part {
    /// Begins it: `FILE.new`, empty. What is at the place stays as it is until [`Self::place`].
    ///
    /// # Errors
    /// What is at the place is no file, as a device or a pipe; it cannot be written; or another program is at it.
    pub fn begin(place: &Path) -> Result<Self, Error> {
        let failed = |why: io::Error| Error::file("write", place, why);
        let is_file = fs::metadata(place).map_or(true, |there| there.is_file());
        let (Some(name), true) = (place.file_name(), is_file) else {
            return Err(Error::file("write", place, "it is no file"));
        };
        let mut part = name.to_owned();
        part.push(".new");
        let part = place.with_file_name(part);
        let file = OpenOptions::new().create(true).truncate(false).write(true).open(&part).map_err(failed)?;
        let locked = flock(&file, FlockOperation::NonBlockingLockExclusive).is_ok();
        // One that was put in its place before the lock was there is another's, and whole.
        if !locked || !fs::metadata(&part).is_ok_and(|there| is_same(&there, &file)) {
            return Err(Error::file("write", place, format_args!("another program is writing {}", part.display())));
        }
        file.set_len(0).map_err(failed)?;
        Ok(Self { file, part, place: place.into() })
    }

    /// What is written to.
    ///
    /// # Errors
    /// The system has no more handles.
    pub fn file(&self) -> io::Result<File> {
        self.file.try_clone()
    }

    /// It is whole: puts it in its place.
    ///
    /// # Errors
    /// It cannot be moved there.
    pub fn place(self) -> io::Result<()> {
        self.file.sync_all()?;
        fs::rename(&self.part, &self.place)
    }
}
