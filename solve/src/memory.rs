//! Model of the force that an array reads in a press: elastic force, relaxation of the tip, and the ink's hysteresis
//! and creep.
//!
//! In the order in which they act:
//!
//! - elastic: `F_e = pi Y d^2` (Park, Kim and Hirai 2003, eq. 14);
//! - relaxation, quasi-linear with one term (Fung, Biomechanics, 1993, 7.6): `F = F_e - s q`, `tau dq/dt = F_e - q`;
//! - hysteresis, the play operator with a width in proportion to the pressure (Brokate and Sprekels, Hysteresis and Phase
//!   Transitions, 1996, 2.1): `y = clamp(y, p (1 - h/2), p (1 + h/2))` on each taxel. Where all pressures grow the reading is
//!   low by h/2, where all fall it is high by h/2; in between it holds. So the mean of both ways is free of it, but only far
//!   from the turning point: hence the operator itself, not the mean, is fitted;
//! - creep, linear in the logarithm of time (Interlink FSR 400 integration guide: under 5 % a decade), as a series with a
//!   term for each decade: `y' = y + c sum of x_k`, `tau_k dx_k/dt = y - x_k`.

use crate::press::{Press, Step};
use std::f64::consts::PI;

/// Time constants of the creep, s. `codes_per_kpa` refers to the reading within the first millisecond.
const CREEP_S: [f64; 7] = [1e-3, 1e-2, 1e-1, 1.0, 1e1, 1e2, 1e3];
/// Rings of equal area, counted over the largest contact: the play acts on each.
const RINGS: usize = 16;
/// Distance before the contact at which a press begins, mm.
const AIR_MM: f64 = 0.2;

#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Memory {
    /// Width h of the hysteresis, as a share of the pressure.
    pub hysteresis: f64,
    /// Creep c, as a share of the pressure for each decade of time.
    pub creep: f64,
    /// Share s of the force that the tip forgets in the end.
    pub relaxation: f64,
    pub relaxation_s: f64,
}

/// Travel over time: three places for each step of a press, and the approach before the first.
#[derive(Clone, Debug)]
pub struct Motion {
    /// Time, s, and travel, mm.
    places: Vec<[f64; 2]>,
    /// Places before the first step's.
    lead: usize,
    /// Coefficients of the creep's terms for the time before each place.
    creep: Vec<[Coefficients; CREEP_S.len()]>,
}

impl Motion {
    /// Motion of a press that touches at a travel. A press that was recorded from the contact on is taken to have come
    /// there at the speed with which it goes on.
    pub fn new(press: &Press, touch_mm: f64) -> Self {
        let mut places = Vec::new();
        if let [first, .., last] = press.steps.as_slice() {
            let next = press.steps.iter().find(|step| step.travel_mm[1] > first.travel_mm[0] + 0.02).unwrap_or(last);
            let way_mm = next.travel_mm[1] - first.travel_mm[0];
            let mm_per_s = (way_mm / (next.time_s[1] - first.time_s[0]).max(1e-6)).max(0.1);
            let before_mm = (first.travel_mm[0] - touch_mm + AIR_MM).max(0.01);
            places.push([first.time_s[0] - before_mm / mm_per_s, first.travel_mm[0] - before_mm]);
            places.push([first.time_s[0] - 0.5 * before_mm / mm_per_s, first.travel_mm[0] - 0.5 * before_mm]);
        }
        let lead = places.len();
        for step in &press.steps {
            places.extend([
                [step.time_s[0], step.travel_mm[0]],
                [step.middle_s(), step.middle_mm()],
                [step.time_s[1], step.travel_mm[1]],
            ]);
        }
        let before = places.iter().take(1).chain(&places);
        let coefficients = |([time_s, _], [before_s, _]): (&[f64; 2], &[f64; 2])| {
            CREEP_S.map(|tau_s| Coefficients::new(time_s - before_s, tau_s))
        };
        let creep = places.iter().zip(before).map(coefficients).collect();
        Self { places, lead, creep }
    }

