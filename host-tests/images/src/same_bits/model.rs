//! Inputs and answers of the model's functions, and tactile images of contacts on and off the array with spoilt bits.

use super::{Mix, Source};
use core::num::NonZeroU16;
use fingertip::arith::floor_sqrt;
use fingertip::model::{MODULUS_MAX, MODULUS_MIN, RADIUS_MAX, RADIUS_MIN, Tip, TipError};
use fingertip::shipped::{COLUMNS, Config, ROWS, TAXELS, TactileImage};
use fingertip::units::{Kilopascals, Millimetres, Newtons};
use paper::units::{NewtonMillimetres, Radians, Ratio, SquareMillimetres};
use paper::{Displacement, LimitSurface, force_on, pressure_of, strain_of};

/// Pictures from one contact; each spoils up to two taxels more.
const PICTURES: u32 = 64;
/// The largest reading, sixteenths of a code.
const TAXEL_MAX: i64 = (1 << 18) - 1;

/// Tactile image, and the number of its uses.
pub struct Pictures {
    picture: TactileImage,
    used: u32,
}

impl Default for Pictures {
    /// The first one shows nothing.
    fn default() -> Self {
        Self { picture: TactileImage::EMPTY, used: PICTURES }
    }
}

impl Pictures {
    /// Next tactile image: the last one with a small change of a taxel, and sometimes an arbitrary or bad taxel.
    pub fn next(&mut self, sample: &Sample, config: &Config) -> &TactileImage {
        self.used += 1;
        if self.used > PICTURES {
            self.used = 1;
            self.picture = contact(sample, config);
        }
        let [noise, wild, bad, _] = sample.words;
        let place = |shift: u32| ((((sample.share_q32 >> shift) & 0xff) * TAXELS as u32) >> 8) as usize;
        let taxels = self.picture.taxels.as_flattened_mut();
        if let Some(taxel) = taxels.get_mut(place(0)) {
            *taxel += ((i64::from(*taxel) * i64::from(noise)) >> 35) as i32;
        }
        if let Some(taxel) = taxels.get_mut(place(8))
            && wild == 0
        {
            *taxel = bad >> 13;
        }
        if bad == 1 && wild < 0 {
            let (row, column) = (place(16) / COLUMNS, place(16) % COLUMNS);
            if let (Some(taxel), Some(bad)) = (taxels.get_mut(place(16)), self.picture.bad.get_mut(row)) {
                *taxel = 0;
                *bad |= 1 << column;
            }
        }
        sum_up(&mut self.picture);
        &self.picture
    }
}

/// A contact on the array or slightly off it; each taxel has the pressure at its middle.
fn contact(sample: &Sample, config: &Config) -> TactileImage {
    let half_pitch = i64::from(config.half_pitch.to_bits());
    let deepest = i64::from(config.tip.depth_max().to_bits()) >> 1;
    let d = Millimetres::from_bits(((deepest * i64::from(sample.share_q32)) >> 32) as i32);
    let [x, y, ..] = sample.words.map(|word| (12 * half_pitch * i64::from(word)) >> 31);
    let gain = i64::from(config.params.codes_per_kpa_milli) * 16;
    let mut picture = TactileImage::EMPTY;
    for (row, line) in (0..).zip(&mut picture.taxels) {
        for (column, taxel) in (0..).zip(line) {
            let place = |taxel: i64, taxels: usize| (2 * taxel + 1 - taxels as i64) * half_pitch;
            let (dx, dy) = (place(column, COLUMNS) - x, place(row, ROWS) - y);
            let r = Millimetres::from_bits(floor_sqrt((dx * dx + dy * dy).unsigned_abs()).min(i32::MAX as u32) as i32);
            let reading = (i64::from(config.tip.pressure(r, d).to_bits()) * gain / 1_000) >> 16;
            *taxel = reading.min(TAXEL_MAX) as i32;
        }
    }
    picture
}

/// Sums, moments and peak, as reading a frame gives them.
fn sum_up(picture: &mut TactileImage) {
    let TactileImage { taxels, sum, moment_x, moment_y, peak, bad, bad_count, .. } = picture;
    (*sum, *moment_x, *moment_y, *peak) = (0, 0, 0, 0);
    for (row, line) in (0..).zip(taxels) {
        for (column, taxel) in (0..).zip(line) {
            *sum += *taxel;
            *moment_x += *taxel * (2 * column + 1 - COLUMNS as i32);
            *moment_y += *taxel * (2 * row + 1 - ROWS as i32);
            *peak = (*peak).max(*taxel);
        }
    }
    *bad_count = bad.iter().map(|row| row.count_ones() as u16).sum();
}

// The model's functions: those of a tip, of a column, and the square root.

