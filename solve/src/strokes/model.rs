//! The motion of a stroke, for given parameters.

use super::Record;
use super::fit::Own;
use core::ops::RangeInclusive;

/// Forms in which friction may fall from its value at standstill: the share that is left at a speed, as a share r of the
/// Stribeck speed. The first is after Hess and Soom, J. Tribology 112 (1990).
pub const FORMS: [fn(f64) -> f64; 3] = [|r| 1.0 / (1.0 + r * r), |r| (-r * r).exp(), |r| (-r).exp()];

/// Dependence of friction on speed in a fit.
#[derive(Clone, Copy, Debug)]
pub struct Law {
    /// One of the [`FORMS`].
    pub share: fn(f64) -> f64,
    /// Speed of the slowest stroke, rad/s.
    pub slowest: f64,
}

impl Law {
    /// V_s, what friction at standstill has beyond that at high speed. The slowest strokes fix friction at their own
    /// speed far better than V_s and w_s, so its excess there is the parameter; `SHARE` keeps V_s finite.
    fn standstill_v(self, p: &Parameters, side: usize) -> f64 {
        p[index::STRIBECK + side] / ((self.share)(self.slowest * (-p[index::SPEED]).exp()) + SHARE)
    }
}

/// Indices of the parameters. The first [`FITTED`] are fitted; the others are 0 in the fit, and only tell how far
/// the result depends on the model.
pub mod index {
    /// ln k, k in V s/rad.
    pub const K: usize = 0;
    /// ln a, a = R J / k in V s^2/rad.
    pub const A: usize = 1;
    /// ln of the friction voltage at high speed, forward; the next index is backward.
    pub const COULOMB: usize = 2;
    /// Additional friction voltage at the speed of the slowest stroke, V, forward; the next index is backward.
    pub const STRIBECK: usize = 4;
    /// ln of the Stribeck speed, rad/s.
    pub const SPEED: usize = 6;
    /// Half the relative difference between k forward and k back.
    pub const SIDES: usize = 7;
    /// Voltage of a force that grows with the square of the place, at the foremost place.
    pub const FRONT: usize = 8;
    /// Voltage of a force that grows with the place, at the foremost place.
    pub const SPRING: usize = 9;
}

pub const FITTED: usize = 7;
pub const ALL: usize = 10;
pub type Parameters = [f64; ALL];

/// Added to the share of friction that is left at the speed of the slowest stroke.
const SHARE: f64 = 0.05;
/// Longest step of the integration, s.
const STEP_S: f64 = 0.4e-3;
/// A stroke is fitted from the first sample at which it has gone this far, rad, and two counts: how it left
/// standstill is not part of the model.
const LEFT_RAD: f64 = 0.03;
const LEFT_COUNTS: f64 = 2.0;
/// Samples at rest that are part of the fit.
const RESTING: usize = 3;
/// Samples of a part at least, of a slow stroke and of a fast one.
const PART: [usize; 2] = [24, 96];
/// Samples over which a first estimate of a speed is taken.
pub const SPAN: usize = 8;
/// Blocks whose neighbours differ by less, V, have one voltage.
const SWITCH_V: f64 = 0.02;

/// A piece of time under one voltage.
#[derive(Clone, Copy, Debug)]
struct Step {
    length_s: f64,
    voltage_v: f64,
    /// A sample was taken at its end.
    sampled: bool,
}

/// A stroke made ready, or a part of a long one: angles and voltages along its own direction. Where friction falls
/// with speed faster than back-EMF rises, a small difference in speed grows; short parts keep it small.
#[derive(Clone, Debug)]
pub struct Path {
    /// 0 forward, 1 back.
    pub side: usize,
    /// The stroke's number in the record.
    pub stroke: usize,
    /// Angles at the samples, from the first fitted one, rad.
    pub angles: Vec<f64>,
    /// First estimate of the speed at the first fitted sample, rad/s.
    pub speed: f64,
    /// Largest voltage, and largest speed of the stroke.
    pub voltage_v: f64,
    pub fastest: f64,
    /// Place of the first fitted sample, and of the ends of all strokes, rad forward.
    place: f64,
    ends: [f64; 2],
    steps: Vec<Step>,
}

impl Path {
    /// The parts of a stroke to fit; `None` if it hardly moved. A stroke above `fast`, rad/s, has longer parts.
    pub fn parts(record: &Record, number: usize, ends: [f64; 2], fast: f64) -> Vec<Self> {
        let stroke = &record.strokes[number];
        let Some(forward) = stroke.forward() else { return Vec::new() };
        let sign = if forward { 1.0 } else { -1.0 };
        let rad = core::f64::consts::TAU / record.counts_per_turn;
        let samples = &stroke.samples;
        let along = |at: usize| sign * f64::from(samples[at].count - samples[0].count) * rad;
        let left = LEFT_RAD.max(LEFT_COUNTS * rad);
        let Some(first) = (0..samples.len()).find(|at| along(*at) >= left) else { return Vec::new() };
        let moved = (1..samples.len()).rfind(|at| samples[*at].count != samples[at - 1].count).unwrap_or(0);
        let last = (moved + RESTING).min(samples.len() - 1);
        if last < first + SPAN {
            return Vec::new();
        }
        let parts = ((last - first) / PART[usize::from(stroke.fastest(record) > fast)]).max(1);
        let edge = |part: usize| first + (last - first) * part / parts;
        let part = |part: usize| Self::new(record, number, sign, edge(part)..=edge(part + 1), ends);
        (0..parts).map(part).collect()
    }

