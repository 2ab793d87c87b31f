//! Tests of the core. All files are linked into one program, so its threads have work until the end. To run one file:
//! `cargo test -p host-tests --test all winding::`.

mod baseline_touched;
mod budget;
mod capture;
mod common;
mod configurations;
mod control;
mod doubt;
mod faults;
mod fit;
mod force_loop;
mod frame_pass;
mod guard;
mod link;
mod measure;
mod model;
mod monitor;
mod pages;
mod pipeline_properties;
mod requests;
mod same_bits;
mod sensing;
mod shapes;
mod store;
mod winding;

/// A file that is not in the list above would never be compiled.
#[test]
fn every_file_is_taken() {
    let folder = std::path::Path::new(env!("FINGERTIP_ROOT")).join("host-tests/tests");
    for entry in folder.read_dir().expect("the sources are there") {
        let path = entry.expect("an entry").path();
        let name = path.file_stem().expect("its name").display().to_string();
        let taken = include_str!("main.rs").contains(&format!("\nmod {name};\n"));
        assert!(taken || ["main", "qemu"].contains(&name.as_str()), "{name}");
    }
}
