//! Contact of one finger: normal force, pressures on the taxels, and friction along the surface.

use crate::effects::contact::{Grip, Named};
use crate::mechanics::pressures::{Between, Pressures};
use crate::mechanics::rotor::mean_square;
use crate::setup::{Setup, Tip};
use core::cell::Cell;
use core::f64::consts::TAU;
use fingertip::shipped::{COLUMNS, ROWS};

/// Contact of one finger, with its effects.
pub struct Contact {
    pub effects: Named,
    pub along: Along,
    /// Law of the force for the next step.
    pub law: Law,
    pressures: Pressures,
    /// Contact at the last sample of each row, and its pressures.
    rows: [(Place, [f64; COLUMNS]); ROWS],
    /// Stiffness along the surface; 0 without friction.
    pub n_per_mm_along: f64,
}

/// Contact at an instant: what its rows have in common.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Place {
    between: Between,
    /// Share of the pressures of the indentation alone.
    share: f64,
}

impl Place {
    pub const NOWHERE: Self = Self { between: Between::NOTHING, share: 1.0 };
}

/// Stretch of the patch along the surface, and its slip.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Along {
    /// Displacement of the object against the tip since they stick, mm.
    pub stretch_mm: f64,
    /// Distance slipped, in both directions, mm.
    pub slip_mm: f64,
    /// Direction of the slip; 0 while it sticks.
    pub slipping: f64,
}

impl Contact {
    pub fn new(setup: &Setup, mut effects: Named) -> Self {
        // The tables of the shape count as a call of its effects.
        effects.shape.each(|_| ());
        let elastic = if effects.shaped() {
            shaped(&effects, &setup.tip)
        } else {
            Elastic::Plane { n_per_mm2: setup.tip.force_per_mm2() }
        };
        let centre_mm = [setup.wall.centre_x_mm, setup.wall.centre_y_mm];
        let pressures = Pressures::new(setup.tip, setup.array.pitch_mm, centre_mm);
        let law = Law {
            elastic,
            forgotten_n: 0.0,
            free_mm: 0.0,
            mm_per_n: effects.series.map(|part| *part).sum(),
            left: 1.0,
        };
        let n_per_mm_along = effects.grip().map_or(0.0, |grip| grip.n_per_mm);
        let rows = [(Place::NOWHERE, [0.0; COLUMNS]); ROWS];
        Self { n_per_mm_along, effects, along: Along::default(), law, pressures, rows }
    }

    /// Lets the tip relax for a time at an overlap.
    pub fn relax(&mut self, dt_s: f64, x_mm: f64) {
        let law = &mut self.law;
        if self.effects.memory.any() {
            let elastic_n = law.elastic.force_n(law.depth_mm(x_mm));
            let elastic_n = (elastic_n >= law.forgotten_n).then_some(elastic_n);
            self.effects.memory.each(|part| part.relax(dt_s, elastic_n));
            law.forgotten_n = self.effects.memory.map(|part| part.forgotten_n()).sum();
            law.free_mm = law.elastic.depth_mm(law.forgotten_n);
        }
    }

    /// Loads the object with the force of an overlap.
    pub fn bear(&mut self, x_mm: f64) {
        if self.effects.strength.any() {
            let force_n = self.law.force_n(x_mm) / self.law.left;
            self.law.left = self.effects.strength.map(|part| part.left(force_n)).product();
        }
    }

    pub fn place(&self, x_mm: f64) -> Place {
        if x_mm <= 0.0 {
            return Place::NOWHERE;
        }
        let law = &self.law;
        let d_mm = law.depth_mm(x_mm);
        let between = self.pressures.between(d_mm, self.along.stretch_mm);
        if law.forgotten_n == 0.0 && law.left == 1.0 {
            return Place { between, share: 1.0 };
        }
        // At the first touch of a shaped surface both forces may round to 0.
        let elastic_n = law.elastic.force_n(d_mm);
        Place { between, share: if elastic_n > 0.0 { law.left * law.net_n(d_mm) / elastic_n } else { law.left } }
    }

