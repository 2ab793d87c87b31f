//! The microcontroller's temperature and analogue supply, of any codes.

use fingertip::chip::{Chip, FRAMES, Factory};
use proptest::prelude::*;

/// What is told after so many frames of codes that come round and round.
fn told(factory: Factory, codes: &[(u16, u16)], frames: u32) -> (u16, Option<f64>) {
    let mut chip = Chip::new(factory);
    for (_, (reference, sensor)) in (0..frames).zip(codes.iter().cycle()) {
        chip.observe(Some([*reference, *sensor]));
    }
    (chip.analogue_mv(), chip.temperature().map(|chip| chip.0.to_num()))
}

proptest! {
    #[test]
    fn any_codes_are_believed_within_bounds_or_not_at_all(
        reference in any::<u16>(),
        sensor in any::<[u16; 2]>(),
        near in any::<bool>(),
        codes in proptest::collection::vec(any::<(u16, u16)>(), 1..20),
        frames in 0..1_000_u32,
    ) {
        // As they come hardly any factory's codes are sensible.
        let sensible = Factory { reference: 1_300 + reference % 400, sensor: [900 + sensor[0] % 100, 1_150 + sensor[1] % 200] };
        let (mv, chip) = told(if near { sensible } else { Factory { reference, sensor } }, &codes, frames);
        prop_assert!(mv == 0 || (1_600..=4_000).contains(&mv));
        prop_assert!(chip.is_none_or(|chip| (-60.0..=160.0).contains(&chip)));
        prop_assert!(mv != 0 || chip.is_none());
        prop_assert!(frames >= FRAMES || (mv, chip) == (0, None));
    }

    #[test]
    fn a_sound_board_tells_its_temperature_and_supply(
        chip_c in -40.0..125.0_f64,
        supply_v in 1.8..3.6_f64,
        (reference_v, sensor_v, volts_per_k) in (1.18..1.24_f64, 0.70..0.82_f64, 0.0022..0.0028_f64),
        noise in proptest::collection::vec((-1.5..1.5_f64, -1.5..1.5_f64), 64),
    ) {
        let volts = |chip_c: f64| sensor_v + volts_per_k * (chip_c - 25.0);
        let code = |volts: f64, supply_v: f64| (volts / supply_v * 4096.0) as u16;
        let factory = Factory { reference: code(reference_v, 3.3), sensor: [30.0, 110.0].map(|chip_c| code(volts(chip_c), 3.3)) };
        let noisy = |volts: f64, noise: f64| (volts / supply_v * 4096.0 + noise) as u16;
        let codes: Vec<_> = noise.iter().map(|(a, b)| (noisy(reference_v, *a), noisy(volts(chip_c), *b))).collect();
        let (mv, found) = told(factory, &codes, FRAMES);
        let found = found.expect("it is sound");
        // The mean noise of 64 draws, the factory's truncated codes (a code is 0.4 K at 30 C and as much at 110), the ratio's.
        prop_assert!((found - chip_c).abs() < 1.5, "{found} C of {chip_c} C");
        prop_assert!((f64::from(mv) - 1e3 * supply_v).abs() < 6.0, "{mv} mV of {supply_v} V");
    }
}
