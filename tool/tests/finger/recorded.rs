//! Recordings: their times, their owners, and the rest of one whose program was killed.

use crate::served::{Served, ended};
use mcap::read::Options;
use mcap::{MessageStream, Summary};
use std::fs;
use std::time::{SystemTime, UNIX_EPOCH};

/// Host's time, s since 1970.
fn unix_s() -> f64 {
    SystemTime::now().duration_since(UNIX_EPOCH).expect("after 1970").as_secs_f64()
}

/// Messages of a whole file.
fn messages(bytes: &[u8]) -> Vec<mcap::Message<'_>> {
    MessageStream::new(bytes).expect("MCAP").map(|message| message.expect("whole")).collect()
}

#[test]
fn states_are_recorded_with_the_controllers_times() {
    let finger = Served::begin("wall");
    let file = finger.file("force.csv");
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
    let done = finger.json(&["record", "--seconds", "0.2", "--pressures", &mcap]);
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
    assert!(Served::not_understood(&["record", "force.txt"]).contains(".csv or .mcap"));
    assert!(finger.refused(&["record", "/nowhere/force.csv"]).contains("cannot write /nowhere/force.csv"));
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

    // A recording whose connection is lost keeps its rows, and reports why it ends.
    let lost = finger.file("lost.csv");
    let child = finger.start(&["record", &lost]);
    Served::begun(&format!("{lost}.part"));
    finger.end();
    let (code, said) = ended(&child.wait_with_output().expect("it ends"));
    assert_eq!(code, Some(1), "{said}");
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
    assert!((messages[0].log_time as f64 * 1e-9 - unix_s()).abs() < 3_600.0, "{}", messages[0].log_time);
}

/// Messages of a file that was cut, by their numbers and bytes, and whether it ends with a whole record.
fn readable(bytes: &[u8]) -> (Vec<(u32, Vec<u8>)>, bool) {
    let mut whole = true;
    let stream = MessageStream::new_with_options(bytes, Options::IgnoreEndMagic.into());
    let Ok(stream) = stream else { return (Vec::new(), false) };
    let messages = stream.map_while(|message| message.inspect_err(|_| whole = false).ok());
    let messages = messages.map(|message| (message.sequence, message.data.into_owned())).collect();
    (messages, whole)
}

#[test]
fn a_recording_that_was_cut_anywhere_is_read_up_to_its_last_whole_chunk() {
    let finger = Served::begin("wall");
    let file = finger.file("cut.mcap");
    finger.done(&["record", "--seconds", "1.5", "--pressures", &file]);
    let bytes = fs::read(&file).expect("it was written");
    let all = readable(&bytes).0;
    let chunks = Summary::read(&bytes).expect("MCAP").expect("a summary").chunk_indexes;
    assert!(chunks.len() > 2, "{} chunks", chunks.len());
    let ends: Vec<usize> =
        chunks.iter().map(|chunk| (chunk.chunk_start_offset + chunk.chunk_length) as usize).collect();
    for (place, end) in ends.iter().enumerate() {
        let (messages, whole) = readable(&bytes[..*end]);
        assert!(whole && messages.len() * ends.len() > place, "chunk {place}: {} messages", messages.len());
    }
    for point in 1..=20 {
        let cut = bytes.len() * point / 21;
        let messages = readable(&bytes[..cut]).0;
        let chunk = ends.iter().rfind(|end| **end <= cut).map_or(0, |end| readable(&bytes[..*end]).0.len());
        assert!(messages.len() >= chunk, "cut at {cut}: {} of {chunk} messages", messages.len());
        assert_eq!(messages, all[..messages.len()], "cut at {cut}");
    }
}

#[test]
fn a_killed_recording_is_kept_and_can_be_read() {
    let finger = Served::begin("wall");
    for name in ["killed.mcap", "killed.csv"] {
        let (file, part) = (finger.file(name), finger.file(&format!("{name}.part")));
        let mut child = finger.start(&["record", "--rate-hz", "0", &file]);
        while !fs::metadata(&part).is_ok_and(|part| part.len() > 300_000) {
            std::thread::yield_now();
        }
        child.kill().expect("it runs");
        child.wait().expect("it ends");
        let bytes = fs::read(&part).expect("it is there");
        if name.ends_with(".mcap") {
            let messages = readable(&bytes).0;
            assert!(messages.len() > 20, "{} messages", messages.len());
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
    Served::begun(&part);
    fs::write(&file, "mine").expect("a file");
    Served::interrupt(&child);
    let (code, said) = ended(&child.wait_with_output().expect("it ends"));
    assert!(code == Some(1) && said.contains(&part), "{said}");
    assert_eq!(fs::read(&file).expect("it is there"), b"mine");
    assert!(fs::read_to_string(&part).expect("it is there").starts_with("time_s,"));
}
