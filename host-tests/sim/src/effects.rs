//! Effects that a scene may name. The files of the families hold their equations, sources and keys.
//!
//! An effect acts at one stage and knows no other effect. A stage holds the named effects in the order of the families.
//! An effect that is not named has no state and is never called.

use crate::scene::Scene;
use crate::scene::tables::{Key, Values};
use crate::watch::Cost;
use fastrand::Rng;
use std::cell::Cell;
use std::time::{Duration, Instant};

/// Named effects of a family: a list for each stage.
macro_rules! named {
    ($($list:ident: $effect:ty,)*) => {
        /// Named effects of the family.
        #[derive(Default)]
        pub struct Named {
            $(pub $list: Stage<$effect>),*
        }

        impl Named {
            pub fn any(&self) -> bool {
                $(self.$list.any())||*
            }

            pub fn costs(&self) -> impl Iterator<Item = Cost> {
                core::iter::empty()$(.chain(self.$list.0.iter().map(Metered::cost)))*
            }
        }
    };
}

pub mod contact;
pub mod drive;
pub mod link;
pub mod sensor;

/// Input of the construction of an effect.
#[derive(Clone, Debug)]
pub struct Build<'a> {
    pub values: &'a Values,
    name: &'static str,
    seed: u64,
    drawn: Cell<bool>,
}

impl<'a> Build<'a> {
    /// Input with a seed of the scene, the name of the effect and the finger.
    fn new(name: &'static str, values: &'a Values, seed: u64) -> Self {
        Self { values, name, seed, drawn: Cell::new(false) }
    }

    pub fn rng(&self) -> Rng {
        self.drawn.set(true);
        Rng::with_seed(self.seed)
    }

    pub fn number(&self, name: &str) -> f64 {
        self.values.number(name)
    }

    /// Returns a part of the effect, to be appended to the list of its stage.
    pub(crate) fn part<T: ?Sized>(&self, part: Box<T>) -> Metered<T> {
        Metered::new(self.name, part)
    }
}

/// True if an effect draws random numbers.
pub fn draws(effect: &Description) -> bool {
    let values = Values::defaults(effect.keys);
    let build = Build::new(effect.name, &values, 0);
    (effect.build)(&build, &mut Parts::default());
    build.drawn.get()
}

/// Returns the seed of the stream of an effect or of a drawn value, independent of all other names.
pub fn stream(seed: u64, name: &str, finger: usize) -> u64 {
    // FNV-1a over the name, then SplitMix64 over all three.
    let name = name
        .bytes()
        .fold(0xcbf2_9ce4_8422_2325, |hash: u64, byte| (hash ^ u64::from(byte)).wrapping_mul(0x0100_0000_01b3));
    let mut z = seed.wrapping_add(name).wrapping_add((finger as u64).wrapping_mul(0x9e37_79b9_7f4a_7c15));
    z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    z ^ (z >> 31)
}

/// One of this number of calls is timed: reading the clock costs about as much as a small effect.
const TIMED: u64 = 256;

/// Effect with a meter of its cost. The measurement never reaches the run.
pub struct Metered<T: ?Sized> {
    name: &'static str,
    calls: u64,
    timed_calls: u64,
    timed: Duration,
    /// Number of calls that were skipped because their results are known.
    repeated: i64,
    part: Box<T>,
}

impl<T: ?Sized> Metered<T> {
    pub fn new(name: &'static str, part: Box<T>) -> Self {
        Self { name, calls: 0, timed_calls: 0, timed: Duration::ZERO, repeated: 0, part }
    }

    fn call<R>(&mut self, f: impl FnOnce(&mut T) -> R) -> R {
        self.calls += 1;
        if self.calls % TIMED != 1 {
            return f(&mut self.part);
        }
        let begun = Instant::now();
        let result = f(&mut self.part);
        self.timed += begun.elapsed();
        self.timed_calls += 1;
        result
    }

    fn cost(&self) -> Cost {
        let share = self.calls as f64 / self.timed_calls.max(1) as f64;
        let evaluations = self.calls.saturating_add_signed(self.repeated);
        Cost { effect: self.name, evaluations, seconds: self.timed.as_secs_f64() * share }
    }
}

/// Named effects of a stage, in the order in which they act.
pub struct Stage<T: ?Sized>(Vec<Metered<T>>);

impl<T: ?Sized> Default for Stage<T> {
    fn default() -> Self {
        Self(Vec::new())
    }
}

impl<T: ?Sized> Stage<T> {
    pub(crate) fn push(&mut self, effect: Metered<T>) {
        self.0.push(effect);
    }

    pub fn any(&self) -> bool {
        !self.0.is_empty()
    }

    pub fn each(&mut self, mut f: impl FnMut(&mut T)) {
        self.0.iter_mut().for_each(|effect| effect.call(&mut f));
    }

    pub fn map<R>(&mut self, mut f: impl FnMut(&mut T) -> R) -> impl DoubleEndedIterator<Item = R> {
        self.0.iter_mut().map(move |effect| effect.call(&mut f))
    }

    /// Returns the effects without counting a call.
    pub fn parts(&self) -> impl Iterator<Item = &T> {
        self.0.iter().map(|effect| &*effect.part)
    }

    /// Counts calls that were skipped because their results are known; negative for an extra call.
    pub(crate) fn repeat(&mut self, calls: i64) {
        self.0.iter_mut().for_each(|effect| effect.repeated += calls);
    }
}

/// Draws from the normal distribution, mean 0 and deviation 1, by Marsaglia's polar method with libm's logarithm.
pub(crate) fn normal(rng: &mut Rng) -> f64 {
    loop {
        let (u, v) = (2.0 * rng.f64() - 1.0, 2.0 * rng.f64() - 1.0);
        let s = u * u + v * v;
        if s > 0.0 && s < 1.0 {
            return u * (-2.0 * libm::log(s) / s).sqrt();
        }
    }
}

