//! What a press adds to a frame: its share of the step, and the row that a complete step makes.

use super::Bench;
use fingertip::config::newtons;
use fingertip::measure::press::{Press as Motion, Step, View};
use fingertip::measure::series::{CHECK, Out, step_bytes};
use fingertip::measure::{Row, Standing, Task};
use fingertip::shipped::{COLUMNS, ROWS};

/// A press that holds the tip, and the memory of a row.
pub struct Press {
    motion: Option<Motion>,
    step: Step<ROWS, COLUMNS>,
    standing: Standing,
    bytes: [u8; step_bytes(ROWS * COLUMNS)],
}

impl Press {
    /// Not begun.
    pub fn new() -> Self {
        let standing = Standing::running(Task::Press);
        Self { motion: None, step: Step::NONE, standing, bytes: [0; step_bytes(ROWS * COLUMNS)] }
    }
}

/// A frame of the press. The first frames find the touch; every later one belongs to a step.
pub extern "C" fn add(bench: &mut Bench) {
    let Bench { press, picture, contact, motion, record, config, .. } = bench;
    let Press { motion: press, step, standing, .. } = &mut **press;
    let press = press.get_or_insert_with(|| Motion::begin(motion));
    contact.force = newtons(1_000);
    let (sequence, encoder) = (record.frame.sequence, record.sense.encoder);
    let chip = record.sense.chip;
    press.observe(&View { sequence, picture, contact, encoder, motion, applied_mv: 900, chip }, step, standing, config);
}

pub extern "C" fn write(bench: &mut Bench) {
    let Press { step, bytes, .. } = &mut *bench.press;
    Out::new(bytes, CHECK).row(&Row::Step(step));
}
