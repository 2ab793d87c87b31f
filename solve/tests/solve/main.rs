//! The solver against simulated fingers and drives. `-- --nocapture` prints the figures.

mod drift;
mod finger;
mod gains;
mod modulus;
mod record;
mod report;
mod series;
mod strokes;
