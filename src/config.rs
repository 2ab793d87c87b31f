//! Parameters, turned once into the numbers that the loop works with.

use crate::params::{ParamError, Params};

/// What the loop derives from [`Params`].
#[derive(Clone, Debug)]
pub struct Config {
    /// The parameters it was made from.
    pub params: Params,
}

impl Config {
    /// Checks the parameters and derives the loop's constants.
    ///
    /// # Errors
    /// Names the parameter, its value and its range.
    pub fn new(params: &Params) -> Result<Self, ParamError> {
        params.check()?;
        Ok(Self { params: *params })
    }
}
