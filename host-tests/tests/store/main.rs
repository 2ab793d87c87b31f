//! The parameters in flash: bytes, two sectors in turns, and losses of power at every word.

mod bytes;
mod nor;
mod taken;
mod tear;
