//! Ghosting and sag in the resistor network; settling and saturation of a column's amplifier.

use super::{all, codes, network, volts};
use fingertip::shipped::{COLUMNS, ROWS, SLOTS};
use sim::effects::sensor::Row;

fn ghosted(hold: &str, row: usize, array: &[Row; ROWS]) -> Row {
    let mut seen = array[row];
    network("ghosting", &format!("hold_ohm = {hold}"))(row, array, &mut seen);
    seen
}

#[test]
fn an_unguarded_array_of_equal_resistances_reads_19_hundredths() {
    for siemens in [2e-6, 1e-4, 0.1] {
        for row in [0, 4, 9] {
            for seen in ghosted("1e12", row, &[all(siemens); ROWS]) {
                let share = siemens / seen;
                let exact = (ROWS + COLUMNS - 1) as f64 / (ROWS * COLUMNS) as f64;
                assert!((share - exact).abs() < 1e-6, "reads {share} of R");
            }
        }
    }
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
    for hold_ohm in [10.0, 1e3, 1e5, 1e7] {
        for _ in 0..30 {
            let array = [(); ROWS].map(|()| all(0.0).map(|_| 2e-6 + 1e-4 * rng.f64() * rng.f64()));
            let row = rng.usize(0..ROWS);
            let seen = ghosted(&hold_ohm.to_string(), row, &array);
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
fn a_well_held_array_does_not_ghost() {
    let mut array = [all(2e-6); ROWS];
    array[4][4] = 1e-4;
    for (seen, guarded) in ghosted("0.001", 4, &array).iter().zip(array[4]) {
        assert!((seen / guarded - 1.0).abs() < 1e-6);
    }
    assert_eq!(ghosted("0", 4, &array), array[4]);
}

#[test]
fn a_row_sags_by_its_switch() {
    for (switch_ohm, ohm, percent) in [(70.0, 1e3, 41.2), (5.0, 1e3, 4.76), (70.0, 1e4, 6.54), (5.0, 1e4, 0.498)] {
        let array = [all(1.0 / ohm); ROWS];
        let mut seen = array[2];
        network("row_sag", &format!("switch_ohm = {switch_ohm}"))(2, &array, &mut seen);
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
        let mut effect = volts("settling", &format!("tau_us = {tau_us}\nafter_us = {after_us}"));
        let mut sample = |slot: usize, time_us: f64, v: f64| {
            let mut volts = all(v);
            effect(slot, time_us * 1e-6, &mut volts);
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
fn half_a_bit_of_twelve_takes_nine_time_constants() {
    let missing = |after_us: f64| {
        let mut effect = volts("settling", &format!("tau_us = 1\nafter_us = {after_us}"));
        let (mut low, mut high) = (all(0.0), all(4096.0));
        effect(0, 0.0, &mut low);
        effect(1, 1.0, &mut high);
        4096.0 - high[0]
    };
    assert!(missing(8.99) > 0.5 && missing(9.03) < 0.5 && missing(9.03) > 0.48);
}

#[test]
fn an_amplifier_ends_at_its_rail() {
    let mut effect = volts("saturation", "headroom_mv = 100");
    let mut row = all(0.0);
    row[1] = 3.19;
    row[2] = 3.21;
    effect(0, 0.0, &mut row);
    assert_eq!(row[..2], [0.0, 3.19]);
    assert!((row[2] - 3.2).abs() < 1e-12);
}

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
