//! A pseudo-terminal, and a link to it that one process holds.

use output::{kept::Lock, say};
use rustix::fs::{OFlags, fcntl_getfl, fcntl_setfl};
use rustix::termios::tcgetattr;
use serial2::SerialPort;
use std::ffi::OsStr;
use std::io;
use std::os::unix::ffi::OsStrExt;
use std::path::{Path, PathBuf};

#[derive(Debug)]
pub(super) struct Pty {
    pub name: String,
    /// The finger's end, and the client's end held open so that clients may come and go.
    near: SerialPort,
    far: SerialPort,
    _link: Option<Link>,
    /// The speed of what was not heard, once that was said.
    unheard: Option<u32>,
}

/// A link to the terminal; gone when dropped.
#[derive(Debug)]
struct Link {
    path: PathBuf,
    device: PathBuf,
    _lock: Lock,
}

impl Pty {
    pub fn open(link: Option<&Path>) -> io::Result<Self> {
        let (near, far) = SerialPort::pair()?;
        let device = rustix::pty::ptsname(&near, Vec::new())?;
        let device = PathBuf::from(OsStr::from_bytes(device.as_bytes()));
        fcntl_setfl(&near, fcntl_getfl(&near)? | OFlags::NONBLOCK)?;
        let name = link.unwrap_or(&device).display().to_string();
        let link = link.map(|link| Link::make(link, device)).transpose()?;
        Ok(Self { name, near, far, _link: link, unheard: None })
    }

    pub fn near(&self) -> &SerialPort {
        &self.near
    }

    pub fn read(&mut self, baud: Option<u32>) -> Vec<u8> {
        let bytes = super::read(&self.near).unwrap_or_default();
        let (Some(baud), Some(set)) = (baud, self.baud()) else { return bytes };
        if set == baud {
            self.unheard = None;
            return bytes;
        }
        if self.unheard.replace(set) != Some(set) {
            say::aside(format_args!("unheard  a client sends at {set} baud, the finger listens at {baud}"));
        }
        Vec::new()
    }

    pub fn write(&mut self, bytes: &[u8]) {
        // Where nobody reads it is lost.
        let _ = rustix::io::write(&self.near, bytes);
    }

    /// As the client has set it.
    fn baud(&self) -> Option<u32> {
        tcgetattr(&self.far).ok().map(|settings| settings.output_speed())
    }
}

impl Link {
    fn make(path: &Path, device: PathBuf) -> io::Result<Self> {
        let lock = Lock::take_or(path, |who, lock| {
            format!(
                "{who} serves a finger at {} and holds {}: end it, or name another link",
                path.display(),
                lock.display()
            )
        })
        .map_err(|why| cannot_make(path, &why))?;
        // A link that an earlier run left behind is replaced; a file is not.
        if path.is_symlink() {
            std::fs::remove_file(path)?;
        } else if path.exists() {
            let why = "a file of this name is there: name another link, or remove the file";
            return Err(cannot_make(path, &io::Error::new(io::ErrorKind::AlreadyExists, why)));
        }
        std::os::unix::fs::symlink(&device, path).map_err(|why| cannot_make(path, &why))?;
        Ok(Self { path: path.into(), device, _lock: lock })
    }
}

impl Drop for Link {
    fn drop(&mut self) {
        // Somebody may have put another thing there.
        if std::fs::read_link(&self.path).is_ok_and(|device| device == self.device) {
            let _ = std::fs::remove_file(&self.path);
        }
    }
}

fn cannot_make(path: &Path, why: &io::Error) -> io::Error {
    io::Error::new(why.kind(), format!("cannot make the link {}: {why}", path.display()))
}
