//! What exercises the fingertip core off the target: the plant, its effects, scenes and metrics.
//!
//! All of it is simulated; nothing here has touched silicon.

#[cfg(feature = "judges")]
pub mod control_table;
#[cfg(feature = "judges")]
pub mod emulator;
#[cfg(feature = "judges")]
pub mod figures;
#[cfg(feature = "judges")]
pub mod fit_cases;
#[cfg(feature = "judges")]
pub mod fit_statistics;
#[cfg(feature = "judges")]
pub mod fit_tables;
pub mod heatmap;
#[cfg(feature = "judges")]
pub mod imports;
pub mod kept;
#[cfg(feature = "judges")]
pub mod long_run;
#[cfg(feature = "judges")]
pub mod model_file;
#[cfg(feature = "judges")]
pub mod native;
pub mod optimal;
pub mod plant;
pub mod plot;
#[cfg(feature = "judges")]
pub mod prove;
pub mod say;
#[cfg(feature = "judges")]
pub mod stimulus;
#[cfg(feature = "judges")]
pub mod study;
pub mod units;

/// A record's bytes as they are written to flash.
pub fn encode<const ROWS: usize, const COLUMNS: usize>(
    record: &fingertip::store::Record<ROWS, COLUMNS>,
    sequence: u32,
) -> Vec<u8> {
    fingertip::store::words(record, sequence).flat_map(u32::to_le_bytes).collect()
}
