//! The same random inputs for every function on any processor, and a digest of the results of each.
//!
//! Two processors whose digests are equal agree in every bit of every answer. Each input goes to all functions of the
//! model ([`model`]) and to the types with a configuration or a state ([`machines`]); about a quarter of the numbers is
//! outside the functions' domains. Functions of a whole frame, [`machines::FRAMES`], get every 8th input, and costly
//! constructors, [`machines::MADE`], every 1024th.

pub mod machines;
pub mod model;

use core::fmt::{Debug, Write};
use fingertip::config::ConfigError;
use fingertip::shipped::Config;
use machines::Machines;
use model::Sample;

/// Inputs that a comparison takes.
pub const INPUTS: u32 = 1_000_000;

/// Number of functions that are compared.
pub const FUNCTIONS: usize =
    model::FUNCTIONS.len() + machines::STEPS.len() + machines::FRAMES.len() + machines::MADE.len();

/// A seeded source of inputs: the upper half of a linear congruential generator.
#[derive(Clone, Debug)]
pub struct Source(u64);

impl Source {
    /// The source that every comparison begins with.
    pub const fn new() -> Self {
        Self(2003)
    }

    pub fn word(&mut self) -> u32 {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 32) as u32
    }

    /// 0 to `top`, evenly.
    pub fn up_to(&mut self, top: u32) -> u32 {
        ((u64::from(self.word()) * (u64::from(top) + 1)) >> 32) as u32
    }

    /// Any number, every size as likely.
    pub fn any(&mut self) -> i32 {
        self.word().cast_signed() >> self.up_to(30)
    }

    /// `min` to `max`, evenly.
    pub fn within(&mut self, min: i32, max: i32) -> i32 {
        min.saturating_add_unsigned(self.up_to(max.abs_diff(min)))
    }

    /// Half of the draws evenly from `min` to `max`, a quarter near `min`, a quarter anything.
    pub fn around(&mut self, min: i32, max: i32) -> i32 {
        match self.up_to(3) {
            0 | 1 => self.within(min, max),
            2 => min.saturating_add_unsigned(self.up_to(max.abs_diff(min)) >> self.up_to(30)),
            _ => self.any(),
        }
    }
}

impl Default for Source {
    fn default() -> Self {
        Self::new()
    }
}

/// Digest of numbers in order. Each number permutes the digest, so two runs that differ in one number keep different
/// digests, unless another difference cancels the first.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Mix(u64);

impl Mix {
    /// Digest of no numbers.
    pub const EMPTY: Self = Self(0);

    pub fn add(&mut self, number: impl Into<i64>) {
        let number: i64 = number.into();
        self.0 = (self.0.rotate_left(23) ^ number.cast_unsigned()).wrapping_mul(0x9e37_79b9_7f4a_7c15);
    }

    /// Adds every field of a value, as its text.
    pub fn add_fields(&mut self, value: &impl Debug) {
        // A digest takes every text.
        let _ = write!(self, "{value:?}");
    }

    /// The digest so far.
    pub const fn value(self) -> u64 {
        self.0
    }
}

impl Write for Mix {
    fn write_str(&mut self, text: &str) -> core::fmt::Result {
        text.bytes().for_each(|byte| self.add(byte));
        Ok(())
    }
}

pub struct Comparison {
    source: Source,
    taken: u32,
    sample: Sample,
    machines: Machines,
    mixes: [Mix; FUNCTIONS],
}

impl Comparison {
    /// Comparison before the first step.
    pub fn new() -> Result<Self, ConfigError> {
        let config = Config::shipped(&crate::CONFIRMED)?;
        let sample = Sample::new(config.tip);
        let machines = Machines::new(config);
        Ok(Self { source: Source::new(), taken: 0, sample, machines, mixes: [Mix::EMPTY; FUNCTIONS] })
    }

    /// Gives the next input to every function.
    pub fn take(&mut self) {
        self.sample.renew(&mut self.source);
        let (by_model, rest) = self.mixes.split_at_mut(model::FUNCTIONS.len());
        let (by_machine, rest) = rest.split_at_mut(machines::STEPS.len());
        let (by_frame, by_maker) = rest.split_at_mut(machines::FRAMES.len());
        for ((_, function), mix) in model::FUNCTIONS.iter().zip(by_model) {
            function(&self.sample, mix);
        }
        if self.taken.is_multiple_of(machines::MADE_EVERY) {
            for ((_, make), mix) in machines::MADE.iter().zip(by_maker) {
                make(&mut self.machines, &mut self.source, mix);
            }
        }
        if self.taken.is_multiple_of(machines::FRAME_EVERY) {
            for ((_, step), mix) in machines::FRAMES.iter().zip(by_frame) {
                step(&mut self.machines, &self.sample, mix);
            }
        }
        for ((_, step), mix) in machines::STEPS.iter().zip(by_machine) {
            step(&mut self.machines, &self.sample, mix);
        }
        self.taken += 1;
    }

    /// Changes the digest of a function like a different result, to test the comparison. Returns false for an unknown
    /// name.
    pub fn spoil(&mut self, name: &str) -> bool {
        let place = names().position(|other| other == name);
        place.and_then(|place| self.mixes.get_mut(place)).map(|mix| mix.add(1)).is_some()
    }

    /// Each function's name and digest, and how many inputs it took.
    pub fn digests(&self) -> impl Iterator<Item = (&'static str, u64, u32)> + '_ {
        functions().zip(&self.mixes).map(|((name, every), mix)| (name, mix.value(), self.taken.div_ceil(every)))
    }
}

/// The functions in the order of their digests.
pub fn names() -> impl Iterator<Item = &'static str> {
    functions().map(|(name, _)| name)
}

/// The same, each with the number of inputs of which it takes one.
fn functions() -> impl Iterator<Item = (&'static str, u32)> {
    let model = model::FUNCTIONS.iter().map(|(name, _)| (*name, 1));
    let steps = machines::STEPS.iter().map(|(name, _)| (*name, 1));
    let frames = machines::FRAMES.iter().map(|(name, _)| (*name, machines::FRAME_EVERY));
    let made = machines::MADE.iter().map(|(name, _)| (*name, machines::MADE_EVERY));
    model.chain(steps).chain(frames).chain(made)
}