    /// The samples of a stroke in a range.
    fn new(record: &Record, stroke: usize, sign: f64, range: RangeInclusive<usize>, ends: [f64; 2]) -> Self {
        let samples = &record.strokes[stroke].samples;
        let rad = core::f64::consts::TAU / record.counts_per_turn;
        let (first, last) = (*range.start(), *range.end());
        let voltage = |at: usize| sign * samples[at.min(samples.len() - 1)].voltage_v;
        // Each block holds until `delay_s` after its sample. A block in which the voltage switched has a mean
        // between its neighbours' voltages: the earlier one held for the first part.
        let pieces = (first + 1..=last).flat_map(|at| {
            let (before, mean, after) = (voltage(at - 1), voltage(at), voltage(at + 1));
            let switched = (before - after).abs() > SWITCH_V && (mean - before) * (mean - after) < 0.0;
            let (earlier, share) = if switched { (before, (mean - after) / (before - after)) } else { (mean, 1.0) };
            [(share * record.sample_s, earlier), ((1.0 - share) * record.sample_s, after)]
        });
        let mut pieces = core::iter::once((record.delay_s, voltage(first))).chain(pieces);
        let (mut left_s, mut voltage_v) = (0.0, 0.0);
        let mut steps = Vec::new();
        for _ in first..last {
            let mut rest_s = record.sample_s;
            while rest_s > 1e-9 {
                while left_s <= 1e-9 {
                    (left_s, voltage_v) = pieces.next().unwrap_or((f64::INFINITY, voltage_v));
                }
                let length_s = left_s.min(rest_s).min(STEP_S);
                rest_s -= length_s;
                left_s -= length_s;
                steps.push(Step { length_s, voltage_v, sampled: rest_s <= 1e-9 });
            }
        }
        let gone = |from: usize, to: usize| sign * f64::from(samples[to].count - samples[from].count) * rad;
        let angles: Vec<f64> = range.map(|at| gone(first, at)).collect();
        Self {
            side: usize::from(sign < 0.0),
            stroke,
            speed: angles[SPAN] / (SPAN as f64 * record.sample_s),
            voltage_v: (first..=last).map(voltage).fold(0.0, f64::max),
            fastest: record.strokes[stroke].fastest(record),
            place: f64::from(samples[first].count) * rad,
            ends,
            angles,
            steps,
        }
    }

    /// Angles at the samples, from the first one.
    ///
    /// ```text
    /// a w' = V - k w - V_f(w)      V_f = V_c + V_s share(w / w_s)
    /// ```
    ///
    /// Within a step V_f is that at the step's middle, so that w goes exponentially; where w reaches 0 the shaft
    /// stays.
    pub fn angles(&self, p: &Parameters, law: Law, own: &Own, angles: &mut Vec<f64>) {
        let sign = if self.side == 0 { 1.0 } else { -1.0 };
        let k = p[index::K].exp() * (1.0 + sign * p[index::SIDES]);
        let tau = p[index::A].exp() / k;
        let coulomb = p[index::COULOMB + self.side].exp() + own[2];
        let stribeck = law.standstill_v(p, self.side);
        let slowness = (-p[index::SPEED]).exp();
        let placed = p[index::FRONT] != 0.0 || p[index::SPRING] != 0.0;
        let (mut x, mut w) = (own[0], own[1]);
        // Most steps are as long as the step before.
        let (mut length_s, mut half) = (0.0, 1.0);
        angles.clear();
        angles.push(x);
        for step in &self.steps {
            let mut drive = step.voltage_v - coulomb;
            if placed {
                drive -= sign * self.force_v(p, self.place + sign * x);
            }
            let end = |w: f64| (drive - stribeck * (law.share)(w.max(0.0) * slowness)) / k;
            if w > 0.0 || end(0.0) > 0.0 {
                if step.length_s != length_s {
                    length_s = step.length_s;
                    half = (-0.5 * length_s / tau).exp();
                }
                let towards = end(w);
                let towards = end(towards + (w - towards) * half);
                let next = towards + (w - towards) * half * half;
                if next > 0.0 {
                    x += towards * step.length_s + (w - towards) * tau * (1.0 - half * half);
                    w = next;
                } else {
                    let rest_s = tau * ((w - towards) / -towards).max(1.0).ln();
                    x += towards * rest_s + w * tau;
                    w = 0.0;
                }
            }
            if step.sampled {
                angles.push(x);
            }
        }
    }

    /// Voltage of the forces that depend on the place.
    fn force_v(&self, p: &Parameters, place: f64) -> f64 {
        let [back, front] = self.ends;
        let share = (2.0 * place - front - back) / (front - back);
        p[index::SPRING] * share + p[index::FRONT] * share.max(0.0).powi(2)
    }
}
