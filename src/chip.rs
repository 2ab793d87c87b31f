//! The microcontroller's own temperature and its analogue supply, by its sensor and its internal reference.
//!
//! The sensor's voltage is a line through two codes that the factory read at 3.3 V. The factory also read the code of
//! the internal reference at 3.3 V. Sensor and reference are measured by the same converter, so the present supply
//! drops out of their ratio. Means over [`FRAMES`] frames are taken, as a code is 0.3 K.

use crate::units::Celsius;
use fixed::types::I16F16;

/// Number of frames of a mean: 26 ms.
pub const FRAMES: u32 = 256;

/// Analogue supply of the factory's codes, mV.
const FACTORY_MV: u32 = 3_300;
/// Temperatures of the factory's codes of the sensor, degrees Celsius.
const FACTORY_C: [i32; 2] = [30, 110];
/// Bits of a converter's code.
const CODE: u16 = 0xfff;
/// Plausible codes of the reference: 1.0 to 1.4 V at 3.3 V; 1.18 to 1.24 V by its data sheet.
const REFERENCE_CODES: core::ops::RangeInclusive<u16> = 1_241..=1_737;
/// Plausible difference of the sensor's codes: 1.3 to 5.2 mV/K; 2.5 mV/K by its data sheet.
const SENSOR_CODES: core::ops::RangeInclusive<i32> = 128..=512;
/// Plausible analogue supplies, mV.
const BELIEVED_MV: core::ops::RangeInclusive<u16> = 1_600..=4_000;
/// Plausible temperatures, degrees Celsius in Q16: -60 to 160.
const BELIEVED_C: core::ops::RangeInclusive<i64> = -60 << 16..=160 << 16;
/// Fractional bits of a mean code.
const MEAN_BITS: u32 = 4;

/// Codes that the factory read at 3.3 V and keeps in the microcontroller, 12 bits.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Factory {
    /// Code of the internal reference.
    pub reference: u16,
    /// Codes of the sensor at 30 and at 110 degrees Celsius.
    pub sensor: [u16; 2],
}

/// Means over the last [`FRAMES`] frames, and the sums of the next.
#[derive(Clone, Copy, Debug)]
pub struct Chip {
    /// Code of the reference at 3.3 V; 0 if the factory's code is implausible.
    reference: u32,
    /// Code of the sensor at 30 degrees Celsius, and Kelvin per code in Q16.
    line: Option<(i32, i32)>,
    frames: u32,
    /// True if every frame so far had codes.
    whole: bool,
    reference_sum: u32,
    sensor_sum: u32,
    analogue_mv: u16,
    temperature: Option<Celsius>,
}

impl Chip {
    /// Creates a state without a mean. With implausible codes, as of blank memory, no mean is ever known.
    pub fn new(factory: Factory) -> Self {
        let [cold, hot] = factory.sensor.map(i32::from);
        let sound = SENSOR_CODES.contains(&(hot - cold)) && hot <= i32::from(CODE);
        let kelvin_q16 = ((FACTORY_C[1] - FACTORY_C[0]) << 16).checked_div(hot - cold).filter(|_| sound);
        Self {
            reference: if REFERENCE_CODES.contains(&factory.reference) { factory.reference.into() } else { 0 },
            line: kelvin_q16.map(|kelvin_q16| (cold, kelvin_q16)),
            frames: 0,
            whole: true,
            reference_sum: 0,
            sensor_sum: 0,
            analogue_mv: 0,
            temperature: None,
        }
    }

    /// Analogue supply, mV; 0 if it is not known.
    pub fn analogue_mv(&self) -> u16 {
        self.analogue_mv
    }

    /// Temperature of the microcontroller; none if it is not known.
    pub fn temperature(&self) -> Option<Celsius> {
        self.temperature
    }

    /// Takes a frame's codes of the reference and the sensor, none if the converter has no new ones. Returns true at
    /// the end of a mean. A mean that lacks a frame is dropped.
    #[inline(always)]
    pub fn observe(&mut self, codes: Option<[u16; 2]>) -> bool {
        match codes.map(|codes| codes.map(|code| u32::from(code & CODE))) {
            Some([reference, sensor]) => {
                self.reference_sum = self.reference_sum.wrapping_add(reference);
                self.sensor_sum = self.sensor_sum.wrapping_add(sensor);
            }
            None => self.whole = false,
        }
        self.frames += 1;
        let complete = self.frames >= FRAMES;
        if complete {
            self.renew();
        }
        complete
    }

