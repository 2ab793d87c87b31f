//! Constructors: too costly for every input.

use super::machines::Machines;
use super::model::Sample;
use super::{Mix, Source};
use fingertip::contact::Contact;
use fingertip::control::Reference;
use fingertip::params::Params;
use fingertip::pressure::{CalibrationError, GAIN_MAX};
use fingertip::shipped::{COLUMNS, Calibration, Config, Frame, ROWS, SLOTS, TactileImage};
use paper::units::Ratio;
use paper::{Relaxation, RelaxationState, RelaxationTerm};

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

/// Adds a reference of the profile.
pub fn add_reference(mix: &mut Mix, reference: Reference) {
    mix.add(reference.speed.to_bits());
    mix.add(reference.acceleration.to_bits());
}

/// Adds all fields of a tactile image.
pub fn add_picture(mix: &mut Mix, picture: &TactileImage) {
    let TactileImage { taxels, sum, moment_x, moment_y, peak, bad, bad_count, bad_again, undriven_max, peak_codes } =
        picture;
    taxels.iter().flatten().chain([sum, moment_x, moment_y, peak]).for_each(|number| mix.add(*number));
    bad.iter().for_each(|row| mix.add(*row));
    [undriven_max, peak_codes].into_iter().for_each(|number| mix.add(*number));
    mix.add(*bad_count);
    mix.add(*bad_again);
}

/// Adds all fields of a contact.
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
