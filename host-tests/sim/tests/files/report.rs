//! Results of a run: metrics, bounds, ablation, report, recording and its replay. `cargo xtask test` shows the report in a browser; here it is text.

use crate::*;
use base64::prelude::{BASE64_STANDARD, Engine as _};
use mcap::{MessageStream, Writer};
use sim::metrics::{self, METRICS, shown};
use sim::recording::{Recorder, check, replay};
use sim::report::{Instant, Over, Report, Trace, page};
use sim::run::{self, Outcome, Without, run};
use sim::scene::Bound;
use std::io::Cursor;

#[test]
fn every_metric_has_a_name_with_a_unit_and_stands_once() {
    let units =
        ["n", "mn", "ms", "mm", "mm_per_s", "percent", "count", "um", "number", "j", "a", "c", "dropped", "broken"];
    let names = metrics::names();
    assert_eq!(names.len(), 3 * METRICS.len());
    assert_eq!(names.iter().collect::<BTreeSet<_>>().len(), names.len());
    for name in names {
        assert!(units.iter().any(|unit| name.ends_with(&format!("_{unit}")) || name.ends_with(unit)), "{name}");
    }
    assert_eq!(metrics::page().lines().count(), METRICS.len());
}

#[test]
fn the_wall_is_measured_and_ablated() {
    let scene = wall();
    let outcome = run(&scene, &native::board, &mut []).unwrap();
    let value = |name: &str| outcome.measured.get(name).unwrap_or_else(|| panic!("no {name}"));
    for (name, range) in [
        ("peak_force_n", 0.99..1.05),
        ("overshoot_percent", 0.0..5.0),
        ("approach_mm_per_s", 29.0..31.0),
        ("touch_ms", 160.0..220.0),
        ("settling_ms", 1.0..30.0),
        ("steady_error_max_mn", 0.01..10.0),
        ("steady_error_rms_mn", 0.0..value("steady_error_max_mn") * (1.0 + 1e-12)),
        ("energy_j", 0.001..0.2),
        ("confidence_min_percent", 50.1..f64::INFINITY),
    ] {
        assert!(range.contains(&value(name)), "{name}: {}", value(name));
    }
    assert_eq!(value("finger0.peak_force_n"), value("peak_force_n"));
    let exact = ["faults_count", "missed_frames_count", "winding_max_c"].map(value);
    assert_eq!(exact, [0.0, 0.0, 25.0]);
    assert!(outcome.measured.get("fault_ms").is_none() && outcome.measured.get("slip_noticed_ms").is_none());
    assert!(outcome.passed(), "{}", outcome.text());

    // The run without an effect shows what that effect changes.
    let ablated = run::ablate(&scene, &native::board).unwrap();
    assert_eq!(ablated.iter().map(|without| without.effect).collect::<Vec<_>>(), ["row_sag"]);
    let rows = run::differences(&outcome.measured, &ablated);
    assert!(rows.iter().any(|(name, ..)| *name == "force_error_rms_mn"));
    assert!(rows.iter().all(|(name, ..)| *name != "winding_max_c"));
    let text = run::ablation_text(&outcome.measured, &ablated);
    assert!(text.contains("row_sag") && text.contains("force_error_rms_mn"), "{text}");
}

#[test]
fn of_two_fingers_faults_the_first_in_time_is_the_scenes() {
    // Fault of each finger and its time, if there is one.
    let measure = |fingers: [Option<(Fault, f64)>; 2]| {
        let mut meter = Meter::default();
        for (finger, tenth) in (0..10).flat_map(|tenth| [(0, tenth), (1, tenth)]) {
            let time_s = f64::from(tenth) * 0.1;
            let fault = fingers[finger].filter(|(_, at_s)| time_s >= *at_s).map(|(fault, _)| fault);
            let status = Status { fault, ..Status::default() };
            observe(&mut meter, finger, time_s, &Command::default(), &status, &Truth::default());
        }
        ["fault_number", "fault_ms", "faults_count"].map(|name| meter.measured().get(name))
    };
    let (low, high) = (Fault::ArrayBroken, Fault::SupplyLow);
    let number = |fault: Fault| Some(f64::from(fault as u8));
    assert!(number(low) < number(high));
    for (first, second) in [(low, high), (high, low)] {
        let expected = [number(first), Some(1e3 * 0.3), Some(2.0)];
        let close = |measured: [Option<f64>; 3]| {
            measured.iter().zip(expected).all(|(a, b)| (a.unwrap() - b.unwrap()).abs() < 1e-9)
        };
        assert!(close(measure([Some((first, 0.25)), Some((second, 0.6))])));
        assert!(close(measure([Some((second, 0.6)), Some((first, 0.25))])));
    }
    let alone = measure([None, Some((high, 0.25))]);
    assert!(alone[0] == number(high) && alone[1].is_some() && alone[2] == Some(1.0), "{alone:?}");
    assert_eq!(measure([None, None]), [Some(0.0), None, Some(0.0)]);
}