    #[inline(never)]
    fn renew(&mut self) {
        // 4095 x 3300 x 256 and 4095 x 4095 x 256 are just within 32 bits.
        let reference = if self.whole { self.reference } else { 0 };
        let full = reference.wrapping_mul(FACTORY_MV).wrapping_mul(FRAMES);
        let supply_mv = full.checked_div(self.reference_sum).and_then(|mv| u16::try_from(mv).ok());
        self.analogue_mv = supply_mv.filter(|mv| BELIEVED_MV.contains(mv)).unwrap_or(0);
        // Mean code of the sensor, scaled to a supply of 3.3 V.
        let code = self.sensor_sum.wrapping_mul(self.reference).checked_div(self.reference_sum >> MEAN_BITS);
        self.temperature = match (code, self.line) {
            (Some(code), Some((cold, kelvin_q16))) if self.analogue_mv != 0 => {
                let warmer = i64::from(code) - i64::from(cold << MEAN_BITS);
                let at_q16 = i64::from(FACTORY_C[0] << 16) + ((warmer * i64::from(kelvin_q16)) >> MEAN_BITS);
                BELIEVED_C.contains(&at_q16).then(|| Celsius(I16F16::from_bits(at_q16 as i32)))
            }
            _ => None,
        };
        (self.frames, self.whole, self.reference_sum, self.sensor_sum) = (0, true, 0, 0);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const FACTORY: Factory = Factory { reference: 1_502, sensor: [954, 1_202] };

    /// Results for constant codes.
    fn told(factory: Factory, reference: u16, sensor: u16) -> (u16, Option<f64>) {
        let mut chip = Chip::new(factory);
        for frame in 1..=FRAMES {
            assert_eq!((chip.analogue_mv(), chip.temperature()), (0, None), "before the first mean");
            assert_eq!(chip.observe(Some([reference, sensor])), frame == FRAMES);
        }
        (chip.analogue_mv(), chip.temperature().map(|chip| chip.0.to_num()))
    }

    #[test]
    fn the_factory_s_codes_are_its_temperatures_at_any_supply() {
        for (code, celsius) in [(954, 30.0), (1_202, 110.0), (1_078, 70.0)] {
            for supply_mv in [1_800, 3_000, 3_300, 3_600] {
                let at = |code: u32| ((code * 3_300 + supply_mv / 2) / supply_mv) as u16;
                let (mv, chip) = told(FACTORY, at(1_502), at(code));
                assert!(u32::from(mv).abs_diff(supply_mv) <= 2, "{mv} mV of {supply_mv}");
                let chip = chip.expect("it is measured");
                assert!((chip - celsius).abs() < 0.35, "{chip} C at {supply_mv} mV, {celsius} C");
            }
        }
    }

    #[test]
    fn a_mean_is_finer_than_a_code() {
        let mut chip = Chip::new(FACTORY);
        for frame in 0..FRAMES {
            chip.observe(Some([1_502, if frame % 4 == 0 { 955 } else { 954 }]));
        }
        let found: f64 = chip.temperature().expect("it is measured").0.to_num();
        assert!((found - (30.0 + 0.25 * 80.0 / 248.0)).abs() < 0.03, "{found} C");
    }

    #[test]
    fn of_a_blank_memory_nothing_is_known() {
        for sensor in
            [[0xffff; 2], [0; 2], [954; 2], [1_202, 954], [954, 0xffff], [3_900, 4_200], [954, 1_000], [0, 1_202]]
        {
            assert_eq!(told(Factory { sensor, ..FACTORY }, 1_502, 960), (3_300, None), "{sensor:?}");
        }
        for reference in [0, 0xffff, 0xfff, 1_000] {
            assert_eq!(told(Factory { reference, ..FACTORY }, 1_502, 960), (0, None), "{reference}");
        }
    }

    #[test]
    fn what_was_measured_is_not_told_when_codes_stay_away() {
        let mut chip = Chip::new(FACTORY);
        let mut told = |codes: &dyn Fn(u32) -> Option<[u16; 2]>| {
            (0..FRAMES).for_each(|frame| _ = chip.observe(codes(frame)));
            (chip.analogue_mv(), chip.temperature().is_some())
        };
        let sound = Some([1_502, 960]);
        assert_eq!(told(&|_| sound), (3_300, true));
        assert_eq!(told(&|frame| sound.filter(|_| frame != 100)), (0, false), "one frame's are missing");
        assert_eq!(told(&|_| sound), (3_300, true));
        assert_eq!(told(&|_| None), (0, false));
    }

    #[test]
    fn what_cannot_be_is_not_believed() {
        assert_eq!(told(FACTORY, 0, 960), (0, None), "no reference");
        assert_eq!(told(FACTORY, 0xfff, 960), (0, None), "1.2 V");
        assert_eq!(told(FACTORY, 1_502, 0), (3_300, None), "a sensor that is off");
        assert_eq!(told(FACTORY, 1_502, 0xfff), (3_300, None), "one at its rail");
    }
}
