//! The joint fit of poses, stiffnesses and gains: Gauss and Newton's equations, damped after Levenberg and Marquardt.
//!
//! Each residual meets one pose, one stiffness and one gain, so the normal equations are summed row by row: some hundred
//! unknowns and ten thousand residuals for three presses.

use crate::gains::{Condition, Gain, Gains, NoGains, Posed, judge, shifts};
use crate::model::{At, Pose, Share, Square, UNKNOWNS};
use crate::press::{Array, Press, Step, first_pose, forces};
use crate::robust::{HUBER, huber, huber_cost, median, spread};
use nalgebra::{DMatrix, DVector};

/// Usual deviation of a gain from 1: arrays differ by 5 to 32 % (Tekscan). It only matters for taxels that hardly read.
const GAIN_USUAL: f64 = 0.25;
/// Usual tangent of a tilt, 3 degrees, and usual roundness, 3 %.
const TILT_USUAL: f64 = 0.05;
const ROUNDNESS_USUAL: f64 = 0.03;
/// Error of the model in a reading: as a share of the reading, and of the highest one of the step.
const MODEL_PART: f64 = 0.005;
const PEAK_PART: f64 = 0.003;
/// Steps below this share of the largest sum are left out: they are mostly rim and noise.
const LEAST_SUM: f64 = 0.02;
/// Rounds of the fit at most; the change of the poses, in radii, at which it ends before, and at which it failed after.
const ROUNDS: usize = 50;
const CLOSE: f64 = 1e-5;
const APART: f64 = 2e-2;
/// A gain below this is a dead taxel.
const DEAD: f64 = 0.25;
/// A taxel is odd where its residuals are this many of their standard deviations and this share of its highest reading.
const ODD_SIGMAS: f64 = 4.0;
const ODD_PART: f64 = 0.02;
/// Least uncertainty of a gain, however well it repeats.
const FLOOR: f64 = 0.003;
/// Usual yield of a plate and its table, mm/N, where they may yield.
pub const YIELD_USUAL: f64 = 0.02;
/// A taxel counts as reached where the model brings it to this share of the highest pressure of a press.
const REACHED: f64 = 1.0 / 24.0;

struct Used<'a> {
    press: usize,
    step: &'a Step,
    at: At,
}

/// Poses and gains of presses on the same array.
///
/// A yield of the plate of this size, mm/N, is taken for usual; 0 is a rigid plate.
pub fn joint(presses: &[Press], yield_usual: f64) -> Result<Gains, NoGains> {
    let array = presses.first().ok_or(NoGains::NoPress)?.array;
    let mut used = Vec::new();
    for (index, press) in presses.iter().enumerate() {
        let largest = press.steps.iter().map(Step::sum).fold(0.0, f64::max);
        let steps: Vec<_> = press.inward().filter(|step| step.sum() > LEAST_SUM * largest).collect();
        if steps.len() < 5 {
            return Err(NoGains::Steps(steps.len()));
        }
        used.extend(steps.into_iter().map(|step| Used { press: index, step, at: step.at(&array) }));
    }
    let mut fit = Joint::new(presses, &array, used, yield_usual.max(1e-6))?;
    let mut change = fit.settle()?;
    // The first pose is far off where the contact lies partly off the array: then sound taxels at its rim looked dead.
    if fit.revive() {
        change = fit.settle()?;
    }
    if change > APART {
        return Err(NoGains::Unsettled(change));
    }
    fit.finish()
}

#[derive(Clone)]
struct Unknowns {
    poses: Vec<Pose>,
    /// Stiffness at each used step, kPa.
    stiffness: Vec<f64>,
    gains: Vec<f64>,
}

struct Joint<'a> {
    presses: &'a [Press],
    array: Array,
    used: Vec<Used<'a>>,
    now: Unknowns,
    /// Taxels that the chip counted as bad in most steps.
    bad: Vec<bool>,
    conditions: Vec<Condition>,
    /// Standard deviation of the residuals, relative to the expected one.
    scale: f64,
    damping: f64,
    yield_usual: f64,
}

/// A residual: its step and taxel, its value and standard deviation, and the model.
struct Residual {
    step: usize,
    taxel: usize,
    value: f64,
    sigma: f64,
    share: Share,
}