/// Name of a function, and function that adds its results to the digest.
pub type Function = (&'static str, fn(&Sample, &mut Mix));

/// One input for every function.
#[derive(Clone, Debug)]
pub struct Sample {
    /// Inputs of the tip, or the reason of its refusal.
    pub made: Result<Tip, TipError>,
    /// The last tip that was made.
    pub tip: Tip,
    pub d: Millimetres,
    /// A distance from the contact's centre: inside, at the rim, outside.
    pub r: Millimetres,
    pub theta: Radians,
    pub radius: Millimetres,
    pub force: Newtons,
    pub peak: Kilopascals,
    pub area: SquareMillimetres,
    /// Indentation, shift and tilt.
    pub displacement: Displacement,
    pub mu: Ratio,
    pub moment: NewtonMillimetres,
    /// Rings of the quadrature, few: each costs as much as a pressure.
    pub rings: NonZeroU16,
    pub share_q32: u32,
    /// Numbers of every size.
    pub words: [i32; 4],
}

impl Sample {
    /// Sample with a tip and all else 0.
    pub const fn new(tip: Tip) -> Self {
        Self {
            made: Ok(tip),
            tip,
            d: Millimetres::ZERO,
            r: Millimetres::ZERO,
            theta: Radians::ZERO,
            radius: Millimetres::ZERO,
            force: Newtons::ZERO,
            peak: Kilopascals::ZERO,
            area: SquareMillimetres::ZERO,
            displacement: Displacement { normal: Millimetres::ZERO, shift: Millimetres::ZERO, tilt: Radians::ZERO },
            mu: Ratio::ZERO,
            moment: NewtonMillimetres::ZERO,
            rings: NonZeroU16::MIN,
            share_q32: 0,
            words: [0; 4],
        }
    }

    pub fn renew(&mut self, source: &mut Source) {
        let radius = source.around(RADIUS_MIN.to_bits(), RADIUS_MAX.to_bits());
        let modulus = source.around(MODULUS_MIN.to_bits(), MODULUS_MAX.to_bits());
        self.made = Tip::new(Millimetres::from_bits(radius), Kilopascals::from_bits(modulus));
        self.tip = self.made.unwrap_or(self.tip);
        let tip = &self.tip;
        self.d = Millimetres::from_bits(source.around(1, tip.depth_max().to_bits()));
        let rim = tip.contact_radius(self.d).to_bits();
        let r = match source.up_to(3) {
            0 => rim.saturating_add(source.any() >> 8),
            1 => source.within(0, tip.radius().to_bits()),
            _ => source.around(0, rim),
        };
        self.r = Millimetres::from_bits(r);
        self.theta = Radians::from_bits(source.around(0, paper::touching_angle_max(tip, self.d).to_bits()));
        self.radius = Millimetres::from_bits(source.around(0, tip.radius().to_bits()));
        self.force = Newtons::from_bits(source.around(0, tip.force_max().to_bits()));
        self.peak = Kilopascals::from_bits(source.around(0, tip.modulus().to_bits()));
        self.area = SquareMillimetres::from_bits(source.around(0, 100 << 16));
        let reach = tip.radius().to_bits() / 2;
        self.displacement = Displacement {
            normal: self.d,
            shift: Millimetres::from_bits(source.around(-reach, reach)),
            tilt: Radians::from_bits(source.around(-1 << 24, 1 << 24)),
        };
        self.mu = Ratio::from_bits(source.around(0, 4 << 16));
        self.moment = NewtonMillimetres::from_bits(source.any());
        self.rings = NonZeroU16::MIN.saturating_add(source.up_to(7) as u16);
        self.share_q32 = source.word();
        self.words = [(); 4].map(|()| source.any());
    }
}

/// Every public function of the model that computes.
pub const FUNCTIONS: [Function; 35] = [
    ("Tip::new", |s, mix| match s.made {
        Ok(tip) => {
            mix.add(tip.depth_max().to_bits());
            mix.add(tip.force_max().to_bits());
        }
        Err(TipError::Radius(radius)) => mix.add(radius.to_bits()),
        Err(TipError::Modulus(modulus)) => mix.add(modulus.to_bits()),
    }),
    ("force", |s, mix| mix.add(s.tip.force(s.d).to_bits())),
    ("pi_y_times", |s, mix| {
        let [high, low, drop, ..] = s.words.map(i32::cast_unsigned);
        mix.add(s.tip.pi_y_times(u64::from(high) << 32 | u64::from(low), drop).cast_signed());
    }),
    ("force_by_rings", |s, mix| mix.add(s.tip.force_by_rings(s.d, s.rings).to_bits())),
    ("indentation", |s, mix| mix.add(s.tip.indentation(s.force).to_bits())),
    ("indentation_from_peak", |s, mix| mix.add(s.tip.indentation_from_peak(s.peak).to_bits())),
    ("indentation_from_radius", |s, mix| mix.add(s.tip.indentation_from_radius(s.radius).to_bits())),
    ("stiffness", |s, mix| mix.add(s.tip.stiffness(s.d).to_bits())),
    ("stiffness_at_force", |s, mix| mix.add(s.tip.stiffness_at_force(s.force).to_bits())),
    ("contact_radius", |s, mix| mix.add(s.tip.contact_radius(s.d).to_bits())),
    ("touching_angle_max", |s, mix| mix.add(paper::touching_angle_max(&s.tip, s.d).to_bits())),
    ("touching_angle", |s, mix| mix.add(paper::touching_angle(&s.tip, s.r, s.d).to_bits())),
    ("distance_at", |s, mix| mix.add(paper::distance_at(&s.tip, s.theta, s.d).to_bits())),
    ("distance_slope", |s, mix| mix.add(paper::distance_slope(&s.tip, s.theta, s.d).to_bits())),
    ("area_density", |s, mix| mix.add(paper::area_density(&s.tip, s.theta, s.d).to_bits())),
    ("height_at", |s, mix| mix.add(paper::height_at(&s.tip, s.theta, s.d).to_bits())),
    ("compression_at", |s, mix| mix.add(paper::compression_at(&s.tip, s.theta, s.d).to_bits())),
    ("particle_length", |s, mix| mix.add(s.tip.particle_length(s.r).to_bits())),
    ("compression", |s, mix| mix.add(s.tip.compression(s.r, s.d).to_bits())),
    ("strain", |s, mix| mix.add(s.tip.strain(s.r, s.d).to_bits())),
    ("pressure", |s, mix| mix.add(s.tip.pressure(s.r, s.d).to_bits())),
    ("peak_pressure", |s, mix| mix.add(s.tip.peak_pressure(s.d).to_bits())),
    ("mean_pressure", |s, mix| mix.add(s.tip.mean_pressure(s.d).to_bits())),
    ("pressure_of", |s, mix| mix.add(pressure_of(s.force, s.area).to_bits())),
    ("strain_of", |s, mix| mix.add(strain_of(s.d, s.radius).to_bits())),
    ("force_on", |s, mix| mix.add(force_on(s.peak, s.area).to_bits())),
    ("particle_force", |s, mix| mix.add(paper::particle_force(&s.tip, s.d, s.radius, s.area).to_bits())),
    ("load", |s, mix| {
        let load = paper::load(&s.tip, s.displacement);
        mix.add(load.normal.to_bits());
        mix.add(load.tangential.to_bits());
        mix.add(load.moment.to_bits());
    }),
    ("energy", |s, mix| mix.add(paper::energy(&s.tip, s.displacement).to_bits())),
    ("free_shift", |s, mix| mix.add(paper::free_shift(&s.tip, s.d, s.displacement.tilt).to_bits())),
    ("friction_shape", |s, mix| mix.add(paper::friction_shape(&s.tip, s.d).to_bits())),
    ("limit_surface", |s, mix| {
        let LimitSurface { force, moment } = paper::limit_surface(&s.tip, s.d, s.mu);
        mix.add(force.to_bits());
        mix.add(moment.to_bits());
    }),
    ("margin", |s, mix| {
        let limit = LimitSurface { force: s.force, moment: NewtonMillimetres::from_bits(s.d.to_bits()) };
        let [tangential, ..] = s.words;
        mix.add(limit.margin(Newtons::from_bits(tangential), s.moment).to_bits());
    }),
    ("floor_sqrt", |s, mix| {
        let [high, low, ..] = s.words;
        mix.add(floor_sqrt(u64::from(high.cast_unsigned()) << 32 | u64::from(low.cast_unsigned())));
    }),
    ("floor_sqrt of squares", |s, mix| {
        let [root, ..] = s.words;
        let square = u64::from(root.unsigned_abs()) * u64::from(root.unsigned_abs());
        mix.add(floor_sqrt(square));
        mix.add(floor_sqrt(square.wrapping_sub(1)));
    }),
];

#[cfg(test)]
mod tests {
    use super::*;
    use crate::same_bits::Source;
    use crate::single::{self, Refined};
    use fingertip::contact;
    use fingertip::params::Params;

    #[test]
    fn many_pictures_are_contacts_that_take_the_fit_and_many_are_not() {
        let config = Config::shipped(&Params::DEFAULT).unwrap();
        let (mut source, mut sample, mut pictures) = (Source::new(), Sample::new(config.tip), Pictures::default());
        let (mut good, mut fitted, mut spoilt) = (0, 0, 0);
        for _ in 0..20_000 {
            sample.renew(&mut source);
            let picture = pictures.next(&sample, &config);
            let contact = single::read(picture, Refined::One, &config);
            let sums = contact::from_sums(picture, &config);
            good += u32::from(contact.confidence >= contact::CONFIDENCE_LEAST);
            fitted += u32::from(contact.force != sums.force);
            spoilt += u32::from(contact.bad_taxels > 0);
        }
        assert!([good, fitted, spoilt].iter().all(|count| (2_000..17_000).contains(count)), "{good} {fitted} {spoilt}");
    }
}
