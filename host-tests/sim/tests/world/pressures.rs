//! Taxel means from the table against the fine integral.

use fingertip::shipped::{COLUMNS, ROWS};
use sim::mechanics::cells::Cell;
use sim::mechanics::pressures::Pressures;
use sim::setup::Tip;

const PITCH_MM: f64 = 1.5;

/// Midpoints along a side; their own error is 1e-5 of the peak where the rim passes.
const FINE: usize = 200;

fn fine(d_mm: f64, centre_mm: [f64; 2], row: usize, column: usize) -> f64 {
    let cell = Cell::at(PITCH_MM, centre_mm, row, column);
    let tip = Tip::default().flattened(d_mm);
    let at = |side: [f64; 2], n: usize| side[0] + (side[1] - side[0]) * (n as f64 + 0.5) / FINE as f64;
    let mut sum = 0.0;
    for (i, j) in (0..FINE).flat_map(|i| (0..FINE).map(move |j| (i, j))) {
        sum += tip.pressure_kpa(at(cell.x_mm, i).powi(2) + at(cell.y_mm, j).powi(2));
    }
    sum / (FINE * FINE) as f64
}

#[test]
fn means_are_within_a_thousandth_of_the_peak_and_add_up() {
    let mut random = fastrand::Rng::with_seed(1);
    let (mut worst, mut worst_sum) = (0.0_f64, 0.0_f64);
    for case in 0..40 {
        let centre_mm = [random.f64() - 0.5, random.f64() - 0.5];
        let mut table = Pressures::new(Tip::default(), PITCH_MM, centre_mm);
        let d_mm = 2.3 * random.f64() * random.f64() + 0.002;
        let shift_mm = if case % 2 == 0 { 0.0 } else { random.f64() - 0.5 };
        let centre_mm = [centre_mm[0], centre_mm[1] + shift_mm];
        let peak_kpa = 250.0 * d_mm / 10.0;
        let mut sum = 0.0;
        for row in 0..ROWS {
            let between = table.between(d_mm, shift_mm);
            let means = table.row_kpa(&(), &between, row);
            sum += means.iter().sum::<f64>();
            // Every taxel of some rows: the fine integral is slow.
            if (row + case) % 3 == 0 {
                for (column, mean) in means.into_iter().enumerate() {
                    worst = worst.max((mean - fine(d_mm, centre_mm, row, column)).abs() / peak_kpa);
                }
            }
        }
        let force_n = Tip::default().force_n(d_mm);
        let error = sum * PITCH_MM * PITCH_MM * 1e-3 / force_n - 1.0;
        worst_sum = worst_sum.max(error.abs());
    }
    println!("a taxel: {worst:.1e} of the peak; the sum: {worst_sum:.1e}");
    assert!(worst < 1e-3, "{worst:e} of the peak");
    assert!(worst_sum < 1e-3, "the sum is off by {worst_sum:e}");
}

fn row_kpa(table: &mut Pressures, d_mm: f64) -> [f64; COLUMNS] {
    let between = table.between(d_mm, 0.0);
    table.row_kpa(&(), &between, 4)
}

#[test]
fn the_order_of_asking_does_not_matter() {
    let depths: Vec<f64> = (1..200).map(|n| f64::from(n) * 0.01).collect();
    let mut forth = Pressures::new(Tip::default(), PITCH_MM, [0.1, 0.2]);
    let mut back = Pressures::new(Tip::default(), PITCH_MM, [0.1, 0.2]);
    let up: Vec<_> = depths.iter().map(|d| row_kpa(&mut forth, *d)).collect();
    let mut down: Vec<_> = depths.iter().rev().map(|d| row_kpa(&mut back, *d)).collect();
    down.reverse();
    assert_eq!(up, down);
}
