//! What holds whatever the loop, the fit or the host believe: the guard, with the last word on the duty, and the
//! monitor, which looks for what must hold in every frame. `docs/safety.md` states the promises by number.

pub mod guard;
pub mod monitor;
