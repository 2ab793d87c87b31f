//! A running digest of all that steps report: quick enough for the board.

use super::bits::mix;
use crate::calibrate::{self, scale};
use crate::commission::Drive;
use crate::contact::Contact;
use crate::identify::Modulus;
use crate::pipeline::{Status, Taken};
use crate::units::Duty;

/// The digest after one more step. What differs once makes all that follow differ.
pub(super) fn add(digest: u32, duty: Duty, status: &Status) -> u32 {
    // Taken apart field by field, so that a field cannot be forgotten.
    let Status {
        sequence,
        missed_frames,
        mode,
        fault,
        limits,
        fit_level,
        contact,
        creep,
        travel,
        speed,
        duty: applied,
        identification,
        commissioning,
        calibration,
        scale,
        tare,
        taken,
    } = status;
    let Contact { force, indentation, centre_x, centre_y, radius, peak_pa, confidence, doubt, bad_taxels } = contact;
    let mut words = Words(digest);
    words.add(*sequence);
    words.add(*missed_frames);
    words.add(pack([*mode as u8, fault.map_or(0, |fault| fault as u8), *fit_level as u8, *tare as u8]));
    words.add(u32::from(limits.0) | u32::from(*bad_taxels) << 16);
    words.add(pack([*confidence, *doubt, 0, 0]));
    words.add(*peak_pa);
    for bits in [force.to_bits(), creep.to_bits(), speed.to_bits()] {
        words.add(bits.cast_unsigned());
    }
    for length in [indentation, centre_x, centre_y, radius, travel] {
        words.add(length.to_bits().cast_unsigned());
    }
    words.add(u32::from(duty.0.cast_unsigned()) | u32::from(applied.0.cast_unsigned()) << 16);
    let Taken { tare, clear, identify, calibrate, forget, shown, commission } = *taken;
    words.add(pack([tare, clear, identify, calibrate]));
    words.add(pack([forget, shown, commission, 0]));
    let calibrate::Standing { state, progress, presses, reached, proposals } = *calibration;
    words.add(pack([state.number(), state.refusal(), progress, presses]));
    words.add(u32::from(reached) | u32::from(proposals) << 16);
    let scale::Standing { refusal, points, factor_ppm, sigma_ppm } = *scale;
    words.add(pack([refusal.map_or(0, |refusal| refusal as u8), points, 0, 0]));
    words.add(factor_ppm);
    words.add(sigma_ppm);
    words.add(pack([
        identification.number(),
        identification.refusal(),
        commissioning.number(),
        commissioning.refusal(),
    ]));
    words.add(commissioning.progress().into());
    if identification.number() == 2 {
        let Modulus { modulus, sigma, contact, points } = identification.result();
        words.add(modulus.to_bits().cast_unsigned());
        words.add(sigma.to_bits().cast_unsigned());
        words.add(contact.to_bits().cast_unsigned());
        words.add(points.into());
    }
    if commissioning.number() == 3 {
        let Drive {
            torque_constant_unm_per_a,
            torque_constant_sigma,
            time_constant_us,
            time_constant_sigma,
            inertia_ug_m2,
            inertia_sigma,
            friction_unm: [forward, back],
            friction_sigma: [forward_sigma, back_sigma],
        } = commissioning.drive();
        for word in [torque_constant_unm_per_a, time_constant_us, inertia_ug_m2] {
            words.add(word);
        }
        let halves = [torque_constant_sigma, time_constant_sigma, inertia_sigma, forward, back];
        for half in halves.into_iter().chain([forward_sigma, back_sigma]) {
            words.add(half.into());
        }
    }
    words.0
}

/// A digest of words, to begin with or to go on from.
pub(super) fn words(digest: u32, words: impl Iterator<Item = u32>) -> u32 {
    let mut all = Words(digest);
    words.for_each(|word| all.add(word));
    all.0
}

/// What of a digest is kept with each frame: the upper bits, which all others reach.
pub(super) const fn short(digest: u32) -> u16 {
    (digest >> 16) as u16
}

const fn pack(bytes: [u8; 4]) -> u32 {
    u32::from_le_bytes(bytes)
}

struct Words(u32);

impl Words {
    #[inline(always)]
    fn add(&mut self, word: u32) {
        self.0 = mix(self.0, word);
    }
}
