//! The loop's kernels, each in a separate region, for the timing model: replays a recording, and measures with real
//! data.
//!
//! Not for a board: it talks to the emulator by semihosting. The command line names the recording. A line
//! `region NUMBER NAME` on the standard output names each region; region 0 is an empty call.
#![no_std]
#![no_main]

mod host;

use When::{Always, Driving, Edge};
use call::pass_on;
use cortex_m_semihosting::debug;
use fingertip::config::newtons;
use fingertip::contact::Contact;
use fingertip::control::{Reference, SpeedLoop, TemperatureDrift, Winding};
use fingertip::fixed::types::I8F24;
use fingertip::grip::Grip;
use fingertip::measure::press::{PARTS, Press as Motion, PressInputs, Step};
use fingertip::measure::series::{CHECK, Out, step_bytes};
use fingertip::measure::{BuiltIn, MeasureStatus, Row, Task};
use fingertip::shipped::{Array, COLUMNS, Config, Fit, Pipeline, ROWS, TactileImage};
use fingertip::state::{Limits, Mode};
use fingertip::touch::Touch;
use fingertip::units::{Duty, Millimetres, Newtons};
use host::{File, command_line, fail, say};
use images::CORRECTED;
use images::record::{MAGIC, Record};
use images::single::{self, Refined};
use static_cell::StaticCell;

#[path = "../study/call.rs"]
mod call;
#[path = "../study/parts.rs"]
mod parts;

/// Too large for the stack.
static PIPELINE: StaticCell<Pipeline> = StaticCell::new();
static PRESS: StaticCell<Press> = StaticCell::new();

/// Data that the kernels read and write.
struct Bench<'a> {
    config: &'a Config,
    /// Configuration with a nonlinear characteristic, creep, and a gain that drifts with temperature.
    corrected: &'a Config,
    record: Record,
    pipeline: &'static mut Pipeline,
    array: Array,
    picture: TactileImage,
    contact: Contact,
    /// Fits of the whole contact, and of the one partly off the array.
    fits: [Fit; 2],
    depth: Millimetres,
    motion: SpeedLoop,
    grip: Grip,
    touch: Touch,
    reference: Reference,
    limits: Limits,
    duty: Duty,
    winding: Winding,
    temperature_drift: TemperatureDrift,
    drift: Newtons,
    press: &'static mut Press,
}

type Kernel = extern "C" fn(&mut Bench);

/// Condition under which a kernel is measured.
#[derive(Clone, Copy, PartialEq, Eq)]
enum When {
    /// In every frame.
    Always,
    /// With a contact that is completely on the array.
    Contact,
    /// With the same contact partly off the array.
    Edge,
    /// While the loop drives the motor.
    Driving,
}

const STEP: usize = 1;
const KERNELS: [(&str, Kernel, When); 24] = [
    ("an empty call", nothing, Always),
    ("pipeline step", step, Always),
    ("frame pass", parts::read, Always),
    ("frame pass, by a curve", parts::curved_read, Always),
    ("indentation from force", indentation, Always),
    ("observer", parts::observe, Driving),
    ("goal and profile", parts::reference, Driving),
    ("goal and profile, with creep", parts::creeping, Driving),
    ("speed law and limits", parts::follow, Driving),
    ("duty from the voltage", parts::duty, Driving),
    ("winding", parts::winding, Always),
    ("warmth, with a coefficient", parts::temperature_drift, Always),
    ("contact, whole, moments", parts::sums, When::Contact),
    ("contact, whole, followed", follow_whole, When::Contact),
    ("contact, whole, one", read_one, When::Contact),
    ("contact, whole, two", read_two, When::Contact),
    ("contact, whole, full", read_full, When::Contact),
    ("contact, over the edge, moments", parts::sums, Edge),
    ("contact, over the edge, followed", follow_edge, Edge),
    ("contact, over the edge, one", read_one, Edge),
    ("contact, over the edge, two", read_two, Edge),
    ("contact, over the edge, full", read_full, Edge),
    ("press, a frame added to a step", add_to_press, Always),
    ("press, a step's row written", write_press, Always),
];

extern "C" fn nothing(_: &mut Bench) {}

extern "C" fn step(bench: &mut Bench) {
    let Record { frame, sense, command } = &bench.record;
    bench.duty = bench.pipeline.step(frame, sense, command).0;
}

extern "C" fn indentation(bench: &mut Bench) {
    bench.depth = bench.config.tip.indentation(bench.contact.force);
}

fn read(bench: &mut Bench, refined: Refined) {
    bench.contact = single::read(&bench.picture, refined, bench.config);
}

extern "C" fn follow_whole(bench: &mut Bench) {
    bench.contact = bench.fits[0].read(&bench.picture, bench.config);
}

extern "C" fn follow_edge(bench: &mut Bench) {
    bench.contact = bench.fits[1].read(&bench.picture, bench.config);
}

extern "C" fn read_one(bench: &mut Bench) {
    read(bench, Refined::One);
}