/// As for a bound that does not grow with the goal: a missing value of one finger is not replaced by that of the other.
#[test]
fn of_two_fingers_one_without_a_value_breaks_what_grows_with_the_goal() {
    let mut meter = Meter::default();
    // Only the first has a goal.
    for (step, (finger, goal_mn)) in (0..600).flat_map(|step| [(step, (0, 1_000)), (step, (1, 0))]) {
        let command = Command { goal: newtons(goal_mn), ..Command::default() };
        let truth = Truth { force_n: f64::from(goal_mn) * 1e-3, ..Truth::default() };
        observe(&mut meter, finger, f64::from(step) * 1e-3, &command, &Status::default(), &truth);
    }
    let bound = |metric: &str| Bound { metric: metric.into(), min: None, max: Some(50.0), max_per_goal_n: Some(100.0) };
    let bounds = ["hold_swing_mn", "finger0.hold_swing_mn", "finger1.hold_swing_mn"].map(bound);
    let verdicts = meter.verdicts(&meter.measured(), &bounds);
    let values: Vec<_> = verdicts.iter().map(|verdict| (verdict.value, verdict.held)).collect();
    assert_eq!(values, [(None, false), (Some(0.0), true), (None, false)]);
}

#[test]
fn a_bound_breaks_on_either_side_and_without_a_value() {
    let mut scene = wall();
    let bound = |metric: &str, min, max| Bound { metric: metric.into(), min, max, max_per_goal_n: None };
    scene.bounds = vec![
        bound("peak_force_n", Some(1.2), None),
        bound("peak_force_n", None, Some(0.9)),
        bound("peak_force_n", Some(0.9), Some(1.2)),
        bound("slip_noticed_ms", None, Some(10.0)),
    ];
    let outcome = run(&scene, &native::board, &mut []).unwrap();
    let held: Vec<bool> = outcome.verdicts.iter().map(|verdict| verdict.held).collect();
    assert_eq!(held, [false, false, true, false]);
    assert!(!outcome.passed());
    let text = outcome.text();
    assert!(text.contains("BROKEN peak_force_n") && text.contains("1.2 or more asked"), "{text}");
    let json = outcome.json(&scene, "native", &[]);
    assert_eq!(json["passed"], false);
    assert_eq!(json["bounds"][3]["value"], Value::Null);
    assert_eq!(json["ledger"][0]["effect"], "row_sag");
    assert_eq!(json["seed"], 1);
}

#[test]
fn values_are_shown_with_the_digits_that_count() {
    let values = [Some(0.0), Some(1.0), Some(1.234_567_8), Some(-123_456.7), Some(1.234_567e-4), None];
    assert_eq!(values.map(metrics::shown), ["0", "1", "1.2346", "-123457", "0.00012346", "none"]);
}

/// Library that draws the plots, after its licence.
const LIBRARY: &str =
    include_str!(concat!(env!("FINGERTIP_ROOT"), "/host-tests/sim/src/report/uplot/uPlot.iife.min.js"));

fn traced(scene: &Scene) -> (Trace, Outcome) {
    let mut trace = Trace::new(scene.duration_s);
    let outcome = run(scene, &native::board, &mut [&mut trace]).unwrap();
    (trace, outcome)
}

/// Report of a run.
pub fn written(scene: &Scene, (trace, outcome): &(Trace, Outcome), ablated: &[Without], over: Option<&Over>) -> String {
    page(&Report { scene, board: "native", outcome, trace, ablated, over })
}