    pub fn row_kpa(&mut self, place: &Place, row: usize) -> [f64; COLUMNS] {
        let (before, kpa) = &mut self.rows[row];
        if before != place {
            *before = *place;
            *kpa = self.pressures.row_kpa(&self.effects, &place.between, row);
            if place.share != 1.0 {
                *kpa = kpa.map(|kpa| kpa * place.share);
            }
        }
        *kpa
    }

    /// Returns the centre of pressure at an indentation, from where the axis of the tip meets the surface.
    pub fn centre_mm(&self, d_mm: f64) -> [f64; 2] {
        let [x, y] = match &self.law.elastic {
            Elastic::Plane { .. } => [0.0; 2],
            Elastic::Table(Table { knots, .. }) => {
                let above = knots.partition_point(|knot| knot.d_mm < d_mm);
                knots[above.min(knots.len() - 1)].centre_mm
            }
        };
        [x, y + self.along.stretch_mm]
    }

    /// Returns the largest slope of force against overlap, at the deepest indentation.
    pub fn steepest_n_per_mm(&self, deepest_mm: f64) -> f64 {
        let tip = self.law.elastic.n_per_mm(deepest_mm);
        tip / (1.0 + self.law.mm_per_n * tip)
    }
}

impl Along {
    /// Returns the mean force on the object along the surface over a step by a displacement, and the state after it.
    pub fn moved(&self, grip: &Grip, normal_n: f64, way_mm: f64, dt_s: f64) -> (f64, Self) {
        let mut next = *self;
        let damping = if dt_s > 0.0 { grip.n_s_per_mm / dt_s } else { 0.0 };
        let trial_mm = self.stretch_mm + way_mm;
        let trial_n = grip.n_per_mm * trial_mm + damping * way_mm;
        // It sticks again once the motion reverses.
        let slips = self.slipping != 0.0 && way_mm * self.slipping > 0.0;
        let limit_n = if slips { grip.slipping } else { grip.still } * normal_n;
        if trial_n.abs() > limit_n {
            next.slipping = trial_n.signum();
            let held_n = next.slipping * grip.slipping * normal_n;
            next.stretch_mm = (held_n + damping * self.stretch_mm) / (grip.n_per_mm + damping);
            next.slip_mm += (trial_mm - next.stretch_mm).abs();
        } else {
            next.stretch_mm = trial_mm;
            next.slipping = 0.0;
        }
        let spring_n = 0.5 * grip.n_per_mm * (self.stretch_mm + next.stretch_mm);
        (-spring_n - damping * (next.stretch_mm - self.stretch_mm), next)
    }
}

/// Law of the normal force during a step: elastic, less the relaxed force, in series with the object.
///
/// With the elastic force F_e, a relaxed force S, the compliance c of the object and the share k of the force that
/// remains:
///
/// ```text
/// N(d) = max(0, F_e(d) - S)      x = d + c N(d)      F = k N      E = k (integral of N over d + c N^2 / 2)
/// ```
///
/// so F = dE/dx. Below the indentation at which F_e = S the tip does not touch, as its shape has not recovered. The
/// elastic force is a closed form on a plane and a table on other surfaces.
///
/// The fields are F_e, S, c and k.
#[derive(Clone, Debug)]
pub struct Law {
    pub elastic: Elastic,
    pub forgotten_n: f64,
    /// Indentation at which the elastic force is `forgotten_n`.
    pub free_mm: f64,
    pub mm_per_n: f64,
    pub left: f64,
}

impl Law {
    /// Indentation of the tip at an overlap; negative without contact.
    pub fn depth_mm(&self, x_mm: f64) -> f64 {
        if self.mm_per_n == 0.0 || x_mm <= 0.0 { x_mm } else { self.yielding_mm(x_mm) }
    }

    fn yielding_mm(&self, x_mm: f64) -> f64 {
        if x_mm <= self.free_mm {
            return x_mm;
        }
        match &self.elastic {
            Elastic::Plane { n_per_mm2 } => {
                let steep = self.mm_per_n * n_per_mm2;
                let ahead = x_mm + self.mm_per_n * self.forgotten_n;
                2.0 * ahead / (1.0 + (1.0 + 4.0 * steep * ahead).sqrt())
            }
            Elastic::Table(table) => table.yielding_mm(x_mm, self.mm_per_n, self.forgotten_n),
        }
    }

