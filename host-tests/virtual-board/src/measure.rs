//! What a run is measured by.

use serde::{Deserialize, Serialize};

/// From the last conversion of a frame to the new duty.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Latency {
    /// Frames that were answered by a duty.
    pub frames: u64,
    /// The longest.
    pub max_ns: u64,
    /// The shortest.
    pub min_ns: u64,
    open: Option<(u64, u64)>,
}

impl Default for Latency {
    fn default() -> Self {
        Self { frames: 0, max_ns: 0, min_ns: u64::MAX, open: None }
    }
}

impl Latency {
    /// A duty was written; the last write after a frame's end counts.
    pub fn duty_written(&mut self, at_ns: u64, frame_end_ns: u64) {
        if frame_end_ns == 0 {
            return;
        }
        if self.open.is_some_and(|(end_ns, _)| end_ns != frame_end_ns) {
            self.close();
        }
        self.open = Some((frame_end_ns, at_ns));
    }

    /// Counts the frame whose duty is complete.
    pub fn close(&mut self) {
        if let Some((end_ns, at_ns)) = self.open.take() {
            let latency_ns = at_ns - end_ns;
            self.max_ns = self.max_ns.max(latency_ns);
            self.min_ns = self.min_ns.min(latency_ns);
            self.frames += 1;
        }
    }
}

/// A pin's level changed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct PinEdge {
    /// Its number in its port.
    pub pin: usize,
    /// Virtual time.
    pub at_ns: u64,
    /// Whether it is high from then on.
    pub high: bool,
}

/// The bridge went on or off.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct BridgeEdge {
    /// Virtual time.
    pub at_ns: u64,
    /// Whether it drives from then on.
    pub on: bool,
}
