//! What is studied: each kernel with its error, and why the firmware's variant is where it is.

use super::inputs::{Inputs, Pair};
use super::judge::input;
use crate::prove::reference::{Real, Reference};

/// A kernel.
pub struct Kernel {
    /// As the image calls it.
    pub name: &'static str,
    /// As the page calls it.
    pub title: &'static str,
    /// What is worked out from what, and over which inputs.
    pub text: &'static str,
    /// The error with its unit, as the picture's axis calls it.
    pub error: &'static str,
    /// Another error, if the kernel has one.
    pub other: Option<&'static str>,
    /// How the errors are found.
    pub measure: Measure,
    /// Why the firmware takes a variant that another beats; empty where none does.
    pub why: &'static str,
}

impl Kernel {
    /// Whether there is an error to lay against the time.
    pub fn has_error(&self) -> bool {
        !matches!(self.measure, Measure::Cost)
    }
}

/// How a kernel's errors are found.
#[derive(Clone, Copy)]
pub enum Measure {
    /// One number from one or two.
    Scalar {
        /// The inputs.
        section: fn(&Inputs) -> &[Pair],
        /// The exact result.
        exact: fn(&Reference, &Pair) -> Real,
        /// Whether the error counts as a share of the result.
        relative: bool,
    },
    /// Sum and moments of a frame.
    Frames,
    /// A contact from pictures.
    Fit {
        /// Whether the pictures have noise.
        noisy: bool,
    },
    /// A controller's output.
    Control,
    /// Only the time is of interest.
    Cost,
}

