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
mod long_run;
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

/// A file that is not in the list of its program would never be compiled.
#[test]
fn every_file_is_taken() {
    for folder in ["host-tests/tests", "host-tests/virtual-board/tests"] {
        let folder = std::path::Path::new(env!("FINGERTIP_ROOT")).join(folder);
        let main = std::fs::read_to_string(folder.join("main.rs")).expect("the list is there");
        for entry in folder.read_dir().expect("the sources are there") {
            let path = entry.expect("an entry").path();
            let name = path.file_stem().expect("its name").display().to_string();
            assert!(main.contains(&format!("\nmod {name};\n")) || ["main", "qemu"].contains(&name.as_str()), "{name}");
        }
    }
}
