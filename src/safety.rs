//! Protection that is independent of loop, fit and host: the guard, with the last word on the duty, and the monitor,
//! which checks conditions of every frame. `docs/safety.md` states the promises by number.

pub mod guard;
pub mod monitor;
