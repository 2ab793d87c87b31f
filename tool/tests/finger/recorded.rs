//! Recordings: their times, their owners, and the rest of one whose program was killed. Captures: taken, kept as files,
//! replayed; and files that are not as they were written. And what the program shows on a screen.

use crate::served::{self, Served, fails, program};
use fingertip::shipped::address;
use fingertip_cli::commands::view::{Seen, draw};
use fingertip_cli::recordings::{Topic, of_bytes, through_the_core};
use fingertip_cli::state::{Stamp, State, unix_ns};
use fingertip_cli::{Error, recordings};
use mcap::{MessageStream, Summary};
use ratatui::buffer::Buffer;
use ratatui::layout::Rect;
use rustix::process::Signal;
use serde_json::Value;
use sim::recording::schemas;
use std::fs;
use std::process::Stdio;

fn messages(bytes: &[u8]) -> Vec<mcap::Message<'_>> {
    MessageStream::new(bytes).expect("MCAP").map(|message| message.expect("whole")).collect()
}

#[test]
fn states_are_recorded_with_the_controllers_times() {
    let finger = Served::begin("wall");
    let file = finger.file("force.csv");
    let unix_s = || unix_ns() as f64 * 1e-9;
    let begun_s = unix_s() - 1.0;
    let done = finger.json(&["record", "--seconds", "0.5", "--rate-hz", "200", "--pressures", &file]);
    let text = fs::read_to_string(&file).expect("it was written");
    let row = |line: &str| line.split(',').map(|cell| cell.parse().expect("a number")).collect();
    let rows: Vec<Vec<f64>> = text.lines().skip(1).map(row).collect();
    assert!(text.starts_with("time_s,unix_time_s,frame,mode,fault,limits,goal_mn,force_mn,"));
    assert_eq!(text.lines().next().map(|head| head.split(',').count()), Some(116));
    assert_eq!(done["states"].as_u64(), Some(rows.len() as u64));
    assert!(rows.len() > 1 && rows.iter().all(|row| row.len() == 116));
    for pair in rows.windows(2) {
        // Time is that of the frames: 99.786 us each, cut to microseconds.
        let (frames, time_s) = (pair[1][2] - pair[0][2], pair[1][0] - pair[0][0]);
        assert!(frames > 0.0 && (time_s - frames * 99.786e-6).abs() < 2e-6, "{frames} frames in {time_s} s");
        assert!(pair[0][1] > begun_s && pair[1][1] >= pair[0][1], "{} {}", pair[0][1], pair[1][1]);
    }
    let mcap = finger.file("force.mcap");
    let done = finger.json(&["record", "--seconds", "0.5", "--pressures", &mcap]);
    let bytes = fs::read(&mcap).expect("it was written");
    let messages = messages(&bytes);
    // The log has the host's time, the publishing the controller's intervals.
    let (first, last) = (&messages[0], &messages[messages.len() - 1]);
    let [first_s, last_s] = [first, last].map(|message| message.log_time as f64 * 1e-9);
    assert!(first_s > begun_s && last_s < unix_s() + 1.0, "{first_s}");
    assert_eq!(first.publish_time, first.log_time);
    let numbers: serde_json::Value = serde_json::from_slice(&messages[messages.len() - 2].data).expect("JSON");
    let since_s = (last.publish_time - first.publish_time) as f64 * 1e-9;
    assert!((since_s - numbers["time_s"].as_f64().expect("a number")).abs() < 1e-8, "{numbers}");
    let image: serde_json::Value = serde_json::from_slice(&last.data).expect("JSON");
    assert_eq!(image["timestamp"]["sec"].as_u64(), Some(last.publish_time / 1_000_000_000));
    assert_eq!(messages.len() as u64, 2 * done["states"].as_u64().expect("a number"));
    assert_eq!(messages[0].channel.topic, "/finger0/scalars");
    assert_eq!(messages[0].channel.schema.as_ref().map(|schema| schema.name.as_str()), Some("fingertip.Scalars"));
    assert_eq!(messages[1].channel.schema.as_ref().map(|schema| schema.name.as_str()), Some("foxglove.RawImage"));
    Served::not_understood(&["record", "force.txt"], ".csv or .mcap");
    finger.refuses(&["record", "/nowhere/force.csv"], &["cannot write /nowhere/force.csv"]);
}