impl<'a> Joint<'a> {
    fn new(presses: &'a [Press], array: &Array, used: Vec<Used<'a>>, yield_usual: f64) -> Result<Self, NoGains> {
        let steps = || presses.iter().flat_map(|press| &press.steps);
        let bad = |taxel: usize| 2 * steps().filter(|step| step.taxels[taxel].bad).count() > steps().count();
        let bad: Vec<bool> = (0..array.taxels()).map(bad).collect();
        let conditions = bad.iter().map(|bad| if *bad { Condition::Dead } else { Condition::Sound }).collect();
        let poses = presses.iter().map(first_pose).collect();
        let now = Unknowns { poses, stiffness: vec![0.0; used.len()], gains: vec![1.0; array.taxels()] };
        let mut fit =
            Self { presses, array: *array, used, now, bad, conditions, scale: 1.0, damping: 1e-4, yield_usual };
        let pressed = fit.find_dead();
        if pressed < 8 {
            return Err(NoGains::Taxels(pressed));
        }
        Ok(fit)
    }

    /// Unknown of a press's pose, of a step's stiffness, of a taxel's gain: where each begins.
    fn places(&self) -> [usize; 3] {
        let poses = self.presses.len() * UNKNOWNS;
        [0, poses, poses + self.used.len()]
    }

    fn squares(&self) -> Vec<Vec<Square>> {
        let square = |index: usize, taxel| {
            Square::new(&self.now.poses[index], self.presses[index].radius_mm, &self.array, taxel)
        };
        (0..self.presses.len())
            .map(|index| (0..self.array.taxels()).map(|taxel| square(index, taxel)).collect())
            .collect()
    }

    /// Sets stiffnesses by the ratio of sums and counts as dead what reads next to nothing where others read; the number of
    /// sound taxels that are pressed.
    fn find_dead(&mut self) -> usize {
        let squares = self.squares();
        let mut sums = vec![[0.0; 2]; self.array.taxels()];
        for (used, stiffness) in self.used.iter().zip(&mut self.now.stiffness) {
            let shares: Vec<f64> = squares[used.press].iter().map(|square| square.share(&used.at)).collect();
            let ratios = shares.iter().zip(&used.step.taxels).filter(|(share, taxel)| **share > 0.005 && !taxel.bad);
            *stiffness = median(ratios.map(|(share, taxel)| taxel.mean / self.array.codes_per_kpa / share).collect());
            for (sums, (share, taxel)) in
                sums.iter_mut().zip(shares.iter().zip(&used.step.taxels)).filter(|(_, (_, taxel))| !taxel.bad)
            {
                sums[0] += taxel.mean / self.array.codes_per_kpa * share;
                sums[1] += *stiffness * share * share;
            }
        }
        let most = sums.iter().map(|[_, model]| *model).fold(0.0, f64::max);
        let mut pressed = 0;
        for ((condition, gain), [read, model]) in self.conditions.iter_mut().zip(&mut self.now.gains).zip(sums) {
            if *condition == Condition::Sound && model > REACHED * REACHED * most {
                *gain = (read / model).clamp(0.3, 3.0);
                pressed += 1;
                if read < DEAD * model {
                    *condition = Condition::Dead;
                    pressed -= 1;
                }
            }
        }
        pressed
    }

    /// Rounds until the poses rest; the last change of a pose, in tip radii.
    fn settle(&mut self) -> Result<f64, NoGains> {
        let (mut change, mut residuals) = (f64::INFINITY, self.residuals());
        for _ in 0..ROUNDS {
            if change < CLOSE {
                break;
            }
            (change, residuals) = self.step(residuals)?;
        }
        Ok(change)
    }

    /// Counts taxels as sound again that follow the fitted pose; true if there were any.
    fn revive(&mut self) -> bool {
        let squares = self.squares();
        let mut sums = vec![[0.0; 2]; self.array.taxels()];
        for (used, stiffness) in self.used.iter().zip(&self.now.stiffness) {
            for ((sums, square), reading) in sums.iter_mut().zip(&squares[used.press]).zip(&used.step.taxels) {
                let share = square.share(&used.at);
                sums[0] += reading.mean / self.array.codes_per_kpa * share;
                sums[1] += stiffness * share * share;
            }
        }
        let mut revived = false;
        for (taxel, [read, model]) in sums.into_iter().enumerate() {
            if self.conditions[taxel] == Condition::Dead && !self.bad[taxel] && read >= DEAD * model {
                self.conditions[taxel] = Condition::Sound;
                self.now.gains[taxel] = if model > 0.0 { (read / model).clamp(0.3, 3.0) } else { 1.0 };
                revived = true;
            }
        }
        revived
    }

