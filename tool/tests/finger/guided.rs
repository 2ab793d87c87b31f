//! The guided procedures: `commission`, `identify` and `calibrate` against a served finger.

use crate::served::{self, Served, Told};
use crate::stopped::{ENDS, End, RESIDUAL_N, end_behind, is_at_rest};
use fingertip::shipped::address;
use rustix::process::Signal;
use serde_json::{Value, json};
use std::fs;
use std::io::{BufRead as _, BufReader, Write as _};
use std::process::{Child, Stdio};

/// Options of a calibration without questions and without the pause of a real sensor.
const QUICK: [&str; 6] = ["calibrate", "--no-wait", "--pause-s", "0", "--within-s", "3600"];

fn output(finger: &Served, arguments: &[&str]) -> (Option<i32>, Value, String) {
    let output = finger.fingertip(&[arguments, &["--json"]].concat()).output().expect("it starts");
    let (code, text) = served::ended(&output);
    (code, serde_json::from_slice(&output.stdout).unwrap_or(Value::Null), text)
}

/// Starts a command that reads its answers from this input.
fn spawned(finger: &Served, arguments: &[&str], answers: impl Into<Stdio>) -> Child {
    let mut command = finger.fingertip(arguments);
    command.stdin(answers).stdout(Stdio::null()).stderr(Stdio::piped()).spawn().expect("it starts")
}

fn parameters(finger: &Served) -> Value {
    finger.json(&["params", "get"])
}

fn gains(finger: &Served) -> Value {
    finger.json(&["params", "diff"])["gains"]["now"].clone()
}

/// True if a number is this close to another, as a share.
fn near(number: &Value, wanted: f64, part: f64) -> bool {
    number.as_f64().is_some_and(|number| (number / wanted - 1.0).abs() < part)
}

#[test]
fn a_program_commissions_and_calibrates_a_finger() {
    let finger = Served::patient("wall");
    finger.done(&["params", "set", "direction_confirmed=0", "torque_constant_unm_per_a=5000"]);
    let session = finger.file("drive");
    let commission = ["commission", "--forward", "yes", "--resistance-ohm", "3.53", "--apply", "--session", &session];
    let drive = finger.json(&commission);
    let [before, after, sigma] = ["before", "after", "sigma"].map(|part| &drive[part]["torque_constant_unm_per_a"]);
    assert!(near(after, 5_350.0, 0.03) && *before == 5_000 && near(sigma, 50.0, 0.9), "{drive}");
    assert_eq!((&drive["applied"], &drive["refused"], &drive["session"]), (&true.into(), &json!([]), &json!(session)));
    let now = parameters(&finger);
    assert_eq!((&now["torque_constant_unm_per_a"], &now["direction_confirmed"]), (after, &1.into()));
    assert_eq!(finger.json(&commission), drive, "a session that is complete gives the same again");

    let session = finger.file("array");
    let scale = ["--presses", "2", "--scale-n", "1,2", "--shown-n", "1.1,2.2", "--apply", "--session", &session];
    let calibrate = [&QUICK[..], &scale].concat();
    let array = finger.json(&calibrate);
    let after = &array["after"];
    // The scale shows 1.1 times what is read: less codes for each kPa, and a harder tip.
    assert!(near(&after["codes_per_kpa_milli"], 24_000.0 / 1.1, 0.02), "{array}");
    assert!(near(&after["modulus_pa"], 250_000.0 * 1.1, 0.05), "{array}");
    assert!(array["sigma"]["gains"][5][5].as_f64() > Some(0.0) && array["sigma"]["gains"][0][0].is_null(), "{array}");
    assert_eq!((&array["dead"], &array["odd"], &array["applied"]), (&json!([]), &json!([]), &true.into()));
    let now = parameters(&finger);
    for name in ["modulus_pa", "codes_per_kpa_milli"] {
        assert_eq!(now[name], after[name], "{name}");
    }
    assert_eq!(gains(&finger), after["gains"]);
    is_at_rest(&finger, "calibrated");
    let heard = finger.heard();
    assert_eq!(finger.json(&calibrate), array, "a session that is complete gives the same again");
    assert!(finger.heard() - heard < 60, "nothing moves");
    finger.done(&["params", "set", "tip_radius_um=9000"]);
    finger.refuses(&calibrate, &["tip_radius_um changed since this session began"]);
    let commission = ["commission", "--forward", "yes", "--session", &session];
    finger.refuses(&commission, &["a session of the command \"calibrate\""]);
}