#[test]
fn a_recording_that_is_interrupted_is_whole() {
    let finger = Served::begin("wall");
    let file = finger.file("stopped.csv");
    // A state in a quarter of an hour: the pause between states ends at once.
    let mut child = finger.start(&["record", "--rate-hz", "0.001", &file]);
    Served::begun(&format!("{file}.part"));
    Served::interrupt(&child);
    assert!(child.wait().expect("it ends").success());
    let text = fs::read_to_string(&file).expect("it is there");
    assert!(text.ends_with('\n') && text.starts_with("time_s,"));
    assert!(!fs::exists(format!("{file}.part")).expect("a folder"));

    // So is one of a controller whose scan has stopped, and that of a lost connection; both report why they end.
    finger.command("fault lost-frames");
    let still = finger.file("still.csv");
    finger.refuses(&["record", "--seconds", "1000000", &still], &["after 0.000 s: no new frame came for 2 s"]);
    assert!(fs::metadata(&still).is_ok());
    finger.command("mend");
    let lost = finger.file("lost.csv");
    let child = finger.start(&["record", &lost]);
    Served::begun(&format!("{lost}.part"));
    finger.end();
    fails(&child.wait_with_output().expect("it ends"), &[]);
}

#[test]
fn a_hangup_does_not_end_a_recording_under_nohup() {
    let finger = Served::begin("wall");
    let (file, part) = (finger.file("nohup.csv"), finger.file("nohup.csv.part"));
    let record = finger.fingertip(&["record", &file]);
    let mut nohup = std::process::Command::new("nohup");
    nohup.arg(record.get_program()).args(record.get_args()).env("FINGERTIP_PORT", &finger.port).stdout(Stdio::null());
    let mut child = nohup.spawn().expect("it starts");
    Served::recorded(&part);
    Served::signal(&child, Signal::HUP);
    let length = || fs::metadata(&part).map_or(0, |part| part.len());
    let before = length();
    // More than what was still in its buffer.
    Served::wait_for(|| length() > before + 30_000 || fs::metadata(&file).is_ok());
    assert!(fs::metadata(&file).is_err(), "it goes on");
    Served::signal(&child, Signal::TERM);
    assert!(child.wait().expect("it ends").success() && fs::metadata(&file).is_ok());
}

#[test]
fn a_recording_tells_whose_it_is() {
    let finger = Served::begin("grasp");
    let file = finger.file("second.mcap");
    finger.done(&["--id", "2", "record", "--seconds", "0.1", &file]);
    let bytes = fs::read(&file).expect("it was written");
    let summary = Summary::read(&bytes).expect("MCAP").expect("a summary");
    let channel = summary.channels.values().next().expect("a channel");
    assert_eq!(channel.topic, "/finger1/scalars");
    let about = mcap::read::metadata(&bytes, &summary.metadata_indexes[0]).expect("a record");
    assert_eq!((about.name.as_str(), &about.metadata), ("fingertip.device", &channel.metadata));
    let entries = ["model_number", "id", "firmware"].map(|name| about.metadata[name].as_str());
    assert_eq!(entries, ["21574", "2", "0.1"]);

    let file = finger.file("tare.mcap");
    finger.done(&["--id", "2", "capture", "--frames", "60", "--out", &file]);
    let bytes = fs::read(&file).expect("it was written");
    let messages = messages(&bytes);
    let mut topics: Vec<&str> = messages.iter().map(|message| message.channel.topic.as_str()).collect();
    topics.sort_unstable();
    topics.dedup();
    assert_eq!(topics, ["/finger1/frame", "/finger1/scalars"]);
    assert_eq!(messages[0].channel.metadata["id"], "2");
    assert!(messages[0].log_time.abs_diff(unix_ns()) < 3_600 * 1_000_000_000, "{}", messages[0].log_time);
}

#[test]
fn a_killed_recording_is_kept_and_can_be_read() {
    let finger = Served::begin("wall");
    for name in ["killed.mcap", "killed.csv"] {
        let (file, part) = (finger.file(name), finger.file(&format!("{name}.part")));
        let mut child = finger.start(&["record", "--rate-hz", "0", &file]);
        Served::wait_for(|| fs::metadata(&part).is_ok_and(|part| part.len() > 300_000));
        served::kill(&mut child);
        let bytes = fs::read(&part).expect("it is there");
        if name.ends_with(".mcap") {
            let shown: usize = messages(&bytes).iter().map(|message| message.data.len()).sum();
            assert!(
                shown > bytes.len() / 2,
                "{shown} bytes of {}: a reader stops at an end amid the file",
                bytes.len()
            );
        } else {
            assert!(bytes.starts_with(b"time_s,") && bytes.iter().filter(|byte| **byte == b'\n').count() > 20);
        }
        // The next recording leaves it alone.
        finger.refuses(&["record", "--seconds", "0.1", &file], &[&part, "--force"]);
        assert_eq!(fs::read(&part).expect("it is there"), bytes);
        finger.done(&["record", "--seconds", "0.1", "--force", &file]);
        assert!(fs::exists(&file).expect("a folder") && !fs::exists(&part).expect("a folder"));
    }
}

