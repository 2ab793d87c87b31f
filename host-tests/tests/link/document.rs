//! The page of the control table, and the model files made of it.

use fingertip::params::Params;
use fingertip::shipped::{REGISTERS, address};
use host_tests::control_table::{COMMAND, markdown, step};
use host_tests::model_file::text;

#[test]
fn the_page_is_fresh() {
    let path = concat!(env!("FINGERTIP_ROOT"), "/docs/control-table.md");
    let page = std::fs::read_to_string(path).expect("docs/control-table.md can be read");
    assert!(page == markdown(), "docs/control-table.md is stale: write it anew with `{COMMAND}`");
}

#[test]
fn the_model_files_are_fresh() {
    for (path, direct) in [("fingertip.model", false), ("fingertip_direct.model", true)] {
        let path = format!("{}/examples/dynamixel/{path}", env!("FINGERTIP_ROOT"));
        let file = std::fs::read_to_string(&path).expect("the model file can be read");
        assert!(file == text(direct), "{path} is stale: write it anew with `{COMMAND}`");
    }
}

#[test]
fn every_register_is_explained() {
    for register in REGISTERS {
        assert!(register.doc.trim().ends_with('.'), "{}: {:?}", register.name, register.doc);
        assert!(register.min <= register.max, "{}", register.name);
        let plain = ["bad_taxels_max", "baseline_follows", "direction_confirmed"];
        let unit = step(register);
        let params = usize::from(address::PARAMS)..usize::from(address::PARAMS) + 4 * Params::COUNT;
        let named = !params.contains(&usize::from(register.address)) || plain.contains(&register.name) || unit != "1";
        assert!(named, "{} has no unit: give its ending one in `units`", register.name);
    }
}
