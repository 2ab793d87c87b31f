//! All that a step reports, as numbers: what digests of runs are made of.

use super::{Status, Taken};
use crate::calibrate::{self, scale};
use crate::commission::Drive;
use crate::contact::Contact;
use crate::identify::Modulus;
use crate::units::Duty;

impl Taken {
    /// Four numbers in a word; the last one's upper byte is 0.
    pub(crate) fn words(self) -> [u32; 2] {
        let Self { tare, clear, identify, calibrate, forget, shown, commission } = self;
        [[tare, clear, identify, calibrate], [forget, shown, commission, 0]].map(u32::from_le_bytes)
    }

    /// The inverse; `None` where that byte is not 0.
    pub(crate) fn from_words(words: [u32; 2]) -> Option<Self> {
        let [[tare, clear, identify, calibrate], [forget, shown, commission, none]] = words.map(u32::to_le_bytes);
        (none == 0).then_some(Self { tare, clear, identify, calibrate, forget, shown, commission })
    }
}

impl Status {
    /// Hands over every field, and the duty that the step returned with it. What a measurement found counts once it is
    /// there.
    pub fn words(&self, duty: Duty, mut each: impl FnMut(u32)) {
        // Taken apart field by field, so that a field cannot be forgotten.
        let Self {
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
            winding,
            chip,
            drift,
        } = *self;
        let Contact { force, indentation, centre_x, centre_y, radius, peak_pa, confidence, doubt, bad_taxels } =
            contact;
        let calibrate::Standing { state, progress, presses, reached, proposals } = calibration;
        let scale::Standing { refusal, points, factor_ppm, sigma_ppm } = scale;
        let [taken, more_taken] = taken.words();
        let always = [
            sequence,
            missed_frames,
            u32::from_le_bytes([mode as u8, fault.map_or(0, |fault| fault as u8), fit_level as u8, tare as u8]),
            u32::from(limits.0) | u32::from(bad_taxels) << 16,
            u32::from_le_bytes([confidence, doubt, 0, 0]),
            peak_pa,
            force.to_bits().cast_unsigned(),
            creep.to_bits().cast_unsigned(),
            drift.to_bits().cast_unsigned(),
            speed.to_bits().cast_unsigned(),
            winding.to_bits().cast_unsigned(),
            chip.unwrap_or_default().to_bits().cast_unsigned(),
            indentation.to_bits().cast_unsigned(),
            centre_x.to_bits().cast_unsigned(),
            centre_y.to_bits().cast_unsigned(),
            radius.to_bits().cast_unsigned(),
            travel.to_bits().cast_unsigned(),
            u32::from(duty.0.cast_unsigned()) | u32::from(applied.0.cast_unsigned()) << 16,
            taken,
            more_taken,
            u32::from_le_bytes([state.number(), state.refusal(), progress, presses]),
            u32::from(reached) | u32::from(proposals) << 16,
            u32::from_le_bytes([refusal.map_or(0, |refusal| refusal as u8), points, 0, 0]),
            factor_ppm,
            sigma_ppm,
            u32::from_le_bytes([
                identification.number(),
                identification.refusal(),
                commissioning.number(),
                commissioning.refusal(),
            ]),
            commissioning.progress().into(),
        ];
        always.iter().for_each(|word| each(*word));
        if identification.number() == 2 {
            let Modulus { modulus, sigma, contact, points } = identification.result();
            for bits in [modulus.to_bits(), sigma.to_bits(), contact.to_bits(), points.into()] {
                each(bits.cast_unsigned());
            }
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
                each(word);
            }
            let halves = [torque_constant_sigma, time_constant_sigma, inertia_sigma, forward, back];
            for half in halves.into_iter().chain([forward_sigma, back_sigma]) {
                each(half.into());
            }
        }
    }
}
