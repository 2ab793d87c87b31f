//! The tests of the flash image on the emulated board, as one program: it is linked once, and both cores have work until
//! the end. A test starts a board once and checks many things on it. One file of them: `cargo test ... --test board temperature::`.
//!
//! `FINGERTIP_IMAGE` names the image; `cargo xtask test` builds it and sets it.

mod bus;
mod clients;
mod common;
mod faults;
mod image;
mod measured;
mod parameters;
mod scenes;
mod temperature;
mod time_budget;
