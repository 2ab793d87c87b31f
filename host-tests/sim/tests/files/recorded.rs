//! Recordings and their replay.

use crate::report::written;
use crate::{WALL, folder, scene, wall};
use base64::prelude::{BASE64_STANDARD, Engine as _};
use mcap::records::Metadata;
use mcap::{MessageStream, Writer};
use serde_json::Value;
use sim::metrics::shown;
use sim::native;
use sim::recording::{Recorder, check, replay};
use sim::report::{Instant, Trace};
use sim::run::run;
use std::fs;
use std::io::Cursor;
use std::path::PathBuf;

fn record(name: &str) -> PathBuf {
    let path = folder(&format!("recorded/{name}")).join("wall.mcap");
    let mut scene = wall();
    scene.duration_s = 0.05;
    let mut recorder = Recorder::new(&path, &scene, 10).unwrap();
    let outcome = run(&scene, &native::board, &mut [&mut recorder]).unwrap();
    recorder.finish(&outcome.summary.digest).unwrap();
    path
}

#[test]
fn a_recording_replays_to_the_bit() {
    let replayed = replay(&record("replayed")).unwrap();
    assert_eq!(replayed.difference, None);
    // 50 ms at 10 kHz and the tare before.
    let tare = u64::from(fingertip::shipped::TARE_FRAMES) + 2;
    assert!((500..=504).contains(&(replayed.steps - tare)), "{}", replayed.steps);
}

#[test]
fn two_fingers_are_measured_recorded_and_drawn_each() {
    let scene = scene(&WALL.replace("wall", "grasp"), &[], None);
    let path = folder("recorded/grasp").join("grasp.mcap");
    let mut recorder = Recorder::new(&path, &scene, 1).unwrap();
    let mut trace = Trace::new(scene.duration_s);
    let outcome = run(&scene, &native::board, &mut [&mut recorder, &mut trace]).unwrap();
    recorder.finish(&outcome.summary.digest).unwrap();
    let replayed = replay(&path).unwrap();
    assert_eq!(replayed.difference, None);
    assert!((6_000..6_400).contains(&replayed.steps), "{}", replayed.steps);

    let value = |name: &str| outcome.measured.get(name).unwrap_or_else(|| panic!("no {name}"));
    let [one, other] = ["finger0.peak_force_n", "finger1.peak_force_n"].map(value);
    assert_eq!(value("peak_force_n"), one.max(other));
    assert!(one > 0.9 && other > 0.9, "{one} {other}");
    assert_eq!(value("energy_j"), value("finger0.energy_j") + value("finger1.energy_j"));

    let ran = (trace, outcome);
    let page = written(&scene, &ran, &[], None);
    assert!(page.contains("Finger 0") && page.contains("Finger 1") && page.contains(">finger 1</th>"));

    // Each has its own, wherever it is shown.
    assert_ne!(one, other);
    let row = page.split("<code>peak_force_n</code>").last().unwrap().split("</tr>").next().unwrap();
    let cells: Vec<_> =
        row.split("<td class=\"number\">").skip(1).map(|cell| cell.split('<').next().unwrap()).collect();
    assert_eq!(cells, [one.max(other), one, other].map(|peak_n| shown(Some(peak_n))));
    let bytes = fs::read(&path).unwrap();
    for (number, peak_n) in [one, other].into_iter().enumerate() {
        let tracks = &ran.0.fingers[number];
        let forces = tracks.force.along(&tracks.time);
        assert_eq!(forces.iter().flatten().map(|kept| kept.high).fold(0.0, f64::max), peak_n);
        assert_eq!(tracks.instants.len(), 150);
        let sum = |map: &[[f64; 10]; 10]| map.iter().flatten().sum::<f64>() * 1.5 * 1.5 * 1e-3;
        let Instant { time_s, true_kpa: last, .. } = tracks.instants.last().unwrap();
        let at = tracks.time.means().iter().rposition(|at_s| at_s <= time_s).unwrap();
        let force_n = forces[at].unwrap().mean;
        assert!((sum(last) / force_n - 1.0).abs() < 0.01, "{} for {force_n} N", sum(last));
        let topic = format!("/finger{number}/scalars");
        let messages = MessageStream::new(&bytes).unwrap().map(Result::unwrap);
        let forces_n = messages
            .filter(|message| message.channel.topic == topic)
            .map(|message| serde_json::from_slice::<Value>(&message.data).unwrap()["true_force_n"].as_f64().unwrap());
        let recorded_n = forces_n.fold(0.0, f64::max);
        assert!((recorded_n - peak_n).abs() < 1e-12, "{recorded_n} of {peak_n} N");
    }
}

