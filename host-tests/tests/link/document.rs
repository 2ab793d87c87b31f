//! The page of the control table, and the model files made of it.

use fingertip::link::table::indirect::BLOCK;
use fingertip::params::Params;
use fingertip::shipped::{REGISTERS, address};
use host_tests::control_table::{COMMAND, markdown, step};
use host_tests::model_file::{items, text};

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

/// What the description asks a driver for is in the model file, and fits the indirect addresses.
#[test]
fn the_description_for_ros2_control_asks_for_what_there_is() {
    let path = concat!(env!("FINGERTIP_ROOT"), "/examples/dynamixel/fingertip.ros2_control.xacro");
    let file = std::fs::read_to_string(path).expect("the description can be read");
    let (_, gpio) = file.split_once("<gpio").expect("a GPIO");
    let items = items();
    let bytes = |tag: &str| {
        let names = gpio.split(tag).skip(1).map(|rest| rest.split('"').next().unwrap_or_default());
        // What is the driver's own.
        let names: Vec<&str> = names.filter(|name| !["type", "ID"].contains(name)).collect();
        assert!(!names.is_empty(), "no {tag}");
        let item = |name: &&str| items.iter().find(|item| item.name == **name);
        names
            .iter()
            .map(|name| usize::from(item(name).unwrap_or_else(|| panic!("no item {name}")).bytes))
            .sum::<usize>()
    };
    assert!(bytes("<state_interface name=\"") <= BLOCK && bytes("<command_interface name=\"") <= BLOCK);
    bytes("<param name=\"");
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
