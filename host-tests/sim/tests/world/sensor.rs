//! Every sensor effect, alone and together, over any input; hysteresis, creep, spread and temperature against their
//! closed forms.

use crate::*;
use sim::effects::sensor::{self, Readout, Row};
use sim::setup::Array;

/// The readout with an effect of these keys.
fn effect(name: &str, keys: &str, seed: u64) -> sensor::Named {
    stages(&format!("[effects.{name}]\n{keys}\n"), seed)
}

/// The same number in every column.
fn all(value: f64) -> Row {
    [value; COLUMNS]
}

/// The readout with these effects.
fn stages(tables: &str, seed: u64) -> sensor::Named {
    parts(tables, seed).sensor
}

/// The effects that act in the readout, one of the link's among them.
fn names() -> Vec<&'static str> {
    sensor::EFFECTS.iter().map(|effect| effect.name).chain(["burst"]).collect()
}

/// Scans frames of a random world.
fn scan(stages: &mut sensor::Named, frames: usize, seed: u64) -> Vec<[u16; COLUMNS]> {
    let mut rng = fastrand::Rng::with_seed(seed);
    let mut readout = Readout::new(&Array::default(), None);
    let mut codes = Vec::new();
    let mut time_s = -0.01;
    for _ in 0..frames {
        let scale = [0.0, 1e-300, 1.0, 30.0, 1e4][rng.usize(0..5)];
        for slot in 0..SLOTS {
            time_s += [0.0, 1e-9, 9e-6, 9e-6, 1.0][rng.usize(0..5)];
            let kpa: Row = core::array::from_fn(|_| scale * rng.f64());
            codes.push(readout.codes(stages, slot, time_s, &kpa));
        }
    }
    codes
}

#[test]
fn any_effect_and_all_together_change_any_input_alike_each_time() {
    let plain = scan(&mut sensor::Named::default(), 1000, 1);
    let table = |name| match name {
        "broken_taxels" => "[effects.broken_taxels]\ndead = [[1, 1]]\n".into(),
        name => format!("[effects.{name}]\n"),
    };
    let alone: Vec<String> = names().into_iter().map(table).collect();
    for tables in alone.iter().chain([&alone.concat()]) {
        for seed in 1..=3 {
            let codes = scan(&mut stages(tables, seed), 1000, seed);
            assert!(codes.iter().flatten().all(|code| *code < 4096));
            assert_eq!(codes, scan(&mut stages(tables, seed), 1000, seed), "{tables} is not repeatable");
            assert!(seed != 1 || codes != plain, "{tables} changes nothing");
        }
    }
}

#[test]
fn an_effects_numbers_are_its_own() {
    // Naming another effect without magnitude does not change the draws of the noise.
    let noise = "[effects.noise]\nrms_codes = 3\n";
    let more = format!("{noise}[effects.gain_spread]\nrms_percent = 0\n[effects.burst]\namplitude_codes = 0\n");
    assert_eq!(scan(&mut stages(noise, 1), 100, 1), scan(&mut stages(&more, 1), 100, 1));
    assert_ne!(scan(&mut stages(noise, 1), 100, 1), scan(&mut stages(noise, 2), 100, 1));
}

fn reads(effect: &mut sensor::Named, time_s: f64, kpa: f64) -> f64 {
    let mut row = all(kpa);
    effect.pressure.each(|part| part(3, time_s, &mut row));
    assert!(row.iter().all(|column| *column == row[0]));
    row[0]
}

#[test]
fn hysteresis_encloses_its_area() {
    for (percent, top_kpa) in [(10.0, 30.0), (10.0, 3.0), (40.0, 30.0), (100.0, 5.0)] {
        let mut effect = effect("hysteresis", &format!("width_percent = {percent}"), 1);
        let steps = 20_000;
        let way = (0..=steps).chain((0..steps).rev()).map(|step| top_kpa * f64::from(step) / f64::from(steps));
        let readings: Vec<_> = way.map(|kpa| (kpa, reads(&mut effect, 0.0, kpa))).collect();
        // Trapezoids: letting go lies above pressing.
        let area: f64 = readings.windows(2).map(|w| -(w[1].0 - w[0].0) * 0.5 * (w[0].1 + w[1].1)).sum();
        let w = percent / 200.0;
        let exact = top_kpa * top_kpa * w * (1.0 - w) / (1.0 + w);
        assert!((area / exact - 1.0).abs() < 1e-6, "{percent} %: {area} for {exact} kPa^2");
        assert_eq!(readings.last(), Some(&(0.0, 0.0)));
    }
}