    fn residuals(&self) -> Vec<Residual> {
        let squares = self.squares();
        let per_kpa = 1.0 / self.array.codes_per_kpa;
        let mut residuals = Vec::new();
        for (index, used) in self.used.iter().enumerate() {
            let highest = used.step.taxels.iter().map(|taxel| taxel.mean).fold(0.0, f64::max);
            let frames = f64::from(used.step.frames.max(1));
            for (taxel, reading) in used.step.taxels.iter().enumerate() {
                if self.conditions[taxel] != Condition::Sound || reading.bad {
                    continue;
                }
                let share = squares[used.press][taxel].share_with_slopes(&used.at);
                let noise2 = reading.deviation * reading.deviation / frames + 0.01;
                let model2 = (MODEL_PART * reading.mean).powi(2) + (PEAK_PART * highest).powi(2);
                let value = reading.mean * per_kpa - self.now.gains[taxel] * self.now.stiffness[index] * share.value;
                let sigma = per_kpa * (noise2 + model2).sqrt();
                residuals.push(Residual { step: index, taxel, value: value / sigma, sigma, share });
            }
        }
        residuals
    }

    fn equations(&self, residuals: &[Residual]) -> (DMatrix<f64>, DVector<f64>) {
        let [_, stiffness_at, gains_at] = self.places();
        let size = gains_at + self.now.gains.len();
        let (mut normal, mut right) = (DMatrix::zeros(size, size), DVector::zeros(size));
        for Residual { step, taxel, value, sigma, share } in residuals.iter().filter(|one| one.share.value > 0.0) {
            let weight = huber(value / self.scale, HUBER) / (self.scale * self.scale);
            let (gain, stiffness) = (self.now.gains[*taxel], self.now.stiffness[*step]);
            let pose_at = self.used[*step].press * UNKNOWNS;
            let mut row = [(0, 0.0); UNKNOWNS + 2];
            for (place, (at, slope)) in row.iter_mut().zip((pose_at..).zip(share.slopes)) {
                *place = (at, gain * stiffness * slope / sigma);
            }
            row[UNKNOWNS] = (stiffness_at + step, gain * share.value / sigma);
            row[UNKNOWNS + 1] = (gains_at + taxel, stiffness * share.value / sigma);
            for (i, one) in row {
                right[i] += weight * one * value;
                for (j, other) in row {
                    normal[(i, j)] += weight * one * other;
                }
            }
        }
        self.priors(&mut normal, &mut right);
        (normal, right)
    }

    /// Usual values of tilt, roundness and gains.
    fn priors(&self, normal: &mut DMatrix<f64>, right: &mut DVector<f64>) {
        let mut usual = |at: usize, value: f64, sigma: f64| {
            normal[(at, at)] += 1.0 / (sigma * sigma);
            right[at] -= value / (sigma * sigma);
        };
        for (index, pose) in self.now.poses.iter().enumerate() {
            let at = index * UNKNOWNS;
            usual(at + 3, pose.tilt[0], TILT_USUAL);
            usual(at + 4, pose.tilt[1], TILT_USUAL);
            usual(at + 5, pose.roundness, ROUNDNESS_USUAL);
            let radius_mm = self.presses[index].radius_mm;
            usual(at + 6, pose.yields_mm_per_n / radius_mm, self.yield_usual / radius_mm);
        }
        let [_, stiffness_at, gains_at] = self.places();
        // A step that the model has in the air has no stiffness.
        (stiffness_at..gains_at).for_each(|at| usual(at, 0.0, 1e4));
        for (taxel, gain) in self.now.gains.iter().enumerate() {
            usual(gains_at + taxel, gain - 1.0, GAIN_USUAL);
        }
    }