    /// Mean force of each step by the model, N: modulus in kPa, radius and touch in mm.
    pub fn forces(&self, modulus_kpa: f64, radius_mm: f64, touch_mm: f64, memory: &Memory) -> Vec<f64> {
        let n_per_mm2 = 1e-3 * PI * modulus_kpa;
        let depth = |travel_mm: f64| ((travel_mm - touch_mm) / radius_mm).clamp(0.0, 0.95);
        let deepest = self.places.iter().map(|[_, x]| depth(*x)).fold(0.0, f64::max);
        let rim2 = deepest * (2.0 - deepest);
        let per_length: [f64; RINGS] =
            core::array::from_fn(|ring| (1.0 - rim2 * (ring as f64 + 0.5) / RINGS as f64).sqrt().recip());
        let mut held = [0.0_f64; RINGS];
        let mut relaxed = LowPass::default();
        let mut crept = [LowPass::default(); CREEP_S.len()];
        let mut before_s = self.places.first().map_or(0.0, |[time_s, _]| *time_s);
        let mut forces = Vec::with_capacity(self.places.len());
        for ([time_s, travel_mm], creep) in self.places.iter().zip(&self.creep) {
            let step_s = time_s - before_s;
            before_s = *time_s;
            let d = depth(*travel_mm);
            let elastic = d * d;
            let forgotten = memory.relaxation * relaxed.take(elastic, &Coefficients::new(step_s, memory.relaxation_s));
            let left = if elastic > 0.0 { (1.0 - forgotten / elastic).max(0.0) } else { 0.0 };
            // Rings' shares of the force sum to d^2 to 1 %; scaling by it keeps eq. 14 exact.
            let (mut sum, mut plain) = (0.0, 0.0);
            for (held, per_length) in held.iter_mut().zip(per_length) {
                let elastic = (1.0 - (1.0 - d) * per_length).max(0.0);
                let pressure = elastic * left;
                let half = 0.5 * memory.hysteresis;
                *held = held.max(pressure * (1.0 - half)).min(pressure * (1.0 + half));
                sum += *held;
                plain += elastic;
            }
            let force = if plain > 0.0 { sum / plain * elastic } else { 0.0 };
            let creep: f64 = crept.iter_mut().zip(creep).map(|(term, by)| term.take(force, by)).sum();
            forces.push(n_per_mm2 * radius_mm * radius_mm * (force + memory.creep * creep));
        }
        forces[self.lead..].chunks_exact(3).map(|at| (at[0] + 4.0 * at[1] + at[2]) / 6.0).collect()
    }
}

/// The press without creep: each taxel's readings as they were without a creep of this share a decade.
///
/// Under the rim a taxel is pressed later than in the middle, so it has crept less: left in, that bends the tactile image by
/// 1 to 3 %, which looks like a plate that yields. The inverse of the creep's series is exact where a reading is straight
/// in time between the middles of steps.
pub fn without_creep(press: &Press, creep: f64) -> Press {
    let mut press = press.clone();
    let mut before_s = f64::INFINITY;
    let coefficients = |step: &Step| {
        let step_s = (step.middle_s() - before_s).max(0.0);
        before_s = step.middle_s();
        CREEP_S.map(|tau_s| Coefficients::new(step_s, tau_s))
    };
    let all: Vec<_> = press.steps.iter().map(coefficients).collect();
    for taxel in 0..press.array.taxels() {
        let mut crept = [LowPass::default(); CREEP_S.len()];
        for (step, all) in press.steps.iter_mut().zip(&all) {
            let reading = &mut step.taxels[taxel].mean;
            // Each term is a line in the reading of now.
            let (mut rest, mut slope) = (0.0, 0.0);
            for (term, by) in crept.iter().zip(all) {
                (rest, slope) = (rest + term.rest(by), slope + by.straight);
            }
            let pressed = (*reading - creep * rest) / (1.0 + creep * slope);
            crept.iter_mut().zip(all).for_each(|(term, by)| {
                term.take(pressed, by);
            });
            *reading = pressed;
        }
    }
    press
}

/// First-order low-pass, exact for an input that is straight between samples (`docs/model.md`, viscoelasticity).
#[derive(Clone, Copy, Default)]
struct LowPass {
    output: f64,
    input: f64,
}

/// Coefficients of a low-pass for a step, independent of its input.
#[derive(Clone, Copy, Debug)]
struct Coefficients {
    /// Share of the distance to a constant input that a step covers.
    gone: f64,
    /// Share of the input at the end of the step.
    straight: f64,
}

impl Coefficients {
    fn new(step_s: f64, tau_s: f64) -> Self {
        if step_s <= 0.0 {
            return Self { gone: 0.0, straight: 0.0 };
        }
        let gone = -(-step_s / tau_s).exp_m1();
        Self { gone, straight: 1.0 - gone * tau_s / step_s }
    }
}

impl LowPass {
    fn take(&mut self, input: f64, by: &Coefficients) -> f64 {
        self.output = self.rest(by) + by.straight * input;
        self.input = input;
        self.output
    }

    /// The output after a step that ends with an input of 0.
    fn rest(&self, by: &Coefficients) -> f64 {
        self.output + by.gone * (self.input - self.output) - by.straight * self.input
    }
}
