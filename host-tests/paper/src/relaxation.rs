//! Viscoelasticity: the quasi-linear response as a small recursive filter.
//!
//! A soft tip held at an indentation relaxes. In the quasi-linear picture the elastic force `F_e` passes through a
//! relaxation function `G`,
//!
//! ```text
//! F(t) = integral of G(t - u) dF_e(u),   G(t) = c_0 + sum of c_i exp(-t / tau_i),   c_0 + sum of c_i = 1
//!      = F_e(t) - sum of c_i m_i(t),     tau_i dm_i/dt + m_i = F_e
//! ```
//!
//! so that each term remembers a low-passed force `m_i` and takes the share `c_i` of it away. With `F_e` taken as
//! straight between samples, a step of the period T is exact: with `x = T/tau`,
//!
//! ```text
//! m' = m + A (F_e - m) + B (F_e' - F_e),   A = 1 - exp(-x),   B = 1 - A/x
//! ```
//!
//! The memory has 48 bits after the point. A constant force is reached to within `2^-48 N / A`, below 2^-27 N for the
//! slowest term allowed, and stays there: the output then neither drifts nor cycles.

use crate::touching::mul_high;
use crate::units::Ratio;
use fingertip::units::Newtons;

/// The longest time constant, in periods.
pub const PERIODS_MAX: u32 = 1 << 20;

/// A term of the relaxation function.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct RelaxationTerm {
    /// The share `c` of the elastic force that relaxes, 0 to 1.
    pub share: Ratio,
    /// Its time constant `tau`, us: from one period to [`PERIODS_MAX`] periods.
    pub time_constant_us: u32,
}

/// A relaxation function that the filter does not cover.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum RelaxationError {
    /// The period is 0.
    #[error("a period of 0 us: at least 1 us is needed")]
    Period,
    /// A term's share is not within 0 to 1.
    #[error("term {term} has the share {}: 0 to 1 are covered", share.0)]
    Share {
        /// Which term.
        term: usize,
        /// Its share.
        share: Ratio,
    },
    /// The shares add up to more than 1, in 2^-16.
    #[error("the shares add up to {0}/65536: at most 65536/65536 can relax")]
    Sum(i64),
    /// The time constant of a term is out of range.
    #[error("term {term} has a time constant of {value_us} us: {min_us} to {max_us} us are covered")]
    TimeConstant {
        /// Number of the term.
        term: usize,
        /// Its time constant, us.
        value_us: u32,
        /// Minimum, us: the period.
        min_us: u32,
        /// Maximum, us.
        max_us: u32,
    },
}

/// A relaxation function of `N` terms, sampled at a fixed period.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Relaxation<const N: usize> {
    terms: [Coefficients; N],
}

/// Coefficients of a term for a step: share in Q16, `A` and `B` in Q64.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
struct Coefficients {
    share: i64,
    follow: u64,
    lead: u64,
}

/// Load history of the tip; see [`Relaxation::step`].
///
/// ```
/// use fingertip::units::Newtons;
/// use paper::units::Ratio;
/// use paper::{Relaxation, RelaxationState, RelaxationTerm};
///
/// // A fifth of the force creeps away with a time constant of 0.3 s; frames of 100 us.
/// let term = RelaxationTerm { share: Ratio::from_bits(13_107), time_constant_us: 300_000 };
/// let filter = Relaxation::new(100, &[term]).unwrap();
/// let mut state = RelaxationState::REST;
/// let held = Newtons::from_bits(2 << 16);
/// let first = filter.step(&mut state, held);
/// let last = (0..30_000).map(|_| filter.step(&mut state, held)).last().unwrap();
/// assert!(first.0 > 1.99 && (1.59..1.61).contains(&last.0.to_num::<f64>()), "{first:?} {last:?}");
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct RelaxationState<const N: usize> {
    elastic_q48: i64,
    memory_q48: [i64; N],
}

impl<const N: usize> RelaxationState<N> {
    /// State after a long time without load.
    pub const REST: Self = Self { elastic_q48: 0, memory_q48: [0; N] };

    /// State after a long time under a constant elastic force.
    pub fn settled(elastic: Newtons) -> Self {
        let elastic_q48 = widen(elastic);
        Self { elastic_q48, memory_q48: [elastic_q48; N] }
    }
}

impl<const N: usize> Relaxation<N> {
    /// The filter for a sampling period and the terms of the relaxation function.
    ///
    /// # Errors
    /// Names the term, its value and its range.
    pub fn new(period_us: u32, terms: &[RelaxationTerm; N]) -> Result<Self, RelaxationError> {
        if period_us == 0 {
            return Err(RelaxationError::Period);
        }
        let max_us = period_us.saturating_mul(PERIODS_MAX);
        let mut sum = 0;
        for (term, &RelaxationTerm { share, time_constant_us }) in terms.iter().enumerate() {
            if !(0..=1 << 16).contains(&share.to_bits()) {
                return Err(RelaxationError::Share { term, share });
            }
            if time_constant_us < period_us || time_constant_us > max_us {
                let (value_us, min_us) = (time_constant_us, period_us);
                return Err(RelaxationError::TimeConstant { term, value_us, min_us, max_us });
            }
            sum += i64::from(share.to_bits());
        }
        if sum > 1 << 16 {
            return Err(RelaxationError::Sum(sum));
        }
        Ok(Self { terms: terms.map(|term| Coefficients::new(period_us, term)) })
    }

    /// Force after one period, in which the elastic force changes linearly to `elastic`.
    ///
    /// An elastic force below 0 counts as 0: a tip does not pull. The result is negative while a released tip
    /// recovers: then the tip has left the object.
    pub fn step(&self, state: &mut RelaxationState<N>, elastic: Newtons) -> Newtons {
        let now_q48 = widen(elastic);
        let before_q48 = core::mem::replace(&mut state.elastic_q48, now_q48);
        let mut left_q48 = now_q48;
        for (term, memory_q48) in self.terms.iter().zip(&mut state.memory_q48) {
            let followed = share_of(before_q48 - *memory_q48, term.follow);
            *memory_q48 += followed + share_of(now_q48 - before_q48, term.lead);
            left_q48 -= term.share * (*memory_q48 >> 16);
        }
        Newtons::from_bits((((left_q48 >> 31) + 1) >> 1) as i32)
    }
}

impl Coefficients {
    fn new(period_us: u32, term: RelaxationTerm) -> Self {
        let x = (u128::from(period_us) << 63) / u128::from(term.time_constant_us);
        // 1 - x/n (1 - x/(n+1) (1 - ...)): the tails of the exponential series, Q63.
        let tail = |from: u128| {
            let one = 1_u128 << 63;
            (from..from + 24).rev().fold(one, |inner, n| one - ((x * inner) >> 63) / n)
        };
        let follow = (x * tail(2)) >> 62;
        let lead = (x * tail(3)) >> 63;
        Self { share: term.share.to_bits().into(), follow: follow as u64, lead: lead as u64 }
    }
}

/// A force in Q48, not below 0.
fn widen(force: Newtons) -> i64 {
    i64::from(force.to_bits().max(0)) << 32
}

/// A Q64 share of a number, rounded towards 0.
fn share_of(number: i64, share_q64: u64) -> i64 {
    let magnitude = mul_high(number.unsigned_abs(), share_q64) as i64;
    if number < 0 { -magnitude } else { magnitude }
}