/// A record of a session, in base64.
fn step(session: &str, name: &str) -> String {
    let session: Value = serde_json::from_str(session).expect("JSON");
    session["steps"][name].as_str().expect("it was kept").to_owned()
}

#[test]
fn a_killed_session_resumes_where_it_was() {
    let finger = Served::patient("wall");
    let session = finger.file("killed");
    let file = finger.file("killed/session.json");
    let calibrate = [&QUICK[..], &["--presses", "2", "--no-scale", "--session", &session]].concat();
    let before = parameters(&finger);
    let kept = || fs::read_to_string(&file).unwrap_or_default();
    let mut child = finger.start(&[&calibrate[..], &["--json"]].concat());
    Served::wait_for(|| kept().contains("press-1"));
    served::kill(&mut child);
    finger.done(&["stop"]);
    finger.done(&["recover"]);
    let first = step(&kept(), "press-1");
    let resumed = finger.json(&calibrate);
    assert_eq!(step(&kept(), "press-1"), first, "the first press was not repeated");
    assert_eq!(finger.json(&calibrate), resumed, "the same records give the same numbers");
    assert_eq!((&resumed["applied"], parameters(&finger)), (&false.into(), before), "{resumed}");
    assert!(near(&resumed["after"]["modulus_pa"], 250_000.0, 0.05), "{resumed}");
    // A weight that lies on the tip: the object comes to it, and goes.
    let creep = [&calibrate[..], &["--creep-s", "6"]].concat();
    let [lay, take] = ["lay a weight", "take the weight off"];
    let questions: [Question<'_>; 3] = [
        (lay, &|| drop(finger.command("move -0.5")), ""),
        (take, &|| drop(finger.command("move 5")), ""),
        ("write these values", &|| (), "no\n"),
    ];
    let (_, said) = asked(&finger, &creep, "", &questions);
    assert!(said.contains(lay) && said.contains(take), "{said}");
    let weighed = finger.json(&creep);
    assert_eq!((&weighed["after"]["creep_permille"], &weighed["refused"]), (&0.into(), &json!([])), "{weighed}");
    // A damaged record is not solved.
    fs::write(&file, kept().replace(&first, &first[..first.len() - 8])).expect("a file");
    finger.refuses(&calibrate, &["press-1: the series has"]);
}

#[test]
fn a_session_of_a_finger_is_refused_for_another_one_at_its_id() {
    let fingers = Served::begin("grasp");
    let session = fingers.file("first");
    let calibrate = [&QUICK[..], &["--presses", "1", "--no-scale", "--session", &session]].concat();
    let begun = fingers.file("first/session.json");
    let mut child = fingers.start(&calibrate);
    Served::begun(&begun);
    served::kill(&mut child);
    fingers.done(&["stop"]);
    for (id, other) in [("1", "3"), ("2", "1")] {
        fingers.done(&["--id", id, "params", "set", &format!("id={other}")]);
    }
    fingers.refuses(&calibrate, &["a session of the finger with chip_id", "name another folder"]);
}

// KILL after packets of a session that has all records: what is left are the write and the tare. Usually after each even number of
// packets, one of which lies between the gains and the parameters.
sim::sizes!(a_write_that_is_killed_leaves_old_or_new_parameters_and_is_completed, write_killed(2), write_killed(1));

