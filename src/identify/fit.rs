//! Points in millimetres and newtons to a modulus in kilopascals.

use super::sums::{Line, POINT_BITS, SLOPE_BITS, Sums, mul, quotient};
use super::{Modulus, POINTS_MAX, POINTS_MIN, RESIDUAL_PART, ROOT_RESIDUAL_PART, Refusal, SIGMA_PART, SPAN_MIN};
use crate::model::{MODULUS_MAX, MODULUS_MIN};
use crate::root::floor_sqrt;
use crate::units::{Kilopascals, Millimetres, Newtons};

/// 1000/pi in Q22: kPa from N/mm^2 and the slope's pi.
const KPA_PER_SLOPE_Q22: i64 = 1_335_088_429;

/// F against d^2 through the origin, for a known indentation.
///
/// ```
/// use fingertip::identify::DepthFit;
/// use fingertip::model::Tip;
/// use fingertip::units::{Kilopascals, Millimetres};
///
/// let tip = Tip::new(Millimetres::from_bits(10 << 24), Kilopascals::from_bits(250 << 16)).unwrap();
/// let mut fit = DepthFit::new(tip.depth_max(), tip.force_max());
/// for hundredths in 1..=300 {
///     let depth = Millimetres::from_bits(hundredths * ((1 << 24) / 100));
///     fit.add(depth, tip.force(depth));
/// }
/// let modulus = fit.modulus().unwrap().modulus.0.to_num::<f64>();
/// assert!((modulus - 250.0).abs() < 0.1, "{modulus} kPa");
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct DepthFit {
    sums: Sums,
    depth: Axis,
    force: Axis,
}

impl DepthFit {
    /// No points yet; those deeper or with more force than this will be left out.
    pub fn new(depth_max: Millimetres, force_max: Newtons) -> Self {
        Self { sums: Sums::EMPTY, depth: Axis::new(depth_max.to_bits()), force: Axis::new(force_max.to_bits()) }
    }

    /// Takes a point, where it is within the limits.
    pub fn add(&mut self, depth: Millimetres, force: Newtons) {
        if self.sums.count() >= POINTS_MAX || !self.depth.holds(depth.to_bits()) || !self.force.holds(force.to_bits()) {
            return;
        }
        let share = u64::from(self.depth.take(depth.to_bits()));
        let square = (share * share + (1 << (POINT_BITS - 1))) >> POINT_BITS;
        self.sums.add(square as u32, self.force.share(force.to_bits()));
    }

    /// The modulus by the points so far.
    ///
    /// # Errors
    /// What the points lack.
    pub fn modulus(&self) -> Result<Modulus, Refusal> {
        enough(self.sums.count(), self.depth.span())?;
        let line = sound(self.sums.through_origin(), RESIDUAL_PART)?;
        // F = s d^2 with shares of 2^(15 - shift) N and of the square of 2^(7 - shift) mm.
        let exponent = 1 + 2 * self.depth.exponent() - self.force.exponent();
        let modulus = modulus(line.slope, exponent)?;
        let sigma = part(modulus, line.sigma, line.slope);
        finish(Modulus { modulus, sigma, contact: Millimetres::ZERO, points: self.sums.count() as u16 })
    }
}

impl Extend<(Millimetres, Newtons)> for DepthFit {
    fn extend<T: IntoIterator<Item = (Millimetres, Newtons)>>(&mut self, points: T) {
        points.into_iter().for_each(|(depth, force)| self.add(depth, force));
    }
}

/// sqrt(F) against travel, for a contact point that is not known beforehand.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct TravelFit {
    sums: Sums,
    from: Millimetres,
    travel: Axis,
    root: Axis,
}

impl TravelFit {
    /// Takes no points at all.
    pub const EMPTY: Self = Self { sums: Sums::EMPTY, from: Millimetres::ZERO, travel: Axis::EMPTY, root: Axis::EMPTY };

    /// No points yet; those before `from`, more than `range` beyond it or with more force than `force_max` will be left
    /// out.
    pub fn new(from: Millimetres, range: Millimetres, force_max: Newtons) -> Self {
        Self { sums: Sums::EMPTY, from, travel: Axis::new(range.to_bits()), root: Axis::new(root(force_max.to_bits())) }
    }

    /// Takes a point of the press, all of them with contact, where it is within the limits.
    pub fn add(&mut self, travel: Millimetres, force: Newtons) {
        let travel = travel.to_bits().saturating_sub(self.from.to_bits());
        let root = root(force.to_bits());
        if self.sums.count() >= POINTS_MAX
            || !self.travel.holds(travel)
            || force < Newtons::ZERO
            || !self.root.holds(root)
        {
            return;
        }
        let share = self.travel.take(travel);
        self.sums.add(share, self.root.share(root));
    }