    /// One round by Levenberg and Marquardt's method; the largest change of a pose, in tip radii.
    fn step(&mut self, residuals: Vec<Residual>) -> Result<(f64, Vec<Residual>), NoGains> {
        self.scale = spread(residuals.iter().filter(|r| r.share.value > 0.0).map(|r| r.value)).max(0.3);
        let (normal, right) = self.equations(&residuals);
        let (before, cost) = (self.now.clone(), self.cost(&residuals));
        while self.damping < 1e6 {
            let mut damped = normal.clone();
            (0..right.len()).for_each(|i| damped[(i, i)] *= 1.0 + self.damping);
            let change = damped.cholesky().ok_or(NoGains::Unsettled(f64::INFINITY))?.solve(&right);
            let largest = self.go(&change);
            let there = self.residuals();
            if self.cost(&there) <= cost {
                self.damping *= 0.2;
                self.normalise();
                return Ok((largest, there));
            }
            self.now = before.clone();
            self.damping = (10.0 * self.damping).max(1e-6);
        }
        self.damping = 1e-4;
        Ok((0.0, residuals))
    }

    /// Huber's cost of the residuals, plus the prior of gains and plate.
    fn cost(&self, residuals: &[Residual]) -> f64 {
        let off: f64 = residuals.iter().map(|residual| huber_cost(residual.value / self.scale, HUBER)).sum();
        let gains: f64 = self.now.gains.iter().map(|gain| ((gain - 1.0) / GAIN_USUAL).powi(2)).sum();
        let pose = |pose: &Pose| {
            let [x, y] = pose.tilt.map(|tilt| tilt / TILT_USUAL);
            x * x
                + y * y
                + (pose.roundness / ROUNDNESS_USUAL).powi(2)
                + (pose.yields_mm_per_n / self.yield_usual).powi(2)
        };
        off + gains + self.now.poses.iter().map(pose).sum::<f64>()
    }

    /// Changes the unknowns; the largest change of a pose, in tip radii.
    fn go(&mut self, change: &DVector<f64>) -> f64 {
        let [_, stiffness_at, gains_at] = self.places();
        let mut largest: f64 = 0.0;
        for (index, pose) in self.now.poses.iter_mut().enumerate() {
            let radius_mm = self.presses[index].radius_mm;
            let mut unknowns = pose.unknowns(radius_mm);
            for (unknown, change) in unknowns.iter_mut().zip(change.rows(index * UNKNOWNS, UNKNOWNS).iter()) {
                *unknown += change.clamp(-0.05, 0.05);
                largest = largest.max(change.abs());
            }
            *pose = Pose::of(&unknowns, radius_mm);
        }
        for (index, stiffness) in self.now.stiffness.iter_mut().enumerate() {
            *stiffness = (*stiffness + change[stiffness_at + index]).max(0.1 * *stiffness);
        }
        for (taxel, gain) in self.now.gains.iter_mut().enumerate() {
            *gain = (*gain + change[gains_at + taxel]).clamp(0.02, 5.0);
        }
        largest
    }

    /// Brings the mean of the gains to 1, and the stiffnesses along.
    fn normalise(&mut self) {
        let sound =
            self.now.gains.iter().zip(&self.conditions).filter(|(_, condition)| **condition == Condition::Sound);
        let (sum, count) = sound.fold((0.0, 0.0), |(sum, count), (gain, _)| (sum + gain, count + 1.0));
        let mean: f64 = if count > 0.0 { sum / count } else { 1.0 };
        self.now.gains.iter_mut().for_each(|gain| *gain /= mean);
        self.now.stiffness.iter_mut().for_each(|stiffness| *stiffness *= mean);
    }

