//! Tests, proofs and studies of the fingertip core off the target; the simulated world is the package `sim`.
//!
//! All of it is simulated; nothing here has touched silicon.

pub mod analogue;
pub mod control_table;
pub mod figures;
pub mod fit_cases;
pub mod fit_statistics;
pub mod page;
pub mod paper;
pub mod program;
/// The proof of the model's error bounds: every result against its exact value.
///
/// Two judges that share no code with the model: [`prove::exact`] compares integers with integers (squares and rational bounds
/// of pi), so that whole input ranges can be walked in seconds; [`mod@prove::reference`] computes in arbitrary precision with
/// a crate and covers what has no such form. `cargo xtask prove` runs all of it; the tests run a part.
pub mod prove {
    pub mod exact;
    pub mod random;
    pub mod reference;
    pub mod tally;
}
pub mod stimulus;

/// Cost of accuracy in time: inputs for the image `study`, the judge of its results, tables and pictures.
///
/// The image runs every variant on the emulated Cortex-M4F and says what each returned; errors are worked out here,
/// against arbitrary precision, so they are exactly the target's.
pub mod study {
    pub mod inputs;
    pub mod kernels;
    pub mod output;
    pub mod page;
    pub mod scan;
    pub mod simulation;
    pub mod whole_loop;
}
