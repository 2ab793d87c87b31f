//! How the array's readings drift with temperature; see `src/control/warmth.rs`.

use crate::params::Params;

/// The array's drift.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Warm {
    /// Change of the gain for a K, Q32.
    pub gain_q32_per_k: i32,
    /// The temperature at which the gain is right, degrees Celsius in Q16.
    pub gain_at_q16: i32,
    /// Change of the whole array's zero for a K, N in Q24.
    pub zero_q24_per_k: i32,
}

impl Warm {
    pub(crate) fn new(p: &Params, [rows, columns]: [usize; 2]) -> Self {
        let taxels = (rows * columns) as i64;
        // um^2 times Pa are 10^-12 N; 16 x 32 taxels of 4 mm at 1,000 Pa are 8.2 N.
        let zero = i64::from(p.array_zero_pa_per_k) * i64::from(p.pitch_um) * i64::from(p.pitch_um);
        Self {
            gain_q32_per_k: ((i64::from(p.array_gain_ppm_per_k) << 32) / 1_000_000) as i32,
            gain_at_q16: p.array_gain_at_c << 16,
            zero_q24_per_k: ((zero * taxels / 1_000) * (1 << 24) / 1_000_000_000) as i32,
        }
    }

    /// Whether there is any.
    pub(crate) fn on(&self) -> bool {
        self.gain_q32_per_k != 0 || self.zero_q24_per_k != 0
    }
}
