//! From a tactile image to a contact: from a single image, and followed from frame to frame at each fit level.

use super::Inputs;
use super::call::pass_on;
use crate::host::{fail, say};
use fingertip::contact::{Contact, FitLevel};
use fingertip::params::Params;
use fingertip::shipped::{COLUMNS, Config, Fit, ROWS, TactileImage};
use images::single::{self, Refined};

/// Data that the variants read and write.
struct Bench<'a> {
    picture: TactileImage,
    config: &'a Config,
    fit: Fit,
    contact: Contact,
}

type Kernel = extern "C" fn(&mut Bench);

/// Name, method, and the fit level of a method that follows the frames.
const VARIANTS: [(&str, Kernel, Option<FitLevel>); 9] = [
    ("One", one, None),
    ("Two", two, None),
    ("Full", full, None),
    ("Fit, level 0", follow, Some(FitLevel::Sum)),
    ("Fit, level 1", follow, Some(FitLevel::Moments)),
    ("**Fit, level 2**", follow, Some(FitLevel::OneRow)),
    ("Fit, level 3", follow, Some(FitLevel::TwoRows)),
    ("Fit, level 4", follow, Some(FitLevel::FiveRows)),
    ("Fit, level 5", follow, Some(FitLevel::AllRows)),
];

extern "C" fn one(bench: &mut Bench) {
    bench.contact = single::read(&bench.picture, Refined::One, bench.config);
}

extern "C" fn two(bench: &mut Bench) {
    bench.contact = single::read(&bench.picture, Refined::Two, bench.config);
}

extern "C" fn full(bench: &mut Bench) {
    bench.contact = single::read(&bench.picture, Refined::Full, bench.config);
}

extern "C" fn follow(bench: &mut Bench) {
    bench.contact = bench.fit.read(&bench.picture, bench.config);
}

/// Measures all variants over the next section: the cases of each pitch, with the same number of images each. Variants
/// without a fit level get the first image only.
#[inline(never)]
pub fn run(kernel: &str, region: &mut u32, inputs: &mut Inputs) {
    let [count, frames] = inputs.words();
    let start = inputs.place();
    for (name, variant, fit_level) in VARIANTS {
        say(format_args!("region {region} {kernel}: {name}"));
        inputs.seek(start);
        let mut left = count;
        while left > 0 {
            // Cases of a pitch follow each other: constants are made once for each, as two do not fit the stack.
            let [pitch_um, cases] = inputs.words();
            let Ok(config) = Config::shipped(&Params { pitch_um, ..Params::DEFAULT }) else {
                fail("a pitch is refused")
            };
            for _ in 0..cases {
                one_case(*region, variant, fit_level, frames, &config, inputs);
            }
            left -= cases;
        }
        *region += 1;
    }
}

fn one_case(
    region: u32,
    variant: Kernel,
    fit_level: Option<FitLevel>,
    frames: i32,
    config: &Config,
    inputs: &mut Inputs,
) {
    let fit = Fit::new(fit_level.unwrap_or_default());
    let mut bench = Bench { picture: TactileImage::EMPTY, config, fit, contact: Contact::default() };
    for frame in 0..frames {
        bench.picture = picture(inputs);
        if frame == 0 || fit_level.is_some() {
            pass_on(region, variant, &mut bench);
        }
    }
    let Contact { force, centre_x, centre_y, .. } = bench.contact;
    let [force, x, y] = [force.to_bits(), centre_x.to_bits(), centre_y.to_bits()];
    say(format_args!("i16 {force} i24 {x} i24 {y}"));
}

/// All taxels are good.
fn picture(inputs: &mut Inputs) -> TactileImage {
    let mut bytes = [0; 4 * ROWS * COLUMNS];
    inputs.read(&mut bytes);
    let mut taxels = [[0; COLUMNS]; ROWS];
    for (taxel, bytes) in taxels.as_flattened_mut().iter_mut().zip(bytes.as_chunks().0) {
        *taxel = i32::from_le_bytes(*bytes);
    }
    images::picture(&taxels, [0; ROWS])
}