#[test]
fn creep_grows_by_its_rate_in_each_decade() {
    for steps_a_decade in [3, 50] {
        let mut effect = effect("creep", "rate_percent_per_decade = 5", 1);
        assert_eq!(reads(&mut effect, 0.0, 20.0), 20.0);
        let mut readings = Vec::new();
        for step in 0..=(7 * steps_a_decade) {
            let time_s = 1e-3 * libm::exp10(f64::from(step) / f64::from(steps_a_decade));
            let reading = reads(&mut effect, time_s, 20.0);
            if step % steps_a_decade == 0 {
                readings.push(reading);
            }
        }
        for (number, decade) in readings.windows(2).enumerate() {
            let percent = (decade[1] - decade[0]) / 20.0 * 100.0;
            // To 1000 s; the next slower term is missing after that.
            let allowed = if number < 6 { 4.995..5.005 } else { 4.95..5.0 };
            assert!(allowed.contains(&percent), "{percent} % in decade {number} from 1 ms");
        }
    }
}

#[test]
fn gains_spread_as_asked_and_by_the_seed() {
    let gains = |seed: u64| {
        let mut effect = effect("gain_spread", "rms_percent = 6", seed);
        (0..ROWS)
            .flat_map(|row| {
                let mut kpa = all(1.0);
                effect.pressure.each(|part| part(row, 0.0, &mut kpa));
                kpa
            })
            .collect::<Vec<_>>()
    };
    assert_eq!(gains(7), gains(7));
    assert_ne!(gains(7), gains(8));
    let many: Vec<f64> = (0..100).flat_map(gains).collect();
    let count = many.len() as f64;
    let mean = many.iter().sum::<f64>() / count;
    let rms = (many.iter().map(|gain| (gain - mean).powi(2)).sum::<f64>() / count).sqrt();
    // Cut at 3 deviations, a normal distribution keeps 0.9866 of its deviation; 10^4 draws know it to 0.7 %.
    assert!((mean - 1.0).abs() < 0.0025, "{mean}");
    assert!((rms / (0.06 * 0.9866) - 1.0).abs() < 0.025, "{rms}");
    assert!(many.iter().all(|gain| (gain - 1.0).abs() <= 0.18 + 1e-12));
}

#[test]
fn temperature_drifts_with_the_exponential() {
    let mut effect = effect(
        "temperature_drift",
        "warming_k = 40\ntime_constant_s = 600\ngain_percent_per_k = 0.36\nzero_kpa_per_k = 0.05",
        1,
    );
    assert_eq!(reads(&mut effect, -1.0, 20.0), 20.0);
    for time_s in [1.0, 600.0, 3600.0] {
        let warmer = 40.0 * (1.0 - f64::exp(-time_s / 600.0));
        let exact = 20.0 * (1.0 + 0.0036 * warmer) + 0.05 * warmer;
        assert!((reads(&mut effect, time_s, 20.0) - exact).abs() < 1e-9);
    }
}

#[test]
fn broken_taxels_conduct_as_broken() {
    let taxels = "dead = [[3, 1]]\nshorted = [[3, 2]]\nstuck = [[3, 4], [4, 4]]\nat_s = 0.5";
    let mut effect = effect("broken_taxels", taxels, 1);
    let mut see = |row: usize, time_s: f64, siemens: f64| {
        let mut array = all(siemens);
        effect.conductance.each(|part| part(row, time_s, &mut array));
        array
    };
    assert_eq!(see(3, 0.4, 1e-5), all(1e-5));
    let mut broken = all(2e-5);
    (broken[1], broken[2]) = (0.0, 0.1);
    assert_eq!(see(3, 0.5, 2e-5), broken);
    let mut later = [3e-5; COLUMNS];
    (later[1], later[2], later[4]) = (0.0, 0.1, 2e-5);
    assert_eq!(see(3, 0.6, 3e-5), later);
    assert_eq!(see(2, 0.6, 3e-5), all(3e-5));
}

fn ghosted(hold_ohm: f64, row: usize, array: &[Row; ROWS]) -> Row {
    let mut seen = array[row];
    effect("ghosting", &format!("hold_ohm = {hold_ohm}"), 1).network.each(|part| part(row, array, &mut seen));
    seen
}

/// By Kirchhoff on all 20 lines: the driven row at 1 V, the read column at 0, the others held; Gauss with pivots.
fn kirchhoff(driven: usize, read: usize, hold: f64, array: &[Row; ROWS]) -> f64 {
    const LINES: usize = ROWS + COLUMNS;
    let mut a = [[0.0; LINES + 1]; LINES];
    for (line, equation) in a.iter_mut().enumerate() {
        if line == driven || line == ROWS + read {
            equation[line] = 1.0;
            equation[LINES] = if line == driven { 1.0 } else { 0.0 };
            continue;
        }
        equation[line] += hold;
        let others: Vec<(f64, usize)> = match line.checked_sub(ROWS) {
            None => (0..COLUMNS).map(|column| (array[line][column], ROWS + column)).collect(),
            Some(column) => (0..ROWS).map(|row| (array[row][column], row)).collect(),
        };
        for (g, to) in others {
            equation[line] += g;
            equation[to] -= g;
        }
    }
    for p in 0..LINES {
        let best = (p..LINES).max_by(|x, y| a[*x][p].abs().total_cmp(&a[*y][p].abs())).unwrap();
        a.swap(p, best);
        let line = a[p];
        for (_, other) in a.iter_mut().enumerate().filter(|(n, _)| *n != p) {
            let factor = other[p] / line[p];
            other.iter_mut().zip(line).for_each(|(entry, part)| *entry -= factor * part);
        }
    }
    (0..ROWS).map(|row| a[row][LINES] / a[row][row] * array[row][read]).sum()
}

