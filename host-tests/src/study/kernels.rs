//! Kernels of the study: each with its error, and the reason for the firmware's variant.

use super::inputs::{Inputs, Pair, Seen};
use super::output::Ran;
use super::page::Point;
use super::scan;
use crate::prove::random::reference_tip;
use crate::prove::reference::{Real, Reference, real};

pub struct Kernel {
    /// As the image calls it.
    pub name: &'static str,
    /// As the page calls it.
    pub title: &'static str,
    /// Result, arguments and inputs of the kernel.
    pub text: &'static str,
    /// Error with its unit, as on the plot's axis.
    pub error: &'static str,
    /// Another error, if the kernel has one.
    pub other: Option<&'static str>,
    /// Method by which the errors are found.
    pub measure: Measure,
    /// Why the firmware takes a variant that another beats; empty where none does.
    pub why: &'static str,
}

impl Kernel {
    /// True if there is an error to lay against the time.
    pub fn has_error(&self) -> bool {
        !matches!(self.measure, Measure::Cost)
    }
}

/// Method by which a kernel's errors are found.
#[derive(Clone, Copy)]
pub enum Measure {
    /// Error of a function of one or two numbers.
    Scalar { relative: bool, section: Section, exact: Exact },
    /// Sum and moments of a frame.
    Frames,
    /// A contact from pictures.
    Fit {
        /// True if the pictures have noise.
        noisy: bool,
    },
    /// Only the time is of interest.
    Cost,
}

type Section = fn(&Inputs) -> &[Pair];
type Exact = fn(&Reference, &Pair) -> Real;

const fn absolute(section: Section, exact: Exact) -> Measure {
    Measure::Scalar { relative: false, section, exact }
}

pub const KERNELS: &[Kernel] = &[
    Kernel {
        name: "root",
        title: "Square root",
        text: "sqrt(x) for 512 numbers from 0.01 to 32767, equally many in each octave.",
        error: "relative error",
        other: None,
        measure: Measure::Scalar {
            relative: true,
            section: |inputs| &inputs.root,
            exact: |_, [x, _]| input(*x).sqrt(),
        },
        why: "it has 32 exact bits of the root of 64, so an indentation of 8 mm is exact to 2^-24 mm, which single precision is not. Its \
            error here is that of a Q48 root cut to Q24.",
    },
    Kernel {
        name: "force",
        title: "Force from indentation",
        text: "F = pi Y d^2 for 512 indentations from 0.01 to 9.5 mm, a = 10 mm, Y = 250 kPa.",
        error: "force error, N",
        other: None,
        measure: absolute(|inputs| &inputs.force, |reference, [d, _]| reference.force(&input(*d))),
        why: "it has no floating-point numbers, and is proven to be correctly rounded for every radius from 4 to 16 mm and \
            every modulus from 20 to 2000 kPa. The cheaper integers serve only the range of this table.",
    },
    Kernel {
        name: "indentation",
        title: "Indentation from force",
        text: "d = sqrt(F / (pi Y)) for 512 forces from 1 mN to 70 N.",
        error: "indentation error, mm",
        other: None,
        measure: absolute(|inputs| &inputs.indentation, |reference, [force, _]| reference.indentation(&input(*force))),
        why: "",
    },
    Kernel {
        name: "pressure",
        title: "Pressure at a distance from the centre",
        text: "p = Y dL/L inside the contact, else 0, for 512 indentations from 0.01 to 9.5 mm and distances up to 1.05 contact radii. \
            *Textbook*: Y (L - (a - d)) / L. *No cancellation*: Y (r_c^2 - r^2) / (L (L + a - d)). No frame computes `Tip::pressure`.",
        error: "pressure error, kPa",
        other: None,
        measure: absolute(|inputs| &inputs.pressure, |reference, [r, d]| reference.pressure(&input(*r), &input(*d))),
        why: "The loop itself takes no pressure by radius: the fit has its own arithmetic. The model's function is there for hosts \
            and tests, is correctly rounded everywhere and holds no floating-point number.",
    },
    Kernel {
        name: "frame",
        title: "Frame to force, centre and flags",
        text: "100 taxels: offset, gain, row sag, tare, sum, moments, dead and saturated taxels; 256 frames of a simulated array with \
            gains of 0.8 to 1.2 and indentations of 0.1 to 5 mm. The error is that of the arithmetic, against exact sums of the same codes and gains.",
        error: "force error, N",
        other: Some("centre error, mm"),
        measure: Measure::Frames,
        why: "",
    },
    Kernel {
        name: "fit-clean",
        title: "Contact from an image, no noise",
        text: "64 contacts as in [contact.md](contact.md), with centres on and off the array, without noise, read to 1/16 code. *One*, *Two* and \
            *Full* read a single image, *Fit* the 90th of 90 at each fit level; 0 and 1 are the sums. Error against the simulated truth. All are the firmware's.",
        error: "force error, N",
        other: Some("centre error, mm"),
        measure: Measure::Fit { noisy: false },
        why: "",
    },
    Kernel {
        name: "fit-noise",
        title: "Contact from an image, 1 % of noise",
        text: "As above, each taxel with noise of 1 % of its reading.",
        error: "force error, N",
        other: Some("centre error, mm"),
        measure: Measure::Fit { noisy: true },
        why: "*One*, *Two* and *Full* read a single image. *Fit* uses several images for each step: less noise in less time a \
            frame.",
    },
    Kernel {
        name: "step",
        title: "The step and its parts",
        text: "`Pipeline::step` over a recorded stimulus of 10,000 frames with faults, by default at fit level 2; its parts over the first \
            3,000. Corrections of a real sensor are off in the step. Switched on, *by a curve* replaces *Array::read*, *with creep* replaces *goal and \
            profile*, and *warmth* (temperature compensation) is added. The *winding* is in the step.",
        error: "",
        other: None,
        measure: Measure::Cost,
        why: "",
    },
];