#[test]
fn a_report_stands_alone_and_has_every_part() {
    let mut scene = wall();
    scene.about = "A <b>wall</b> & more".into();
    let ran = traced(&scene);
    let page = written(&scene, &ran, &run::ablate(&scene, &native::board).unwrap(), None);
    for part in ["bounds", "plots", "metrics", "ledger", "ablation", "scene"] {
        assert!(page.contains(&format!("<section id=\"{part}\">")), "{part}");
    }
    assert!(page.contains("A &lt;b&gt;wall&lt;/b&gt; &amp; more") && !page.contains("<b>wall"));
    assert!(page.contains("Simulated") && page.contains("row_sag") && page.contains("[[expect]]"));
    // The control error is drawn to the scale of the holds: the approach is off by the whole goal.
    let plots = &ran.0.fingers[0];
    let [[low, high], held] = [&plots.control_error, &plots.held_error].map(|track| track.ends().unwrap());
    assert!(low < -900.0 && high < 100.0 && held[0] > -50.0 && held[1] < 50.0, "{low} to {high}, held {held:?}");
    assert!(page.contains("the axis fits the holds"));
    // Nothing is fetched, and nothing may be: the only addresses are XML's names, and the library's of itself.
    assert!(page.contains("content=\"default-src 'none'; style-src 'unsafe-inline'; script-src 'unsafe-inline'\""));
    assert_eq!(page.matches(LIBRARY).count(), 1);
    let fetched = page.replace(LIBRARY, "").replace("http://www.w3.org/2000/svg", "");
    for address in ["http:", "https:", "src=", "href=", "url(", "@import"] {
        assert!(!fetched.contains(address), "{address}");
    }
    assert!(page.matches("<figure class=\"plot\"").count() > 4 && page.contains("<noscript>"));
    // Every picture has a description.
    let pictures: Vec<&str> = page.split(" role=\"img\"").skip(1).collect();
    assert!(
        !pictures.is_empty() && pictures.iter().all(|tag| tag.split('>').next().unwrap().contains(" aria-label=\""))
    );
    assert_eq!(plots.instants.len(), 150);
    assert!(plots.instants.iter().any(|at| at.true_kpa.iter().flatten().any(|kpa| *kpa > 10.0)));
    assert!(plots.instants.iter().any(|at| at.codes.iter().flatten().any(|code| *code > 100)));
    // Stretches and maps bound its size for any length of a run.
    assert!(page.len() < 1_000_000, "{} bytes", page.len());
}

#[test]
fn what_is_broken_comes_first_and_the_rest_is_folded() {
    let scene = scene(WALL, &["duration_s=0.05"], None);
    assert_eq!(scene.set, ["duration_s=0.05"]);
    let mut ran = traced(&scene);
    let held = Verdict { held: true, ..ran.1.verdicts[0].clone() };
    let mut broken = Verdict { held: false, ..held.clone() };
    broken.metric = "energy_j".into();
    ran.1.verdicts = vec![held, broken];
    let page = written(&scene, &ran, &[], None);
    let at = |part: &str| page.find(part).unwrap_or_else(|| panic!("no {part}"));
    assert!(at("<code>duration_s=0.05</code>") < at("1 of 2 bounds broken"));
    assert!(at("1 of 2 bounds broken") < at("<code>energy_j</code>"));
    assert!(at("<code>energy_j</code>") < at("<details><summary>1 held</summary>"));
    let groups: Vec<&str> = page.split("<details class=\"group\"").skip(1).collect();
    assert!(groups.len() > 4 && groups[0].starts_with(" open><summary>Motor and energy"), "{}", &groups[0][..80]);
    assert!(groups[1..].iter().all(|group| group.starts_with("><summary>")));
    // Each metric is in one group.
    for name in METRICS.iter().map(|metric| metric.name) {
        assert_eq!(groups.concat().matches(&format!("<code>{name}</code>")).count(), 1, "{name}");
    }
}

#[test]
fn a_report_lies_over_another_whatever_the_scenes_are_called() {
    let mut scene = wall();
    scene.name = "</script><script>alert(1)</script><!--".into();
    scene.about = scene.name.clone();
    let ran = traced(&scene);
    let alone = written(&scene, &ran, &[], None);
    // Its data, the library, the scripts of the page.
    assert_eq!((alone.matches("<script").count(), alone.matches("</script>").count()), (3, 3));
    let over = Over::of(&alone).unwrap();
    let both = written(&scene, &ran, &[], Some(&over));
    assert_eq!((both.matches("<script").count(), both.matches("</script>").count()), (4, 4));
    assert!(!both.contains("<!--"));
    // The page holds the data of the other run unchanged.
    let data =
        |page: &str, begin: &str| page.split_once(begin).unwrap().1.split_once("</script>").unwrap().0.to_owned();
    let [own, other] =
        ["run", "over"].map(|id| data(&both, &format!("<script type=\"application/json\" id=\"{id}\">")));
    assert_eq!(own, other);
    for (wrong, why) in [
        ("<p>a page</p>".to_owned(), "no report"),
        (alone.split_at(alone.find("\"fingers\"").unwrap() + 20).0.to_owned(), "cut off"),
        (alone.replace("id=\"run\">{", "id=\"run\">{{"), "damaged"),
        (alone.replace("\"format\":1,", "\"format\":99,"), "format 99, not 1"),
    ] {
        let error = Over::of(&wrong).unwrap_err();
        assert!(error.contains(why) && error.contains("--out"), "{error}");
    }
}

