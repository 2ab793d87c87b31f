//! The loop as it is, over the recorded stimulus: the whole step at each fit level, and its parts.

use super::Inputs;
use super::call::pass_on;
use crate::host::{fail, say};
use fingertip::command::Command;
use fingertip::contact::{self, Contact, FitLevel};
use fingertip::control::{Reference, SpeedLoop, TemperatureDrift, Winding};
use fingertip::frame::Sense;
use fingertip::grip::{Goal, Grip};
use fingertip::pipeline::AcknowledgedRequests;
use fingertip::safety::guard::{Guard, Seen};
use fingertip::shipped::{Array, Config, Pipeline, TactileImage};
use fingertip::state::{Limits, Mode};
use fingertip::touch::Touch;
use fingertip::units::{Celsius, Duty, Newtons};
use images::CORRECTED;
use images::record::Record;
use static_cell::StaticCell;

/// Too large for the stack.
static PIPELINE: StaticCell<Pipeline> = StaticCell::new();
static CORRECTED_CONFIG: StaticCell<Config> = StaticCell::new();

/// Data that the parts read and write.
struct Bench<'a> {
    config: &'a Config,
    /// Configuration with a nonlinear characteristic, creep, and a gain that drifts with temperature.
    corrected: &'a Config,
    fit_level: FitLevel,
    record: Record,
    pipeline: &'a mut Pipeline,
    duty: Duty,
    array: Array,
    picture: TactileImage,
    contact: Contact,
    motion: SpeedLoop,
    grip: Grip,
    touch: Touch,
    guard: Guard,
    winding: Winding,
    temperature_drift: TemperatureDrift,
    drift: Newtons,
    reference: Reference,
    limits: Limits,
    wanted: i32,
}

type Kernel = extern "C" fn(&mut Bench);

const STEPS: [(&str, FitLevel); 6] = [
    ("Pipeline::step, fit level 0", FitLevel::Sum),
    ("Pipeline::step, fit level 1", FitLevel::Moments),
    ("**Pipeline::step**", FitLevel::OneRow),
    ("Pipeline::step, fit level 3", FitLevel::TwoRows),
    ("Pipeline::step, fit level 4", FitLevel::FiveRows),
    ("Pipeline::step, fit level 5", FitLevel::AllRows),
];

/// Index of the first part that uses the results of the parts before it.
const OBSERVER: usize = 2;
/// Maximum number of records for the parts; the step gets all.
const PART_RECORDS: i32 = 3_000;

/// The part, and whether it runs only while the loop drives the motor.
const PARTS: [(&str, Kernel, bool); 12] = [
    ("**Array::read**", read, false),
    ("**contact::from_sums**", sums, false),
    ("**observer**", observe, true),
    ("**goal and profile**", reference, true),
    ("**speed law with limits**", follow, true),
    ("**limits alone, Drive::apply**", apply, true),
    ("**duty from the voltage**", duty, true),
    ("**guard**", guard, true),
    ("**Array::read, by a curve**", curved_read, false),
    ("**goal and profile, with creep**", creeping, true),
    ("**warmth, with a coefficient**", temperature_drift, false),
    ("**winding**", winding, false),
];

extern "C" fn step(bench: &mut Bench) {
    let Record { frame, sense, command } = &bench.record;
    bench.duty = bench.pipeline.step(frame, sense, &Command { fit_level: bench.fit_level, ..*command }).0;
}

extern "C" fn read(bench: &mut Bench) {
    bench.array.read(&bench.record.frame, bench.config);
}

extern "C" fn curved_read(bench: &mut Bench) {
    bench.array.read(&bench.record.frame, bench.corrected);
}

extern "C" fn observe(bench: &mut Bench) {
    bench.motion.observe(bench.record.sense.encoder, bench.config);
}

extern "C" fn reference(bench: &mut Bench) {
    let Bench { config, record, contact, touch, drift, motion, grip, limits, .. } = bench;
    let goal = Goal { force: record.command.goal, drift: *drift };
    bench.reference = images::reference(grip, goal, contact, touch, motion, config, limits);
}

extern "C" fn creeping(bench: &mut Bench) {
    let Bench { corrected, record, contact, touch, drift, motion, grip, limits, .. } = bench;
    let goal = Goal { force: record.command.goal, drift: *drift };
    bench.reference = images::reference(grip, goal, contact, touch, motion, corrected, limits);
}

extern "C" fn follow(bench: &mut Bench) {
    let supply_mv = bench.record.sense.supply_mv;
    bench.motion.apply_law(bench.reference, supply_mv, bench.config, &mut bench.limits);
}

