//! Where the tip meets the plate: the travel at which they touch, the tip's axis on the array, and the plate's tilt.
//!
//! By the model every taxel stands under a column of the tip of the length L, and once all of it is pressed it reads
//! `u = g (1 - (1 - x + x_c - t rho) / L)` in shares of Y at the travel x, with g what it conducts too much. That is a
//! line in x, and the line's zero, `z = x_c + 1 - L - t rho`, does not depend on g: so the pose is found from the zeros
//! of all lines, whatever the gains are, by least squares. The tilt and the axis' place differ by what L differs from 1.

use super::number::{BITS, ONE, clamped, div, mean, mul, root};
use super::series::{STEPS, Series};

/// Unknowns: x_c, the axis along columns and rows, the tilt along both, the roundness.
pub const UNKNOWNS: usize = 6;
/// Steps in which a taxel's line must be seen.
const STEPS_LEAST: i64 = 4;
/// Steps that tell whether a line is bent.
const BEND_STEPS: i64 = 9;
/// Beyond the cell's own span a column counts as pressed from here on: 0.3 % of the radius.
const MARGIN: i64 = ONE * 3 / 1_000;
/// The shortest column that is looked at: 0.3 of the radius.
const SHORTEST: i64 = ONE * 3 / 10;
/// How much tilt there is before anything is known: 3 degrees; and how much roundness: 3 %.
const TILT_USUAL: i64 = ONE / 20;
const ROUNDNESS_USUAL: i64 = ONE * 3 / 100;
/// The least that the zeros are taken to scatter: 1/10,000 of the radius.
const SCATTER_LEAST: i64 = ONE / 10_000;
/// Bits dropped from a sum over all taxels: 512 at most.
const SUM_BITS: u32 = 9;
/// The Gauss points of a side, as a share of it: 1 / (2 sqrt(3)).
const GAUSS: i64 = ONE * 288_675 / 1_000_000;

/// Where the tip meets the plate, in tip radii, Q30.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Pose {
    /// Travel at which the apex touches a plate that is not tilted.
    pub touch: i64,
    /// The tip's axis from the array's middle, along the columns and the rows.
    pub axis: [i64; 2],
    /// The tangent of the plate's tilt along them: where positive, what is beyond the axis is pressed more.
    pub tilt: [i64; 2],
    /// How much rounder than the tip the gap between tip and plate is: a tip whose radius is less than its parameter, or a
    /// plate that is no plane.
    pub roundness: i64,
}

impl Pose {
    /// Where a column stands from the axis, and how long it is; None where the tip is too low there.
    pub fn column(&self, place: [i64; 2]) -> Option<Column> {
        let [x, y] = [clamped(place[0] - self.axis[0]), clamped(place[1] - self.axis[1])];
        let length = root(ONE - mul(x, x) - mul(y, y));
        (length >= SHORTEST).then_some(Column { from_axis: [x, y], length })
    }

    /// What the tilt adds to the compression there.
    pub fn lift(&self, column: &Column) -> i64 {
        let [x, y] = column.from_axis;
        let tilted = mul(self.tilt[0], x) + mul(self.tilt[1], y);
        tilted - mul(self.roundness, mul(x, x) + mul(y, y)) / 2
    }

    /// How steep the compression is there, along the columns and the rows.
    pub fn slope(&self, column: &Column) -> [i64; 2] {
        let round = clamped(div(ONE, column.length) + self.roundness);
        let [x, y] = column.from_axis;
        [self.tilt[0] - mul(x, round), self.tilt[1] - mul(y, round)]
    }

    /// Where the pose has the zero of a taxel's line; None where the tip is too low there.
    pub fn zero(&self, place: [i64; 2], pitch: i64) -> Option<Zero> {
        let column = self.column(place)?;
        let part = mul(pitch, GAUSS);
        let mut inverse = 0;
        for (dx, dy) in [(-1, -1), (-1, 1), (1, -1), (1, 1)] {
            inverse += div(ONE, self.column([place[0] + dx * part, place[1] + dy * part])?.length) / 4;
        }
        let zero = self.touch + ONE - div(ONE, inverse) - self.lift(&column);
        let [slope_x, slope_y] = self.slope(&column);
        let from = zero + mul(pitch, clamped(slope_x.abs() + slope_y.abs())) / 2 + MARGIN;
        let [x, y] = column.from_axis;
        let apart = (mul(x, x) + mul(y, y)) / 2;
        Some(Zero { zero, from, slopes: [ONE, slope_x, slope_y, -x, -y, apart] })
    }
}

