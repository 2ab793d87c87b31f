//! Scenes: simulate only the effects that a scene names.
//!
//! A scene is a text file (TOML) with the finger, the object, the requested forces and the effects. An effect that the
//! scene does not name has no state, is never called, and costs nothing.
//!
//! The steps of a run: [`scene`] reads the file; [`effects`] builds the named effects; the world moves the finger and
//! fills the frames; the core's `Pipeline::step` answers each frame with a duty; watchers ([`watch`]) see the run step
//! by step: metrics, ledger, recording, report.
//!
//! Everything is simulated; nothing here was measured on hardware.

#![expect(missing_docs, reason = "a name that tells quantity and unit has no comment that repeats it")]

#[cfg(feature = "files")]
pub mod cli;
pub mod cores;
pub mod demo;
pub mod effects;
pub mod events;
#[cfg(feature = "files")]
pub mod explain;
pub mod host;
pub mod mechanics;
pub mod metrics;
pub mod native;
#[cfg(feature = "files")]
mod part;
pub mod plant;
#[cfg(feature = "files")]
pub mod population;
#[cfg(feature = "files")]
pub mod recording;
#[cfg(feature = "files")]
pub mod report;
pub mod run;
pub mod scene;
pub mod setup;
#[cfg(feature = "files")]
pub mod shards;
#[cfg(feature = "files")]
pub mod sweep;
pub mod watch;
pub mod world;

pub use native::{SimError, simulate};

/// Returns the bytes of a record as they are written to flash.
pub fn encode<const ROWS: usize, const COLUMNS: usize>(
    record: &fingertip::store::Record<ROWS, COLUMNS>,
    sequence: u32,
) -> Vec<u8> {
    fingertip::store::words(record, sequence).flat_map(u32::to_le_bytes).collect()
}

/// Defines the test `name` of the usual size, and `name::long_` of a larger size or of the other cases.
///
/// `cargo xtask test --long` runs the latter. `cases: a, b` is short for `cases(a), cases(b)`.
#[macro_export]
macro_rules! sizes {
    ($name:ident, $cases:ident: $usual:expr, $long:expr) => {
        $crate::sizes!($name, $cases($usual), $cases($long));
    };
    ($name:ident, $usual:expr, $long:expr) => {
        #[test]
        fn $name() {
            $usual;
        }

        mod $name {
            #[test]
            #[ignore = "long: cargo xtask test --long"]
            fn long_() {
                use super::*;
                $long;
            }
        }
    };
}
