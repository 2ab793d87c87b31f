//! The array's characteristic where it is not a line.

/// The constants of f(u) = u (1 + p u / 4096) / (1 + p): see [`crate::params::Params::curve_permille`], which is p.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Curve {
    /// q = 1 / (1 + p), Q26.
    pub least: i32,
    /// q p, Q30.
    pub growth: i32,
}

impl Curve {
    /// Fractional bits of q.
    pub(crate) const FACTOR_BITS: u32 = 26;

    /// By p in permille, at most 8,000; none is a line.
    pub(crate) fn new(permille: i32) -> Option<Self> {
        let permille = permille.max(0).min(8_000);
        let whole = i64::from(1_000 + permille);
        let least = ((1_000 << Self::FACTOR_BITS) + whole / 2) / whole;
        let growth = ((i64::from(permille) << 30) + whole / 2) / whole;
        (permille > 0).then_some(Self { least: least as i32, growth: growth as i32 })
    }
}
