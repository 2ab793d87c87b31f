//! What a run leaves behind: metrics, ledger, recording, report, sweep.

mod measured;
mod recorded;
mod reported;
mod stub;