extern "C" fn duty(bench: &mut Bench) {
    bench.duty = bench.motion.drive.duty(bench.record.sense.supply_mv, bench.config);
}

extern "C" fn winding(bench: &mut Bench) {
    bench.winding.observe(bench.motion.drive.acceleration(), bench.config);
}

extern "C" fn temperature_drift(bench: &mut Bench) {
    bench.temperature_drift.observe(Some(Celsius::from_bits(30 << 16)), bench.corrected);
    bench.drift = bench.temperature_drift.force(bench.record.command.goal, bench.corrected);
}

extern "C" fn sums(bench: &mut Bench) {
    bench.contact = contact::from_sums(&bench.picture, bench.config);
}

extern "C" fn apply(bench: &mut Bench) {
    let supply_mv = bench.record.sense.supply_mv;
    bench.motion.drive.apply(bench.wanted, 0, supply_mv, bench.config, &mut bench.limits);
}

extern "C" fn guard(bench: &mut Bench) {
    let Sense { encoder, .. } = bench.record.sense;
    let seen = Seen {
        encoder,
        force: bench.contact.force,
        pressing: true,
        goal: bench.record.command.goal,
        given_q8_mm_per_s2: bench.motion.drive.given(),
    };
    if bench.guard.check(&seen, true, bench.config).is_none() {
        bench.duty = bench.guard.permit(bench.duty, &mut bench.limits);
    }
}

impl<'a> Bench<'a> {
    fn new(fit_level: FitLevel, [config, corrected]: [&'a Config; 2], pipeline: &'a mut Pipeline) -> Self {
        pipeline.renew(AcknowledgedRequests::default(), 0, Winding::new());
        Self {
            config,
            corrected,
            fit_level,
            record: Record::from_bytes(&[0; Record::BYTES]),
            pipeline,
            duty: Duty::ZERO,
            array: Array::new(),
            picture: TactileImage::EMPTY,
            contact: Contact::default(),
            motion: SpeedLoop::new(),
            grip: Grip::default(),
            touch: Touch::default(),
            guard: Guard::default(),
            winding: Winding::new(),
            temperature_drift: TemperatureDrift::default(),
            drift: Newtons::ZERO,
            reference: Reference::default(),
            limits: Limits::default(),
            wanted: 0,
        }
    }
}

/// Makes the pipeline. A separate function, because a pipeline is large and takes stack only here.
#[inline(never)]
fn begin(config: &Config) -> (&'static mut Pipeline, &'static Config) {
    let Ok(corrected) = Config::shipped(&CORRECTED) else { fail("a curve is refused") };
    (PIPELINE.init_with(|| Pipeline::new(config)), CORRECTED_CONFIG.init(corrected))
}

fn record(inputs: &mut Inputs) -> Record {
    let mut bytes = [0; Record::BYTES];
    inputs.read(&mut bytes);
    Record::from_bytes(&bytes)
}

/// Replays the next section's records, once for each fit level and part.
#[inline(never)]
pub fn run(region: &mut u32, config: &Config, inputs: &mut Inputs) {
    let [count] = inputs.words();
    let start = inputs.place();
    let (pipeline, corrected) = begin(config);
    let configs = [config, corrected];
    for (name, fit_level) in STEPS {
        say(format_args!("region {region} step: {name}"));
        inputs.seek(start);
        let mut bench = Bench::new(fit_level, configs, pipeline);
        for _ in 0..count {
            bench.record = record(inputs);
            pass_on(*region, step, &mut bench);
        }
        *region += 1;
    }
    for (part, (name, kernel, driving)) in PARTS.into_iter().enumerate() {
        say(format_args!("region {region} step: {name}"));
        inputs.seek(start);
        let mut bench = Bench::new(FitLevel::default(), configs, pipeline);
        for n in 0..count.min(PART_RECORDS) {
            bench.record = record(inputs);
            step(&mut bench);
            let status = *bench.pipeline.status();
            let drives = matches!(status.mode, Mode::Approach | Mode::Force | Mode::Release);
            bench.array = bench.pipeline.array().clone();
            bench.picture = *bench.array.picture();
            bench.contact = status.contact;
            bench.wanted = (i64::from(n) * 7_919 % 200_000_000) as i32 - 100_000_000;
            if drives {
                // What the measured part builds on.
                for before in [OBSERVER, OBSERVER + 1].into_iter().filter(|before| *before != part) {
                    PARTS[before].1(&mut bench);
                }
            } else {
                bench.motion = SpeedLoop::new();
                let encoder = bench.record.sense.encoder;
                bench.guard.start(encoder, encoder, config);
            }
            if drives || !driving {
                pass_on(*region, kernel, &mut bench);
            }
        }
        *region += 1;
    }
}
