//! The parameters in flash: bytes, two sectors in turns, and losses of power at every word.

mod bytes;
mod fleet;
mod nor;
mod random;
mod taken;
mod tear;
