//! Constructors: too costly for every input.

use super::machines::Machines;
use super::model::Sample;
use super::{Mix, Source};
use fingertip::config::{self, ArrayDrift, ConfigError, Gains, Heat, Lag, Motions};
use fingertip::contact::Contact;
use fingertip::control::Reference;
use fingertip::params::Params;
use fingertip::pressure::{CalibrationError, GAIN_MAX};
use fingertip::scan::ScanTiming;
use fingertip::shipped::{COLUMNS, Calibration, Config, Frame, ROWS, SLOTS, TactileImage};
use fingertip::units::Newtons;
use paper::units::Ratio;
use paper::{Relaxation, RelaxationError, RelaxationState, RelaxationTerm};

/// Name of a constructor, and function that calls it and adds the results to the digest.
pub type Make = (&'static str, fn(&mut Machines, &mut Source, &mut Mix));

/// Inputs between two that make new machines: each takes up to half a million instructions.
pub const MADE_EVERY: u32 = 1_024;

/// The sampling times that the converter has.
const SAMPLE_CYCLES: [i32; 8] = [3, 15, 28, 56, 84, 112, 144, 480];

/// Machines that are made for every [`MADE_EVERY`]th input.
pub const MADE: [Make; 3] = [
    ("Config::new", |m, source, mix| match Config::shipped(&params(source)) {
        Ok(config) => {
            m.config = config;
            add_config(mix, &m.config);
        }
        Err(ConfigError::Param(error)) => mix.add(error.value),
        Err(ConfigError::Order([(_, low), (_, high)])) => mix.add(low - high),
        // The scan.
        Err(_) => mix.add(-1),
    }),
    ("Calibration::new", |m, source, mix| match calibration(source) {
        // The gains change the readings of the array.
        Ok(calibration) => m.array.calibrate(&calibration),
        Err(CalibrationError::Gain { row, column, value }) => {
            mix.add(row as u32);
            mix.add(column as u32);
            mix.add(value);
        }
        Err(CalibrationError::Mask { row, value, .. }) => {
            mix.add(row as u32);
            mix.add(value);
        }
    }),
    ("Relaxation::new", |m, source, mix| {
        let period_us = source.up_to(2_000);
        let terms = [(); 3].map(|()| RelaxationTerm {
            share: Ratio::from_bits(source.within(0, 22_000)),
            time_constant_us: period_us.saturating_mul(1 << source.up_to(20)),
        });
        match Relaxation::new(period_us, &terms) {
            Ok(filter) => (m.filter, m.memory) = (Some(filter), RelaxationState::REST),
            Err(RelaxationError::Sum(sum)) => mix.add(sum),
            Err(_) => mix.add(-1),
        }
        // What it is made of shows in a step from rest.
        let mut rest = RelaxationState::REST;
        if let Some(filter) = &m.filter {
            mix.add(filter.step(&mut rest, Newtons::from_bits(i32::MAX)).to_bits());
        }
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

/// Every number of a configuration, but the parameters that it was made from and the array's geometry, which shows in
/// the fit.
fn add_config(mix: &mut Mix, config: &Config) {
    // Taken apart, so that a field cannot be forgotten.
    let config::Config {
        params: _,
        geometry: _,
        timing: ScanTiming { settle, slot, sample_cycles, slots: _, idle, frame_ns, deadline },
        tip,
        sag_q32,
        dead_codes,
        saturated_codes,
        newtons_per_sum_q48,
        pascals_per_sum_q32,
        curve,
        creep_share_q32,
        creep_leak_q32,
        half_pitch,
        contact_on,
        contact_off,
        touch_line,
        frame_s_q37,
        mm_per_count_q40,
        count,
        jump,
        counts_max,
        gain_sets,
        calm_band,
        calm_frames,
        damping_q17_per_s,
        voltage_max_q8_mm_per_s2,
        current_max_q8_mm_per_s2,
        supply_weak_mv,
        slew_max_q8_mm_per_s2,
        brake: [brake_least, brake_usual, brake_most],
        share_per_mv_q32,
        voltage_shift,
        duty_gain,
        speed_max,
        approach,
        near,
        travel_max,
        clearance,
        bounds,
        heat,
        drift,
        motions,
        force_fault,
        force_max,
        force_seen,
    } = &**config;
    for ticks in
        [settle.0, slot.0, idle.0, deadline.0, (*sample_cycles).into(), (*dead_codes).into(), (*saturated_codes).into()]
    {
        mix.add(ticks);
    }
    mix.add(u32::from(*sag_q32));
    for force in [tip.force_max(), *contact_on, *contact_off, *force_fault, *force_max, *force_seen] {
        mix.add(force.to_bits());
    }
    for length in [half_pitch, count, calm_band, travel_max, clearance, &bounds.back] {
        mix.add(length.to_bits());
    }
    for number in [newtons_per_sum_q48, pascals_per_sum_q32, mm_per_count_q40] {
        mix.add(*number);
    }
    mix.add(curve.least);
    mix.add(curve.growth);
    for number in [creep_share_q32, creep_leak_q32, frame_ns, jump, voltage_shift, duty_gain, share_per_mv_q32] {
        mix.add(*number);
    }
    let ArrayDrift { gain_q32_per_k, gain_at_q16, zero_q24_per_k } = *drift;
    for number in [gain_q32_per_k, gain_at_q16, zero_q24_per_k] {
        mix.add(number);
    }
    let Heat { frames_bits, most, down, up, lags, start_q30, room_q30, ambient_q16 } = *heat;
    for number in [most, ambient_q16] {
        mix.add(number);
    }
    for shift in [frames_bits, down, up] {
        mix.add(shift);
    }
    for kelvin in [start_q30, room_q30] {
        mix.add(kelvin);
    }
    for Lag { gain, rise_q31, fall_q31 } in lags {
        mix.add(gain);
        mix.add(rise_q31);
        mix.add(fall_q31);
    }
    for number in [*frame_s_q37, *counts_max, calm_frames.cast_signed()] {
        mix.add(number);
    }
    for gains in gain_sets {
        let Gains { observer, speed_q18_per_s, slope_per_s, half_over_slope_q32, half_over_slope2_q40 } = gains;
        for number in observer {
            mix.add(*number);
        }
        for number in [speed_q18_per_s, slope_per_s, half_over_slope_q32, half_over_slope2_q40] {
            mix.add(*number);
        }
    }
    mix.add(near.to_bits());
    for speed in [speed_max, approach, &bounds.speed_loose, &bounds.speed_any] {
        mix.add(speed.to_bits());
    }
    for number in [
        damping_q17_per_s,
        voltage_max_q8_mm_per_s2,
        current_max_q8_mm_per_s2,
        slew_max_q8_mm_per_s2,
        supply_weak_mv,
        touch_line,
        &bounds.frames_per_s,
        &bounds.leak,
        &bounds.acceleration_per_n,
        &bounds.change_per_n,
        &bounds.change_least,
        &bounds.change_free,
        &bounds.change_unsure,
    ] {
        mix.add(*number);
    }
    for number in [brake_least, brake_usual, brake_most] {
        mix.add(*number);
    }
    let Motions { felt, stroke, farthest, back, pulse, pulse_frames, jog_rise_uv, rise_uv, feel_uv, start_uv, .. } =
        motions;
    let Motions { fastest_uv, uv_per_count_q8, uv_per_newton, span_part, push, push_mn, roll_q8, .. } = motions;
    let Motions { still, rest, longest, touch, .. } = motions;
    for number in [felt, stroke, farthest, back, pulse, jog_rise_uv, rise_uv, feel_uv, start_uv, fastest_uv] {
        mix.add(*number);
    }
    for number in [uv_per_count_q8, uv_per_newton, push, push_mn, roll_q8] {
        mix.add(*number);
    }
    for frames in [pulse_frames, span_part, still, rest, longest] {
        mix.add(*frames);
    }
    mix.add(touch.to_bits());
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