// Errors of what the variants returned, against arbitrary precision.

/// Largest error and root of the mean square.
#[derive(Clone, Copy, Debug, Default)]
pub struct Errors {
    max: f64,
    squares: f64,
    count: u32,
}

impl Errors {
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
pub fn points(kernel: &Kernel, runs: &[Ran], inputs: &Inputs) -> Result<Vec<Point>, String> {
    let of_kernel = runs.iter().filter(|ran| ran.kernel == kernel.name);
    let mut points = of_kernel.map(|ran| point(kernel, ran, inputs)).collect::<Result<Vec<_>, _>>()?;
    points.sort_by(|a, b| a.cycles().cmp(&b.cycles()).then(a.error_max.total_cmp(&b.error_max)));
    if points.is_empty() { Err(format!("nothing was run for {}", kernel.name)) } else { Ok(points) }
}

fn point(kernel: &Kernel, ran: &Ran, inputs: &Inputs) -> Result<Point, String> {
    let one = |errors: Option<[f64; 2]>| errors.map(|errors| (errors, None));
    let two = |errors: Option<[[f64; 2]; 2]>| errors.map(|[force, centre]| (force, Some(centre)));
    let errors = match kernel.measure {
        Measure::Scalar { relative, section, exact } => one(scalar(ran, section(inputs), exact, relative)),
        Measure::Fit { noisy } => two(fit(ran, &inputs.fits[usize::from(noisy)])),
        // Nothing to compare with: neither on a front nor beaten.
        Measure::Cost => one(Some([f64::NAN; 2])),
        Measure::Frames => two(scan::errors(&ran.returned, &inputs.frames)),
    };
    let ([error_max, error_rms], other) =
        errors.ok_or_else(|| format!("{}: {} was not run on all inputs", ran.kernel, ran.name))?;
    let Ran { name, firmware, cost, .. } = ran.clone();
    Ok(Point { name, firmware, cost, error_max, error_rms, other })
}

fn scalar(ran: &Ran, inputs: &[Pair], exact: Exact, relative: bool) -> Option<[f64; 2]> {
    let reference = Reference::new(&reference_tip());
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

pub fn input(bits: i32) -> Real {
    real(bits, 16)
}
