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

/// A file that is not in the list above would never be compiled.
#[test]
fn every_file_is_taken() {
    let folder = std::path::Path::new(env!("FINGERTIP_ROOT")).join("host-tests/virtual-board/tests");
    for entry in folder.read_dir().expect("the sources are there") {
        let path = entry.expect("an entry").path();
        if let Some(name) = path.file_stem().filter(|name| path.extension() == Some("rs".as_ref()) && *name != "main") {
            let line = format!("mod {};", name.display());
            assert!(include_str!("main.rs").lines().any(|other| other == line), "{line}");
        }
    }
}