/// Runs a scene with a recorder that writes every n-th frame as a message. Returns the file, the trace and the outcome.
fn recorded(name: &str, scene: &Scene, every: u64) -> (PathBuf, (Trace, Outcome)) {
    let path = folder(&format!("recorded/{name}")).join("run.mcap");
    let mut recorder = Recorder::new(&path, scene, every, true).unwrap();
    let mut trace = Trace::new(scene.duration_s);
    let outcome = run(scene, &native::board, &mut [&mut recorder, &mut trace]).unwrap();
    recorder.finish(&outcome.summary.digest).unwrap();
    (path, (trace, outcome))
}

fn record(name: &str) -> PathBuf {
    recorded(name, &Scene { duration_s: 0.05, ..wall() }, 10).0
}

#[test]
fn two_fingers_are_measured_recorded_and_drawn_each() {
    let scene = scene(&WALL.replace("wall", "grasp"), &[], None);
    let (path, ran) = recorded("grasp", &scene, 1);
    let replayed = replay(&path).unwrap();
    assert_eq!(replayed.difference, None);
    assert!((6_000..6_400).contains(&replayed.steps), "{}", replayed.steps);

    let value = |name: &str| ran.1.measured.get(name).unwrap_or_else(|| panic!("no {name}"));
    let [one, other] = ["finger0.peak_force_n", "finger1.peak_force_n"].map(value);
    assert_eq!(value("peak_force_n"), one.max(other));
    assert!(one > 0.9 && other > 0.9, "{one} {other}");
    assert_eq!(value("energy_j"), value("finger0.energy_j") + value("finger1.energy_j"));

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

/// Changes messages of the core in a recording, which stays whole with valid checksums.
fn rewritten(bytes: &[u8], change: impl Fn(u32, &mut Value)) -> Vec<u8> {
    let summary = mcap::Summary::read(bytes).unwrap().unwrap();
    let mut out = Writer::new(Cursor::new(Vec::new())).unwrap();
    for index in &summary.metadata_indexes {
        out.write_metadata(&mcap::read::metadata(bytes, index).unwrap()).unwrap();
    }
    for message in MessageStream::new(bytes).unwrap() {
        let mut message = message.unwrap();
        if message.channel.topic == "/finger0/core" {
            let mut core = serde_json::from_slice(&message.data).unwrap();
            change(message.sequence, &mut core);
            message.data = core.to_string().into_bytes().into();
        }
        out.write(&message).unwrap();
    }
    out.finish().unwrap();
    out.into_inner().into_inner()
}

#[test]
fn a_recording_replays_to_the_bit_and_one_flipped_bit_is_found_at_its_frame() {
    let path = record("flipped");
    let bytes = fs::read(&path).unwrap();
    // 50 ms at 10 kHz and the tare before.
    let steps = replay(&path).unwrap().steps - u64::from(fingertip::shipped::TARE_FRAMES) - 2;
    assert!((500..=504).contains(&steps), "{steps}");
    fs::write(&path, rewritten(&bytes, |_, _| ())).unwrap();
    assert_eq!(replay(&path).unwrap().difference, None);

    // The lowest bit of the encoder's count in frame 300.
    let changed = rewritten(&bytes, |number, core| {
        if number == 300 {
            let mut record = BASE64_STANDARD.decode(core["record"].as_str().unwrap()).unwrap();
            record[2 * 110 + 4] ^= 1;
            core["record"] = BASE64_STANDARD.encode(record).into();
        }
    });
    fs::write(&path, changed).unwrap();
    let difference = replay(&path).unwrap().difference.expect("a changed encoder changes the core's answer");
    assert!(difference.starts_with("finger 0 differs first at frame 300, "), "{difference}");

    // A duty that was not answered.
    let changed = rewritten(&bytes, |number, core| {
        if number == 200 {
            core["duty"] = (core["duty"].as_i64().unwrap() ^ 1).into();
        }
    });
    fs::write(&path, changed).unwrap();
    assert!(replay(&path).unwrap().difference.unwrap().contains("at frame 200, "));
}

#[test]
fn every_changed_byte_and_what_is_no_recording_is_found_before_the_replay() {
    let path = record("every_byte");
    let bytes = fs::read(&path).unwrap();
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
        contains(at, "in its messages, its metadata or what is attached");
    }
    contains(bytes.len() - 100, "in its summary");

    let half = bytes.len() / 2;
    let mut damaged = bytes.clone();
    damaged[half] ^= 1;
    for (left, why) in [(&damaged[..], "CRC differs"), (&bytes[..half], ""), (b"no recording", "")] {
        fs::write(&path, left).unwrap();
        assert!(replay(&path).unwrap_err().to_string().contains(why));
    }
    assert!(replay(&path.with_extension("nowhere")).unwrap_err().to_string().contains("cannot read"));
}
