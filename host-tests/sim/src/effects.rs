//! The effects: what a scene may name, each in a file of its own with its equations, its source and its keys.
//!
//! An effect acts at one stage and knows no other effect. A stage holds the named ones in the order of the registry, so
//! an effect that is not named has no state and is never called.

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
pub(crate) mod random;
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
