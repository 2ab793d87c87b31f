//! The digest of a run: every duty and every byte on the bus, with its time.

use serde::{Deserialize, Serialize};

/// A chained SHA-256; small enough to travel in a snapshot.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Trace {
    state: [u8; 32],
    records: u64,
}

/// What a record is about.
#[derive(Clone, Copy, Debug)]
pub enum Record {
    /// A value written to a register of the bridge's timer: its offset and the value.
    Pwm(u16, u32),
    /// A byte from the image.
    Sent(u8),
    /// The bridge was switched off (false) or on.
    Bridge(bool),
}

impl Trace {
    /// Adds a record.
    pub fn add(&mut self, at_ns: u64, record: Record) {
        let (kind, value) = match record {
            Record::Pwm(offset, value) => (1_u64 << 56 | u64::from(offset) << 32, value),
            Record::Sent(byte) => (2 << 56, u32::from(byte)),
            Record::Bridge(on) => (3 << 56, u32::from(on)),
        };
        let mut block = [0; 48];
        block[..32].copy_from_slice(&self.state);
        block[32..40].copy_from_slice(&at_ns.to_le_bytes());
        block[40..].copy_from_slice(&(kind | u64::from(value)).to_le_bytes());
        self.state = rigless::snapshot::digest(&block);
        self.records += 1;
    }

    /// How many records it is made of.
    pub fn records(&self) -> u64 {
        self.records
    }

    /// The digest, in hexadecimal.
    pub fn hash(&self) -> String {
        self.state.iter().map(|byte| format!("{byte:02x}")).collect()
    }
}
