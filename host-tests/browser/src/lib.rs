//! A headless Chromium, driven over the DevTools protocol: opens a page as a screen or a phone shows it, light or dark,
//! and tells what is wrong with it.

mod complaints;
mod devtools;
mod hand;

pub use complaints::{Look, complaints, events, look, shoot};
pub use devtools::{Browser, BrowserError};
pub use hand::Place;
