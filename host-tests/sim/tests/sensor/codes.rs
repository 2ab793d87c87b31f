//! Noise, offsets and the converter.

use crate::{all, codes};
use fingertip::shipped::SLOTS;

#[test]
fn noise_has_its_deviation_and_no_bias() {
    let mut effect = codes("noise", "rms_codes = 3", 11);
    let mut draws = Vec::new();
    for n in 0..10_000 {
        let mut row = all(0.0);
        effect(n % SLOTS, 0.0, &mut row);
        draws.extend(row);
    }
    let count = draws.len() as f64;
    let mean = draws.iter().sum::<f64>() / count;
    let square = draws.iter().map(|draw| draw * draw).sum::<f64>() / count;
    let fourth = draws.iter().map(|draw| draw.powi(4)).sum::<f64>() / count;
    // 10^5 draws: the mean to 0.01 (3 deviations 0.03), the deviation to 0.7 % at 3 deviations, the kurtosis to 0.05.
    assert!(mean.abs() < 0.03, "{mean}");
    assert!((square.sqrt() / 3.0 - 1.0).abs() < 0.008, "{}", square.sqrt());
    assert!((fourth / (square * square) - 3.0).abs() < 0.06, "kurtosis {}", fourth / (square * square));
    // White: the correlation of neighbours is 0.
    let lag = draws.windows(2).map(|w| w[0] * w[1]).sum::<f64>() / count / square;
    assert!(lag.abs() < 0.01, "{lag}");
}

#[test]
fn offsets_stay_as_they_were_drawn() {
    let mut effect = codes("offset", "rms_codes = 5", 2);
    let mut draw = || {
        (0..SLOTS)
            .flat_map(|slot| {
                let mut row = all(100.0);
                effect(slot, 0.0, &mut row);
                row
            })
            .collect::<Vec<_>>()
    };
    let first = draw();
    assert_eq!(first, draw());
    let rms = (first.iter().map(|code| (code - 100.0).powi(2)).sum::<f64>() / first.len() as f64).sqrt();
    // 110 draws know the deviation to 7 %: within 3 of these.
    assert!((0.79..1.21).contains(&(rms / 5.0)), "{rms}");
}

#[test]
fn a_coarse_converter_rounds_down_to_its_steps() {
    for bits in 1..=12 {
        let step = 4096 >> bits;
        let mut effect = codes("converter", &format!("bits = {bits}"), 1);
        for code in (0..4096).step_by(7) {
            let mut row = all(f64::from(code) + 0.25);
            effect(0, 0.0, &mut row);
            assert_eq!(row[0], f64::from(code / step * step));
        }
    }
}

#[test]
fn a_bent_converter_errs_most_in_its_middle() {
    let mut effect = codes("converter", "bits = 12\ninl_codes = 3", 1);
    for (code, more) in [(0.0, 0.0), (1024.0, 2.25), (2048.0, 3.0), (3072.0, 2.25)] {
        let mut row = all(code);
        effect(0, 0.0, &mut row);
        assert_eq!(row[0], code + f64::floor(more));
    }
}