fn write_killed(every: usize) {
    let finger = Served::patient("wall");
    let session = finger.file("written");
    let calibrate = [&QUICK[..], &["--presses", "1", "--no-scale", "--session", &session]].concat();
    let before = parameters(&finger);
    let wanted = finger.json(&calibrate)["after"].clone();
    let applied = [&calibrate[..], &["--apply"]].concat();
    let (mut seen, mut completed) = ([0; 2], 0);
    for packets in (0..).step_by(every) {
        if !finger.ended_after(packets, &applied, Signal::KILL) {
            break;
        }
        let now = parameters(&finger);
        let mut new = before.clone();
        new["modulus_pa"] = wanted["modulus_pa"].clone();
        assert!(now == before || now == new, "killed after {packets}: {now}");
        seen[usize::from(now == new)] += 1;
        if now == before && gains(&finger) == wanted["gains"] {
            // The worst instant: the same session completes the write.
            let done = finger.json(&applied);
            assert_eq!((&done["applied"], &done["after"]), (&true.into(), &wanted), "killed after {packets}");
            assert_eq!(parameters(&finger), new);
            completed += 1;
        }
        // Behind a reset there is what was saved.
        finger.restart();
        assert_eq!(parameters(&finger), before);
    }
    assert!(seen.iter().all(|count| *count > 0) && completed > 0, "{seen:?}, {completed} completed");
    assert_eq!((&parameters(&finger)["modulus_pa"], gains(&finger)), (&wanted["modulus_pa"], wanted["gains"].clone()));
}

// A restart before packets of a write that is saved, and before each one of a restore: flash has all of it or nothing, and a run
// that ends well has it. A controller that restarted has the values of the flash, and reports them as saved.
sim::sizes!(a_restart_amid_a_write_is_no_success_and_saves_no_half, restarted_every(12), restarted_every(3));

fn restarted_every(every: usize) {
    let finger = Served::patient("wall");
    let [session, old, new] = ["restarted", "old.toml", "new.toml"].map(|name| finger.file(name));
    finger.done(&["params", "save"]);
    finger.done(&["params", "backup", &old]);
    let calibrate =
        [&QUICK[..], &["--presses", "1", "--no-scale", "--session", &session, "--apply", "--save"]].concat();
    finger.done(&calibrate);
    finger.done(&["params", "backup", &new]);
    let is = |file: &str| finger.json(&["params", "diff", file]) == json!({});
    for (arguments, every) in [(&calibrate[..], every), (&["params", "restore", &new, "--save"], 1)] {
        let mut seen = [0; 3];
        for packets in (0..).step_by(every) {
            finger.done(&["params", "restore", &old, "--save"]);
            finger.line(move |line| line.restart = Some(packets));
            let (code, found, said) = output(&finger, arguments);
            let restarted = finger.line(|line| line.restart.is_none());
            finger.restart();
            let (as_new, as_old) = (is(&new), is(&old));
            assert!(as_new || as_old && code == Some(1), "{arguments:?}, {packets}: {said}");
            assert!(as_new || found["saved"] != true, "{arguments:?}, {packets}: {found}");
            seen[if code == Some(0) { 0 } else { 1 + usize::from(as_new) }] += 1;
            if !restarted {
                break;
            }
        }
        assert!(seen[0] > 0 && seen[1] > 0, "{seen:?}");
    }
    // Nothing of an earlier run is left: without a scale the sensitivity is as it was.
    let session = finger.file("twice");
    let calibrate = [&QUICK[..], &["--presses", "1", "--session", &session, "--apply"]].concat();
    finger.done(&["params", "restore", &old, "--save"]);
    finger.done(&[&calibrate[..], &["--scale-n", "1", "--shown-n", "1.3"]].concat());
    assert!(parameters(&finger)["codes_per_kpa_milli"] != 24_000);
    finger.done(&[&calibrate[..], &["--no-scale"]].concat());
    assert_eq!(parameters(&finger)["codes_per_kpa_milli"], 24_000);
}

