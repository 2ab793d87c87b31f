//! Functions with a state or a configuration: the viscoelastic filter, the array's reading, the fit, the loop's
//! observer, profile and drive.

use super::model::{Pictures, Sample};
use super::{Mix, Source};
use crate::single::{self, Refined};
use fingertip::contact::{self, Contact, FitLevel};
use fingertip::control::{Drive, Observer, Reference, SpeedLoop, TemperatureDrift, Winding};
use fingertip::grip::{Goal, Grip};
use fingertip::params::Params;
use fingertip::pressure::{CalibrationError, GAIN_MAX};
use fingertip::shipped::{Array, Budget, COLUMNS, Calibration, Config, Fit, Frame, ROWS, SLOTS, TactileImage};
use fingertip::state::Limits;
use fingertip::touch::{Touch, TouchInputs};
use fingertip::units::{Celsius, CoreCycles, Millimetres, MillimetresPerSecond, MillimetresPerSecond2, Newtons};
use lanes::{Codes, Common, Curve, Row, Total};
use paper::units::Ratio;
use paper::{Relaxation, RelaxationState, RelaxationTerm};

/// Name of a machine, and function that makes one step and adds its results to the digest.
pub type Step = (&'static str, fn(&mut Machines, &Sample, &mut Mix));
/// The largest braking of the profile: 1000 m/s^2 in Q8 mm/s^2.
const BRAKE_MAX: i32 = 1_000_000 << 8;

pub struct Machines {
    pub(super) config: Config,
    pub(super) filter: Option<Relaxation<3>>,
    pub(super) memory: RelaxationState<3>,
    observer: Observer,
    drive: Drive,
    winding: Winding,
    temperature_drift: TemperatureDrift,
    motion: SpeedLoop,
    grip: Grip,
    touch: Touch,
    pictures: Pictures,
    fit: Fit,
    budget: Budget,
    frame: Frame,
    pub(super) array: Array,
}

impl Machines {
    /// Machines at rest, with a first configuration.
    pub fn new(config: Config) -> Self {
        Self {
            config,
            filter: None,
            memory: RelaxationState::REST,
            observer: Observer::new(),
            drive: Drive::new(),
            winding: Winding::new(),
            temperature_drift: TemperatureDrift::default(),
            motion: SpeedLoop::new(),
            grip: Grip::default(),
            touch: Touch::default(),
            pictures: Pictures::default(),
            fit: Fit::default(),
            budget: Budget::new(),
            frame: plausible(),
            array: Array::new(),
        }
    }
}

/// Inputs for each input that functions of a whole frame (100 taxels) take.
pub const FRAME_EVERY: u32 = 8;
/// A step of every machine that looks at a whole frame.
pub const FRAMES: [Step; 6] = [
    ("Array::read", |m, s, mix| {
        change(&mut m.frame, s);
        add_picture(mix, m.array.read(&m.frame, &m.config));
    }),
    ("Array::follow_drift", |m, s, mix| {
        m.array.follow_drift(s.share_q32 & 0x1_ffff);
        if s.words[2] == 0 {
            m.array.continue_tare();
        }
        m.array.tare().flatten().for_each(|tare| mix.add(*tare));
    }),
    ("Array::bad_taxels", |m, _, mix| mix.add(m.array.bad_taxels(&m.frame, ROWS, &m.config))),
    ("single::read", |m, s, mix| {
        let refined = match s.share_q32 >> 27 {
            0 => Refined::Full,
            1 => Refined::Two,
            _ => Refined::One,
        };
        add_contact(mix, &single::read(m.pictures.next(s, &m.config), refined, &m.config));
    }),
    ("contact::from_sums", |m, s, mix| {
        add_contact(mix, &contact::from_sums(m.pictures.next(s, &m.config), &m.config));
    }),
    ("Fit::read", |m, s, mix| {
        // A change now and then, in the middle of a refinement as well.
        if s.share_q32 >> 27 == 4 {
            m.fit.set_fit_level(FitLevel::from_number((s.share_q32 >> 24 & 7) as u8));
        }
        add_contact(mix, &m.fit.read(m.pictures.next(s, &m.config), &m.config));
    }),
];

/// One step of every other machine for each input.
pub const STEPS: [Step; 20] = [
    ("Relaxation::step", |m, s, mix| {
        if let Some(filter) = &m.filter {
            mix.add(filter.step(&mut m.memory, s.force).to_bits());
        }
    }),
    ("lanes::sub", |_, s, mix| mix.add(lanes::sub(s.share_q32, s.words[0].cast_unsigned()))),
    ("lanes::dot", |_, s, mix| mix.add(lanes::dot(s.share_q32, s.words[0].cast_unsigned(), s.words[1]))),
    ("lanes::excess", |_, s, mix| mix.add(lanes::excess(s.share_q32, s.words[0].cast_unsigned()))),
    ("lanes::add_high", |_, s, mix| mix.add(lanes::add_high(s.words[2], s.share_q32.cast_signed(), s.words[0]))),
    ("lanes::pass", |_, s, mix| {
        let [first, second, third, fourth] = s.words.map(i32::cast_unsigned);
        let pairs = [first, second, third, fourth, s.share_q32];
        let gains = [s.share_q32, third, first, fourth, second];
        let moments = [fourth, first, s.share_q32, second, third];
        let tare = core::array::from_fn(|column| s.words[column % 4].wrapping_mul(column as i32));
        let [pairs, gains, moments] = [pairs, gains, moments].map(halves);
        let codes = Codes { rows: [pairs, moments], undriven: gains };
        let signed = |row: [u16; COLUMNS]| row.map(u16::cast_signed);
        for curve in [Curve::LINE, Curve { least: s.words[1], growth: s.words[2] | 1 }] {
            let mut rows = [Row { tare, ..Row::new(signed(gains), signed(moments)) }; 2];
            let common = Common { dead: fourth, sag: second & 0x7fff_7fff, curve };
            let mut taxels = [[0; COLUMNS]; 2];
            let total = lanes::pass(&codes, &mut rows, &common, &mut taxels);
            let Total { first, second, running, largest, peak } = total;
            [first, second, running, peak, rows[0].boost, rows[1].boost].into_iter().for_each(|number| mix.add(number));
            taxels.into_iter().flatten().for_each(|taxel| mix.add(taxel));
            [largest, rows[0].largest, rows[1].largest].into_iter().for_each(|number| mix.add(number));
            rows.iter().for_each(|row| (0..COLUMNS).for_each(|column| mix.add(row.reading(column))));
        }
    }),
    ("lanes::near_root", |_, s, mix| mix.add(lanes::near_root(s.share_q32 | 1 << 30))),
    ("lanes::root_and_product", |_, s, mix| {
        let [x, y, high, low] = s.words.map(i32::cast_unsigned);
        let (root, product) = lanes::root_and_product(x, y, u64::from(high) << 32 | u64::from(low));
        mix.add(root);
        mix.add(product.cast_signed());
    }),
    ("Budget::next", |m, s, mix| {
        // A whole deadline is about 2^13 ticks; the model is now and then at work.
        let asked = FitLevel::from_number((s.share_q32 >> 29) as u8);
        let taken = s.words[0].unsigned_abs() >> 17;
        mix.add(m.budget.next(asked, CoreCycles(taken), CoreCycles(12_568)) as u32);
        m.budget.note((s.words[2] > 0).then_some(s.words[1] > 0));
    }),
    ("Observer::measured", |m, s, mix| mix.add(m.observer.measured(s.words[0], &m.config).to_bits())),
    ("Observer::update", |m, s, mix| {
        let [encoder, acceleration, ..] = s.words;
        m.observer.update(encoder >> 24, acceleration, &m.config.gain_sets[(s.share_q32 & 3) as usize], &m.config);
        mix.add(m.observer.travel.to_bits());
        mix.add(m.observer.speed.to_bits());
        mix.add(m.observer.disturbance.to_bits());
    }),
    ("Reference::towards", |m, s, mix| add_reference(mix, towards(m, s))),
    ("Reference::limited", |m, s, mix| {
        let limit = MillimetresPerSecond::from_bits(s.words[3]);
        add_reference(mix, towards(m, s).limited(limit));
    }),
    ("Drive::apply", |m, s, mix| {
        let [wanted, back_emf, supply_mv, _] = s.words;
        let mut limits = Limits::default();
        m.drive.apply(wanted, back_emf, supply_mv as u16, &m.config, &mut limits);
        mix.add(m.drive.duty(supply_mv as u16, &m.config).0);
        mix.add(limits.0);
        mix.add(m.drive.acceleration());
    }),
    ("SpeedLoop::observe", |m, s, mix| {
        m.motion.observe(s.words[1], &m.config);
        mix.add(m.motion.observer.travel.to_bits());
        mix.add(m.motion.observer.speed.to_bits());
        mix.add(m.motion.observer.disturbance.to_bits());
    }),
    ("SpeedLoop::brake", |m, s, mix| mix.add(m.motion.brake(s.displacement.shift, &m.config).to_bits())),
    ("Winding::observe", |m, s, mix| {
        m.winding.observe(s.words[1], &m.config);
        mix.add(m.winding.temperature(&m.config).to_bits());
        mix.add(m.winding.share());
    }),
    ("TemperatureDrift::force", |m, s, mix| {
        m.temperature_drift.observe((s.share_q32 & 15 != 0).then_some(Celsius::from_bits(s.words[0])), &m.config);
        if s.share_q32 & 0xf0 == 0 {
            m.temperature_drift.zero(s.share_q32 as i32 & 0x1_ffff);
        }
        mix.add(m.temperature_drift.force(s.force, &m.config).to_bits());
    }),
    ("Touch::observe and Grip::reference", |m, s, mix| {
        let contact = Contact { force: s.force, indentation: s.d, ..Contact::default() };
        let (goal, mut limits) = (Newtons::from_bits(s.words[1]), Limits::default());
        let goal = if s.share_q32 & 3 == 1 { Newtons::ZERO } else { goal };
        let travel = m.motion.observer.travel;
        let (summed, presses) = (Newtons::from_bits(s.words[2]), s.share_q32 & 4 == 0);
        let inputs = TouchInputs { contact: &contact, summed, travel, presses };
        m.touch.observe(&inputs, || Millimetres::ZERO, &m.config);
        let Machines { grip, touch, motion, config, .. } = m;
        let goal = Goal { force: goal, drift: s.force };
        add_reference(mix, grip.reference(&goal, &contact, touch, motion, config, &mut limits));
        mix.add(m.grip.mode(&m.touch) as u8);
        mix.add(limits.0);
    }),
    ("SpeedLoop::follow", |m, s, mix| {
        let (reference, mut limits) = (towards(m, s), Limits::default());
        let duty = m.motion.follow(reference, (s.words[2] & 0xffff) as u16, &m.config, &mut limits);
        mix.add(duty.0);
        mix.add(limits.0);
    }),
];

/// Distance to go, speed and braking of an input.
fn towards(machines: &Machines, sample: &Sample) -> Reference {
    let [way, speed, brake, _] = sample.words;
    let brake = MillimetresPerSecond2::from_bits(brake.clamp(0, BRAKE_MAX));
    Reference::towards(
        Millimetres::from_bits(way),
        MillimetresPerSecond::from_bits(speed),
        brake,
        machines.motion.schedule.gains(&machines.config),
    )
}

/// Splits each word into its halves.
fn halves(pairs: [u32; COLUMNS / 2]) -> [u16; COLUMNS] {
    core::array::from_fn(|column| (pairs[column / 2] >> (16 * (column % 2))) as u16)
}

/// Name of a constructor, and function that calls it and adds the results to the digest.
pub type Make = (&'static str, fn(&mut Machines, &mut Source, &mut Mix));

/// Inputs between two that make new machines: each takes up to half a million instructions.
pub const MADE_EVERY: u32 = 1_024;

/// The sampling times that the converter has.
const SAMPLE_CYCLES: [i32; 8] = [3, 15, 28, 56, 84, 112, 144, 480];

/// Machines that are made for every [`MADE_EVERY`]th input. What they are made of, or why they are refused, is compared
/// field by field.
pub const MADE: [Make; 4] = [
    ("Config::new", |m, source, mix| {
        let made = Config::shipped(&params(source));
        mix.add_fields(&made);
        if let Ok(config) = made {
            m.config = config;
        }
    }),
    ("Calibration::new", |m, source, mix| {
        let made = calibration(source);
        mix.add_fields(&made);
        if let Ok(calibration) = made {
            m.array.calibrate(&calibration);
        }
    }),
    ("Relaxation::new", |m, source, mix| {
        let period_us = source.up_to(2_000);
        let terms = [(); 3].map(|()| RelaxationTerm {
            share: Ratio::from_bits(source.within(0, 22_000)),
            time_constant_us: period_us.saturating_mul(1 << source.up_to(20)),
        });
        let made = Relaxation::new(period_us, &terms);
        mix.add_fields(&made);
        if let Ok(filter) = made {
            (m.filter, m.memory) = (Some(filter), RelaxationState::REST);
        }
    }),
    // Not made, but as rare: the board's own functions against this machine's, at any alignment and overlap.
    ("copy and fill", |_, source, mix| {
        let mut bytes: [u8; 160] = core::array::from_fn(|_| source.word() as u8);
        for _ in 0..64 {
            let [from, to, length] = [90, 90, 69].map(|top| source.up_to(top) as usize);
            let before = bytes;
            match source.up_to(2) {
                0 => bytes.copy_within(from..from + length, to),
                1 => bytes[to..to + length].copy_from_slice(&before[from..from + length]),
                _ => bytes[to..to + length].fill(source.word() as u8),
            }
        }
        bytes.into_iter().for_each(|byte| mix.add(byte));
    }),
];

/// Parameters within their ranges, most of them such that they do not contradict each other.
fn params(source: &mut Source) -> Params {
    let mut params = Params::from_array(&Params::RANGES.map(|(_, _, min, max)| source.within(min, max)));
    params.sample_cycles = SAMPLE_CYCLES.get((source.word() & 7) as usize).map_or(0, |cycles| *cycles);
    let order = |low: &mut i32, high: &mut i32| (*low, *high) = ((*low).min(*high), (*low).max(*high));
    order(&mut params.contact_off_mn, &mut params.contact_on_mn);
    // So the range of most converters is at least four times the smallest contact force.
    params.contact_on_mn = (params.contact_on_mn / 16).max(5);
    params.contact_off_mn = params.contact_off_mn.min(params.contact_on_mn - 1);
    order(&mut params.contact_on_mn, &mut params.force_max_mn);
    order(&mut params.force_max_mn, &mut params.force_fault_mn);
    order(&mut params.supply_min_mv, &mut params.supply_max_mv);
    order(&mut params.approach_um_per_s, &mut params.speed_max_um_per_s);
    params
}

// Adds the outputs of the machines to a digest, number by number.

pub fn add_reference(mix: &mut Mix, reference: Reference) {
    mix.add(reference.speed.to_bits());
    mix.add(reference.acceleration.to_bits());
}

pub fn add_picture(mix: &mut Mix, picture: &TactileImage) {
    let TactileImage { taxels, sum, moment_x, moment_y, peak, bad, bad_count, bad_again, undriven_max, peak_codes } =
        picture;
    taxels.iter().flatten().chain([sum, moment_x, moment_y, peak]).for_each(|number| mix.add(*number));
    bad.iter().for_each(|row| mix.add(*row));
    [undriven_max, peak_codes].into_iter().for_each(|number| mix.add(*number));
    mix.add(*bad_count);
    mix.add(*bad_again);
}

pub fn add_contact(mix: &mut Mix, contact: &Contact) {
    let Contact { force, indentation, centre_x, centre_y, radius, peak_pa, confidence, doubt, bad_taxels } = *contact;
    mix.add(force.to_bits());
    for length in [indentation, centre_x, centre_y, radius] {
        mix.add(length.to_bits());
    }
    mix.add(peak_pa);
    mix.add(confidence);
    mix.add(doubt);
    mix.add(bad_taxels);
}

// Frames for the array's reading: a plausible one that changes code by code, with wild codes in between.

/// Codes of a column with no row driven.
const LEVEL: u16 = 372;

/// A frame with no load.
pub fn plausible() -> Frame {
    let mut frame = Frame::EMPTY;
    for (slot, column) in (0..SLOTS).flat_map(|slot| (0..COLUMNS).map(move |column| (slot, column))) {
        frame.set_code(slot, column, if slot < ROWS { LEVEL + 40 } else { LEVEL });
    }
    frame
}

/// Changes a code to a plausible one, and one in fifty to any.
pub fn change(frame: &mut Frame, sample: &Sample) {
    let [wild, when, ..] = sample.words;
    let bits = sample.share_q32;
    let place = |bits: u32, count: usize| (((bits & 0xff) * count as u32) >> 8) as usize;
    let (slot, column) = (place(bits, SLOTS), place(bits >> 8, COLUMNS));
    let above = if slot < ROWS { (bits >> 16) as u16 & 0x7ff } else { (bits >> 16) as u16 & 0x1f };
    frame.set_code(slot, column, if when == 0 { wild as u16 } else { LEVEL + above });
}

/// Gains within their range and masks of a few taxels; now and then one that is refused.
pub fn calibration(source: &mut Source) -> Result<Calibration, CalibrationError> {
    let mut gains = [[0; COLUMNS]; ROWS];
    gains.as_flattened_mut().iter_mut().for_each(|gain| *gain = source.within(1, GAIN_MAX.into()) as u16);
    let mut mask = [0; ROWS];
    mask.iter_mut().for_each(|row| *row = source.word() & source.word() & source.word() & 0x3ff);
    match source.up_to(15) {
        0 => mask[3] |= 0x400,
        1 => gains[7][2] = 0,
        2 => gains[2][7] = GAIN_MAX + 1,
        _ => {}
    }
    Calibration::new(&gains, &mask)
}
