//! Pictures for the fit: contacts by the model, on and beside the array, that spoil bit by bit.

use super::model::Sample;
use fingertip::arith::floor_sqrt;
use fingertip::shipped::{COLUMNS, Config, Picture, ROWS, TAXELS};
use fingertip::units::Millimetres;

/// Pictures from one contact; each spoils up to two taxels more.
const PICTURES: u32 = 64;
/// The largest reading, sixteenths of a code.
const TAXEL_MAX: i64 = (1 << 18) - 1;

/// A picture and how often it was used.
pub struct Pictures {
    picture: Picture,
    used: u32,
}

impl Pictures {
    /// The first one shows nothing.
    pub const fn new() -> Self {
        Self { picture: Picture::EMPTY, used: PICTURES }
    }

    /// The next picture: the last one with a taxel a little off, and now and then one that is wild or bad.
    pub fn next(&mut self, sample: &Sample, config: &Config) -> &Picture {
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

impl Default for Pictures {
    fn default() -> Self {
        Self::new()
    }
}

/// A contact anywhere on the array or a little beside it; each taxel shows the pressure at its middle.
fn contact(sample: &Sample, config: &Config) -> Picture {
    let half_pitch = i64::from(config.half_pitch.to_bits());
    let deepest = i64::from(config.tip.depth_max().to_bits()) >> 1;
    let d = Millimetres::from_bits(((deepest * i64::from(sample.share_q32)) >> 32) as i32);
    let [x, y, ..] = sample.words.map(|word| (12 * half_pitch * i64::from(word)) >> 31);
    let gain = i64::from(config.params.codes_per_kpa_milli) * 16;
    let mut picture = Picture::EMPTY;
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
fn sum_up(picture: &mut Picture) {
    let Picture { taxels, sum, moment_x, moment_y, peak, bad, bad_count, .. } = picture;
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
        let (mut source, mut sample, mut pictures) = (Source::new(), Sample::new(config.tip), Pictures::new());
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
