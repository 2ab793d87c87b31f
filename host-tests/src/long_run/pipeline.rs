//! The whole pipeline under frames, senses and commands that do not change.

use super::cases::cool;
use super::{Cycle, Outcome};
use fingertip::command::Command;
use fingertip::config::newtons;
use fingertip::frame::Sense;
use fingertip::pipeline::Status;
use fingertip::shipped::{Config, Frame, Pipeline, ROWS, SLOTS, TARE_FRAMES};

/// The baseline visits a row of ten a frame, a refinement of the fit takes eleven frames, and a step of the winding's
/// model 256: the pipeline can repeat itself no sooner than after this many steps.
const PERIOD: u64 = 14_080;

/// The frame of a tip that presses, or not, in the middle of the array.
fn frame(codes: u16) -> Frame {
    let mut frame = Frame::EMPTY;
    for (slot, column) in (0..SLOTS).flat_map(|slot| (0..10).map(move |column| (slot, column))) {
        let pressed = (3..7).contains(&slot) && (3..7).contains(&column);
        let preload = if slot < ROWS { 40 } else { 0 };
        frame.set_code(slot, column, 372 + preload + if pressed { codes } else { 0 });
    }
    frame
}

/// Holds a goal against frames that show so many codes on 16 taxels, with an encoder that stands, until nothing in the
/// pipeline changes from period to period but the frames' number.
///
/// # Panics
/// Something still changes after `most` steps.
pub fn hold(name: &str, torque: bool, goal_mn: i32, codes: u16, most: u64) -> (Outcome, Status) {
    let mut pipeline = Pipeline::new(&Config::shipped(&cool()).expect("the defaults are allowed"));
    let sense = Sense { supply_mv: 6_000, ..Sense::default() };
    let mut command = Command { tare_request: 1, ..Command::default() };
    let mut shown = frame(0);
    let step = |pipeline: &mut Pipeline, command: &Command, shown: &mut Frame| {
        shown.sequence = shown.sequence.wrapping_add(1);
        *pipeline.step(shown, &sense, command).1
    };
    for _ in 0..TARE_FRAMES + 2 {
        step(&mut pipeline, &command, &mut shown);
    }
    command.torque = torque;
    command.goal = newtons(goal_mn);
    let mut shown = Frame { sequence: shown.sequence, ..frame(codes) };

    let (mut taken, mut next) = (0, 1_024);
    while taken < most {
        for _ in 0..next {
            step(&mut pipeline, &command, &mut shown);
        }
        let before = state(&pipeline, shown.sequence);
        let mut status = Status::default();
        for _ in 0..PERIOD {
            status = step(&mut pipeline, &command, &mut shown);
        }
        taken += next + PERIOD;
        if state(&pipeline, shown.sequence) == before {
            let cycle = Cycle { lead: taken - PERIOD, length: PERIOD };
            return (Outcome { name: name.into(), cycle, taken, swings: vec![] }, status);
        }
        next *= 2;
    }
    panic!("{name}: still changes after {taken} steps")
}

/// Every field of the pipeline, but the frames' number.
fn state(pipeline: &Pipeline, sequence: u32) -> String {
    format!("{pipeline:?}").replacen(&format!("sequence: {sequence},"), "", 1)
}
