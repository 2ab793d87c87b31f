//! Files that are there whole or not at all, and that one process writes at a time.
//!
//! A file NAME is written as NAME.new beside it, brought to the disk and then renamed: whoever reads NAME finds what
//! was there before or all that is new, whatever ends the writer. Meanwhile NAME.lock is locked. The system unlocks it
//! when its process ends, however that is, so the files of a killed process block no other process.

use std::fmt::Display;
use std::fs::{self, File, OpenOptions, TryLockError};
use std::io::{self, Read, Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};
use std::process;
use std::sync::atomic::{AtomicU64, Ordering};

/// Counts this process's locks: two of them differ as two of two processes do.
static LOCKS: AtomicU64 = AtomicU64::new(0);

/// The right to write a file; given back when it is dropped.
#[derive(Debug)]
pub struct Lock {
    pub path: PathBuf,
    lock: PathBuf,
    _file: File,
}

impl Lock {
    /// The right to write this file, whose folder is there.
    ///
    /// # Errors
    /// Another process has it, which the text names, or the folder cannot be written.
    pub fn take(path: &Path) -> io::Result<Self> {
        Self::take_or(path, |who, lock| {
            format!(
                "{} is being written by {who}, which holds {}: wait for it, or name another folder with --out",
                path.display(),
                lock.display()
            )
        })
    }

    /// The same, with another text for the holder and the lock file of a taken lock.
    pub fn take_or(path: &Path, taken: impl Fn(&str, &Path) -> String) -> io::Result<Self> {
        Self::get(path, |file, lock| match file.try_lock() {
            Ok(()) => Ok(()),
            Err(TryLockError::WouldBlock) => Err(io::Error::new(io::ErrorKind::WouldBlock, taken(&holder(file), lock))),
            Err(TryLockError::Error(error)) => Err(error),
        })
    }

    /// The same, but waits for who has it: for what is written in an instant.
    pub fn wait(path: &Path) -> io::Result<Self> {
        Self::get(path, |file, _| file.lock())
    }

    fn get(path: &Path, lock_file: impl Fn(&mut File, &Path) -> io::Result<()>) -> io::Result<Self> {
        let lock = beside(path, "lock");
        loop {
            let mut file = OpenOptions::new().create(true).truncate(false).read(true).write(true).open(&lock)?;
            lock_file(&mut file, &lock)?;
            // Who had it may have removed the file before this process had locked it: then the name is another's by
            // now.
            let mine = format!("{} {}\n", process::id(), LOCKS.fetch_add(1, Ordering::Relaxed));
            file.set_len(0)?;
            file.seek(SeekFrom::Start(0))?;
            file.write_all(mine.as_bytes())?;
            if fs::read_to_string(&lock).is_ok_and(|found| found == mine) {
                return Ok(Self { path: path.into(), lock, _file: file });
            }
        }
    }

    pub fn write(&self, bytes: impl AsRef<[u8]>) -> io::Result<()> {
        self.write_with(&self.path, bytes)
    }

    /// Replaces a file that belongs to it, and that nobody writes without this lock.
    pub fn write_with(&self, path: &Path, bytes: impl AsRef<[u8]>) -> io::Result<()> {
        let mut whole = Whole::begin(path, None)?;
        whole.write_all(bytes.as_ref())?;
        if let Ok(old) = fs::metadata(path) {
            whole.file.set_permissions(old.permissions())?;
        }
        whole.finish()
    }
}

impl Drop for Lock {
    fn drop(&mut self) {
        // It is unlocked behind this, when the file is closed.
        let _ = fs::remove_file(&self.lock);
    }
}

fn holder(file: &mut File) -> String {
    let mut text = String::new();
    // Some systems do not let others read what is locked.
    let _ = file.read_to_string(&mut text);
    text.split(' ').next().filter(|id| !id.is_empty()).map_or("another process".into(), |id| {
        if id == process::id().to_string() { "this process itself".into() } else { format!("process {id}") }
    })
}

/// A file that is there once it is finished. One that is dropped before leaves what was there as it was.
#[derive(Debug)]
pub struct Whole {
    file: File,
    new: PathBuf,
    path: PathBuf,
    /// Dropped last; none where the writer holds it.
    _lock: Option<Lock>,
}

impl Whole {
    pub fn create(path: &Path) -> io::Result<Self> {
        Self::begin(path, Some(Lock::take(path)?))
    }

    fn begin(path: &Path, lock: Option<Lock>) -> io::Result<Self> {
        let new = beside(path, "new");
        Ok(Self { file: File::create(&new)?, new, path: path.into(), _lock: lock })
    }

    pub fn finish(self) -> io::Result<()> {
        self.file.sync_all()?;
        fs::rename(&self.new, &self.path)?;
        // The folder holds the name. Not every system lets a folder be brought to the disk.
        let folder = self.path.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."));
        let _ = File::open(folder).and_then(|folder| folder.sync_all());
        Ok(())
    }
}

impl Write for Whole {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        self.file.write(bytes)
    }

    fn flush(&mut self) -> io::Result<()> {
        self.file.flush()
    }
}

impl Seek for Whole {
    fn seek(&mut self, to: SeekFrom) -> io::Result<u64> {
        self.file.seek(to)
    }
}

impl Drop for Whole {
    fn drop(&mut self) {
        // A finished file has another name by now, and nobody else begins one under this lock.
        let _ = fs::remove_file(&self.new);
    }
}

/// Replaces a file in one step, never with a part of the bytes. Writes directly to terminals, pipes and other devices.
///
/// # Errors
/// The file cannot be written; then the old one remains.
pub fn write(path: &Path, bytes: impl AsRef<[u8]>) -> io::Result<()> {
    // The target of a link is replaced, not the link.
    match fs::canonicalize(path) {
        Ok(known) if known.is_file() => Lock::wait(&known)?.write(bytes),
        Ok(known) => OpenOptions::new().write(true).open(known)?.write_all(bytes.as_ref()),
        Err(_) => Lock::wait(path)?.write(bytes),
    }
}

/// `NAME.kind` beside `NAME`.
pub fn beside(path: &Path, kind: impl Display) -> PathBuf {
    let mut name = path.file_name().unwrap_or_default().to_owned();
    name.push(format!(".{kind}"));
    path.with_file_name(name)
}
