//! Motions that measure: what begins, what ends them, and what is left of them.

mod finger;
mod interrupted;
mod properties;
mod record;
mod refused;
mod series;