/// All of them.
pub const KERNELS: &[Kernel] = &[
    Kernel {
        name: "root",
        title: "Square root",
        text: "sqrt(x) for 512 numbers from 0.01 to 32767, as many in each octave.",
        error: "relative error",
        other: None,
        measure: Measure::Scalar {
            section: |inputs| &inputs.root,
            exact: |_, [x, _]| input(*x).sqrt(),
            relative: true,
        },
        why: "The loop takes 32 exact bits of the root of 64: an indentation of 8 mm to its unit of 2^-24 mm, which single \
            precision does not hold. Its error here is that of a Q48 number whose root is cut to Q24.",
    },
    Kernel {
        name: "force",
        title: "Force from indentation",
        text: "F = pi Y d^2 for 512 indentations from 0.01 to 9.5 mm, a = 10 mm, Y = 250 kPa.",
        error: "force error, N",
        other: None,
        measure: Measure::Scalar {
            section: |inputs| &inputs.force,
            exact: |reference, [d, _]| reference.force(&input(*d)),
            relative: false,
        },
        why: "The loop holds no floating-point number. The cheaper integer way is made for this range; the model's is correctly \
            rounded for every radius from 4 to 16 mm and every modulus from 20 to 2000 kPa, which is proven.",
    },
    Kernel {
        name: "indentation",
        title: "Indentation from force",
        text: "d = sqrt(F / (pi Y)) for 512 forces from 1 mN to 70 N.",
        error: "indentation error, mm",
        other: None,
        measure: Measure::Scalar {
            section: |inputs| &inputs.indentation,
            exact: |reference, [force, _]| reference.indentation(&input(*force)),
            relative: false,
        },
        why: "",
    },
    Kernel {
        name: "pressure",
        title: "Pressure at a distance from the centre",
        text: "p = Y dL/L, 0 from the rim on, for 512 indentations from 0.01 to 9.5 mm and distances up to 1.05 contact radii. \
            *Textbook* is Y (L - (a - d)) / L; *no cancellation* is Y (r_c^2 - r^2) / (L (L + a - d)).",
        error: "pressure error, kPa",
        other: None,
        measure: Measure::Scalar {
            section: |inputs| &inputs.pressure,
            exact: |reference, [r, d]| reference.pressure(&input(*r), &input(*d)),
            relative: false,
        },
        why: "The loop itself takes no pressure by radius: the fit has its own arithmetic. The model's function is there for hosts \
            and tests, is correctly rounded everywhere and holds no floating-point number.",
    },
    Kernel {
        name: "rings",
        title: "Equation 14 by rings",
        text: "F = integral of p dS as a sum over 4 to 64 rings, by the midpoint rule in r or in u = r^2, against the closed form \
            pi Y d^2, for 32 indentations from 0.5 to 5 mm. The front is that of the sums alone: nothing sums what has a closed form. `fixed` is I16F16, *Tip* the model's `force_by_rings`.",
        error: "relative error of the force",
        other: None,
        measure: Measure::Scalar {
            section: |inputs| &inputs.rings,
            exact: |reference, [d, _]| reference.force(&input(*d)),
            relative: true,
        },
        why: "",
    },
    Kernel {
        name: "frame",
        title: "Frame to force, centre and flags",
        text: "100 taxels: offset, gain, the driven row's sag, tare, then sum, moments, and whether a taxel is dead or saturated; \
            256 frames of a simulated array with gains of 0.8 to 1.2, indentations of 0.1 to 5 mm. The error is that of the arithmetic: force and \
            centre by the sums, against those by exact sums of the same codes and gains, less those of the frame without contact. All find \
            a peak as well: `Array::read` and those that work taxel by taxel the largest taxel, the packed ones and the sums alone the largest code. \
            *Sums alone* is the pass that the firmware had before, which left single taxels to those frames that looked at them, *two rows* \
            what most frames took, *all rows* every taxel by that way. What a frame pays for all taxels, always fresh, is the difference to `Array::read`.",
        error: "force error, N",
        other: Some("centre error, mm"),
        measure: Measure::Frames,
        why: "`Array::read` works out every taxel as well. A picture of which some rows are older than others cost less, but a contact \
            whose rows nobody had looked at was never fitted: its force stayed the sum's.",
    },
    Kernel {
        name: "fit-clean",
        title: "Contact from a picture, no noise",
        text: "64 contacts, with their centres on the array or beyond its edge, as [contact.md](contact.md) draws them, without noise, read to a sixteenth of a code. *One*, *Two* and *Full* see one picture; \
            *Fit* sees 90 at each of the loop's fit_levels and is judged on the last; 0 and 1 are the sums. The error is that against the simulated truth. All are the firmware's.",
        error: "force error, N",
        other: Some("centre error, mm"),
        measure: Measure::Fit { noisy: false },
        why: "",
    },
    Kernel {
        name: "fit-noise",
        title: "Contact from a picture, 1 % of noise",
        text: "64 contacts, with their centres on the array or beyond its edge, as [contact.md](contact.md) draws them, each taxel with noise of 1 % of its reading. *One*, *Two* and *Full* see one picture; \
            *Fit* sees 90 at each of the loop's fit_levels and is judged on the last; 0 and 1 are the sums. The error is that against the simulated truth. All are the firmware's.",
        error: "force error, N",
        other: Some("centre error, mm"),
        measure: Measure::Fit { noisy: true },
        why: "*One*, *Two* and *Full* read a single picture, where nothing went before. Where pictures follow each other, *Fit* takes \
            several into each refinement: less noise for less time a frame.",
    },
    Kernel {
        name: "control",
        title: "Controller step",
        text: "A proportional and integral controller by increments with a slew limit and an output limit that wind nothing up, y = y1 + 1.591 e - 1.53 e1, \
            2048 steps. The error is that against the same law in arbitrary precision. What the firmware does instead has no \
            row here, as it answers another question: it takes a speed, its slope and a disturbance, and holds voltage, current and \
            slew. It is the *speed law with limits* among the parts of the step below; the *duty from the voltage* is the division by the supply.",
        error: "output error, share of the range",
        other: None,
        measure: Measure::Control,
        why: "",
    },
    Kernel {
        name: "step",
        title: "The step and its parts",
        text: "`Pipeline::step` over the recorded stimulus of 10,000 frames, faults included, at the default fit level, 2, and at the others; its parts over the first 3,000. What corrects for a real sensor is off in the step and costs it a \
            comparison; switched on, *by a curve* takes the place of *Array::read*, *with creep* that of *goal and profile*, and *warmth* is added. The *winding* is in the step.",
        error: "",
        other: None,
        measure: Measure::Cost,
        why: "",
    },
];
