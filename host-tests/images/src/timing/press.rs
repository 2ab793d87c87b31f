//! Cost that a press adds to a frame: its share of the step, and the row that a complete step makes.

use super::Bench;
use fingertip::config::newtons;
use fingertip::fixed::types::I8F24;
use fingertip::measure::press::{PARTS, Press as Motion, PressInputs, Step};
use fingertip::measure::series::{CHECK, Out, step_bytes};
use fingertip::measure::{BuiltIn, MeasureStatus, Row, Task};
use fingertip::shipped::{COLUMNS, ROWS};
use fingertip::units::Millimetres;

/// A press that holds the tip, and the memory of a row.
pub struct Press {
    motion: Option<Motion>,
    step: Step<ROWS, COLUMNS>,
    standing: MeasureStatus,
    bytes: [u8; step_bytes(ROWS * COLUMNS)],
    part: u8,
    frames: u32,
}

impl Press {
    /// Press that has not begun.
    pub fn new() -> Self {
        let standing = MeasureStatus::running(Task::Press);
        Self { motion: None, step: Step::NONE, standing, bytes: [0; step_bytes(ROWS * COLUMNS)], part: 0, frames: 0 }
    }
}

/// A frame of the press. The first frames find the touch and the place before it; every later one belongs to a step.
pub extern "C" fn add(bench: &mut Bench) {
    let Bench { press, picture, contact, motion, record, config, .. } = bench;
    let Press { motion: press, step, standing, frames, .. } = &mut **press;
    let press = press.get_or_insert_with(|| Motion::begin(motion, BuiltIn::PROOF.expect("it is built in")));
    *frames += 1;
    contact.force = newtons(if *frames == 1 { 0 } else { 1_000 });
    motion.observer.travel = Millimetres(I8F24::from_num(if *frames == 3 { -3 } else { 0 }));
    let (sequence, encoder) = (record.frame.sequence, motion.observer.origin());
    let chip = record.sense.chip;
    press.observe(
        &PressInputs { sequence, picture, contact, encoder, motion, applied_mv: 900, chip },
        step,
        standing,
        config,
    );
}

pub extern "C" fn write(bench: &mut Bench) {
    let Press { step, bytes, part, .. } = &mut *bench.press;
    // Each part in turn, at its place in the row.
    *part = (*part + 1) % PARTS;
    let part = *part;
    let begun = [0, bytes.len() / 3, bytes.len() / 3 * 2, bytes.len() / 5 * 4][usize::from(part % PARTS)];
    Out::new(bytes, begun, CHECK).row(&Row::Step(step, part));
}
