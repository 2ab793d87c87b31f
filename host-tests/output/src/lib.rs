//! Output of the programs on the host: text, pictures and files.

#![allow(missing_docs, reason = "parts of the project's own programs: a name that says all needs no comment")]

pub mod kept;
pub mod plot;
pub mod say;
pub mod units;
