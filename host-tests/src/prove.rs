//! The proof of the model's error bounds: every result against its exact value.
//!
//! Two judges that share no code with the model: [`exact`] compares integers with integers (squares and rational bounds
//! of pi), so that whole input ranges can be walked in seconds; [`mod@reference`] computes in arbitrary precision with
//! a crate and covers what has no such form. `cargo xtask prove` runs all of it; the tests run a part.

pub mod beyond;
pub mod domain;
pub mod exact;
pub mod exhaustive;
pub mod oracle;
pub mod random;
pub mod reference;
pub mod tables;
pub mod tally;
