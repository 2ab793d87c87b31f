//! Captures from the host's side: taken, kept as files, replayed; and files that are not as they were written.

use crate::served::Served;
use fingertip::shipped::address;
use fingertip_cli::captured;
use fingertip_cli::captured::{of_bytes, through_the_core};
use std::fs;

#[test]
fn a_capture_is_taken_and_replays() {
    let finger = Served::begin("wall");
    let file = finger.file("press.mcap");
    let taken = finger.json(&["capture", "--press", "0.5", "--out", &file, "--board", "a served one", "--contribute"]);
    assert_eq!(
        (taken["replays"].as_bool(), taken["ended"].as_str()),
        (Some(true), Some("its memory is full")),
        "{taken}"
    );
    let frames = taken["frames"].as_u64().expect("a number");
    assert!(frames > 600 && taken["bytes"].as_u64() <= Some(44 << 10), "{taken}");
    let kept = captured::open(file.as_ref()).expect("a capture");
    let about = |name: &str| kept.about.get(name).map(String::as_str).unwrap_or_default();
    assert_eq!((about("board"), about("firmware"), about("frames")), ("a served one", "0.1", &*frames.to_string()));
    assert!(about("licence").contains("contributed") && about("params").contains("\"modulus_pa\":"), "{kept:?}");

    let told = finger.done(&["replay", &file]);
    assert_eq!(told, format!("{file}: {frames} frames, the same to the bit\n"));
    let told = finger.json(&["replay", &file]);
    assert_eq!((told[0]["frames"].as_u64(), told[0]["difference"].is_null()), (Some(frames), true));
    // The finger released.
    assert_eq!(finger.client().number(address::TORQUE_ENABLE).expect("it answers"), 0);
    let full = fs::OpenOptions::new().write(true).open("/dev/full").expect("Linux has it");
    let why = captured::write(full, &kept.bytes, &kept.about).expect_err("it is full");
    assert!(why.contains("No space left"), "{why}");
    // A tare alone, ended early.
    let file = finger.file("tare.mcap");
    let told = finger.done(&["capture", "--frames", "30", "--out", &file]);
    assert!(told.contains("ended: the host ended it; replays here to the bit"), "{told}");
}

#[test]
fn a_press_from_a_tip_that_touches_is_told_and_ends() {
    let finger = Served::begin("wall");
    finger.done(&["tare"]);
    // Torque goes off while it presses: the tip rests on the wall.
    finger.set(&[(address::TORQUE_ENABLE, 1), (address::GOAL_FORCE_MN, 1_000)]);
    while finger.true_force_n() < 0.9 {
        finger.command("state");
    }
    finger.set(&[(address::TORQUE_ENABLE, 0)]);
    let file = finger.file("touching.mcap");
    finger.refuses(&["capture", "--press", "1", "--out", &file], &["something seemed to touch"]);
    assert!(fs::metadata(&file).is_err(), "nothing was written");
    assert_eq!(finger.client().number(address::TORQUE_ENABLE).expect("it answers"), 0);
}

#[test]
fn what_cannot_be_captured_is_told() {
    let finger = Served::begin("wall");
    assert!(Served::not_understood(&["capture", "--out", "press.csv"]).contains(".mcap"));
    let file = finger.file("press.mcap");
    finger.done(&["params", "set", "direction_confirmed=0"]);
    finger.refuses(&["capture", "--press", "0.5", "--out", &file], &["`fingertip commission`"]);
    finger.done(&["params", "set", "direction_confirmed=1"]);
    finger.done(&["tare"]);
    finger.set(&[(address::TORQUE_ENABLE, 1)]);
    finger.refuses(&["capture", "--out", &file], &["torque is on"]);
    finger.set(&[(address::TORQUE_ENABLE, 0)]);
    finger.command("fault supply-low");
    finger.set(&[(address::TORQUE_ENABLE, 1)]);
    finger.command("state");
    finger.refuses(&["capture", "--out", &file], &["fault 9", "`fingertip recover`"]);
    assert!(fs::metadata(&file).is_err(), "nothing was written");
}

#[test]
fn a_file_that_is_not_as_it_was_written_is_refused() {
    let finger = Served::begin("wall");
    let file = finger.file("short.mcap");
    finger.done(&["capture", "--frames", "10", "--out", &file]);
    let whole = fs::read(&file).expect("it was written");
    assert!(of_bytes(&whole).is_ok());
    let mut bytes = whole.clone();
    for place in 0..bytes.len() {
        for change in [0x01, 0x80, 0xFF] {
            bytes[place] ^= change;
            assert!(of_bytes(&bytes).is_err(), "byte {place} of {}, changed by {change:#x}", bytes.len());
            bytes[place] ^= change;
        }
    }
    for length in 0..whole.len() {
        assert!(of_bytes(&whole[..length]).is_err(), "cut at {length}");
    }
    assert!(of_bytes(&[&whole[..], &[0]].concat()).is_err());

    fs::write(&file, &whole[..whole.len() / 2]).expect("it can be written");
    finger.refuses(&["replay", &file], &["1 of 1 captures do not replay"]);
    // A whole file about a capture that is cut short.
    let kept = of_bytes(&whole).expect("a capture");
    let cut = &kept.bytes[..kept.bytes.len() - 1];
    let why = through_the_core(cut, |_, _| {}).expect_err("it is cut");
    assert_eq!(why.to_string(), "the capture is cut off");
    assert!(captured::write(std::io::Cursor::new(Vec::new()), cut, &kept.about).is_err());
    finger.refuses(&["replay", &finger.file("nowhere")], &["cannot read"]);
    fs::remove_file(&file).expect("it is there");
    let folder = std::path::Path::new(&file).parent().expect("a folder");
    // Links that lead back are not followed.
    for link in ["one", "two"] {
        std::os::unix::fs::symlink(folder, folder.join(link)).expect("a link");
    }
    finger.refuses(&["replay", folder.to_str().expect("text")], &["no capture there"]);
}
