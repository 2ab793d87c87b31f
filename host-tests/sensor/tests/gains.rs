//! Gains by presses under a load cell: arrays that are made, so the truth is known.

use sensor::gains::{Found, fit};
use sensor::presses::Presses;
use std::f64::consts::PI;
use std::fmt::Write as _;

const SIDE: usize = 10;
const PITCH_MM: f64 = 1.5;
const RADIUS_MM: f64 = 10.0;
const MODULUS_KPA: f64 = 250.0;
const CODES_PER_KPA: f64 = 24.0;

struct Made {
    /// What each taxel conducts too much or too little, relative.
    spread: f64,
    noise_codes: f64,
    noise_n: f64,
    presses: usize,
    seed: u64,
}

impl Default for Made {
    fn default() -> Self {
        Self { spread: 0.15, noise_codes: 2.0, noise_n: 0.005, presses: 24, seed: 1 }
    }
}

fn normal(random: &mut fastrand::Rng) -> f64 {
    (-2.0 * (1.0 - random.f64()).ln()).sqrt() * (2.0 * PI * random.f64()).cos()
}

/// The mean of the paper's pressure over a taxel, kPa: the tip of radius a pressed by d.
fn kpa(d_mm: f64, place: [f64; 2]) -> f64 {
    let point = |x: f64, y: f64| {
        let rho = (place[0] + x).hypot(place[1] + y) / RADIUS_MM;
        let l = (1.0 - rho * rho).max(0.04).sqrt();
        (1.0 - (1.0 - d_mm / RADIUS_MM) / l).max(0.0)
    };
    let steps = 5;
    let at = |step: usize| PITCH_MM * ((step as f64 + 0.5) / f64::from(steps as u32) - 0.5);
    let sum: f64 = (0..steps).flat_map(|x| (0..steps).map(move |y| point(at(x), at(y)))).sum();
    MODULUS_KPA * sum / (steps * steps) as f64
}

impl Made {
    /// What each taxel's reading is to be multiplied by; of one array, whatever is pressed.
    fn gains(&self) -> Vec<f64> {
        let mut random = fastrand::Rng::with_seed(77);
        (0..SIDE * SIDE).map(|_| 1.0 / (1.0 + self.spread * normal(&mut random)).clamp(0.6, 1.6)).collect()
    }

    fn text(&self) -> String {
        let mut random = fastrand::Rng::with_seed(self.seed);
        let gains = self.gains();
        let names = (0..SIDE).flat_map(|row| (0..SIDE).map(move |column| format!("r{row}c{column}")));
        let mut text = format!("press,force_N,{}\n", names.collect::<Vec<_>>().join(","));
        for press in 0..self.presses {
            let centre = [5.0 * (random.f64() - 0.5), 5.0 * (random.f64() - 0.5)];
            for step in 0..20 {
                let d_mm = f64::from(step) * 0.1;
                let (mut force_n, mut codes) = (0.0, String::new());
                for (at, gain) in gains.iter().enumerate() {
                    let middle = |at: usize| (at as f64 - 4.5) * PITCH_MM;
                    let kpa = kpa(d_mm, [middle(at % SIDE) - centre[0], middle(at / SIDE) - centre[1]]);
                    force_n += kpa * PITCH_MM * PITCH_MM * 1e-3;
                    let code = 40.0 + CODES_PER_KPA * kpa / gain + self.noise_codes * normal(&mut random);
                    let _ = write!(codes, ",{:.0}", code.clamp(0.0, 4_095.0));
                }
                let shown = if step == 0 { 0.0 } else { (force_n + self.noise_n * normal(&mut random)).max(0.01) };
                let _ = writeln!(text, "{press},{shown:.4}{codes}");
            }
        }
        text
    }

    fn presses(&self) -> Presses {
        Presses::parse("made.csv", self.text().as_bytes()).unwrap_or_else(|refusal| panic!("{refusal}"))
    }
}

/// Root mean square of the known gains' error, their mean taken off.
fn off(found: &Found, truth: &[f64]) -> f64 {
    let known: Vec<f64> = (found.gains.iter().zip(truth).zip(&found.relative_sigmas))
        .filter_map(|((gain, truth), sigma)| sigma.map(|_| gain / truth))
        .collect();
    let mean = known.iter().sum::<f64>() / known.len() as f64;
    (known.iter().map(|ratio| (ratio / mean - 1.0).powi(2)).sum::<f64>() / known.len() as f64).sqrt()
}