#[test]
fn a_wrong_answer_changes_nothing() {
    let finger = Served::patient("wall");
    let before = parameters(&finger);
    let (_, text) = asked(&finger, &["commission"], "perhaps\nyes\n", &[]);
    assert!(text.contains("`perhaps`: yes or no is expected") && text.contains("give --apply"), "{text}");
    assert_eq!(parameters(&finger), before);
    let (code, text) = asked(&finger, &["commission"], "no\n", &[]);
    assert!(text.contains("swap the motor's leads") && code == Some(1), "{text}");
    assert_eq!(parameters(&finger)["direction_confirmed"], 0, "torque is refused from here on");
    finger.refuses(&["identify", "--no-wait"], &["`fingertip commission`"]);
    finger.done(&["params", "set", "direction_confirmed=1"]);

    let session = finger.file("scale");
    let calibrate = [&QUICK[..], &["--presses", "1", "--scale-n", "1", "--apply", "--session", &session]].concat();
    // A signal while the force is held.
    let child = finger.start(&[&calibrate[..], &["--shown-n", "1"]].concat());
    finger.until("Force:");
    Served::interrupt(&child);
    let ended = child.wait_with_output().expect("it ends");
    assert_eq!(ended.status.code(), Some(130), "{ended:?}");
    assert!(finger.true_force_n() < 0.05, "{}", finger.command("state"));
    is_at_rest(&finger, "interrupted");
    assert_eq!(parameters(&finger), before);
    // What the scale shows is ten times what is read.
    let (code, found, why) = output(&finger, &[&calibrate[..], &["--shown-n", "10"]].concat());
    assert!(why.contains("a half to two is allowed") && code == Some(1), "{why}");
    assert_eq!((&found["applied"], found["refused"].as_array().map(Vec::len)), (&false.into(), Some(1)), "{found}");
    assert_eq!(parameters(&finger), before);
    let found = finger.json(&[&calibrate[..], &["--shown-n", "1.1"]].concat());
    assert_eq!(found["applied"], true, "{found}");
}

#[test]
fn a_program_is_asked_nothing() {
    let finger = Served::patient("wall");
    for (arguments, option) in [
        (&["commission"][..], "--forward yes"),
        (&["identify"], "--no-wait"),
        (&["calibrate", "--no-wait"], "--shown-n"),
        (&["calibrate", "--no-wait", "--scale-n", "1,2", "--shown-n", "1"], "has 1 numbers for 2"),
    ] {
        let (code, found, why) = output(&finger, arguments);
        assert!(code == Some(2) && found.is_null() && why.contains(option), "{arguments:?}: {why}");
    }
}

/// Words of a question, what happens meanwhile, and the answer.
type Question<'a> = (&'a str, &'a dyn Fn(), &'a str);