#[test]
fn no_file_is_written_over_without_force() {
    let finger = Served::begin("wall");
    for (name, command) in [
        ("there.csv", &["record", "--seconds", "0.1"][..]),
        ("there.mcap", &["record", "--seconds", "0.1"]),
        ("kept.mcap", &["capture", "--frames", "10", "--out"]),
        ("there.toml", &["params", "backup"]),
    ] {
        let file = finger.file(name);
        fs::write(&file, "mine").expect("a file");
        let arguments = [command, &[&*file]].concat();
        finger.refuses(&arguments, &["is there already: --force"]);
        assert_eq!(fs::read(&file).expect("it is there"), b"mine");
        assert!(!fs::exists(format!("{file}.part")).expect("a folder"));
        finger.done(&[&[command[0]], &command[1..], &[&file, "--force"]].concat());
        assert_ne!(fs::read(&file).expect("it is there"), b"mine");
    }
    // One that came while it was recorded stays, and so does the recording.
    let (file, part) = (finger.file("late.csv"), finger.file("late.csv.part"));
    let child = finger.start(&["record", &file]);
    Served::recorded(&part);
    fs::write(&file, "mine").expect("a file");
    Served::interrupt(&child);
    fails(&child.wait_with_output().expect("it ends"), &[&part]);
    assert_eq!(fs::read(&file).expect("it is there"), b"mine");
    assert!(fs::read_to_string(&part).expect("it is there").starts_with("time_s,"));
}

#[test]
fn a_capture_is_taken_and_replays() {
    let finger = Served::begin("wall");
    let file = finger.file("press.mcap");
    let taken = finger.json(&["capture", "--press", "0.5", "--out", &file, "--board", "a served one", "--contribute"]);
    assert_eq!((&taken["replays"], &taken["ended"]), (&true.into(), &"its memory is full".into()), "{taken}");
    let frames = taken["frames"].as_u64().expect("a number");
    assert!(frames > 600 && taken["bytes"].as_u64() <= Some(44 << 10), "{taken}");
    let kept = recordings::open(file.as_ref()).expect("a capture");
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
    let why = recordings::write(full, &kept.bytes, &kept.about).expect_err("it is full");
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
    finger.refuses(&["capture", "--press", "1", "--out", &file], &["came to nothing: refused", "tare --force"]);
    assert!(fs::metadata(&file).is_err(), "nothing was written");
    assert_eq!(finger.client().number(address::TORQUE_ENABLE).expect("it answers"), 0);
    // The user may take what touches as zero, and then press further.
    assert_eq!(finger.json(&["tare", "--force"])["touched"], true);
    finger.set(&[(address::TORQUE_ENABLE, 1)]);
}

#[test]
fn what_cannot_be_captured_is_told() {
    let finger = Served::begin("wall");
    Served::not_understood(&["capture", "--out", "press.csv"], ".mcap");
    let file = finger.file("press.mcap");
    finger.done(&["params", "set", "direction_confirmed=0"]);
    finger.refuses(&["capture", "--press", "0.5", "--out", &file], &["`fingertip commission`"]);
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
    assert!(recordings::write(std::io::Cursor::new(Vec::new()), cut, &kept.about).is_err());
    finger.refuses(&["replay", &finger.file("nowhere")], &["cannot read"]);
    fs::remove_file(&file).expect("it is there");
    let folder = std::path::Path::new(&file).parent().expect("a folder");
    // Links that lead back are not followed.
    for link in ["one", "two"] {
        std::os::unix::fs::symlink(folder, folder.join(link)).expect("a link");
    }
    finger.refuses(&["replay", folder.to_str().expect("text")], &["no capture there"]);
}

fn names(schema: &Value) -> Vec<&str> {
    schema["properties"].as_object().expect("a map").keys().map(String::as_str).collect()
}

