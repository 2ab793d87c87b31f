//! Between tip and object.
//!
//! Where tip and object overlap by x, the tip is indented by d and pushes back with F. The stages in order: the
//! object's surface (shape), the force that the tip has forgotten (memory), the object's own yielding (series), what is
//! left of it (strength), and the motion along the surface (tangent). Without effects the object is a rigid plane
//! without friction: d = x, F = pi Y d^2. All forces of a step come from one energy, which is asked for its mean slope,
//! so a step creates none.

mod surface;
mod tip_and_object;

use super::{Metered, Part};
use crate::registry::Description;
use crate::watch::{Cost, Truth};

/// The effects of this family, in the order in which they act within a stage.
pub const EFFECTS: &[&Description] = &[
    &surface::TILTED_PLANE,
    &surface::SPHERE,
    &surface::CYLINDER,
    &surface::EDGE,
    &tip_and_object::RELAXATION,
    &tip_and_object::OBJECT_STIFFNESS,
    &tip_and_object::BREAKABLE_OBJECT,
    &tip_and_object::TANGENTIAL,
    &tip_and_object::OBJECT_MASS,
];

/// Acts on the object's surface.
pub trait Shape: Send {
    /// How far the surface stands out towards the tip beyond the plane at which indentations count from 0; below where
    /// it falls away. `x` goes along the array's columns, `y` along its rows, from the tip's axis; the tip's radius is
    /// that.
    fn height_mm(&self, x_mm: f64, y_mm: f64, radius_mm: f64) -> f64;

    /// Whether the height is 0 wherever a tip reaches: then the plane's closed forms hold.
    fn plain(&self) -> bool;
}

/// Where an object ends: farther away than any tip reaches.
const NOTHING_MM: f64 = -1e3;

/// A round surface's height at the square of a distance from its highest point or line.
fn round(per_mm: f64, distance2_mm2: f64) -> f64 {
    let turned = per_mm * per_mm * distance2_mm2;
    // R - sqrt(R^2 - s^2) without its cancellation for a large R.
    if turned < 1.0 { -per_mm * distance2_mm2 / (1.0 + (1.0 - turned).sqrt()) } else { NOTHING_MM }
}

/// A force that the tip has forgotten.
pub trait Memory: Send {
    /// It is taken from the elastic force.
    fn forgotten_n(&mut self) -> f64;

    /// Time goes on at a held elastic force; at none where the tip, not yet back in shape, touches nothing.
    fn relax(&mut self, dt_s: f64, elastic_n: Option<f64>);
}

/// The object yields like a spring behind its surface: how far, mm, for each N. Asked for once.
pub type Series = dyn FnMut() -> f64 + Send;

/// What an object bears.
pub trait Strength: Send {
    /// The share of the force that is left after it bore this one.
    fn left(&mut self, force_n: f64) -> f64;

    /// Says what it knows.
    fn tell(&self, truth: &mut Truth);
}

/// Friction along the surface, with the tip's give.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Grip {
    /// Stiffness of the patch along the surface.
    pub n_per_mm: f64,
    /// Damping beside the stiffness.
    pub n_s_per_mm: f64,
    /// Share of the normal force at which it begins to slip.
    pub still: f64,
    /// Share of the normal force while it slips.
    pub slipping: f64,
    /// How fast the object goes by, where the scene moves it.
    pub drift_mm_per_s: f64,
    /// From when.
    pub drift_from_s: f64,
}

/// Acts along the surface. Asked for once a step.
pub type Tangent = dyn FnMut() -> Grip + Send;

/// The object can move: its mass, kg. Asked for once.
pub type Body = dyn FnMut() -> f64 + Send;

