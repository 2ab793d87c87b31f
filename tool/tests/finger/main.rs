//! Every command against a served finger behind a pseudo-terminal, judged by words, bytes and counts.

mod failed;
mod guided;
mod left;
mod recorded;
mod served;
mod shared;
mod stopped;
#[cfg(feature = "foxglove")]
mod streamed;

use fingertip::params::Params;
use fingertip::shipped::address;
use served::{Served, fails, program};
use std::collections::BTreeMap;
use std::fs;

#[test]
fn it_is_found_and_tells_what_it_is() {
    let finger = Served::begin("wall");
    let found = finger.json(&["scan", "--speeds", "57600,1000000"]);
    let expected = serde_json::json!([{
        "port": finger.port, "baud": 1_000_000, "id": 1, "model_number": 21574, "firmware_version": 1, "fingertip": true,
    }]);
    assert_eq!(found, expected);
    finger.refuses(&["scan", "--speeds", "115200"], &["nothing answers", "at 115200 baud"]);

    let info = finger.json(&["info"]);
    assert_eq!((info["rows"].as_i64(), info["columns"].as_i64()), (Some(10), Some(10)));
    assert_eq!((info["mode_name"].as_str(), &info["fault_name"]), (Some("off"), &serde_json::Value::Null));
    assert_eq!(info["limit_names"], serde_json::json!(["not tared"]));
    assert_eq!(info["return_delay_us"], 500);
    let text = finger.done(&["info"]);
    assert!(text.contains("limits    not tared") && text.contains("reset_cause            1 (power-on)"), "{text}");
}

#[test]
fn who_is_not_there_is_told() {
    let finger = Served::begin("wall");
    finger.refuses(&["--id", "3", "--timeout-ms", "10", "info"], &["ping: no answer of ID 3", "fingertip scan"]);
    finger.refuses(&["--baud", "115200", "--timeout-ms", "10", "info"], &["at 115200 baud"]);
    finger.refuses(&["--port", "/nowhere", "info"], &["cannot open /nowhere"]);
    // One line has one host.
    let mut first = finger.start(&["record", &finger.file("first.csv")]);
    Served::begun(&finger.file("first.csv.part"));
    finger.refuses(&["info"], &["another program has it open"]);
    Served::interrupt(&first);
    assert!(first.wait().expect("it ends").success());
    finger.done(&["info"]);
    fails(&program(&["info"]).output().expect("it starts"), &["--port", "FINGERTIP_PORT"]);
}

#[test]
fn several_ids_are_asked_one_after_the_other() {
    let finger = Served::begin("grasp");
    Served::not_understood(&["--id", "1,2", "press", "1"], "takes one --id");
    let why = finger.refuses(&["--id", "9,2", "--timeout-ms", "1000", "tare"], &[]);
    assert!(why.contains("ID 9: ping: no answer") && !why.contains("ID 2"), "{why}");
    let infos = finger.json(&["--id", "all", "--timeout-ms", "1000", "info"]);
    let (first, second) = (&infos[0], &infos[1]);
    assert_eq!((&first["id"], &second["id"]), (&1.into(), &2.into()));
    assert_eq!((first["limit_names"][0].as_str(), second["limit_names"][0].as_str()), (Some("not tared"), None));
    let stopped = finger.json(&["--id", "1,2", "stop"]);
    assert_eq!((&stopped[0]["id"], &stopped[1]["id"]), (&1.into(), &2.into()));
    let said = finger.done(&["--id", "1,2", "tare"]);
    assert!(said.starts_with("ID 1:\ntared: ") && said.contains("\nID 2:\ntared: "), "{said}");
    let said = finger.done(&["--id", "all", "--timeout-ms", "1000", "stop"]);
    assert!(said.contains("ID 1: mode ") && said.contains("ID 2: mode "), "{said}");
}

