//! Contact of one finger: normal force, pressures on the taxels, and friction along the surface.

use crate::effects::contact::{Grip, Named};
use crate::mechanics::normal::{Elastic, Law};
use crate::mechanics::pressures::{Between, Pressures};
use crate::mechanics::shape;
use crate::setup::Setup;
use fingertip::shipped::{COLUMNS, ROWS};

/// Contact of one finger, with its effects.
pub struct Contact {
    pub effects: Named,
    pub along: Along,
    elastic: Elastic,
    /// Indentations, each with the centre of pressure; empty on a plane.
    centres: Vec<[f64; 3]>,
    pressures: Pressures,
    /// Contact at the last sample of each row, and its pressures.
    rows: [(Place, [f64; COLUMNS]); ROWS],
    mm_per_n: f64,
    /// Stiffness along the surface; 0 without friction.
    pub n_per_mm_along: f64,
    forgotten_n: f64,
    free_mm: f64,
    left: f64,
}

/// Contact at an instant: what its rows have in common.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Place {
    between: Between,
    /// Share of the pressures of the indentation alone.
    share: f64,
}

impl Place {
    /// No contact.
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
        effects.shape_built();
        let (elastic, centres) = if effects.shaped() {
            shape::tables(&effects, &setup.tip)
        } else {
            (Elastic::Plane { n_per_mm2: setup.tip.force_per_mm2() }, Vec::new())
        };
        let centre_mm = [setup.wall.centre_x_mm, setup.wall.centre_y_mm];
        let pressures = Pressures::new(setup.tip, setup.array.pitch_mm, centre_mm);
        let mm_per_n = effects.mm_per_n();
        let n_per_mm_along = effects.grip().map_or(0.0, |grip| grip.n_per_mm);
        Self {
            n_per_mm_along,
            effects,
            along: Along::default(),
            elastic,
            centres,
            pressures,
            rows: [(Place::NOWHERE, [0.0; COLUMNS]); ROWS],
            mm_per_n,
            forgotten_n: 0.0,
            free_mm: 0.0,
            left: 1.0,
        }
    }

    /// Returns the law of the force for the next step.
    pub fn law(&self) -> Law<'_> {
        let Self { elastic, forgotten_n, free_mm, mm_per_n, left, .. } = self;
        Law { elastic, forgotten_n: *forgotten_n, free_mm: *free_mm, mm_per_n: *mm_per_n, left: *left }
    }

    /// Lets the tip relax for a time at an overlap.
    pub fn relax(&mut self, dt_s: f64, x_mm: f64) {
        if !self.effects.forgets() {
            return;
        }
        let elastic_n = self.elastic.force_n(self.law().depth_mm(x_mm));
        self.effects.relax(dt_s, (elastic_n >= self.forgotten_n).then_some(elastic_n));
        self.forgotten_n = self.effects.forgotten_n();
        self.free_mm = self.elastic.depth_mm(self.forgotten_n);
    }

    /// Loads the object with the force of an overlap.
    pub fn bear(&mut self, x_mm: f64) {
        if self.effects.breaks() {
            let force_n = self.law().force_n(x_mm);
            self.left = self.effects.left(force_n / self.left);
        }
    }

    #[inline]
    pub fn place(&self, x_mm: f64) -> Place {
        if x_mm <= 0.0 {
            return Place::NOWHERE;
        }
        let law = self.law();
        let d_mm = law.depth_mm(x_mm);
        let between = self.pressures.between(d_mm, self.along.stretch_mm);
        if law.forgotten_n == 0.0 && law.left == 1.0 {
            return Place { between, share: 1.0 };
        }
        // At the first touch of a shaped surface both forces may round to 0.
        let elastic_n = self.elastic.force_n(d_mm);
        Place { between, share: if elastic_n > 0.0 { law.left * law.net_n(d_mm) / elastic_n } else { law.left } }
    }

    #[inline]
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
        let above = self.centres.partition_point(|[knot_mm, ..]| *knot_mm < d_mm);
        let [x, y] = match self.centres.get(above.min(self.centres.len().saturating_sub(1))) {
            Some([_, x, y]) => [*x, *y],
            None => [0.0, 0.0],
        };
        [x, y + self.along.stretch_mm]
    }

    /// Returns the largest slope of force against overlap, at the deepest indentation.
    pub fn steepest_n_per_mm(&self, deepest_mm: f64) -> f64 {
        let tip = self.elastic.n_per_mm(deepest_mm);
        tip / (1.0 + self.mm_per_n * tip)
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
