//! The paper's figures 7, 10 and 11, drawn from the fixed-point core.
//!
//! Forces and pressures are the core's. What the array sees is the core's pressure averaged over each taxel of an ideal
//! 10 x 10 array: simulated, as are the readings of figure 11, to which noise is added. Nothing here was measured.

use crate::prove::random::reference_tip;
use fastrand::Rng;
use fingertip::model::Tip;
use fingertip::shipped::{COLUMNS, ROWS};
use fingertip::units::{Kilopascals, Millimetres, Newtons};
use output::plot::{Curve, Curves, Map, PlotError, Pressures, curves, maps};

/// Distance from taxel to taxel: the largest contact shown, 14.3 mm across, fits the array.
pub const PITCH_MM: f64 = 1.5;
/// Indentations of the paper's figures 7 and 10.
const DEPTHS_MM: [i32; 3] = [1, 2, 3];
/// Samples of a taxel's side for its mean.
const SAMPLES: u32 = 16;
/// Points of a curve.
const POINTS: i32 = 400;
/// Readings of figure 11, evenly spread up to its deepest indentation.
const READINGS: i32 = 24;
const DEEPEST_MM: f64 = 3.0;
/// Noise of a taxel in figure 11, as a share of its pressure.
const NOISE: f64 = 0.1;
const SEED: u64 = 2003;

/// Pressure over the distance from the contact's centre, and what the array's row beside the centre sees of it.
pub fn figure_7() -> Result<String, PlotError> {
    let tip = &reference_tip();
    let panels = DEPTHS_MM.map(|d_mm| {
        let d = Millimetres::from_bits(d_mm << 24);
        let half_mm = 0.5 * PITCH_MM * COLUMNS as f64;
        let place = |n: i32| half_mm * f64::from(2 * n - POINTS) / f64::from(POINTS);
        let smooth = (0..=POINTS).map(|n| (place(n), kpa(tip.pressure(mm(place(n)), d)))).collect();
        let row = seen(tip, d)[ROWS / 2];
        let side = |column: usize| column as f64 * PITCH_MM - half_mm;
        let steps = row.iter().enumerate().flat_map(|(column, kpa)| [(side(column), *kpa), (side(column + 1), *kpa)]);
        let title = format!("d = {d_mm} mm: model, array (dashed)");
        Curves {
            title,
            x: "distance from the centre, mm",
            y: "pressure p, kPa",
            x_range: [-half_mm, half_mm],
            y_range: [0.0, 80.0],
            curves: vec![Curve::Dashed(steps.collect()), Curve::Solid(smooth)],
        }
    });
    curves(&panels, (300, 260))
}

/// Tactile image, with the contact's circle dotted.
pub fn figure_10() -> Result<String, PlotError> {
    let tip = &reference_tip();
    let pictures = DEPTHS_MM.map(|d_mm| {
        let d = Millimetres::from_bits(d_mm << 24);
        Map {
            title: format!("d = {d_mm} mm"),
            pressures_kpa: seen(tip, d),
            centre_mm: [0.0; 2],
            radius_mm: tip.contact_radius(d).0.to_num(),
        }
    });
    maps(&pictures, PITCH_MM)
}

/// Force over indentation: the model, and readings of the noisy array with the modulus that fits them.
pub fn figure_11() -> Result<String, PlotError> {
    let tip = &reference_tip();
    let readings = readings(tip);
    let Modulus { kpa, sigma_kpa } = fit(tip, &readings);
    let fitted = format!("Y = {kpa:.1} kPa, standard uncertainty {sigma_kpa:.1} kPa, by these readings");
    let depth = |n: i32| 1.05 * DEEPEST_MM * f64::from(n) / f64::from(POINTS);
    let theory = (0..=POINTS).map(|n| (depth(n), tip.force(mm(depth(n))).0.to_num())).collect();
    let points = readings.iter().map(|(d, force)| (d.0.to_num(), force.0.to_num())).collect();
    let panel = Curves {
        title: format!("Model for Y = 250 kPa (line), simulated readings (circles): {fitted}"),
        x: "indentation d, mm",
        y: "force F, N",
        x_range: [0.0, depth(POINTS)],
        y_range: [0.0, 8.0],
        curves: vec![Curve::Solid(theory), Curve::Circles(points)],
    };
    curves(&[panel], (900, 420))
}

/// The mean of the core's pressure on each taxel, the contact centred on the array.
pub fn seen(tip: &Tip, d: Millimetres) -> Pressures {
    let mean = |row: usize, column: usize| {
        let place = |taxel: usize, n: u32| {
            (taxel as f64 - 0.5 * COLUMNS as f64 + (f64::from(n) + 0.5) / f64::from(SAMPLES)) * PITCH_MM
        };
        let sample = |n: u32| {
            let (x, y) = (place(column, n % SAMPLES), place(row, n / SAMPLES));
            kpa(tip.pressure(mm((x * x + y * y).sqrt()), d))
        };
        (0..SAMPLES * SAMPLES).map(sample).sum::<f64>() / f64::from(SAMPLES * SAMPLES)
    };
    core::array::from_fn(|row| core::array::from_fn(|column| mean(row, column)))
}

/// Indentations, and the sums of what the taxels read at them.
pub fn readings(tip: &Tip) -> Vec<(Millimetres, Newtons)> {
    let mut rng = Rng::with_seed(SEED);
    // Nearly normal, and the same bits on every machine.
    let mut normal = || (0..12).map(|_| rng.f64()).sum::<f64>() - 6.0;
    let mut read = |n: i32| {
        let d = mm(DEEPEST_MM * f64::from(n) / f64::from(READINGS));
        let sum_kpa: f64 = seen(tip, d).iter().flatten().map(|kpa| kpa * (1.0 + NOISE * normal())).sum();
        (d, Newtons::from_bits((sum_kpa * PITCH_MM * PITCH_MM * 1e-3 * 65_536.0).round() as i32))
    };
    (1..=READINGS).map(&mut read).collect()
}

pub struct Modulus {
    pub kpa: f64,
    /// Standard uncertainty of the modulus.
    pub sigma_kpa: f64,
}

/// Least squares of the model's force, which is proportional to the modulus. `tip` has a modulus of 250 kPa.
pub fn fit(tip: &Tip, readings: &[(Millimetres, Newtons)]) -> Modulus {
    let [mut squares, mut products, mut read] = [0.0; 3];
    for (d, force) in readings {
        let (per_kpa, force) = (tip.force(*d).0.to_num::<f64>() / 250.0, force.0.to_num::<f64>());
        squares += per_kpa * per_kpa;
        products += per_kpa * force;
        read += force * force;
    }
    let kpa = products / squares;
    let variance = (read - kpa * products) / (readings.len() as f64 - 1.0);
    Modulus { kpa, sigma_kpa: (variance / squares).sqrt() }
}

fn mm(value: f64) -> Millimetres {
    Millimetres::from_bits((value * f64::from(1 << 24)).round() as i32)
}

fn kpa(pressure: Kilopascals) -> f64 {
    pressure.0.to_num()
}
