//! Progress of a long piece of work, one line each, so that it can continue after a stop.
//!
//! A line is `<CRC-64 of the text, 16 hexadecimal digits> <text>`. The first line names the work. A line that was cut
//! off or is damaged is ignored, and its work is done again.

use crate::run::RunError;
use output::kept::{self, Lock};
use std::fs::{self, File, OpenOptions};
use std::io::{self, ErrorKind, Write as _};
use std::path::{Path, PathBuf};

const CRC: crc::Crc<u64> = crc::Crc::<u64>::new(&crc::CRC_64_XZ);

/// Lines of a future file NAME so far. They are in NAME.part, and only this process writes NAME.
#[derive(Debug)]
pub struct Part {
    /// Lock on NAME and on the files that are made of the lines.
    pub lock: Lock,
    path: PathBuf,
    file: File,
    /// Length up to the end of the last whole line.
    length: u64,
}

impl Part {
    /// Resumes from the lines of an earlier try of the same work, or begins. Creates the folder.
    ///
    /// # Errors
    /// Another process does this work, the file has lines of other work, or it cannot be written.
    pub fn open(of: &Path, head: &str) -> Result<(Self, Vec<String>), RunError> {
        if let Some(folder) = of.parent().filter(|folder| !folder.as_os_str().is_empty()) {
            make_folder(folder)?;
        }
        // Replaces the target of a link, not the link.
        let of = &fs::canonicalize(of).unwrap_or(of.into());
        let lock = Lock::take(of).map_err(|error| cannot_write(of, &error))?;
        let path = kept::beside(of, "part");
        let bytes = match fs::read(&path) {
            Err(error) if error.kind() == ErrorKind::NotFound => Vec::new(),
            bytes => bytes.map_err(|error| format!("cannot read {}: {error}", path.display()))?,
        };
        let mut known = bytes.split_inclusive(|byte| *byte == b'\n').map(whole);
        let lines: Vec<String> = match known.next().flatten() {
            // The file has at most the head.
            _ if line(head).as_bytes().starts_with(&bytes) => Vec::new(),
            Some(found) if found == head => known.flatten().map(str::to_owned).collect(),
            found => {
                let whose = found.unwrap_or("something that cannot be read");
                return Err(format!(
                    "{} holds what is done of {whose}, not of {head}: finish that, move the file away, or name another place",
                    path.display()
                )
                .into());
            }
        };
        // Rewrites the file, so that it has only whole lines.
        let whole: String = std::iter::once(head).chain(lines.iter().map(String::as_str)).map(line).collect();
        let failed = |error: io::Error| cannot_write(&path, &error);
        if bytes != whole.as_bytes() {
            lock.write_with(&path, &whole).map_err(failed)?;
        }
        let file = OpenOptions::new().append(true).open(&path).map_err(failed)?;
        Ok((Self { lock, path, file, length: whole.len() as u64 }, lines))
    }

    pub fn add(&mut self, text: &str) -> Result<(), RunError> {
        let line = line(text);
        if let Err(error) = self.file.write_all(line.as_bytes()) {
            let _ = self.file.set_len(self.length);
            return Err(format!("{}; what was done before is kept there", cannot_write(&self.path, &error)).into());
        }
        self.length += line.len() as u64;
        Ok(())
    }

    pub fn write(&self, bytes: impl AsRef<[u8]>) -> Result<(), RunError> {
        let told = |error| {
            format!("{}; all that was done is kept in {}", cannot_write(&self.lock.path, &error), self.path.display())
        };
        Ok(self.lock.write(bytes).map_err(told)?)
    }

    /// Removes the lines once everything made of them is written.
    pub fn done(self) -> Result<(), RunError> {
        Ok(fs::remove_file(&self.path).map_err(|error| format!("cannot remove {}: {error}", self.path.display()))?)
    }
}

/// Replaces a file. After a failure an earlier file remains.
pub fn write(path: &Path, bytes: impl AsRef<[u8]>) -> Result<(), RunError> {
    Ok(kept::write(path, bytes).map_err(|error| cannot_write(path, &error))?)
}

pub fn make_folder(folder: &Path) -> Result<(), String> {
    fs::create_dir_all(folder).map_err(|error| format!("cannot make {}: {error}", folder.display()))
}

/// Explains to people that a file cannot be written, and what to do.
pub fn cannot_write(path: &Path, error: &io::Error) -> String {
    let advice = match error.kind() {
        // The error of the lock names the other process.
        ErrorKind::WouldBlock => return error.to_string(),
        ErrorKind::StorageFull | ErrorKind::QuotaExceeded | ErrorKind::FileTooLarge => {
            ": make room and give the same command again"
        }
        _ => "",
    };
    format!("cannot write {}: {error}{advice}", path.display())
}

/// Check word of a text: CRC-64 in 16 hexadecimal digits.
pub fn check(text: &str) -> String {
    format!("{:016x}", CRC.checksum(text.as_bytes()))
}

fn line(text: &str) -> String {
    format!("{} {text}\n", check(text))
}

/// Text of a line; none if it is cut off or damaged.
fn whole(line: &[u8]) -> Option<&str> {
    let text = str::from_utf8(line.strip_suffix(b"\n")?).ok()?;
    let (found, text) = text.split_once(' ')?;
    (found == check(text)).then_some(text)
}
