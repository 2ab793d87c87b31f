//! The effects: what a scene may name, each in a file of its own with its equations, its source and its keys.
//!
//! An effect acts at one stage and knows no other effect. A stage holds the named ones in the order of the registry, so
//! an effect that is not named has no state and is never called.

use fastrand::Rng;

/// A family's named effects: a list for each stage, filled from the parts of that name.
macro_rules! named {
    ($($part:ident($list:ident: $effect:ty),)*) => {
        /// The named effects.
        #[derive(Default)]
        pub struct Named {
            any: bool,
            $($list: Vec<Metered<$effect>>),*
        }

        impl Named {
            /// Takes an effect in behind those that are there; gives back what belongs elsewhere.
            pub fn take(&mut self, name: &'static str, part: Part) -> Option<Part> {
                match part {
                    $(Part::$part(part) => self.$list.push(Metered::new(name, part)),)*
                    other => return Some(other),
                }
                self.any = true;
                None
            }

            /// Whether there is one.
            pub fn any(&self) -> bool {
                self.any
            }

            /// What each has cost so far.
            pub fn costs(&self) -> impl Iterator<Item = Cost> {
                core::iter::empty()$(.chain(self.$list.iter().map(Metered::cost)))*
            }
        }
    };
}

pub mod contact;
pub mod drive;
pub mod link;
pub mod sensor;
pub mod set;

use crate::key::Values;
use crate::watch::Cost;
use std::time::{Duration, Instant};

/// What an effect is built from.
#[derive(Clone, Copy, Debug)]
pub struct Build<'a> {
    /// Its checked values.
    pub values: &'a Values,
    /// Its own stream of random numbers: of the scene's seed, its name and the finger.
    pub seed: u64,
}

/// A built effect, by the stage at which it acts.
pub enum Part {
    /// See [`sensor::Pressure`].
    Pressure(Box<dyn sensor::Pressure>),
    /// See [`sensor::Conductance`].
    Conductance(Box<sensor::Conductance>),
    /// See [`sensor::Network`].
    Network(Box<sensor::Network>),
    /// See [`sensor::Volts`].
    Volts(Box<sensor::Volts>),
    /// See [`sensor::Codes`].
    Codes(Box<sensor::Codes>),
    /// See [`contact::Shape`].
    Shape(Box<dyn contact::Shape>),
    /// See [`contact::Memory`].
    Memory(Box<dyn contact::Memory>),
    /// See [`contact::Series`].
    Series(Box<contact::Series>),
    /// See [`contact::Strength`].
    Strength(Box<dyn contact::Strength>),
    /// See [`contact::Tangent`].
    Tangent(Box<contact::Tangent>),
    /// See [`contact::Body`].
    Body(Box<contact::Body>),
    /// See [`drive::Inertia`].
    Inertia(Box<drive::Inertia>),
    /// See [`drive::Electric`].
    Electric(Box<dyn drive::Electric>),
    /// See [`drive::Resist`].
    Resist(Box<drive::Resist>),
    /// See [`drive::Potential`].
    Potential(Box<dyn drive::Potential>),
    /// See [`drive::Play`].
    Play(Box<drive::Play>),
    /// See [`drive::Encoder`].
    Encoder(Box<drive::Encoder>),
    /// See [`link::Clock`].
    Clock(Box<link::Clock>),
    /// See [`link::Packets`].
    Packets(Box<link::Packets>),
}

/// The seed of an effect's or a drawn value's own stream, so that naming one does not change the numbers of another.
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

/// One of so many calls is timed: reading the clock costs about as much as a small effect.
const TIMED: u64 = 256;

/// An effect with the meter for its ledger. What it measures never reaches the run.
pub struct Metered<T: ?Sized> {
    name: &'static str,
    calls: u64,
    timed_calls: u64,
    timed: Duration,
    part: Box<T>,
}

impl<T: ?Sized> Metered<T> {
    /// With nothing on the meter.
    pub fn new(name: &'static str, part: Box<T>) -> Self {
        Self { name, calls: 0, timed_calls: 0, timed: Duration::ZERO, part }
    }

    /// Calls the effect.
    pub fn call<R>(&mut self, f: impl FnOnce(&mut T) -> R) -> R {
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

    /// The effect, to look at.
    pub fn part(&self) -> &T {
        &self.part
    }

    /// What it has cost so far.
    pub fn cost(&self) -> Cost {
        let share = self.calls as f64 / self.timed_calls.max(1) as f64;
        Cost { effect: self.name, evaluations: self.calls, seconds: self.timed.as_secs_f64() * share }
    }
}

/// A number of the normal distribution, mean 0 and deviation 1: Marsaglia's polar method. The logarithm is libm's own,
/// in plain Rust.
pub fn normal(rng: &mut Rng) -> f64 {
    loop {
        let (u, v) = (2.0 * rng.f64() - 1.0, 2.0 * rng.f64() - 1.0);
        let s = u * u + v * v;
        if s > 0.0 && s < 1.0 {
            return u * (-2.0 * libm::log(s) / s).sqrt();
        }
    }
}

/// So many of them, to the bit what [`normal`] gives one after the other, but quicker: no draw that is thrown away is
/// waited for.
pub fn normals<const COUNT: usize>(rng: &mut Rng) -> [f64; COUNT] {
    let (mut first, mut squares) = ([0.0; COUNT], [0.0; COUNT]);
    let mut drawn = 0;
    while drawn < COUNT {
        let (u, v) = (2.0 * rng.f64() - 1.0, 2.0 * rng.f64() - 1.0);
        let s = u * u + v * v;
        (first[drawn], squares[drawn]) = (u, s);
        drawn += usize::from((s > 0.0) & (s < 1.0));
    }
    for (u, s) in first.iter_mut().zip(squares) {
        *u *= (-2.0 * libm::log(s) / s).sqrt();
    }
    first
}

/// One of [`normal`], drawn again beyond three deviations: for what a part is made with, since worse parts are thrown
/// away.
pub fn normal_within_3(rng: &mut Rng) -> f64 {
    loop {
        let draw = normal(rng);
        if draw.abs() <= 3.0 {
            return draw;
        }
    }
}

/// A waiting time of a Poisson process; infinite at rate 0.
pub fn waiting_s(rng: &mut Rng, rate_per_s: f64) -> f64 {
    -libm::log(1.0 - rng.f64()) / rate_per_s
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn many_normal_numbers_are_those_drawn_one_by_one() {
        let (mut one_by_one, mut at_once) = (Rng::with_seed(5), Rng::with_seed(5));
        for _ in 0..100_000 {
            let expected: [u64; 10] = core::array::from_fn(|_| normal(&mut one_by_one).to_bits());
            assert_eq!(normals::<10>(&mut at_once).map(f64::to_bits), expected);
        }
        assert_eq!(one_by_one.u64(..), at_once.u64(..));
    }
}