#[test]
fn it_tares_presses_and_lets_go() {
    let finger = Served::begin("wall");
    finger.refuses(&["press", "1"], &["not tared", "`fingertip tare`"]);
    finger.command("move -1");
    finger.until("object is at -1.00");
    let touched = "Free the tip and tare again";
    finger.refuses(&["tare"], &[touched]);
    finger.refuses(&["press", "1"], &[touched]);
    finger.command("move 5");
    finger.until("object is at 5.00");
    let tared = finger.json(&["tare"]);
    assert_eq!((&tared["tared"], &tared["touched"]), (&true.into(), &false.into()));
    // As a command leaves it that was killed before torque was on.
    finger.set(&[(address::BUS_WATCHDOG, 26)]);
    let held = finger.json(&["press", "1.5", "--seconds", "0.3", "--within-s", "3600"]);
    let mean_mn = held["mean_mn"].as_f64().expect("a number");
    assert!((1_470.0..=1_530.0).contains(&mean_mn) && held["held_s"].as_f64() >= Some(0.3), "{held}");
    assert_eq!((&held["reached"], &held["held"], &held["states_outside"]), (&true.into(), &true.into(), &0.into()));
    let [least_mn, most_mn] = ["least_mn", "most_mn"].map(|name| held[name].as_i64().expect("a number"));
    assert!(held["tolerance_mn"] == 75.0 && least_mn >= 1_425 && most_mn <= 1_575, "{held}");
    let info = finger.json(&["info"]);
    assert_eq!((&info["torque_enable"], &info["goal_mn"], &info["bus_watchdog_ms"]), (&0.into(), &0.into(), &0.into()));
    let heard = finger.heard();
    finger.refuses(&["press", "0.001"], &["1 mN are less than the finger can hold: contact_on_mn is 40"]);
    assert!(finger.heard() - heard < 10, "nothing moves");
    finger.refuses(&["press", "9"], &["goal_force_mn to 9000", "error 6", "force_max_mn is 7000"]);
    finger.command("remove");
    let press = finger.start(&["press", "1", "--within-s", "0.5", "--json"]).wait_with_output().expect("it ends");
    let (code, why) = served::ended(&press);
    assert!(code == Some(1) && why.contains("not reached") && why.contains("mode approach"), "{why}");
    let report: serde_json::Value = serde_json::from_slice(&press.stdout).expect("JSON");
    assert_eq!((&report["reached"], &report["held"], &report["states"]), (&false.into(), &false.into(), &0.into()));
    assert!(report["mean_mn"].is_null(), "{report}");
    assert_eq!(finger.json(&["info"])["torque_enable"], 0, "torque is off all the same");
    finger.set(&[(address::BUS_WATCHDOG, 50)]);
    finger.refuses(&["press", "9"], &["force_max_mn"]);
    assert_eq!(finger.json(&["info"])["bus_watchdog_ms"], 1_000, "another host's watchdog stays");
}

#[test]
fn a_fault_is_told_and_cleared() {
    let finger = Served::begin("wall");
    finger.done(&["tare"]);
    finger.command("fault supply-low");
    finger.refuses(&["press", "1", "--within-s", "3600"], &["fault 9 (supply low)", "`fingertip recover`"]);
    finger.refuses(&["recover"], &["cannot be cleared: the supply is below supply_min_mv"]);
    finger.refuses(&["tare"], &["fault 9"]);
    finger.command("mend");
    finger.command("state");
    let cleared = finger.json(&["recover"]);
    assert_eq!((&cleared["fault"], &cleared["fault_name"]), (&9.into(), &"supply low".into()));
    let again = finger.done(&["recover"]);
    assert!(again.starts_with("there was nothing to recover from"), "{again}");
    finger.done(&["press", "0.5", "--seconds", "0.1", "--within-s", "3600"]);
    // The tare reads the array, and shows what is broken there.
    finger.command("fault row-stuck");
    finger.refuses(&["tare"], &["fault 3 (row stuck)", "`fingertip recover`"]);
    finger.command("mend");
    finger.done(&["recover"]);
    finger.done(&["tare"]);
    // A fault that is cleared by its register leaves the bus watchdog tripped.
    finger.set(&[(address::TORQUE_ENABLE, 1), (address::BUS_WATCHDOG, 1)]);
    finger.until_alone("BusSilent");
    finger.set(&[(address::CLEAR_FAULT, 1)]);
    finger.until("Off");
    finger.refuses(&["press", "1"], &["the bus watchdog has tripped: `fingertip recover`"]);
}

#[test]
fn parameters_are_set_all_or_none_and_saved() {
    let finger = Served::begin("wall");
    let get = |names: &[&str]| finger.json(&[&["params", "get"], names].concat());
    let all = get(&[]);
    assert_eq!(all.as_object().map(serde_json::Map::len), Some(Params::COUNT + 4), "and four beside them");
    finger.done(&["params", "set", "modulus_pa=300000", "fit_level=3", "--save"]);
    assert_eq!(get(&["modulus_pa", "fit_level"]), serde_json::json!({ "modulus_pa": 300_000, "fit_level": 3 }));
    assert_eq!(finger.json(&["info"])["saved_state"], 0);
    assert_eq!(finger.json(&["params", "save"]), serde_json::json!({ "saved": true }));

    // An error of one finger does not affect the other one.
    for (values, why) in [
        (&["tip_radius_um=9000", "modulus_pa=4"][..], "modulus_pa of 4: 20000 to 2000000"),
        (&["tip_radius_um=9000", "contact_on_mn=10"], "contact_off_mn of 15"),
        (&["tip_radius_um=9000", "goal_force_mn=5"], "goal_force_mn is no parameter"),
    ] {
        finger.refuses(&[&["params", "set"], values].concat(), &[why]);
    }
    for (values, why) in [
        (&["tip_radius_um=9000", "radius=5"][..], "no register `radius`; did you mean tip_radius_um?"),
        (&["tip_radius_um=9000", "modulus_pa=soft"], "`soft` is no whole number"),
        (&["tip_radius_um"], "NAME=VALUE is asked for"),
    ] {
        Served::not_understood(&[&["params", "set"], values].concat(), why);
    }
    assert_eq!(get(&["tip_radius_um"]), serde_json::json!({ "tip_radius_um": 10_000 }));
    // `contact_on_mn=10` alone is refused; with a lower `contact_off_mn` in the same packet it is accepted.
    finger.done(&["params", "set", "contact_on_mn=10", "contact_off_mn=5"]);
    let said = finger.done(&["params", "set", "contact_on_mn=10"]);
    assert!(said.contains("nothing differs"), "{said}");

    // Another address and speed are followed.
    let moved = finger.done(&["params", "set", "id=7", "baud_rate=4"]);
    assert!(moved.contains("id: 1 -> 7") && moved.contains("baud_rate: 3 -> 4"), "{moved}");
    finger.done(&["--id", "7", "--baud", "2000000", "params", "set", "id=1", "baud_rate=3"]);
    assert_eq!(get(&["id"]), serde_json::json!({ "id": 1 }));
}

