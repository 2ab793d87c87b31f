//! The moving world and the effects on it, against closed forms.

mod bench;
mod clock;
#[path = "../common/mod.rs"]
mod common;
mod contact;
mod drive;
mod energy;
mod hard;
mod object;