#[test]
fn a_recording_holds_what_viewers_look_for() {
    let bytes = fs::read(record("viewed")).unwrap();
    let summary = mcap::Summary::read(&bytes).unwrap().unwrap();
    let mut topics: Vec<_> = summary.channels.values().map(|channel| channel.topic.as_str()).collect();
    topics.sort_unstable();
    assert_eq!(topics, ["/finger0/core", "/finger0/frame", "/finger0/image", "/finger0/scalars"]);
    for channel in summary.channels.values() {
        let schema = channel.schema.as_ref().unwrap();
        assert_eq!((schema.encoding.as_str(), channel.message_encoding.as_str()), ("jsonschema", "json"));
        let shape: Value = serde_json::from_slice(&schema.data).unwrap();
        let properties = shape["properties"].as_object().unwrap();
        // Each message has exactly the fields of its schema.
        let messages = MessageStream::new(&bytes).unwrap().map(Result::unwrap);
        let mut count = 0;
        for message in messages.filter(|message| message.channel.topic == channel.topic) {
            let message: Value = serde_json::from_slice(&message.data).unwrap();
            assert!(message.as_object().unwrap().keys().eq(properties.keys()), "{message}");
            count += 1;
        }
        assert!(count >= 5, "{count} messages of {}", channel.topic);
        if channel.topic == "/finger0/image" {
            assert_eq!(schema.name, "foxglove.RawImage");
        }
    }
    let attachment = mcap::read::attachment(&bytes, &summary.attachment_indexes[0]).unwrap();
    assert_eq!((attachment.name.as_str(), &attachment.data[..]), ("wall.toml", wall().text.as_bytes()));
}

