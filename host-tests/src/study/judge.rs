//! Errors of what the variants returned, against arbitrary precision.

use super::frames;
use super::front::Point;
use super::inputs::{Inputs, Pair, Seen};
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
        Measure::Fit { noisy } => {
            let [force, centre] = fit(ran, &inputs.fits[usize::from(noisy)]).ok_or_else(|| incomplete(ran))?;
            (force, Some(centre))
        }
        Measure::Control => (control(ran, &inputs.control).ok_or_else(|| incomplete(ran))?, None),
        // Nothing to compare with: neither on a front nor beaten.
        Measure::Cost => ([f64::NAN; 2], None),
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

/// Force and centre against the truth of the scene.
fn fit(ran: &Ran, seen: &[Seen]) -> Option<[[f64; 2]; 2]> {
    let (mut force, mut centre) = (Errors::default(), Errors::default());
    if ran.returned.len() != seen.len() {
        return None;
    }
    for (Seen { scene, .. }, returned) in seen.iter().zip(&ran.returned) {
        let [read, x, y] = returned[..] else { return None };
        force.add(read.to_f64() - scene.force_n());
        centre.add((x.to_f64() - scene.x_mm).hypot(y.to_f64() - scene.y_mm));
    }
    Some([force.both(), centre.both()])
}

/// Against the same law, y = y1 + 1.591 e - 1.53 e1 within 0.03 of y1 and within 1 either way, in arbitrary precision.
fn control(ran: &Ran, inputs: &[Pair]) -> Option<[f64; 2]> {
    let thousandths = |n: i32| real(n, 0) / real(1_000, 0);
    let held = |value: Real, low: Real, high: Real| if value < low { low } else { value.min(high) };
    let (mut before, mut y, mut errors) = (real(0, 0), real(0, 0), Errors::default());
    if ran.returned.len() != inputs.len() {
        return None;
    }
    for ([error, _], returned) in inputs.iter().zip(&ran.returned) {
        let error = input(*error);
        let wanted = &y + thousandths(1_591) * &error - thousandths(1_530) * &before;
        let slewed = held(wanted, &y - thousandths(30), &y + thousandths(30));
        y = held(slewed, real(-1, 0), real(1, 0));
        before = error;
        errors.add(returned.first()?.real().map_or(f64::NAN, |value| (value - &y).to_f64().value()));
    }
    Some(errors.both())
}

/// The value of an input.
pub fn input(bits: i32) -> Real {
    real(bits, 16)
}
