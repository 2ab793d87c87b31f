//! From a picture to a contact: from a single one, and followed from frame to frame at each effort.

use super::call::pass_on;
use super::inputs::Inputs;
use crate::host::{fail, say};
use fingertip::contact::Contact;
use fingertip::contact::{self, Effort, Refined};
use fingertip::params::Params;
use fingertip::shipped::{COLUMNS, Config, Fit, Picture, ROWS};

/// What the variants read and write.
struct Bench<'a> {
    picture: Picture,
    config: &'a Config,
    fit: Fit,
    contact: Contact,
}

type Kernel = extern "C" fn(&mut Bench);

/// The name, the way, and of one that follows the pictures its effort.
const VARIANTS: [(&str, Kernel, Option<Effort>); 9] = [
    ("One", one, None),
    ("Two", two, None),
    ("Full", full, None),
    ("Fit, effort 0", follow, Some(Effort::Sum)),
    ("Fit, effort 1", follow, Some(Effort::Moments)),
    ("**Fit, effort 2**", follow, Some(Effort::OneRow)),
    ("Fit, effort 3", follow, Some(Effort::TwoRows)),
    ("Fit, effort 4", follow, Some(Effort::FiveRows)),
    ("Fit, effort 5", follow, Some(Effort::AllRows)),
];

extern "C" fn one(bench: &mut Bench) {
    bench.contact = contact::read(&bench.picture, Refined::One, bench.config);
}

extern "C" fn two(bench: &mut Bench) {
    bench.contact = contact::read(&bench.picture, Refined::Two, bench.config);
}

extern "C" fn full(bench: &mut Bench) {
    bench.contact = contact::read(&bench.picture, Refined::Full, bench.config);
}

extern "C" fn follow(bench: &mut Bench) {
    bench.contact = bench.fit.read(&bench.picture, bench.config);
}

/// Measures all over the next section: for each pitch its cases, of as many pictures each. Variants without an effort see the
/// first picture only.
#[inline(never)]
pub fn run(kernel: &str, region: &mut u32, inputs: &mut Inputs) {
    let [count, frames] = inputs.words();
    let start = inputs.place();
    for (name, variant, effort) in VARIANTS {
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
                one_case(*region, variant, effort, frames, &config, inputs);
            }
            left -= cases;
        }
        *region += 1;
    }
}

/// Measures a case.
fn one_case(region: u32, variant: Kernel, effort: Option<Effort>, frames: i32, config: &Config, inputs: &mut Inputs) {
    let fit = Fit::new(effort.unwrap_or_default());
    let mut bench = Bench { picture: Picture::EMPTY, config, fit, contact: Contact::default() };
    for frame in 0..frames {
        bench.picture = picture(inputs);
        if frame == 0 || effort.is_some() {
            pass_on(region, variant, &mut bench);
        }
    }
    let Contact { force, centre_x, centre_y, .. } = bench.contact;
    let [force, x, y] = [force.to_bits(), centre_x.to_bits(), centre_y.to_bits()];
    say(format_args!("i16 {force} i24 {x} i24 {y}"));
}

/// All taxels are good.
fn picture(inputs: &mut Inputs) -> Picture {
    let mut bytes = [0; 4 * ROWS * COLUMNS];
    inputs.read(&mut bytes);
    let mut values = bytes.as_chunks::<4>().0.iter().map(|bytes| i32::from_le_bytes(*bytes));
    let mut picture = Picture::EMPTY;
    for (row, line) in picture.taxels.iter_mut().enumerate() {
        for (column, taxel) in line.iter_mut().enumerate() {
            *taxel = values.next().unwrap_or(0);
            picture.sum += *taxel;
            picture.moment_x += *taxel * (2 * column as i32 - 9);
            picture.moment_y += *taxel * (2 * row as i32 - 9);
            picture.peak = picture.peak.max(*taxel);
        }
    }
    picture
}