#[test]
fn the_messages_are_those_of_the_scenes_that_a_controller_knows() {
    for topic in [Topic::Scalars, Topic::Image] {
        let scenes = schemas().into_iter().find(|(_, name, _)| *name == topic.schema_name());
        let (kind, _, scenes) = scenes.unwrap_or_else(|| panic!("the scenes have no {topic:?}"));
        assert_eq!(topic.name(1), format!("/finger0/{kind}"));
        let message = topic.message(&Stamp::default(), &State::default());
        let [scenes, own, message] =
            [scenes.into_bytes(), topic.schema(), message].map(|json| serde_json::from_slice(&json).expect("JSON"));
        let (own, message): (_, Value) = (names(&own), message);
        assert_eq!(message.as_object().expect("a map").keys().collect::<Vec<_>>(), own);
        let known: Vec<&str> = names(&scenes).into_iter().filter(|name| own.contains(name)).collect();
        assert_eq!(known, own, "by the same names, in the same order");
    }
}

// What `view` shows, by the characters on a screen of 80 x 24.

fn screen(seen: &Seen, width: u16, height: u16) -> Vec<String> {
    let mut buffer = Buffer::empty(Rect::new(0, 0, width, height));
    draw(seen, buffer.area, &mut buffer);
    let cells = buffer.content().chunks(usize::from(width));
    cells.map(|line| line.iter().map(ratatui::buffer::Cell::symbol).collect::<String>().trim_end().to_owned()).collect()
}

fn pressed(time_us: u32) -> State {
    let mut pressures_pa = vec![0; 100];
    // Row 0 is the lowest line, and column 9 the last.
    (pressures_pa[0], pressures_pa[9], pressures_pa[45]) = (12_499, 1_500, 60_000);
    State {
        time_us,
        goal_mn: 1_500,
        force_mn: 1_498,
        indentation_um: 1_381,
        centre_x_um: -740,
        mode: 3,
        limits: 1 << 8,
        pressures_pa,
        ..State::default()
    }
}

#[test]
fn all_fits_eighty_by_twenty_four() {
    let mut seen = Seen { name: "ID 1 on /dev/ttyACM0".into(), rate_hz: 30.0, ..Seen::default() };
    (0..300).for_each(|n| seen.take(Ok(pressed(n * 33_333))));
    let lines = screen(&seen, 80, 24);
    println!("{}", lines.join("\n"));
    assert_eq!(lines[0], "fingertip ID 1 on /dev/ttyACM0  30 updates a second");
    assert_eq!(lines[10], " 12   0   0   0   0   0   0   0   0   2");
    assert!(lines[6].starts_with("  0   0   0   0   0  60 "), "{}", lines[6]);
    assert_eq!(lines[11].trim_end(), "kPa; the lightest is 60");
    let right: Vec<&str> = lines[1..10].iter().map(|line| line.get(41..).unwrap_or_default().trim_end()).collect();
    assert_eq!(right[0], "force      1.498 N");
    assert_eq!(right[1], "goal       1.500 N");
    assert_eq!(right[2], "mode      force");
    assert_eq!(right[3], "fault     none");
    assert_eq!(right[8], "limits    slew");
    assert!(lines[12..23].iter().any(|line| line.contains("1.5 N")) && lines[22].contains("now"));
    assert_eq!(lines[23], "q ends");
}

#[test]
fn a_fault_and_a_lost_line_are_shown() {
    let mut seen = Seen::default();
    assert!(screen(&seen, 80, 24).iter().any(|line| line.contains("waiting for the first state")));
    seen.take(Ok(State { fault: 9, mode: 5, ..pressed(0) }));
    assert!(screen(&seen, 80, 24)[4].contains("fault     9 supply low"));
    seen.take(Err(Error::Other("no answer of ID 1".into())));
    let lines = screen(&seen, 80, 24);
    assert_eq!(lines[23], "no answer of ID 1");
    assert!(lines[4].contains("supply low"), "the last state stays");
    seen.take(Ok(State { fault: 1, ..pressed(0) }));
    let lines = screen(&seen, 80, 24);
    assert!(lines[4].contains("lost frames") && lines[23].contains("no new frame"), "{lines:?}");
    assert_eq!(seen.past.len(), 1, "no time passed");
    // Any size will do.
    for (width, height) in [(1, 1), (20, 5), (41, 12), (79, 23), (300, 100)] {
        screen(&seen, width, height);
    }
}

// The captures of the repository: the core answers as the boards did.

#[test]
fn every_capture_replays_to_the_bit() {
    let output = program(&["replay", concat!(env!("CARGO_MANIFEST_DIR"), "/../captures")]).output().expect("it starts");
    let (out, err) = (String::from_utf8_lossy(&output.stdout), String::from_utf8_lossy(&output.stderr));
    assert!(output.status.success(), "{out}{err}");
    assert!(out.contains("press.mcap") && out.lines().all(|line| line.ends_with("the same to the bit")), "{out}");
}
