//! What the program shows on a screen, records, streams and replays.

use fingertip_cli::Error;
use fingertip_cli::commands::view::{Seen, draw};
use fingertip_cli::messages::Topic;
use fingertip_cli::state::{Stamp, State};
use ratatui::buffer::Buffer;
use ratatui::layout::Rect;
use serde_json::Value;
use sim::recording::{SCALARS, schemas};
use std::path::Path;
use std::process::Command;

/// A schema that both have.
fn both(topic: Topic) -> [Value; 2] {
    let name = topic.schema_name();
    let scenes = schemas().into_iter().find(|(_, known, _)| *known == name);
    let (kind, _, scenes) = scenes.unwrap_or_else(|| panic!("the scenes have no {name}"));
    assert_eq!(topic.name(1), format!("/finger0/{kind}"));
    [scenes.into_bytes(), topic.schema()].map(|schema| serde_json::from_slice(&schema).expect("JSON"))
}

fn names(schema: &Value) -> Vec<&str> {
    schema["properties"].as_object().expect("a map").keys().map(String::as_str).collect()
}

#[test]
fn the_scalars_are_those_of_the_scenes_that_a_controller_knows() {
    let [scenes, own] = both(Topic::Scalars);
    let own = names(&own);
    assert_eq!(names(&scenes), SCALARS.map(|(name, ..)| name));
    let known: Vec<&str> = names(&scenes).into_iter().filter(|name| own.contains(name)).collect();
    assert_eq!(known, own, "by the same names, in the same order");
    let message: Value =
        serde_json::from_slice(&Topic::Scalars.message(&Stamp::default(), &State::default())).expect("JSON");
    assert_eq!(message.as_object().expect("a map").keys().collect::<Vec<_>>(), own);
}

#[test]
fn the_picture_is_that_of_the_scenes() {
    let [scenes, own] = both(Topic::Image);
    assert_eq!(scenes, own);
    let message: Value =
        serde_json::from_slice(&Topic::Image.message(&Stamp::default(), &State::default())).expect("JSON");
    assert_eq!(message.as_object().expect("a map").keys().collect::<Vec<_>>(), names(&own));
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
}

#[test]
fn any_size_of_a_terminal_will_do() {
    let mut seen = Seen::default();
    seen.take(Ok(pressed(0)));
    for (width, height) in [(1, 1), (20, 5), (41, 12), (79, 23), (300, 100)] {
        screen(&seen, width, height);
    }
}

// The captures of the repository: the core answers as the boards did.

#[test]
fn every_capture_replays_to_the_bit() {
    let captures = Path::new(env!("CARGO_MANIFEST_DIR")).join("../captures");
    let output = Command::new(env!("CARGO_BIN_EXE_fingertip")).arg("replay").arg(captures).output().expect("it starts");
    let (out, err) = (String::from_utf8_lossy(&output.stdout), String::from_utf8_lossy(&output.stderr));
    assert!(output.status.success(), "{out}{err}");
    assert!(out.contains("press.mcap") && out.lines().all(|line| line.ends_with("the same to the bit")), "{out}");
}