/// The stages as the contact calls them: of the named effects, or `()`, in which none is compiled.
pub trait Stages {
    /// Whether none of the stages holds an effect: a step of the contact then asks for none.
    fn none(&self) -> bool;
    /// Whether the surface is other than a plane.
    fn shaped(&self) -> bool {
        false
    }
    /// The sum of [`Shape::height_mm`].
    fn height_mm(&self, _x_mm: f64, _y_mm: f64, _radius_mm: f64) -> f64 {
        0.0
    }
    /// Counts the building of the shape's tables as a call of its effects.
    fn shape_built(&mut self) {}
    /// Whether there is a [`Memory`]: without one, none is asked.
    fn forgets(&self) -> bool;
    /// The sum of [`Memory::forgotten_n`].
    fn forgotten_n(&mut self) -> f64 {
        0.0
    }
    /// See [`Memory::relax`].
    fn relax(&mut self, _dt_s: f64, _elastic_n: Option<f64>) {}
    /// Takes over the tip's memory from the effects of another scene.
    fn remember(&mut self, _before: &mut Self) {}
    /// The sum of [`Series`].
    fn mm_per_n(&mut self) -> f64 {
        0.0
    }
    /// Whether there is a [`Strength`]: without one, none is asked.
    fn breaks(&self) -> bool;
    /// The product of [`Strength::left`].
    fn left(&mut self, _force_n: f64) -> f64 {
        1.0
    }
    /// See [`Tangent`].
    fn grip(&mut self) -> Option<Grip> {
        None
    }
    /// The sum of [`Body`]; none where the object stands fast.
    fn mass_kg(&mut self) -> Option<f64> {
        None
    }
    /// Says what the effects know.
    fn tell(&self, _truth: &mut Truth) {}
}

impl Stages for () {
    fn none(&self) -> bool {
        true
    }

    fn forgets(&self) -> bool {
        false
    }

    fn breaks(&self) -> bool {
        false
    }
}

named! {
    Shape(shape: dyn Shape),
    Memory(memory: dyn Memory),
    Series(series: Series),
    Strength(strength: dyn Strength),
    Tangent(tangent: Tangent),
    Body(body: Body),
}

impl Stages for Named {
    fn none(&self) -> bool {
        !self.any()
    }

    fn shaped(&self) -> bool {
        self.shape.iter().any(|effect| !effect.part().plain())
    }

    fn height_mm(&self, x_mm: f64, y_mm: f64, radius_mm: f64) -> f64 {
        self.shape.iter().map(|effect| effect.part().height_mm(x_mm, y_mm, radius_mm)).sum()
    }

    fn shape_built(&mut self) {
        self.shape.iter_mut().for_each(|effect| effect.call(|_| ()));
    }

    fn forgets(&self) -> bool {
        !self.memory.is_empty()
    }

    fn forgotten_n(&mut self) -> f64 {
        self.memory.iter_mut().map(|effect| effect.call(|part| part.forgotten_n())).sum()
    }

    fn relax(&mut self, dt_s: f64, elastic_n: Option<f64>) {
        self.memory.iter_mut().for_each(|effect| effect.call(|part| part.relax(dt_s, elastic_n)));
    }

    fn remember(&mut self, before: &mut Self) {
        self.memory = core::mem::take(&mut before.memory);
    }

    fn mm_per_n(&mut self) -> f64 {
        self.series.iter_mut().map(|effect| effect.call(|part| part())).sum()
    }

    fn breaks(&self) -> bool {
        !self.strength.is_empty()
    }

    fn left(&mut self, force_n: f64) -> f64 {
        self.strength.iter_mut().map(|effect| effect.call(|part| part.left(force_n))).product()
    }

    fn grip(&mut self) -> Option<Grip> {
        self.tangent.iter_mut().map(|effect| effect.call(|part| part())).last()
    }

    fn mass_kg(&mut self) -> Option<f64> {
        self.body.iter_mut().map(|effect| effect.call(|part| part())).reduce(|all, more| all + more)
    }

    #[inline]
    fn tell(&self, truth: &mut Truth) {
        self.strength.iter().for_each(|effect| effect.part().tell(truth));
    }
}
