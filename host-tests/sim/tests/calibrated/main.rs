//! What the procedures that calibrate an array give, on arrays that were drawn.

mod gains;
mod ordinary;
mod refused;