#[test]
fn ghosting_obeys_kirchhoff_and_lies_between_guarded_and_the_column() {
    let mut rng = fastrand::Rng::with_seed(3);
    for hold_ohm in [1e-3, 10.0, 1e3, 1e5, 1e7, 1e12] {
        for _ in 0..30 {
            let array = [(); ROWS].map(|()| all(0.0).map(|_| 2e-6 + 1e-4 * rng.f64() * rng.f64()));
            let row = rng.usize(0..ROWS);
            assert_eq!(ghosted(0.0, row, &array), array[row], "well held, it does not ghost");
            let seen = ghosted(hold_ohm, row, &array);
            for (column, seen) in seen.iter().enumerate() {
                let exact = kirchhoff(row, column, 1.0 / hold_ohm, &array);
                assert!((seen / exact - 1.0).abs() < 1e-9, "{seen} for {exact}");
                let most: f64 = array.iter().map(|row| row[column]).sum();
                assert!(*seen >= array[row][column] * (1.0 - 1e-12) && *seen <= most * (1.0 + 1e-12));
            }
        }
    }
}

#[test]
fn a_row_sags_by_its_switch() {
    for (switch_ohm, ohm, percent) in [(70.0, 1e3, 41.2), (5.0, 1e3, 4.76), (70.0, 1e4, 6.54), (5.0, 1e4, 0.498)] {
        let array = [all(1.0 / ohm); ROWS];
        let mut seen = array[2];
        effect("row_sag", &format!("switch_ohm = {switch_ohm}"), 1).network.each(|part| part(2, &array, &mut seen));
        for siemens in seen {
            let sag = 100.0 * (1.0 - siemens * ohm);
            let exact = 100.0 * (1.0 - 1.0 / (1.0 + switch_ohm * 10.0 / ohm));
            assert!((sag - exact).abs() < 1e-9 && (sag / percent - 1.0).abs() < 0.005, "{sag} %");
        }
    }
}

#[test]
fn a_column_settles_with_the_exponential() {
    for (tau_us, after_us) in [(1.0, 2.4), (0.2, 2.4), (5.0, 1.0)] {
        let mut effect = effect("settling", &format!("tau_us = {tau_us}\nafter_us = {after_us}"), 1);
        let mut sample = |slot: usize, time_us: f64, v: f64| {
            let mut volts = all(v);
            effect.volts.each(|part| part(slot, time_us * 1e-6, &mut volts));
            volts[0]
        };
        // A step from 0.3 V, settled, to 2.3 V, and on to 1.3 V 9 us later, before it has settled.
        assert_eq!(sample(0, 0.0, 0.3), 0.3);
        let left = f64::exp(-after_us / tau_us);
        assert!((sample(1, 1000.0, 2.3) - (2.3 - 2.0 * left)).abs() < 1e-11);
        let edge = 2.3 - 2.0 * f64::exp(-9.0 / tau_us);
        assert!((sample(2, 1009.0, 1.3) - (1.3 + (edge - 1.3) * left)).abs() < 1e-11);
    }
}

#[test]
fn an_amplifier_ends_at_its_rail() {
    let mut effect = effect("saturation", "headroom_mv = 100", 1);
    let mut row = all(0.0);
    row[1] = 3.19;
    row[2] = 3.21;
    effect.volts.each(|part| part(0, 0.0, &mut row));
    assert_eq!(row[..2], [0.0, 3.19]);
    assert!((row[2] - 3.2).abs() < 1e-12);
}

#[test]
fn noise_has_its_deviation_and_no_bias() {
    let mut effect = effect("noise", "rms_codes = 3", 11);
    let mut draws = Vec::new();
    for n in 0..10_000 {
        let mut row = all(0.0);
        effect.codes.each(|part| part(n % SLOTS, 0.0, &mut row));
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
    let mut effect = effect("offset", "rms_codes = 5", 2);
    let mut draw = || {
        (0..SLOTS)
            .flat_map(|slot| {
                let mut row = all(100.0);
                effect.codes.each(|part| part(slot, 0.0, &mut row));
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
        let mut effect = effect("converter", &format!("bits = {bits}"), 1);
        for code in (0..4096).step_by(7) {
            let mut row = all(f64::from(code) + 0.25);
            effect.codes.each(|part| part(0, 0.0, &mut row));
            assert_eq!(row[0], f64::from(code / step * step));
        }
    }
    // A bent one errs most in its middle.
    let mut effect = effect("converter", "bits = 12\ninl_codes = 3", 1);
    for (code, more) in [(0.0, 0.0), (1024.0, 2.25), (2048.0, 3.0), (3072.0, 2.25)] {
        let mut row = all(code);
        effect.codes.each(|part| part(0, 0.0, &mut row));
        assert_eq!(row[0], code + f64::floor(more));
    }
}