extern "C" fn read_two(bench: &mut Bench) {
    read(bench, Refined::Two);
}

extern "C" fn read_full(bench: &mut Bench) {
    read(bench, Refined::Full);
}

#[cortex_m_rt::entry]
fn main() -> ! {
    let mut line = [0; 256];
    let recording = File::open(command_line(&mut line));
    let mut head = [0; MAGIC.len() + 4];
    recording.read(&mut head);
    let (magic, count) = head.split_at(MAGIC.len());
    if magic != MAGIC {
        fail("no recording of this version");
    }
    let count = count.iter().rev().fold(0, |count, byte| count << 8 | u32::from(*byte));
    let Ok(config) = Config::shipped(&images::CONFIRMED) else { fail("the default parameters are refused") };
    let Ok(corrected) = Config::shipped(&CORRECTED) else { fail("a curve is refused") };
    let mut bench = Bench {
        config: &config,
        corrected: &corrected,
        record: Record::from_bytes(&[0; Record::BYTES]),
        pipeline: PIPELINE.init_with(|| Pipeline::new(&config)),
        array: Array::new(),
        picture: TactileImage::EMPTY,
        contact: Contact::default(),
        fits: [Fit::default(), Fit::default()],
        depth: Millimetres::ZERO,
        motion: SpeedLoop::new(),
        grip: Grip::default(),
        touch: Touch::default(),
        reference: Reference::default(),
        limits: Limits::default(),
        duty: Duty::ZERO,
        winding: Winding::new(),
        temperature_drift: TemperatureDrift::default(),
        drift: Newtons::ZERO,
        press: PRESS.init_with(Press::new),
    };
    for _ in 0..count {
        let mut bytes = [0; Record::BYTES];
        recording.read(&mut bytes);
        bench.record = Record::from_bytes(&bytes);
        measure_frame(&mut bench);
    }
    for (number, (name, ..)) in KERNELS.iter().enumerate() {
        say(format_args!("region {number} {name}"));
    }
    loop {
        debug::exit(debug::EXIT_SUCCESS);
    }
}

/// The step first: the other kernels work on its results.
fn measure_frame(bench: &mut Bench) {
    pass_on(STEP as u32, step, bench);
    let status = *bench.pipeline.status();
    let touches = status.contact.force >= bench.config.contact_on;
    let drives = matches!(status.mode, Mode::Approach | Mode::Force | Mode::Release);
    if !drives {
        bench.motion = SpeedLoop::new();
    }
    for (number, (_, kernel, when)) in KERNELS.iter().enumerate() {
        if number == STEP {
            continue;
        }
        bench.array = bench.pipeline.array().clone();
        bench.picture = *bench.array.picture();
        bench.contact = status.contact;
        let now = match when {
            Always => true,
            When::Contact => touches,
            Edge => {
                bench.picture = pushed_over_the_edge(&bench.picture);
                touches
            }
            Driving => drives,
        };
        if now {
            pass_on(number as u32, *kernel, bench);
        }
    }
}

/// Four columns to the side, so that the contact reaches over the edge.
fn pushed_over_the_edge(picture: &TactileImage) -> TactileImage {
    const BY: usize = 4;
    let mut pushed = TactileImage::EMPTY;
    for row in 0..ROWS {
        let (mut row_sum, y) = (0, 2 * row as i32 - 9);
        for column in 0..COLUMNS - BY {
            let value = picture.taxels[row][column + BY];
            pushed.taxels[row][column] = value;
            row_sum += value;
            pushed.moment_x += value * (2 * column as i32 - 9);
            pushed.peak = pushed.peak.max(value);
        }
        pushed.sum += row_sum;
        pushed.moment_y += row_sum * y;
    }
    pushed
}

#[panic_handler]
fn panic(info: &core::panic::PanicInfo) -> ! {
    fail(info.message())
}

/// A press that holds the tip, and the memory of a row.
struct Press {
    motion: Option<Motion>,
    step: Step<ROWS, COLUMNS>,
    standing: MeasureStatus,
    bytes: [u8; step_bytes(ROWS * COLUMNS)],
    part: u8,
    frames: u32,
}

impl Press {
    /// Press that has not begun.
    fn new() -> Self {
        let standing = MeasureStatus::running(Task::Press);
        Self { motion: None, step: Step::NONE, standing, bytes: [0; step_bytes(ROWS * COLUMNS)], part: 0, frames: 0 }
    }
}

/// A frame of the press. The first frames find the touch and the place before it; every later one belongs to a step.
extern "C" fn add_to_press(bench: &mut Bench) {
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

extern "C" fn write_press(bench: &mut Bench) {
    let Press { step, bytes, part, .. } = &mut *bench.press;
    // Each part in turn, at its place in the row.
    *part = (*part + 1) % PARTS;
    let part = *part;
    let begun = [0, bytes.len() / 3, bytes.len() / 3 * 2, bytes.len() / 5 * 4][usize::from(part % PARTS)];
    Out::new(bytes, begun, CHECK).row(&Row::Step(step, part));
}