    pub fn force_n(&self, x_mm: f64) -> f64 {
        self.left * self.net_n(self.depth_mm(x_mm))
    }

    /// Energy at an overlap, mJ.
    pub fn energy_mj(&self, x_mm: f64) -> f64 {
        let (d_mm, free_mm) = (self.depth_mm(x_mm), self.free_mm);
        if d_mm <= free_mm {
            return 0.0;
        }
        let tip = self.elastic.energy_mj(d_mm) - self.elastic.energy_mj(free_mm) - self.forgotten_n * (d_mm - free_mm);
        let net_n = self.net_n(d_mm);
        self.left * (tip + 0.5 * self.mm_per_n * net_n * net_n)
    }

    /// Mean force between two overlaps: the difference in energy over the distance.
    pub fn mean_n(&self, x0: f64, x1: f64) -> f64 {
        if x0 <= 0.0 && x1 <= 0.0 {
            return 0.0;
        }
        if self.mm_per_n == 0.0 {
            return self.left * self.tip_mean_n(x0, x1);
        }
        let (d0, d1) = (self.depth_mm(x0), self.depth_mm(x1));
        let (n0, n1) = (self.net_n(d0), self.net_n(d1));
        let (tip_mm, object_mm) = (d1 - d0, self.mm_per_n * (n1 - n0));
        let way_mm = tip_mm + object_mm;
        if way_mm == 0.0 {
            return self.left * n0;
        }
        self.left * (self.tip_mean_n(d0, d1) * tip_mm + 0.5 * (n0 + n1) * object_mm) / way_mm
    }

    pub fn net_n(&self, d_mm: f64) -> f64 {
        (self.elastic.force_n(d_mm) - self.forgotten_n).max(0.0)
    }

    fn tip_mean_n(&self, d0: f64, d1: f64) -> f64 {
        if self.forgotten_n == 0.0 {
            return self.elastic.mean_n(d0, d1);
        }
        let (from, to) = (d0.max(self.free_mm), d1.max(self.free_mm));
        let share = if d0 == d1 { f64::from(d0 > self.free_mm) } else { (to - from) / (d1 - d0) };
        (self.elastic.mean_n(from, to) - self.forgotten_n).max(0.0) * share
    }
}

/// Elastic force of an indentation. Beyond the table the force continues in a straight line.
#[derive(Clone, Debug, PartialEq)]
pub enum Elastic {
    /// A rigid plane: F = c d^2.
    Plane {
        /// c = pi Y, N/mm^2.
        n_per_mm2: f64,
    },
    /// Straight lines between knots; the energy is their integral, so force = dE/dd holds by construction.
    Table(Table),
}

/// Knots of a force that rises ever more steeply, from 0 at 0.
#[derive(Clone, Debug, PartialEq)]
pub struct Table {
    knots: Vec<Knot>,
    /// Segment of the last indentation, by its lower knot: the next one is near.
    last: Cell<usize>,
}

#[derive(Clone, Debug, Default, PartialEq)]
struct Knot {
    /// Indentation, larger than in the knot before.
    d_mm: f64,
    force_n: f64,
    energy_mj: f64,
    /// Slope of the force up to the next knot.
    n_per_mm: f64,
    /// Centre of pressure, from where the axis of the tip meets the surface.
    centre_mm: [f64; 2],
}

impl Table {
    /// Returns the segment in which `before` becomes false, by its lower knot. The first and the last one have no outer end.
    fn segment(&self, before: impl Fn(&Knot) -> bool) -> usize {
        let (line, last) = (self.last.get(), self.knots.len() - 2);
        if (line == 0 || before(&self.knots[line])) && (line == last || !before(&self.knots[line + 1])) {
            return line;
        }
        let line = self.knots.partition_point(before).clamp(1, last + 1) - 1;
        self.last.set(line);
        line
    }

