//! Captures in the core: what is kept comes back to the bit, what is damaged is told, and a replay finds what differs.

mod burst;
mod coded;
mod damaged;
mod replayed;