#[test]
fn a_backup_is_restored_whole() {
    let finger = Served::begin("wall");
    let file = finger.file("backup.toml");
    finger.done(&["params", "set", "modulus_pa=300000", "fit_level=4"]);
    finger.done(&["params", "backup", &file]);
    finger.refuses(&["params", "backup", &file], &["is there already: --force"]);
    finger.done(&["params", "backup", "--force", &file]);
    finger.done(&["params", "set", "modulus_pa=200000", "fit_level=1", "clearance_um=500"]);
    let differing: BTreeMap<String, serde_json::Value> =
        serde_json::from_value(finger.json(&["params", "diff", &file])).expect("a map");
    assert_eq!(differing.keys().collect::<Vec<_>>(), ["clearance_um", "fit_level", "modulus_pa"]);
    finger.done(&["params", "restore", &file]);
    assert_eq!(finger.json(&["params", "diff", &file]), serde_json::json!({}));

    // The taxels' gains are in it, and come back with it.
    let text = fs::read_to_string(&file).expect("it was written");
    let gains = "row_3 = [16384, 16384, 16384, 16384, ";
    assert!(text.contains(gains), "{text}");
    let with = |gain| text.replace(gains, &format!("row_3 = [16384, 16384, 16384, {gain}, "));
    fs::write(&file, with(21_000)).expect("a file");
    let packets = finger.packets(&["params", "restore", &file]);
    // A save that fails takes back neither gains nor parameters.
    finger.deaf(packets, 3);
    fs::write(&file, with(20_000)).expect("a file");
    finger.refuses(&["--timeout-ms", "1000", "params", "restore", &file, "--save"], &["no answer"]);
    assert_eq!(finger.json(&["params", "diff"])["gains"]["now"][3][3], 20_000);
    let other =
        text.replace(gains, "row_3 = [16384, 16384, 16384, 8191, ").replace("clearance_um = 500", "clearance_um = 600");
    for (text, why) in [
        (other, "from 8192 to 32767"),
        (text.replace("row_9", "row_8a"), "lacks row_9"),
        (text.replace(gains, "row_3 = [16384, 16384, 16384, "), "10 rows of 10 gains"),
        (text.replace("row_3 = ", "row_3 = 1 #"), "row_3"),
    ] {
        fs::write(&file, text).expect("a file");
        finger.refuses(&["params", "restore", &file], &[why]);
        assert_eq!(finger.json(&["params", "diff"])["gains"]["now"][3][3], 20_000);
    }
    fs::write(&file, &text).expect("a file");
    finger.done(&["params", "restore", &file]);
    assert_eq!(finger.json(&["params", "diff", &file]), serde_json::json!({}));

    // A damaged file changes nothing, and all its errors are reported.
    for (from, to, why) in [
        ("modulus_pa = 300000", "modulus_pa = 3", "modulus_pa of 3"),
        ("modulus_pa = 300000", "modulus_pb = 3", "no register `modulus_pb`"),
        ("[parameters]", "[params]", "no table [parameters]"),
        ("modulus_pa = ", "modulus_pa ", "cannot read"),
        ("chip_id = ", "chip_id = 1", "take out the line `chip_id`"),
    ] {
        fs::write(&file, text.replace(from, to).replace("fit_level = 4", "fit_level = 2")).expect("a file");
        finger.refuses(&["params", "restore", &file], &[why]);
        let now = finger.json(&["params", "get", "modulus_pa", "fit_level"]);
        assert_eq!(now, serde_json::json!({ "modulus_pa": 300_000, "fit_level": 4 }));
    }
    finger.refuses(&["params", "restore", "/nowhere.toml"], &["/nowhere.toml"]);
}

#[test]
fn answers_are_measured() {
    let finger = Served::begin("wall");
    let measured = finger.json(&["latency", "--seconds", "0.2"]);
    assert_eq!((&measured["unanswered"], &measured["return_delay_us"]), (&0.into(), &500.into()));
    assert!(measured["reads"].as_u64() > Some(0) && measured["median_ms"].as_f64() > Some(0.0), "{measured}");
}

#[test]
fn a_view_needs_a_terminal_and_shells_get_completions() {
    let finger = Served::begin("wall");
    finger.refuses(&["view"], &["`fingertip record`"]);
    let words = finger.done(&["completions", "bash"]);
    assert!(words.contains("complete -F _fingertip") && words.contains("backup"), "no completions");
}