    /// Returns the segment of an indentation, by its lower knot.
    fn line(&self, d_mm: f64) -> usize {
        self.segment(|knot| knot.d_mm <= d_mm)
    }

    /// Solves d + c (F(d) - S) = x for d, where d > 0 and F(d) > S. The left side rises with d.
    fn yielding_mm(&self, x_mm: f64, mm_per_n: f64, forgotten_n: f64) -> f64 {
        let left_mm = |knot: &Knot| x_mm - knot.d_mm - mm_per_n * (knot.force_n - forgotten_n);
        let knot = &self.knots[self.segment(|knot| left_mm(knot) >= 0.0)];
        knot.d_mm + left_mm(knot) / (1.0 + mm_per_n * knot.n_per_mm)
    }

    fn force_n(&self, d_mm: f64) -> f64 {
        if d_mm <= 0.0 { 0.0 } else { self.knots[self.line(d_mm)].force_beyond_n(d_mm) }
    }

    fn energy_mj(&self, d_mm: f64) -> f64 {
        if d_mm <= 0.0 {
            return 0.0;
        }
        let knot = &self.knots[self.line(d_mm)];
        let over = d_mm - knot.d_mm;
        knot.energy_mj + over * (knot.force_n + 0.5 * over * knot.n_per_mm)
    }

    /// Mean force between two indentations. Within a segment it is the mean of the ends, exact at any distance.
    fn mean_n(&self, d0: f64, d1: f64) -> f64 {
        if d0 == d1 {
            return self.force_n(d0);
        }
        let (low, high) = (d0.min(d1), d0.max(d1));
        let (first, last) = (self.line(low), self.line(high));
        let part = |line: usize, from: f64, to: f64| {
            let (knot, from, to) = (&self.knots[line], from.max(0.0), to.max(0.0));
            0.5 * (knot.force_beyond_n(from) + knot.force_beyond_n(to)) * (to - from)
        };
        if first == last {
            return part(first, low, high) / (high - low);
        }
        let [after, before] = [&self.knots[first + 1], &self.knots[last]];
        let inner = before.energy_mj - after.energy_mj;
        (part(first, low, after.d_mm) + inner + part(last, before.d_mm, high)) / (high - low)
    }

    fn depth_mm(&self, force_n: f64) -> f64 {
        if force_n <= 0.0 {
            return 0.0;
        }
        let above = self.knots.partition_point(|knot| knot.force_n <= force_n);
        let knot = &self.knots[above.clamp(1, self.knots.len() - 1) - 1];
        knot.d_mm + (force_n - knot.force_n) / knot.n_per_mm
    }
}

impl Knot {
    /// Force of an indentation in the segment that begins here.
    fn force_beyond_n(&self, d_mm: f64) -> f64 {
        self.force_n + (d_mm - self.d_mm) * self.n_per_mm
    }
}

impl Elastic {
    pub fn force_n(&self, d_mm: f64) -> f64 {
        match self {
            Self::Plane { n_per_mm2 } => n_per_mm2 * d_mm.max(0.0) * d_mm.max(0.0),
            Self::Table(table) => table.force_n(d_mm),
        }
    }

    /// Indentation of a force, the inverse of [`Elastic::force_n`]; 0 without a force.
    pub fn depth_mm(&self, force_n: f64) -> f64 {
        match self {
            Self::Plane { n_per_mm2 } => (force_n.max(0.0) / n_per_mm2).sqrt(),
            Self::Table(table) => table.depth_mm(force_n),
        }
    }

    pub fn energy_mj(&self, d_mm: f64) -> f64 {
        match self {
            Self::Plane { n_per_mm2 } => n_per_mm2 / 3.0 * d_mm.max(0.0).powi(3),
            Self::Table(table) => table.energy_mj(d_mm),
        }
    }

    /// Mean force between two indentations: the difference in energy over the distance.
    pub fn mean_n(&self, d0: f64, d1: f64) -> f64 {
        match self {
            Self::Plane { n_per_mm2 } => mean_square(*n_per_mm2, d0, d1),
            Self::Table(table) => table.mean_n(d0, d1),
        }
    }

