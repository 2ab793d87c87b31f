//! What the converter's codes hold.

use super::ConfigError;
use super::numbers::{exp2, narrow};
use crate::frame::CODE_MAX;
use crate::model::Tip;
use crate::params::{ParamError, Params};
use crate::units::{Kilopascals, Newtons};

/// Share of the converter's range up to saturation that a peak may use,
const SEEN: f32 = 0.95;
/// less the columns' undriven level: it is known only while the scan runs, so it counts as the highest allowed, but not
/// as more than this.
const LEVEL_MAX: i32 = 1_024;
/// The largest [`Params::row_sag_ppb_per_code`] that leaves a row of so many columns, all at the converter's top, a sag
/// of 0.32: what the boost's series and 32 bits hold. Up to ten columns that is more than the parameter's own range.
pub(super) const fn sag_max(columns: usize) -> i32 {
    (320_000_000 / (4_095 * columns)) as i32
}

/// The codes for a kPa at the full range, thousandths: fewer where the characteristic is not a line. Rounded, at most by
/// 5e-4 of them.
pub(super) fn codes_at_full_range(p: &Params) -> Result<i32, ConfigError> {
    let whole = 1_000 + p.curve_permille;
    let codes = (p.codes_per_kpa_milli.unsigned_abs() * 1_000 + whole.unsigned_abs() / 2) / whole.unsigned_abs().max(1);
    if codes < 1_000 {
        let (name, value) = ("codes_per_kpa_milli", p.codes_per_kpa_milli);
        return Err(ConfigError::Param(ParamError { name, value, min: whole, max: 200_000 }));
    }
    Ok(codes as i32)
}

/// Smallest code of a saturated taxel, see [`Params::headroom_codes`].
pub(super) const fn saturated_codes(p: &Params) -> u16 {
    CODE_MAX - p.headroom_codes as u16
}

/// See [`super::Config::force_seen`]. The sag of the row, which lets the converter see more, is left out.
pub(super) fn force_seen(p: &Params, codes_milli: i32, tip: &Tip) -> Newtons {
    let codes = SEEN * f32::from(saturated_codes(p)) - p.undriven_max_codes.min(LEVEL_MAX) as f32;
    let grown = p.curve_permille as f32 * 1e-3;
    // See `Curve`: what so many codes carry, in those of the full range.
    let codes = codes * (1.0 + grown * codes / 4_096.0) / (1.0 + grown);
    let peak_kpa = codes / (codes_milli as f32 * 1e-3);
    tip.force(tip.indentation_from_peak(Kilopascals::from_bits(narrow(peak_kpa * exp2(16)))))
}
