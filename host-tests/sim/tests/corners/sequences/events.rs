//! Sequences, drawn.

use crate::{log_uniform, object, uniform};
use core::fmt;
use fastrand::Rng;
use fingertip::measure::Task;

/// Something that the host or the surroundings do.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Event {
    /// A goal, N.
    Goal(f64),
    Torque(bool),
    Tare,
    Clear,
    /// A motion that measures.
    Measure(Task),
    /// The object's surface moves, towards the tip where `by_mm` is below 0.
    Move {
        by_mm: f64,
        mm_per_s: f64,
    },
    /// The object is taken away.
    Remove,
    /// The object is put in its place again, or in front of the tip.
    PutBack,
    Wait,
}

impl Event {
    fn drawn(rng: &mut Rng) -> Self {
        match rng.u32(0..24) {
            0..6 => Self::Goal(log_uniform(rng, 0.2, 7.0)),
            6..9 => Self::Goal(0.0),
            9..11 => Self::Torque(false),
            11..15 => Self::Torque(true),
            15 => Self::Tare,
            16 => Self::Clear,
            17..19 => Self::Measure(Task::Press),
            19 => Self::Measure(rng.choice([Task::Jog, Task::Strokes]).expect("there are two")),
            20..22 => Self::Move { by_mm: uniform(rng, -2.0, 2.0), mm_per_s: uniform(rng, 5.0, 60.0) },
            22 => Self::Remove,
            _ => rng.choice([Self::PutBack, Self::Wait]).expect("there are two"),
        }
    }
}

/// A finger, what happens to it, and how long after what was before.
#[derive(Clone, Debug)]
pub struct Sequence {
    seed: u64,
    pub distance_mm: f64,
    yield_mm_per_n: f64,
    modulus_kpa: f64,
    friction_mnm: f64,
    noise: bool,
    pub events: Vec<(f64, Event)>,
}

impl Sequence {
    /// The sequence of a number.
    pub fn drawn(seed: u64) -> Self {
        let mut rng = Rng::with_seed(seed);
        let count = rng.usize(4..=12);
        let mut events = Vec::new();
        // The drive is measured with torque off; all else needs torque.
        if rng.u32(0..4) != 0 {
            events.extend([(0.001, Event::Torque(true)), (0.001, Event::Goal(log_uniform(&mut rng, 0.2, 7.0)))]);
        }
        events.extend((0..count).map(|_| (log_uniform(&mut rng, 0.001, 0.4), Event::drawn(&mut rng))));
        events.push((
            log_uniform(&mut rng, 0.001, 0.4),
            if rng.bool() { Event::Goal(0.0) } else { Event::Torque(false) },
        ));
        Self {
            seed,
            distance_mm: uniform(&mut rng, 1.0, 5.0),
            yield_mm_per_n: if rng.bool() { 0.0 } else { log_uniform(&mut rng, 0.1, 2.0) },
            modulus_kpa: log_uniform(&mut rng, 150.0, 400.0),
            friction_mnm: uniform(&mut rng, 0.0, 0.25),
            noise: rng.bool(),
            events,
        }
    }

    /// The finger.
    pub fn tables(&self) -> String {
        let Self { seed, modulus_kpa, friction_mnm, .. } = self;
        format!(
            "seed = {seed}\n[controller]\ndirection_confirmed = 1\n[tip]\nmodulus_kpa = {modulus_kpa:?}\n{}[effects.dry_friction]\ntorque_mnm = {friction_mnm:?}\n{}",
            object(self.distance_mm, self.yield_mm_per_n),
            if self.noise { "[effects.noise]\nrms_codes = 1.5\n" } else { "" }
        )
    }

    /// The time within which pressing ends, and the force that may be left: what friction holds of a motor without
    /// voltage. A driven release of a very soft object takes longer, and a tip that a shorted motor lets go slows down
    /// towards the end.
    pub fn stops(&self, driven: bool) -> (f64, f64) {
        let soft = self.yield_mm_per_n > 1.0;
        if driven {
            return (if soft { 0.8 } else { 0.5 }, 0.0);
        }
        // The drum of 12 mm behind 43:1.
        (if soft { 1.5 } else { 1.0 }, 0.05 + self.friction_mnm * 43.0 / 12.0)
    }
}

impl fmt::Display for Sequence {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { distance_mm, yield_mm_per_n, modulus_kpa, friction_mnm, noise, .. } = self;
        writeln!(
            f,
            "  object at {distance_mm:.3} mm, {yield_mm_per_n:.3} mm/N; {modulus_kpa:.0} kPa, {friction_mnm:.3} mN m, noise {noise}"
        )?;
        let mut time_s = 0.0;
        for (after_s, event) in &self.events {
            time_s += after_s;
            writeln!(f, "  + {after_s:.4} s, {time_s:.4} s at least: {event:?}")?;
        }
        Ok(())
    }
}