    /// How many points were taken.
    pub fn points(&self) -> u32 {
        self.sums.count()
    }

    /// From the shallowest to the deepest point.
    pub fn span(&self) -> Millimetres {
        Millimetres::from_bits(self.travel.span())
    }

    /// The modulus by the points so far.
    ///
    /// # Errors
    /// What the points lack.
    pub fn modulus(&self) -> Result<Modulus, Refusal> {
        enough(self.sums.count(), self.travel.span())?;
        let line = sound(self.sums.line(), ROOT_RESIDUAL_PART)?;
        // F = s^2 d^2, in shares of 2^(7 - shift) of both.
        let square = mul(line.slope, line.slope, SLOPE_BITS);
        let modulus = modulus(square, 2 * (self.travel.exponent() - self.root.exponent()))?;
        let sigma = part(modulus, 2 * line.sigma, line.slope);
        let contact = self.travel.value(line.zero).saturating_add(i64::from(self.from.to_bits()));
        let contact = Millimetres::from_bits(contact.clamp(i32::MIN.into(), i32::MAX.into()) as i32);
        finish(Modulus { modulus, sigma, contact, points: self.sums.count() as u16 })
    }
}

impl Extend<(Millimetres, Newtons)> for TravelFit {
    fn extend<T: IntoIterator<Item = (Millimetres, Newtons)>>(&mut self, points: T) {
        points.into_iter().for_each(|(travel, force)| self.add(travel, force));
    }
}

/// A quantity's full scale, a power of two that holds its largest value, and what was seen of it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Axis {
    max: i32,
    shift: u32,
    least: i32,
    most: i32,
}

impl Axis {
    const EMPTY: Self = Self { max: -1, shift: 0, least: i32::MAX, most: i32::MIN };

    fn new(max: i32) -> Self {
        let max = max.max(1);
        Self { max, shift: max.leading_zeros().saturating_sub(1), ..Self::EMPTY }
    }

    fn holds(&self, value: i32) -> bool {
        (0..=self.max).contains(&value)
    }

    /// The share of the full scale, Q31, of a value that it holds.
    fn share(&self, value: i32) -> u32 {
        value.unsigned_abs() << self.shift
    }

    /// The same, noted as seen.
    fn take(&mut self, value: i32) -> u32 {
        self.least = self.least.min(value);
        self.most = self.most.max(value);
        self.share(value)
    }

    fn span(&self) -> i32 {
        self.most.saturating_sub(self.least).max(0)
    }

    fn exponent(&self) -> i32 {
        self.shift as i32
    }

    /// The inverse of [`Axis::share`].
    fn value(&self, share: i64) -> i64 {
        share >> self.shift
    }
}

fn enough(points: u32, span: i32) -> Result<(), Refusal> {
    if points == 0 || span < SPAN_MIN.to_bits() {
        return Err(Refusal::Span);
    }
    if points < POINTS_MIN { Err(Refusal::Points) } else { Ok(()) }
}

/// A line that rises and that the points follow.
fn sound(line: Option<Line>, residual_part: i64) -> Result<Line, Refusal> {
    let rising = line.filter(|line| line.slope > 0);
    rising.filter(|line| line.residual <= line.square / residual_part).ok_or(Refusal::Residual)
}

/// A slope of F against d^2 (Q40, times a power of two, in N/mm^2), over pi.
fn modulus(slope: i64, exponent: i32) -> Result<Kilopascals, Refusal> {
    // Q40 times Q22 to Q16.
    let product = i128::from(slope) * i128::from(KPA_PER_SLOPE_Q22);
    let bits = product >> (46 - exponent).clamp(0, 126);
    let in_range = (i128::from(MODULUS_MIN.to_bits())..=i128::from(MODULUS_MAX.to_bits())).contains(&bits);
    if in_range { Ok(Kilopascals::from_bits(bits as i32)) } else { Err(Refusal::Range) }
}

/// modulus a / b.
fn part(modulus: Kilopascals, a: i64, b: i64) -> Kilopascals {
    let share = quotient(a, b, POINT_BITS).unwrap_or(i64::MAX).min(1 << POINT_BITS);
    Kilopascals::from_bits(mul(i64::from(modulus.to_bits()), share, POINT_BITS) as i32)
}

fn finish(modulus: Modulus) -> Result<Modulus, Refusal> {
    if modulus.sigma.to_bits() > modulus.modulus.to_bits() / SIGMA_PART { Err(Refusal::Scatter) } else { Ok(modulus) }
}

/// Square root of a force (Q16), in sqrt(N) (Q24).
fn root(force_bits: i32) -> i32 {
    floor_sqrt(u64::from(force_bits.max(0).unsigned_abs()) << 32).min(i32::MAX as u32) as i32
}