    /// Taxels by their residuals; uncertainties; and the stiffness of every step of every press.
    fn finish(mut self) -> Result<Gains, NoGains> {
        self.find_odd();
        let mut residuals = self.residuals();
        for _ in 0..3 {
            (_, residuals) = self.step(residuals)?;
        }
        // The last equations leave the plates free to yield, whatever the fit took them for.
        self.yield_usual = YIELD_USUAL;
        let (normal, right) = self.equations(&residuals);
        let covariance = normal.cholesky().ok_or(NoGains::Unsettled(f64::INFINITY))?.inverse();
        let change = &covariance * right;
        let reached = self.reached();
        let [.., gains_at] = self.places();
        let own = covariance.view((gains_at, gains_at), (self.now.gains.len(), self.now.gains.len()));
        let sound: Vec<bool> =
            (0..self.now.gains.len()).map(|i| self.conditions[i] == Condition::Sound && reached[i]).collect();
        let count = sound.iter().filter(|sound| **sound).count().max(1) as f64;
        let mean = (self.now.gains.iter().zip(&sound))
            .map(|(gain, sound)| if *sound { gain / count } else { 0.0 })
            .sum::<f64>();
        // Row sums over the sound ones: the factor that all have in common is taken out of the uncertainties.
        let rows: Vec<f64> = own
            .row_iter()
            .map(|row| row.iter().zip(&sound).filter(|(_, sound)| **sound).map(|(c, _)| c).sum())
            .collect();
        let all: f64 = rows.iter().zip(&sound).filter(|(_, sound)| **sound).map(|(row, _)| row).sum();
        let gain = |taxel: usize| {
            let reads = self.now.gains[taxel] / mean;
            let means = self.presses.iter().flat_map(|press| &press.steps).map(|step| step.taxels[taxel].mean);
            let highest = means.fold(0.0, f64::max);
            let part = reads / count;
            let variance = own[(taxel, taxel)] - 2.0 * part * rows[taxel] + part * part * all;
            match self.conditions[taxel] {
                Condition::Sound if reached[taxel] => {
                    let sigma = (variance.max(0.0) / (mean * mean) + FLOOR * FLOOR).sqrt();
                    Gain { reads, sigma, condition: Condition::Sound, highest }
                }
                Condition::Sound => Gain { reads: 1.0, sigma: GAIN_USUAL, condition: Condition::Unreached, highest },
                condition => Gain { reads: 1.0, sigma: GAIN_USUAL, condition, highest },
            }
        };
        let taxels: Vec<Gain> = (0..self.now.gains.len()).map(gain).collect();
        let known = || taxels.iter().filter(|gain| gain.condition == Condition::Sound);
        let variance = known().map(|gain| (gain.reads - 1.0).powi(2)).sum::<f64>() / (count - 1.0).max(1.0);
        let common = (variance / count).sqrt();
        let presses = (0..self.presses.len()).map(|index| self.posed(index, &covariance, &change, &taxels)).collect();
        Ok(Gains {
            columns: self.array.columns,
            taxels,
            presses,
            left_out: Vec::new(),
            spread: variance.sqrt(),
            common,
        })
    }

    /// Names taxels that do not follow the model, by the median of their residuals: no single step decides.
    fn find_odd(&mut self) {
        let mut own = vec![(Vec::new(), Vec::new(), 0.0_f64); self.now.gains.len()];
        for Residual { step, taxel, value, sigma, share } in self.residuals() {
            let (values, off, highest) = &mut own[taxel];
            values.push(value);
            off.push(value * sigma);
            *highest = highest.max(self.now.gains[taxel] * self.now.stiffness[step] * share.value);
        }
        let reached = self.reached();
        for (taxel, (values, off, highest)) in own.into_iter().enumerate() {
            if self.conditions[taxel] != Condition::Sound || !reached[taxel] {
                continue;
            }
            if self.now.gains[taxel] < DEAD {
                self.conditions[taxel] = Condition::Dead;
            } else if spread(values.into_iter()) > ODD_SIGMAS && spread(off.into_iter()) > ODD_PART * highest {
                self.conditions[taxel] = Condition::Odd;
            }
        }
    }

    fn reached(&self) -> Vec<bool> {
        let squares = self.squares();
        let mut reached = vec![false; self.now.gains.len()];
        for (index, press) in self.presses.iter().enumerate() {
            let Some(deepest) = press.deepest() else { continue };
            let at = deepest.at(&self.array);
            let shares: Vec<f64> = squares[index].iter().map(|square| square.share(&at)).collect();
            let highest = shares.iter().copied().fold(0.0, f64::max);
            reached.iter_mut().zip(shares).for_each(|(reached, share)| *reached |= share > REACHED * highest);
        }
        reached
    }

    fn posed(&self, index: usize, covariance: &DMatrix<f64>, change: &DVector<f64>, taxels: &[Gain]) -> Posed {
        let (pose, press, yields_at) = (self.now.poses[index], &self.presses[index], index * UNKNOWNS + 6);
        let forces_n = forces(press, &pose, taxels);
        let yields = pose.yields_mm_per_n + press.radius_mm * change[yields_at];
        let sigma = covariance[(yields_at, yields_at)].sqrt() * press.radius_mm;
        let verdict = judge(&pose, [yields, sigma], &shifts(press, &pose, taxels, &forces_n));
        Posed { pose, forces_n, yields_mm_per_n: [yields, sigma], verdict }
    }
}