/// The zero of a taxel's line by the pose, from which travel on all of it is pressed, and how the zero goes with the
/// unknowns.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Zero {
    zero: i64,
    from: i64,
    slopes: [i64; UNKNOWNS],
}

/// A column of the tip.
#[derive(Clone, Copy, Debug)]
pub struct Column {
    /// Its place from the axis.
    pub from_axis: [i64; 2],
    /// L.
    pub length: i64,
}

/// A taxel's line.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Line {
    zero: i64,
    /// How far it is bent: the part of a parabola against its rise, both in the standard deviation of its travel; above 0
    /// where it rises less and less. None of a short one.
    bend: Option<i64>,
}

impl Line {
    /// Over the steps in which all of it is pressed; None where these are too few.
    pub fn of(zero: &Zero, travel: &[Option<i64>; STEPS], reading: &Series) -> Option<Self> {
        let from = zero.from;
        let steps = || travel.iter().zip(reading).filter_map(|(x, u)| x.filter(|x| *x > from).map(|x| (x, *u)));
        let (mut count, mut x_sum, mut u_sum) = (0, 0, 0);
        for (x, u) in steps() {
            (count, x_sum, u_sum) = (count + 1, x_sum + x, u_sum + u);
        }
        if count < STEPS_LEAST {
            return None;
        }
        let (x_mean, u_mean) = (mean(x_sum, count), mean(u_sum, count));
        let (mut square, mut product) = (0, 0);
        for (x, u) in steps() {
            square += mul(x - x_mean, x - x_mean);
            product += mul(x - x_mean, u - u_mean);
        }
        let slope = div(product, square);
        let spread = mean(square, count);
        let mut bent = 0;
        for (x, u) in steps() {
            let left = u - u_mean - mul(slope, x - x_mean);
            bent -= mul(left, mul(x - x_mean, x - x_mean) - spread);
        }
        let bend = (count >= BEND_STEPS).then(|| div(mean(bent, count), mul(slope, mul(spread, root(spread)))));
        // What conducts hardly at all has no zero.
        (slope > ONE / 8).then(|| Self { zero: x_mean - div(u_mean, slope), bend })
    }
}

/// What all zeros say of the pose.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Equations {
    /// Of the slopes' products, the lower half.
    squares: [[i64; UNKNOWNS]; UNKNOWNS],
    /// Of the slopes times the residual.
    right: [i64; UNKNOWNS],
    /// Of the residual's square, Q40.
    misfit_q40: i64,
    /// How many taxels say it.
    pub taxels: u16,
    /// Sum of the lines' bends, and how many.
    bends: [i64; 2],
    /// The bends' moments along the columns and the rows, and half of that of the places.
    leaning: [i64; 3],
}

impl Equations {
    /// Of no taxel.
    pub const NONE: Self = Self {
        squares: [[0; UNKNOWNS]; UNKNOWNS],
        right: [0; UNKNOWNS],
        misfit_q40: 0,
        taxels: 0,
        bends: [0; 2],
        leaning: [0; 3],
    };

    /// Takes a taxel.
    pub fn take(&mut self, zero: &Zero, line: &Line) {
        let (residual, bend, slopes) = (clamped(line.zero - zero.zero), line.bend, zero.slopes);
        for ((squares, right), one) in self.squares.iter_mut().zip(&mut self.right).zip(slopes) {
            for (sum, other) in squares.iter_mut().zip(slopes) {
                *sum += mul(one, other) >> SUM_BITS;
            }
            *right += mul(one, residual) >> SUM_BITS;
        }
        // Q50 of each, and 512 of them at most.
        self.misfit_q40 += (residual * residual) >> (2 * BITS - 40);
        self.taxels += 1;
        if let Some(bend) = bend {
            self.bends[0] += bend;
            self.bends[1] += 1;
            // The slopes by the tilt are the places, turned round.
            let [_, _, _, x, y, apart] = slopes;
            for (sum, part) in self.leaning.iter_mut().zip([mul(bend, x), mul(bend, y), apart]) {
                *sum += part >> SUM_BITS;
            }
        }
    }

    /// How far the lines are bent in the mean.
    pub fn bend(&self) -> i64 {
        self.bends[0].checked_div(self.bends[1]).unwrap_or(0)
    }

    /// By how much more the lines are bent on one side than in the middle, a third of the radius out.
    pub fn leaning(&self) -> i64 {
        let [x, y, apart] = self.leaning;
        let [x, y] = [x, y].map(|moment| div(moment, apart) / 3);
        root(mul(x, x) + mul(y, y))
    }

    /// The root mean square of the residuals, in tip radii, Q30.
    pub fn misfit(&self) -> i64 {
        let mean = self.misfit_q40.checked_div(self.taxels.into()).unwrap_or(0);
        root((mean.min(ONE << 10)) >> 10)
    }