/// A part of a recording.
enum Part<'a> {
    Metadata(&'a mut Metadata),
    Scene(&'a mut Vec<u8>),
    /// Number and content of a message of the core.
    Core(u32, &'a mut Value),
}

/// Changes parts of a recording, which stays whole with valid checksums.
fn rewritten(bytes: &[u8], change: impl Fn(Part)) -> Vec<u8> {
    let summary = mcap::Summary::read(bytes).unwrap().unwrap();
    let mut out = Writer::new(Cursor::new(Vec::new())).unwrap();
    for index in &summary.attachment_indexes {
        let mut scene = mcap::read::attachment(bytes, index).unwrap();
        change(Part::Scene(scene.data.to_mut()));
        out.attach(&scene).unwrap();
    }
    for index in &summary.metadata_indexes {
        let mut metadata = mcap::read::metadata(bytes, index).unwrap();
        change(Part::Metadata(&mut metadata));
        out.write_metadata(&metadata).unwrap();
    }
    for message in MessageStream::new(bytes).unwrap() {
        let mut message = message.unwrap();
        if message.channel.topic == "/finger0/core" {
            let mut core = serde_json::from_slice(&message.data).unwrap();
            change(Part::Core(message.sequence, &mut core));
            message.data = core.to_string().into_bytes().into();
        }
        out.write(&message).unwrap();
    }
    out.finish().unwrap();
    out.into_inner().into_inner()
}

#[test]
fn one_flipped_bit_is_found_at_its_frame() {
    let path = record("flipped");
    let bytes = fs::read(&path).unwrap();
    fs::write(&path, rewritten(&bytes, |_| ())).unwrap();
    assert_eq!(replay(&path).unwrap().difference, None);

    // The lowest bit of the encoder's count in frame 300.
    let changed = rewritten(&bytes, |part| {
        if let Part::Core(300, core) = part {
            let mut record = BASE64_STANDARD.decode(core["record"].as_str().unwrap()).unwrap();
            record[2 * 110 + 4] ^= 1;
            core["record"] = BASE64_STANDARD.encode(record).into();
        }
    });
    fs::write(&path, changed).unwrap();
    let difference = replay(&path).unwrap().difference.expect("a changed encoder changes the core's answer");
    assert_eq!((difference.finger, difference.frame), (0, 300));
    assert!(difference.to_string().contains("differs first at frame 300"), "{difference}");

    // A duty that was not answered.
    let changed = rewritten(&bytes, |part| {
        if let Part::Core(200, core) = part {
            core["duty"] = (core["duty"].as_i64().unwrap() ^ 1).into();
        }
    });
    fs::write(&path, changed).unwrap();
    assert_eq!(replay(&path).unwrap().difference.unwrap().frame, 200);
}

#[test]
fn what_was_changed_after_the_run_is_named_and_not_the_core() {
    let path = record("changed");
    let bytes = fs::read(&path).unwrap();
    let told = |change: fn(Part)| {
        fs::write(&path, rewritten(&bytes, change)).unwrap();
        replay(&path).unwrap_err().to_string()
    };
    let error = told(|part| {
        if let Part::Metadata(metadata) = part
            && let Some(finger) = metadata.metadata.get_mut("finger0")
        {
            *finger = finger.replacen("\"params\":{", "\"params\":{\"more\":1,", 1);
        }
    });
    assert!(error.contains("fingertip.setup") && error.contains("was changed"), "{error}");
    let error = told(|part| {
        if let Part::Scene(scene) = part {
            scene.push(b'#');
        }
    });
    assert!(error.contains("the attached scene was changed"), "{error}");
}

#[test]
fn every_changed_byte_is_found_before_the_replay() {
    let bytes = fs::read(record("every_byte")).unwrap();
    check(&bytes).unwrap();
    let told = |at: usize, bit: usize| {
        let mut damaged = bytes.clone();
        damaged[at] ^= 1 << bit;
        check(&damaged).map_err(|error| error.to_string())
    };
    // All that is in front of the first chunk and behind the last one by elevens, both ends whole, and some of the
    // messages.
    let chunks = mcap::Summary::read(&bytes).unwrap().unwrap().chunk_indexes;
    let first = chunks.iter().map(|chunk| chunk.chunk_start_offset as usize).min().unwrap();
    let last = chunks.iter().map(|chunk| (chunk.chunk_start_offset + chunk.chunk_length) as usize).max().unwrap();
    let places = (0..first).step_by(11).chain((first..last).step_by(9973)).chain((last..bytes.len()).step_by(11));
    for at in places.chain(0..9).chain(bytes.len() - 60..bytes.len()) {
        assert!(told(at, at % 8).is_err(), "byte {at} was changed");
    }
    let contains = |at: usize, what: &str| {
        let error = told(at, 0).unwrap_err();
        assert!(error.contains(what), "{error}");
    };
    let find = |text: &str| bytes.windows(text.len()).position(|window| window == text.as_bytes()).unwrap();
    for at in [find("about ="), find("modulus_pa") + 13, first + 100] {
        contains(at, "in its messages, its metadata or the attached scene");
    }
    contains(bytes.len() - 100, "in its summary");
}

#[test]
fn damaged_files_are_told() {
    let path = record("damaged");
    let bytes = fs::read(&path).unwrap();
    let mut damaged = bytes.clone();
    damaged[bytes.len() / 2] ^= 1;
    fs::write(&path, damaged).unwrap();
    assert!(replay(&path).unwrap_err().to_string().contains("CRC differs"));
    fs::write(&path, &bytes[..bytes.len() / 2]).unwrap();
    assert!(replay(&path).is_err());
    fs::write(&path, "no recording").unwrap();
    assert!(replay(&path).is_err());
    assert!(replay(&path.with_extension("nowhere")).unwrap_err().to_string().contains("cannot read"));
}
