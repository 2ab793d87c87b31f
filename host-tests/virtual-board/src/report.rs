//! What a run has come to so far.

use crate::error::Error;
use crate::measure::{BridgeEdge, Latency};
use crate::rig::Rig;
use rigless::device::ResetCause;

/// A reset of the microcontroller.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Reset {
    /// Virtual time.
    pub at_ns: u64,
    /// `software`, `pin`, `power`, or the name of the peripheral that asked for it: `IWDG`.
    pub cause: String,
}

impl Rig {
    /// Instructions retired since power-on.
    ///
    /// # Errors
    /// The emulator stopped.
    pub fn instructions(&mut self) -> Result<u64, Error> {
        self.with(|stand| stand.stop.instruction_count)
    }

    /// From the last conversion of each frame to the duty that answered it.
    ///
    /// # Errors
    /// The emulator stopped.
    pub fn latency(&mut self) -> Result<Latency, Error> {
        self.with(|stand| stand.bench.latency.clone())
    }

    /// When the bridge went on and off.
    ///
    /// # Errors
    /// The emulator stopped.
    pub fn bridge_edges(&mut self) -> Result<Vec<BridgeEdge>, Error> {
        self.with(|stand| stand.bench.bridge_edges.clone())
    }

    /// The resets since power-on.
    ///
    /// # Errors
    /// The emulator stopped.
    pub fn resets(&mut self) -> Result<Vec<Reset>, Error> {
        self.with(|stand| {
            let resets = stand.session.resets().iter();
            resets.map(|reset| Reset { at_ns: reset.at.0, cause: cause(reset.cause) }).collect()
        })
    }
}

fn cause(cause: ResetCause) -> String {
    match cause {
        ResetCause::Core => "software".to_owned(),
        ResetCause::Model(instance) => instance.to_owned(),
        ResetCause::Pin => "pin".to_owned(),
        ResetCause::PowerOn => "power".to_owned(),
        other => format!("{other:?}"),
    }
}