    /// What is to be solved for a pose nearer to the solution, where the zeros miss the model by so much anyhow.
    ///
    /// What the model leaves is the same for all taxels and not each one's own: it counts as much as all of them together.
    pub fn system(mut self, pose: &Pose, scatter: i64) -> System {
        let scatter = scatter.max(SCATTER_LEAST);
        let whole = self.squares[0][0];
        let known =
            [(3, TILT_USUAL, pose.tilt[0]), (4, TILT_USUAL, pose.tilt[1]), (5, ROUNDNESS_USUAL, pose.roundness)];
        for (place, usual, value) in known {
            let part = div(scatter, usual).min(ONE);
            let weight = mul(whole, mul(part, part));
            if let (Some(own), Some(right)) =
                (self.squares.get_mut(place).and_then(|row| row.get_mut(place)), self.right.get_mut(place))
            {
                *own += weight;
                *right -= mul(weight, value);
            }
        }
        let shift = whole.max(1).leading_zeros().saturating_sub(63 - BITS);
        let mut system = System::NONE;
        for ((row, squares), right) in system.0.iter_mut().zip(self.squares).zip(self.right) {
            for (to, from) in row.iter_mut().zip(squares.into_iter().chain([right])) {
                *to = from << shift;
            }
        }
        system
    }
}

/// A symmetric system, its largest numbers near to 1: solved by elimination, a pivot in a frame.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct System([[i64; UNKNOWNS + 1]; UNKNOWNS]);

impl System {
    /// Of nothing.
    pub const NONE: Self = Self([[0; UNKNOWNS + 1]; UNKNOWNS]);
    /// Pivots before [`System::solve`].
    pub const PIVOTS: u8 = UNKNOWNS as u8 - 1;

    /// Takes an unknown out of the rows below its own.
    pub fn eliminate(&mut self, pivot: u8) {
        let pivot = usize::from(pivot);
        let own = self.0.get(pivot).copied().unwrap_or_default();
        let divisor = own.get(pivot).copied().unwrap_or(0);
        for row in self.0.iter_mut().skip(pivot + 1) {
            let share = row.get(pivot).map_or(0, |first| div(*first, divisor));
            for (to, own) in row.iter_mut().zip(&own).skip(pivot) {
                *to -= mul(share, *own);
            }
        }
    }

    /// The pose that they say, from the one that they were made for.
    pub fn solve(&self, pose: &Pose) -> Pose {
        let mut solution = [0; UNKNOWNS];
        for (place, row) in self.0.iter().enumerate().rev() {
            let mut left = row.last().copied().unwrap_or(0);
            for (factor, known) in row.iter().zip(solution).skip(place + 1) {
                left -= mul(*factor, known);
            }
            if let (Some(to), Some(divisor)) = (solution.get_mut(place), row.get(place)) {
                *to = div(left, *divisor);
            }
        }
        let [touch, x, y, tilt_x, tilt_y, round] = solution.map(|step: i64| step.max(-ONE / 4).min(ONE / 4));
        // No tilt beyond 45 degrees, no axis beyond a radius.
        let moved = |from: i64, step: i64| (from + step).max(-ONE).min(ONE);
        Pose {
            touch: moved(pose.touch, touch),
            axis: [moved(pose.axis[0], x), moved(pose.axis[1], y)],
            tilt: [moved(pose.tilt[0], tilt_x), moved(pose.tilt[1], tilt_y)],
            roundness: moved(pose.roundness, round),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A taxel in the middle, whose line is one of 1.25 times what it should be.
    #[test]
    fn a_line_has_its_zero_whatever_its_gain() {
        let pose = Pose { touch: -ONE / 50, ..Pose::default() };
        let zero = pose.zero([ONE / 20, -ONE / 30], ONE * 3 / 20).expect("the tip is there");
        let mut travel = [None; STEPS];
        let mut reading = [0; STEPS];
        for (step, (x, u)) in (1..).zip(travel.iter_mut().zip(&mut reading)) {
            *x = Some(step * ONE / 80);
            *u = ((step * ONE / 80 - zero.zero) * 5 / 4).max(0);
        }
        for gain in [1, 3, 5] {
            let line = Line::of(&zero, &travel, &reading.map(|u| u * gain / 4)).expect("it is seen");
            assert!((line.zero - zero.zero).abs() < ONE / 1_000_000, "{} {}", line.zero, zero.zero);
            assert!(line.bend.expect("it is long").abs() < ONE / 1_000);
        }
        assert_eq!(Line::of(&zero, &travel, &[0; STEPS]), None);
    }
}