/// Writes `first` to a command, and at each question its answer; without questions its input ends. Exit code and errors.
fn asked(finger: &Served, arguments: &[&str], first: &str, questions: &[Question<'_>]) -> (Option<i32>, String) {
    let mut child = spawned(finger, arguments, Stdio::piped());
    let mut input = child.stdin.take();
    input.as_ref().expect("a pipe").write_all(first.as_bytes()).expect("it reads");
    input = input.filter(|_| !questions.is_empty());
    let mut said = String::new();
    for line in BufReader::new(child.stderr.take().expect("a pipe")).lines() {
        let line = line.expect("text");
        for (_, meanwhile, answer) in questions.iter().filter(|(question, ..)| line.contains(question)) {
            meanwhile();
            input.as_ref().expect("a pipe").write_all(answer.as_bytes()).expect("it reads");
        }
        said += &(line + "\n");
    }
    (child.wait().expect("it ends").code(), said)
}

#[test]
fn a_session_moves_and_writes_only_under_its_first_settings() {
    let finger = Served::patient("wall");
    let before = parameters(&finger);
    let press = ["identify", "--pause-s", "0", "--within-s", "3600"];
    // A restart loses the radius that was not saved.
    for (arguments, talk) in [
        ([&press[..], &["--apply"]].concat(), ["", "then press Enter", "\n"]),
        (press.to_vec(), ["\n", "write these values", "yes\n"]),
    ] {
        finger.done(&["params", "set", "tip_radius_um=9600"]);
        let (code, said) = asked(&finger, &arguments, talk[0], &[(talk[1], &|| finger.restart(), talk[2])]);
        assert!(code == Some(1) && said.contains("tip_radius_um changed since this session began"), "{talk:?}: {said}");
        assert_eq!(parameters(&finger), before, "{talk:?}");
    }

    // A refused result has an object too.
    finger.done(&["params", "set", "tip_radius_um=9000"]);
    let (code, found, _) = output(&finger, &[&press[..], &["--no-wait"]].concat());
    assert!(code == Some(1) && found["refused"][0].as_str().is_some_and(|why| why.contains("no modulus")), "{found}");
    finger.done(&["params", "set", "tip_radius_um=10000"]);

    let session = finger.file("once");
    let calibrate = [&QUICK[..], &["--apply", "--session", &session]].concat();
    finger.done(&[&calibrate[..], &["--presses", "1", "--no-scale"]].concat());
    let more = [&["--presses", "2", "--no-scale"][..], &["--presses", "1", "--scale-n", "1", "--shown-n", "1.1"]];
    for more in more {
        finger.refuses(&[&calibrate[..], more].concat(), &["this session's values are written: begin another one"]);
    }
}

#[test]
fn numbers_of_a_scale_belong_to_their_holds() {
    let finger = Served::patient("wall");
    let session = finger.file("scale");
    let calibrate = [&QUICK[..], &["--presses", "1", "--session", &session]].concat();
    let run = |more: &[&str]| output(&finger, &[&calibrate[..], more].concat());
    for (wrong, what) in [
        (&["--scale-n", "1,9", "--shown-n", "1.1,9.9"][..], "9000 mN cannot be held"),
        (&["--no-scale", "--warm"], "does not measure its temperature"),
    ] {
        let (code, _, why) = run(wrong);
        assert!(code == Some(1) && why.contains(what) && finger.heard() < 200, "before a press: {why}");
    }
    run(&["--scale-n", "1,2", "--shown-n", "1.1,2.2"]);
    let heard = finger.heard();
    for wrong in [["--scale-n", "1", "--shown-n", "1.1"], ["--scale-n", "2,1", "--shown-n", "2.2,1.1"]] {
        let (code, _, why) = run(&wrong);
        assert!(code == Some(1) && why.contains("holds of [1.0, 2.0] N"), "{wrong:?}: {why}");
    }
    let (code, found, why) = run(&["--scale-n", "1,2", "--shown-n", "10,20"]);
    assert!(code == Some(1) && found["applied"] == false && why.contains("correct --shown-n"), "{why}");
    let corrected = run(&["--scale-n", "1,2", "--shown-n", "1.2,2.4"]).1;
    assert!(near(&corrected["scale"]["factor"], 1.2, 0.02), "{corrected}");
    let (_, again, why) = run(&[]);
    assert_eq!(again, corrected, "a number that was corrected is kept: {why}");
    assert!(why.contains("the session has the step holds: it is reused"), "{why}");
    assert!(finger.heard() - heard < 200, "nothing moves");

    // The values are written, but the tare fails.
    finger.command("fault supply-low");
    finger.refuses(&["press", "0.5", "--within-s", "3600"], &["fault 9"]);
    let (code, found, why) = run(&["--apply"]);
    assert!(code == Some(1) && why.contains("the tare that new gains need failed"), "{why}");
    assert_eq!((&found["applied"], &found["saved"]), (&true.into(), &false.into()), "{found}");
    finger.command("mend");
    finger.done(&["recover"]);
    assert_eq!(run(&["--apply"]).1["applied"], true);
    assert_eq!(finger.json(&["info"])["limit_names"], json!([]), "it is tared");
    // After a refused write the session can write again.
    let other = ["--scale-n", "1,2", "--shown-n", "1.1,2.2", "--apply"];
    finger.set(&[(address::TORQUE_ENABLE, 1)]);
    let (code, found, why) = run(&other);
    assert!(code == Some(1) && found["applied"] == false && why.contains("Nothing was changed"), "{why}");
    finger.set(&[(address::TORQUE_ENABLE, 0)]);
    let (code, found, why) = run(&other);
    assert!(code == Some(0) && found["applied"] == true, "{why}");
}

#[test]
fn a_jog_that_is_repeated_repeats_the_strokes() {
    let finger = Served::patient("wall");
    let session = finger.file("drive");
    let commission = ["commission", "--forward", "yes", "--within-s", "3600", "--session", &session];
    let strokes = || step(&fs::read_to_string(finger.file("drive/session.json")).expect("it was kept"), "strokes");
    finger.json(&commission);
    let first = strokes();
    let (_, _, said) = output(&finger, &commission);
    assert!(said.contains("step jog: it is reused") && said.contains("step strokes: it is reused"), "{said}");
    finger.done(&["params", "set", "direction_confirmed=0"]);
    finger.json(&commission);
    assert!(strokes() != first, "another finger, by all that is known");

    // The answer no also clears direction_confirmed in flash: it reads 0 after a reboot.
    finger.done(&["params", "save"]);
    let (code, found, why) = output(&finger, &["commission", "--forward", "no", "--within-s", "3600"]);
    assert!(code == Some(1) && found["refused"][0].as_str().is_some_and(|why| why.contains("swap")), "{found}, {why}");
    finger.restart();
    assert_eq!(parameters(&finger)["direction_confirmed"], 0);
}

#[test]
fn answers_come_after_their_question_and_a_signal_ends_half_of_one() {
    let finger = Served::patient("wall");
    let commission = ["commission", "--within-s", "3600"];
    let mut terminal = serve::Port::open(&serve::Place::Pty(None)).expect("a pseudo-terminal");
    let input = fs::File::open(terminal.name()).expect("its other side");
    terminal.send(b"yes\n");
    let mut child = spawned(&finger, &commission, input);
    served::line_with("towards the object?", child.stderr.take().expect("a pipe"));
    terminal.send(b"no\n");
    assert_eq!(child.wait().expect("it ends").code(), Some(1), "a key before the question does not answer it");
    finger.done(&["params", "set", "direction_confirmed=1"]);

    let mut child = spawned(&finger, &commission, Stdio::piped());
    served::line_with("towards the object?", child.stderr.take().expect("a pipe"));
    let pipe = child.stdin.as_mut().expect("a pipe");
    pipe.write_all(b"y").expect("it reads");
    Served::wait_for(|| rustix::io::ioctl_fionread(&*pipe).expect("a pipe") == 0);
    Served::interrupt(&child);
    // Not `wait`, which would close the pipe and so end the answer.
    Served::wait_for(|| child.try_wait().expect("it was started").is_some());
    assert_eq!(child.wait().expect("it ends").code(), Some(130));
}

#[test]
fn a_press_on_a_silent_bus_names_the_fault() {
    let finger = Served::patient("wall");
    finger.line(|line| line.at.push(("Press:", 0.5, Told::stall)));
    let child = finger.start(&["identify", "--no-wait", "--pause-s", "0", "--within-s", "3600"]);
    Served::wait_for(|| finger.line(|line| line.stalled.is_some()));
    finger.until_alone("Release:");
    finger.go_on();
    served::fails(&child.wait_with_output().expect("it ends"), &["fault 7"]);
}

/// Force at the tip that the dry friction of the scene's motor holds, N: 0.12 mN m, a gear of 43, a drum of 12 mm.
const FRICTION_N: f64 = 0.12e-3 * 43.0 / 12e-3;

/// An instant of an end of each procedure, drawn with a fixed seed: no force is left, the parameters are those before or
/// all of the new ones, and the same session gives the same result. All ends, at more instants, with
/// `INSTANTS=42 cargo test -p fingertip-cli --test finger ends_at_any -- --nocapture`.
#[test]
fn a_procedure_that_ends_at_any_instant_resumes() {
    let instants = std::env::var("INSTANTS").ok().map(|text| text.parse::<usize>().expect("a number of instants"));
    let mut random = fastrand::Rng::with_seed(30);
    let calibrate = [&QUICK[..], &["--presses", "2", "--no-scale", "--apply"]].concat();
    for procedure in [vec!["commission", "--forward", "yes", "--within-s", "3600", "--apply"], calibrate] {
        let finger = Served::patient("wall");
        let begun = finger.heard();
        let reference = finger.json(&procedure)["after"].clone();
        let packets = finger.heard() - begun;
        let ends = instants.map_or_else(|| vec![ENDS[random.usize(0..ENDS.len())]], |instants| ENDS.repeat(instants));
        let resumed: Vec<_> =
            ends.into_iter().map(|end| resumes(&procedure, end, random.u64(1..packets), &reference)).collect();
        let before = resumed.iter().filter(|(kept, _)| *kept).count();
        println!(
            "{}: {before} ends before the write, {} behind it, none within; resumed, at most {:.2} % off",
            procedure[0],
            resumed.len() - before,
            100.0 * resumed.iter().map(|(_, off)| *off).fold(0.0, f64::max)
        );
    }
}

/// Ends a procedure after some packets and resumes it: whether nothing was written, and how far off the result is.
fn resumes(procedure: &[&str], end: End, packets: u64, reference: &Value) -> (bool, f64) {
    let finger = Served::patient("wall");
    let (old, session, what) =
        (parameters(&finger), finger.file("session"), format!("{end:?} after {packets} packets"));
    let arguments = [procedure, &["--session", &session]].concat();
    let json = [&arguments[..], &["--json"]].concat();
    end_behind(&finger, packets, &json, end);
    // After a loss of power nothing drives the finger away: the motor's friction holds the tip in place.
    let left_n = if matches!(end, End::Power) { FRICTION_N } else { RESIDUAL_N };
    let state = finger.command("state");
    assert!(finger.true_force_n() < left_n, "{what}: {state}");
    if matches!(end, End::Power) {
        let later = finger.command("state");
        assert_eq!(later, state, "{what}: it rests");
        // The report of a tare asks for this: free the tip.
        finger.command("remove");
        finger.command("put");
    }
    finger.deaf(0, 0);
    for command in ["recover", "stop"] {
        finger.fingertip(&[command]).output().expect("it starts");
    }
    let now = parameters(&finger);
    let mut new = old.clone();
    let values = || reference.as_object().expect("names and values").iter().filter(|(name, _)| *name != "gains");
    values().for_each(|(name, value)| new[name] = value.clone());
    let number = |of: &Value, name: &str| of[name].as_f64().unwrap_or(0.0);
    let off = |now: &Value| {
        let off = values().map(|(name, _)| number(now, name) / number(&new, name).max(1e-9) - 1.0);
        off.map(f64::abs).fold(0.0, f64::max)
    };
    let kept = now == old;
    // A motion that was repeated gives another result of the same uncertainty: 6 % of the friction.
    assert!(kept || off(&now) < 0.1, "{what}: {now} of {old} and {new}");
    let resumed = finger.json(&arguments);
    let off = off(&resumed["after"]);
    assert!(off < 0.1 && resumed["applied"] == true, "{what}: {resumed} of {reference}");
    if !kept {
        assert_eq!(parameters(&finger)["modulus_pa"], now["modulus_pa"], "{what}: written once");
    }
    (kept, off)
}
