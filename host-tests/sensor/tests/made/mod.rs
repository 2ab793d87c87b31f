//! Recordings that are made: the truth is known.
#![allow(dead_code, reason = "each test takes its part of it")]

use std::fmt::Write as _;

/// Cycles of pressing to about 25 N.
#[derive(Clone, Copy)]
pub struct Pressed {
    /// a, N/mS.
    pub line: f64,
    /// c, 1/mS.
    pub growth: f64,
    /// b of a resistance that stays, 1/mS.
    pub series: f64,
    /// Standard deviation of the force, N.
    pub noise: f64,
    /// The converter's end, mS.
    pub end: Option<f64>,
    pub seed: u64,
}

impl Default for Pressed {
    fn default() -> Self {
        Self { line: 40.0, growth: 0.0, series: 0.0, noise: 0.1, end: None, seed: 1 }
    }
}

impl Pressed {
    pub fn text(&self) -> String {
        format!("set,sample,force_N,conductance_mS\n{}", self.rows("a"))
    }

    pub fn rows(&self, set: &str) -> String {
        let mut random = fastrand::Rng::with_seed(self.seed);
        let mut text = String::new();
        for sample in 0..200 {
            let phase = f64::from(sample) / 40.0;
            let conductance = 0.3 * (1.0 - (2.0 * (phase - phase.floor()) - 1.0).abs());
            let force = self.line * conductance * (1.0 + self.growth * conductance) / (1.0 - self.series * conductance);
            let force = force + self.noise * normal(&mut random);
            let shown = self.end.map_or(conductance, |end| conductance.min(end - 0.0002 * random.f64()));
            let _ = writeln!(text, "{set},{sample},{force:.4},{shown:.6}");
        }
        text
    }
}

/// Twelve weights held for 15 s.
#[derive(Clone, Copy)]
pub struct Creeping {
    pub rate: f64,
    pub time_constant_s: f64,
    /// Standard deviation of the rate from hold to hold, as a share.
    pub spread: f64,
    pub seed: u64,
}

impl Creeping {
    pub fn text(&self, runs: &[&str]) -> String {
        let mut random = fastrand::Rng::with_seed(self.seed);
        let mut text = String::from("run,weight_kg,t_s,conductance_mS\n");
        for run in runs {
            for weight in 0..=12 {
                let rate = self.rate * (1.0 + self.spread * normal(&mut random));
                for at in 0..75 {
                    let t = 0.1 + 0.2 * f64::from(at);
                    let grown = 1.0 + rate * (1.0 - (-t / self.time_constant_s).exp());
                    let conductance = (1.0 + 10.0 * f64::from(weight)) * grown * (1.0 + 0.002 * normal(&mut random));
                    let _ = writeln!(text, "{run},{weight},{t:.3},{conductance:.5}");
                }
            }
        }
        text
    }
}

/// Of a standard deviation of 1, nearly normal.
fn normal(random: &mut fastrand::Rng) -> f64 {
    (0..12).map(|_| random.f64()).sum::<f64>() - 6.0
}