/// Draws `COUNT` numbers, those of consecutive calls of [`normal`] to 1e-11, but faster: no rejected draw is waited for,
/// and the logarithm is a series that the processor works out for several numbers at once.
pub(crate) fn normals<const COUNT: usize>(rng: &mut Rng) -> [f64; COUNT] {
    let (mut first, mut squares) = ([0.0; COUNT], [0.0; COUNT]);
    let mut drawn = 0;
    while drawn < COUNT {
        // 2 rng.f64() - 1 to the bit: 52 random bits of a number from 2 to 4.
        let [u, v] = [rng.u64(..), rng.u64(..)].map(|bits| f64::from_bits(2.0_f64.to_bits() | bits >> 12) - 3.0);
        let s = u * u + v * v;
        (first[drawn], squares[drawn]) = (u, s);
        drawn += usize::from((s > 0.0) & (s < 1.0));
    }
    for (u, s) in first.iter_mut().zip(squares) {
        *u *= (-2.0 * ln(s) / s).sqrt();
    }
    first
}

/// Natural logarithm of a normal positive number, to 1e-12: with s = m 2^e and t = (m - 1) / (m + 1), ln s = e ln 2 +
/// 2 (t + t^3/3 + t^5/5 + ...), m from sqrt(1/2) on.
#[inline(always)]
fn ln(s: f64) -> f64 {
    const ROOT_HALF: u64 = 0x3fe6_a09e_667f_3bcd;
    let above = s.to_bits().wrapping_sub(ROOT_HALF);
    let exponent = (above as i64 >> 52) as i32;
    let m = f64::from_bits((above & 0x000f_ffff_ffff_ffff).wrapping_add(ROOT_HALF));
    let t = (m - 1.0) / (m + 1.0);
    let t2 = t * t;
    let series = [13.0, 11.0, 9.0, 7.0, 5.0, 3.0, 1.0].iter().fold(1.0 / 15.0, |sum, n| 1.0 / n + t2 * sum);
    f64::from(exponent) * core::f64::consts::LN_2 + 2.0 * t * series
}

/// Draws by [`normal`], again beyond three deviations: worse parts are not delivered.
pub(crate) fn normal_within_3(rng: &mut Rng) -> f64 {
    loop {
        let draw = normal(rng);
        if draw.abs() <= 3.0 {
            return draw;
        }
    }
}

/// Draws a waiting time of a Poisson process; infinite at rate 0.
pub(crate) fn waiting_s(rng: &mut Rng, rate_per_s: f64) -> f64 {
    -libm::log(1.0 - rng.f64()) / rate_per_s
}

/// Effects of one finger by family.
#[derive(Default)]
pub struct Parts {
    pub sensor: sensor::Named,
    pub contact: contact::Named,
    pub drive: drive::Named,
    pub link: link::Named,
}

impl Parts {
    pub fn of(scene: &Scene, finger: usize) -> Self {
        let mut parts = Self::default();
        for NamedEffect { effect, values } in &scene.effects {
            let build = Build::new(effect.name, values, stream(scene.seed, effect.name, finger));
            (effect.build)(&build, &mut parts);
        }
        parts
    }
}

/// Description of an effect. It is next to the equations in the table of its family.
#[derive(Clone, Copy, Debug)]
pub struct Description {
    /// Name in a scene: `[effects.NAME]`.
    pub name: &'static str,
    pub about: &'static str,
    /// Equations in plain text, one per line.
    pub equations: &'static [&'static str],
    /// Additional state; "none" without one.
    pub state: &'static str,
    /// Source of equations and magnitudes.
    pub reference: &'static str,
    pub keys: &'static [Key],
    /// Appends the effect to the list of its stage.
    pub build: fn(&Build, &mut Parts),
}

/// A family of effects, by the place at which they act.
#[derive(Clone, Copy, Debug)]
pub struct Family {
    pub name: &'static str,
    /// Heading on the reference page.
    pub title: &'static str,
    /// Effects, in the order in which they act within a stage.
    pub effects: &'static [Description],
}

/// All families, in the order in which their effects act within a stage: interference comes before the converter.
pub const FAMILIES: [Family; 4] = [
    Family { name: "link", title: "Link: clocks, electronics, bus and host", effects: link::EFFECTS },
    Family { name: "sensor", title: "Sensor: from pressure to codes", effects: sensor::EFFECTS },
    Family { name: "contact", title: "Contact: between tip and object", effects: contact::EFFECTS },
    Family { name: "drive", title: "Drive: from the duty to the tip's way", effects: drive::EFFECTS },
];

#[derive(Clone, Debug)]
pub struct NamedEffect {
    pub effect: &'static Description,
    pub values: Values,
}

/// Returns every effect, in the order in which they act within a stage.
pub fn all() -> impl Iterator<Item = &'static Description> {
    FAMILIES.iter().flat_map(|family| family.effects)
}

pub fn family_of(effect: &Description) -> &'static str {
    let family = FAMILIES.iter().find(|family| family.effects.iter().any(|known| known.name == effect.name));
    family.map_or("", |family| family.name)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn many_normal_numbers_are_those_drawn_one_by_one() {
        let (mut one_by_one, mut at_once) = (Rng::with_seed(5), Rng::with_seed(5));
        for _ in 0..100_000 {
            let expected: [f64; 10] = core::array::from_fn(|_| normal(&mut one_by_one));
            let drawn = normals::<10>(&mut at_once);
            assert!(drawn.iter().zip(expected).all(|(drawn, expected)| (drawn - expected).abs() < 1e-11));
        }
        assert_eq!(one_by_one.u64(..), at_once.u64(..));
    }
}
