//! Measurements of a run: latency, edges, and a digest of all duties and bytes.

/// Time from the last conversion of a frame to the new duty.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Latency {
    /// Number of frames that got a duty.
    pub frames: u64,
    /// Longest time, ns.
    pub max_ns: u64,
    /// Shortest time, ns.
    pub min_ns: u64,
    open: Option<(u64, u64)>,
}

impl Default for Latency {
    fn default() -> Self {
        Self { frames: 0, max_ns: 0, min_ns: u64::MAX, open: None }
    }
}

impl Latency {
    /// Records a duty. The last write after the end of a frame counts.
    pub fn duty_written(&mut self, at_ns: u64, frame_end_ns: u64) {
        if frame_end_ns == 0 {
            return;
        }
        if self.open.is_some_and(|(end_ns, _)| end_ns != frame_end_ns) {
            self.close();
        }
        self.open = Some((frame_end_ns, at_ns));
    }

    /// Counts the frame whose last duty was recorded.
    pub fn close(&mut self) {
        if let Some((end_ns, at_ns)) = self.open.take() {
            let latency_ns = at_ns - end_ns;
            self.max_ns = self.max_ns.max(latency_ns);
            self.min_ns = self.min_ns.min(latency_ns);
            self.frames += 1;
        }
    }
}

/// Change of a pin's level.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct PinEdge {
    /// Number of the pin in its port.
    pub pin: usize,
    /// Virtual time.
    pub at_ns: u64,
    /// True if the pin is high after the edge.
    pub high: bool,
}

/// Change of the bridge between on and off.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct BridgeEdge {
    /// Virtual time.
    pub at_ns: u64,
    /// True if the bridge drives after the edge.
    pub on: bool,
}

/// A chained SHA-256 of every duty and every byte on the bus, with their times.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Trace {
    state: [u8; 32],
    records: u64,
}

/// Content of a record.
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

    /// Number of records in the digest.
    pub fn records(&self) -> u64 {
        self.records
    }

    /// The digest, in hexadecimal.
    pub fn hash(&self) -> String {
        self.state.iter().map(|byte| format!("{byte:02x}")).collect()
    }
}
