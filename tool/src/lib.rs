//! A fingertip controller from the host's side: the bus, the registers by name, and what `fingertip` does with them.
//!
//! [`Client`] talks DYNAMIXEL Protocol 2.0 by the core's own packets; [`table`] finds registers and what their numbers
//! mean in the core's own control table. So neither can differ from the firmware of the same version. [`Error`] is what
//! failed, where, and what to do about it.

#![allow(missing_docs, reason = "the parts of one program, which only its tests use from elsewhere")]

pub mod client;
pub mod commands;
pub mod numbers;
pub mod recordings;
pub mod state;
pub mod table;
pub mod whole;

pub use client::Client;
use fingertip::link::packet::StatusError;

#[derive(Debug, thiserror::Error)]
pub enum Error {
    #[error("cannot open {0}: {1}{ports}", ports = ports_there())]
    Open(String, std::io::Error),
    #[error("no port: name one with --port, or in FINGERTIP_PORT{}", ports_there())]
    NoPort,
    #[error("{0}: {1}; is it still connected?")]
    Port(String, std::io::Error),
    #[error("{0}")]
    Silent(String),
    #[error("{0}")]
    Damaged(String),
    #[error("{0}")]
    Refused(String, u8),
    /// The command line asks for something that does not exist; nothing was sent.
    #[error("{0}")]
    NotUnderstood(String),
    /// A force was reached, but did not stay within its tolerance.
    #[error("{0}")]
    NotHeld(String),
    /// A signal ended a command that moves the finger.
    #[error("interrupted before its end; torque is off")]
    Interrupted,
    #[error("{0}")]
    Other(String),
}

impl Error {
    /// The exit code of the program, as docs/host.md lists them.
    pub fn exit_code(&self) -> u8 {
        match self {
            Self::NotUnderstood(_) => 2,
            Self::NotHeld(_) => 3,
            // As a shell has it for Ctrl-C.
            Self::Interrupted => 130,
            _ => 1,
        }
    }

    pub fn refused_with(&self, wanted: StatusError) -> bool {
        matches!(self, Self::Refused(_, number) if *number == wanted as u8)
    }

    /// True if the line may be what was wrong, so that it may go well the next time.
    pub fn is_noise(&self) -> bool {
        matches!(self, Self::Silent(_) | Self::Damaged(_)) || self.refused_with(StatusError::Crc)
    }

    pub fn file(doing: &str, path: &std::path::Path, why: impl std::fmt::Display) -> Self {
        Self::Other(format!("cannot {doing} {}: {why}", path.display()))
    }
}

impl From<String> for Error {
    fn from(text: String) -> Self {
        Self::Other(text)
    }
}

impl From<&str> for Error {
    fn from(text: &str) -> Self {
        Self::Other(text.into())
    }
}

/// The serial ports of this machine, for people.
fn ports_there() -> String {
    let ports = client::ports();
    if ports.is_empty() {
        return "; this machine has no serial port (a simulated finger: `cargo xtask serve`)".into();
    }
    format!("; serial ports that are there: {}", ports.join(", "))
}
