//! What a run was, in one number.

use fingertip::frame::{Frame, Sense};
use fingertip::pipeline::{Command, Status};
use fingertip::record::{self, Record};
use fingertip::units::Duty;
use sha2::{Digest as _, Sha256};

/// SHA-256 over what every control step took and gave, in order.
pub struct Digest(Sha256);

impl Digest {
    /// Of nothing.
    pub fn new() -> Self {
        Self(Sha256::new())
    }

    /// Adds a step: the record of what it took, and the record's digest of what it gave.
    pub fn add(&mut self, frame: &Frame, sense: &Sense, command: &Command, duty: Duty, status: &Status) {
        let record = Record { frame: *frame, sense: *sense, command: *command };
        self.0.update(record.to_bytes());
        let mut gave = record::Digest::new();
        gave.add(duty, status);
        self.0.update(gave.value().to_le_bytes());
    }

    /// In hexadecimal.
    pub fn hex(&self) -> String {
        let bytes = self.0.clone().finalize();
        bytes.iter().map(|byte| format!("{byte:02x}")).collect()
    }
}
