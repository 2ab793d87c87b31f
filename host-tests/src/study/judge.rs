//! Errors of what the variants returned, against arbitrary precision.

use super::frames;
use super::front::Point;
use super::inputs::{Inputs, Pair};
use super::kernels::{Kernel, Measure};
use super::output::Ran;
use crate::figures::tip;
use crate::prove::reference::{Real, Reference, real};

/// Largest error and root of the mean square.
#[derive(Clone, Copy, Debug, Default)]
pub struct Errors {
    max: f64,
    squares: f64,
    count: u32,
}

impl Errors {
    /// Takes one in.
    pub fn add(&mut self, error: f64) {
        let error = error.abs();
        // A variant without a result is infinitely wrong.
        let error = if error.is_nan() { f64::INFINITY } else { error };
        self.max = self.max.max(error);
        self.squares += error * error;
        self.count += 1;
    }

    /// The largest, and the root of the mean square.
    pub fn both(&self) -> [f64; 2] {
        [self.max, (self.squares / f64::from(self.count.max(1))).sqrt()]
    }
}

/// The variants of a kernel as points; cheapest first.
///
/// # Errors
/// A variant was not run on all inputs.
pub fn points(kernel: &Kernel, runs: &[Ran], inputs: &Inputs) -> Result<Vec<Point>, String> {
    let of_kernel = runs.iter().filter(|ran| ran.kernel == kernel.name);
    let mut points = of_kernel.map(|ran| point(kernel, ran, inputs)).collect::<Result<Vec<_>, _>>()?;
    points.sort_by(|a, b| a.cycles().cmp(&b.cycles()).then(a.error_max.total_cmp(&b.error_max)));
    if points.is_empty() { Err(format!("nothing was run for {}", kernel.name)) } else { Ok(points) }
}

fn point(kernel: &Kernel, ran: &Ran, inputs: &Inputs) -> Result<Point, String> {
    let ([error_max, error_rms], other) = match kernel.measure {
        Measure::Scalar { section, exact, relative } => {
            (scalar(ran, section(inputs), exact, relative).ok_or_else(|| incomplete(ran))?, None)
        }
        Measure::Frames => {
            let [force, centre] = frames::errors(&ran.returned, &inputs.frames).ok_or_else(|| incomplete(ran))?;
            (force, Some(centre))
        }
    };
    let Ran { name, firmware, cost, .. } = ran.clone();
    Ok(Point { name, firmware, cost, error_max, error_rms, other })
}

fn incomplete(ran: &Ran) -> String {
    format!("{}: {} was not run on all inputs", ran.kernel, ran.name)
}

fn scalar(ran: &Ran, inputs: &[Pair], exact: fn(&Reference, &Pair) -> Real, relative: bool) -> Option<[f64; 2]> {
    let reference = Reference::new(&tip());
    let mut errors = Errors::default();
    if ran.returned.len() != inputs.len() {
        return None;
    }
    for (input, returned) in inputs.iter().zip(&ran.returned) {
        let exact = exact(&reference, input);
        errors.add(match returned.first()?.real() {
            None => f64::NAN,
            Some(value) if relative => ((value - &exact) / exact).to_f64().value(),
            Some(value) => (value - exact).to_f64().value(),
        });
    }
    Some(errors.both())
}

/// The value of an input.
pub fn input(bits: i32) -> Real {
    real(bits, 16)
}