#[test]
fn gains_are_found_and_help_on_presses_that_were_not_fitted_to() {
    for spread in [0.05, 0.1, 0.2] {
        let made = Made { spread, ..Made::default() };
        let found = fit(&made.presses(), Some(&Made { seed: 2, presses: 8, ..made }.presses())).unwrap();
        let judged = found.judged.as_ref().unwrap();
        let off = off(&found, &made.gains());
        let known = found.relative_sigmas.iter().flatten().count();
        println!("{spread}: {known} known, rms {off:.4}\n{found}");
        assert!(found.supported && (40..=100).contains(&known));
        // The force is the sum of some forty taxels: it tells little of one, and little is what one does to it.
        assert!(off < 0.9 * spread, "{off}");
        assert!(judged.with_percent < 0.75 * judged.without_percent, "{judged:?}");
        assert!((found.codes_per_kpa_milli as f64 / 24_000.0 - 1.0).abs() < 0.05, "{}", found.codes_per_kpa_milli);
    }
}

#[test]
fn an_array_without_spread_or_a_recording_that_tells_nothing_gets_no_gains() {
    for made in [Made { spread: 0.0, ..Made::default() }, Made { noise_n: 0.5, ..Made::default() }] {
        let found = fit(&made.presses(), None).unwrap();
        assert!(!found.supported, "{found}");
        assert!(found.gains.iter().all(|gain| (gain - 1.0).abs() < 1e-12));
        assert!(found.relative_sigmas.iter().all(Option::is_none));
    }
}

#[test]
fn what_is_said_of_the_uncertainty_is_true() {
    let made = Made::default();
    let found = fit(&made.presses(), None).unwrap();
    let truth = made.gains();
    let ratios: Vec<(f64, f64)> = (found.gains.iter().zip(&truth).zip(&found.relative_sigmas))
        .filter_map(|((gain, truth), sigma)| sigma.map(|sigma| (gain / truth - 1.0, sigma)))
        .collect();
    let mean = ratios.iter().map(|(off, _)| off).sum::<f64>() / ratios.len() as f64;
    let within = ratios.iter().filter(|(off, sigma)| (off - mean).abs() < 2.0 * sigma).count();
    let share = within as f64 / ratios.len() as f64;
    assert!((0.8..=1.0).contains(&share), "{share}");
}

#[test]
fn parameters_are_written_as_they_are_restored() {
    let found = fit(&Made { presses: 6, ..Made::default() }.presses(), None).unwrap();
    let text = found.parameters();
    assert_eq!(text.lines().filter(|line| line.starts_with("row_")).count(), SIDE, "{text}");
    assert!(text.contains("\ncodes_per_kpa_milli = "), "{text}");
}

/// Presses, with so many rows free of contact at the beginning.
fn few(presses: usize, free: usize) -> String {
    let text = Made { presses, ..Made::default() }.text();
    let (header, rows) = text.split_once('\n').expect("rows");
    let (without, with): (Vec<&str>, Vec<&str>) = rows.lines().partition(|row| row.contains(",0.0000,"));
    let free = without.iter().cycle().take(free);
    std::iter::once(&header).chain(free).chain(&with).fold(String::new(), |text, line| text + line + "\n")
}

#[test]
fn what_cannot_be_used_is_refused_with_its_line_and_what_to_do() {
    let text = Made { presses: 4, ..Made::default() }.text();
    let (header, _) = text.split_once('\n').unwrap();
    let cases = [
        (text.replacen("force_N", "newtons", 1), "line 1: the header lacks force_N"),
        (text.replacen("r0c1,", "r0c0,", 1), "r0c0 stands here twice"),
        (text.replacen("r4c4", "other", 1), "lacks r4c4"),
        (format!("{header}\n"), "no rows"),
        (text.replacen(",40,", ",5000,", 1), "0 to 4095"),
        (text.replacen(",40,", ",nan,", 1), "nan"),
        (text.replacen("1,0.", "1,-9.", 1), "zero the load cell"),
        (few(2, 3), "three at different places"),
        (few(1, 3), "30 are needed"),
        (few(4, 2), "rows without a force"),
    ];
    for (text, why) in cases {
        let refusal = Presses::parse("made.csv", text.as_bytes()).expect_err(why);
        assert!(refusal.0.contains(why), "{refusal} for {why}");
    }
    // Forces that have nothing to do with the codes.
    let turned: String = text.lines().enumerate().fold(String::new(), |all, (at, line)| {
        let mut fields: Vec<String> = line.split(',').map(str::to_owned).collect();
        if at > 0 && fields[1] != "0.0000" {
            fields[1] = format!("{:.4}", 3.0 / (0.05 + fields[1].parse::<f64>().unwrap()));
        }
        all + &fields.join(",") + "\n"
    });
    let other = Presses::parse("made.csv", turned.as_bytes()).unwrap();
    let found = fit(&other, None);
    assert!(found.as_ref().is_err() || found.as_ref().is_ok_and(|found| found.with_percent > 10.0), "{found:?}");
}