    pub fn n_per_mm(&self, d_mm: f64) -> f64 {
        match self {
            Self::Plane { n_per_mm2 } => 2.0 * n_per_mm2 * d_mm.max(0.0),
            Self::Table(table) => table.knots[table.line(d_mm)].n_per_mm,
        }
    }
}

/// Samples around the axis, and from the apex to the rim of the tip.
const AROUND: usize = 64;
const OUTWARDS: usize = 256;
/// Knots of the force, evenly spaced in the square root of the indentation.
const KNOTS: usize = 2048;

/// Force and centre of pressure against indentation on a surface that is not a plane, from its height.
///
/// The local compression is `dL = sqrt(a^2 - r^2) - (a - d) + h(x, y)` and the pressure `Y dL / L`, `L = sqrt(a^2 -
/// r^2)`, so with polar coordinates, as `r dr = -L dL`, the force is `Y` times the integral of `dL` over `L` and the
/// angle: sample by sample, a ramp that begins at the clearance `a - L - h` of the sample.
fn shaped(effects: &Named, tip: &Tip) -> Elastic {
    let mut samples = samples(effects, tip);
    samples.sort_by(|a, b| a.clearance_mm.total_cmp(&b.clearance_mm));
    let deepest_mm = Tip::DEEPEST * tip.radius_mm;
    let mut knots: Vec<Knot> = Vec::with_capacity(KNOTS + 1);
    // Sums over the touching samples of weight and weight times clearance, alone and times the place.
    let mut sums = [[0.0; 2]; 3];
    let mut reached = samples.iter().peekable();
    for knot in 0..=KNOTS {
        let share = knot as f64 / KNOTS as f64;
        let depth_mm = share * share * deepest_mm;
        while let Some(sample) = reached.next_if(|sample| sample.clearance_mm < depth_mm) {
            for (sum, by) in sums.iter_mut().zip([1.0, sample.x_mm, sample.y_mm]) {
                sum[0] += sample.weight * by;
                sum[1] += sample.weight * by * sample.clearance_mm;
            }
        }
        let [force, x, y] = sums.map(|[weight, clearance]| (weight * depth_mm - clearance) * tip.modulus_kpa * 1e-3);
        let mut next = Knot { d_mm: depth_mm, ..Knot::default() };
        if let Some(before) = knots.last_mut() {
            let further_mm = depth_mm - before.d_mm;
            next.force_n = f64::max(force, before.force_n);
            next.energy_mj = before.energy_mj + 0.5 * (next.force_n + before.force_n) * further_mm;
            before.n_per_mm = (next.force_n - before.force_n) / further_mm;
        }
        if next.force_n > 0.0 {
            next.centre_mm = [x, y].map(|moment| moment / next.force_n);
        }
        knots.push(next);
    }
    Elastic::Table(Table { knots, last: Cell::new(0) })
}

/// Place on the tip: the indentation at which it touches, and its weight in the integral.
struct Sample {
    clearance_mm: f64,
    weight: f64,
    x_mm: f64,
    y_mm: f64,
}

fn samples(effects: &Named, tip: &Tip) -> Vec<Sample> {
    let radius_mm = tip.radius_mm;
    let mut samples = Vec::with_capacity(AROUND * OUTWARDS);
    for outwards in 0..OUTWARDS {
        // L = a (1 - t^2): closest at the apex, where shallow contacts are.
        let t = (outwards as f64 + 0.5) / OUTWARDS as f64;
        let length_mm = radius_mm * (1.0 - t * t);
        let weight = 2.0 * radius_mm * t / OUTWARDS as f64 * TAU / AROUND as f64;
        let r_mm = (radius_mm * radius_mm - length_mm * length_mm).sqrt();
        for around in 0..AROUND {
            let angle = TAU * (around as f64 + 0.5) / AROUND as f64;
            let (x_mm, y_mm) = (r_mm * libm::cos(angle), r_mm * libm::sin(angle));
            let clearance_mm = radius_mm - length_mm - effects.height_mm(x_mm, y_mm, radius_mm);
            samples.push(Sample { clearance_mm, weight, x_mm, y_mm });
        }
    }
    samples
}
