//! The solver against a simulated finger. `-- --nocapture` prints the figures.

mod drift;
mod finger;
mod gains;
mod modulus;
mod plates;
