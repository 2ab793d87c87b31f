//! A configuration for an array of a certain shape.

use super::geometry::places;
use super::{Config, ConfigError};
use crate::frame::Shape;
use crate::params::Params;
use crate::scan::Clocks;
use core::ops::{Deref, DerefMut};

/// What the loop derives from [`Params`] for an array of this shape. What does not go by the shape takes the [`Config`]
/// in it.
///
/// ```
/// use fingertip::config::Shaped;
/// use fingertip::params::Params;
/// use fingertip::scan::Clocks;
///
/// // Of a microcontroller with a timer and a core of 64 MHz, and converters of 16 MHz.
/// let clocks = Clocks {
///     timer_hz: 64_000_000,
///     core_hz: 64_000_000,
///     converter_hz: 16_000_000,
///     converters: 2,
///     sample_cycles: &[4, 8, 16],
///     conversion_cycles: 13,
///     trigger_cycles: 4,
///     slot_step: 1,
///     frame_ns: None,
/// };
/// let config = Shaped::<4, 4>::new(&Params { sample_cycles: 8, ..Params::DEFAULT }, &clocks)?;
/// assert_eq!(config.timing.frame_ns, 26_406); // five slots of 338 ticks
/// # Ok::<(), fingertip::config::ConfigError>(())
/// ```
#[derive(Clone, Debug)]
pub struct Shaped<const ROWS: usize, const COLUMNS: usize> {
    config: Config,
    /// Middles of the columns in tip radii, Q15.
    pub(crate) columns: [i32; COLUMNS],
    /// Middles of the rows.
    pub(crate) rows: [i32; ROWS],
}

impl<const ROWS: usize, const COLUMNS: usize> Shaped<ROWS, COLUMNS> {
    /// Checks the parameters and derives the loop's constants, with the clocks of a board.
    ///
    /// # Errors
    /// Names the parameter, its value and its range, the scan that cannot be timed, or the two that contradict each
    /// other.
    pub fn new(params: &Params, clocks: &Clocks) -> Result<Self, ConfigError> {
        const { Shape::<ROWS, COLUMNS>::CHECKED };
        let config = Config::new(params, [ROWS, COLUMNS], clocks)?;
        Ok(Self { config, columns: places(params), rows: places(params) })
    }
}

impl<const ROWS: usize, const COLUMNS: usize> Deref for Shaped<ROWS, COLUMNS> {
    type Target = Config;

    fn deref(&self) -> &Config {
        &self.config
    }
}

impl<const ROWS: usize, const COLUMNS: usize> DerefMut for Shaped<ROWS, COLUMNS> {
    fn deref_mut(&mut self) -> &mut Config {
        &mut self.config
    }
}
