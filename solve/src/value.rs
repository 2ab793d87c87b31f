/// A number with its standard uncertainty, in the same unit.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Value {
    /// The estimate.
    pub value: f64,
    /// Its standard uncertainty.
    pub sigma: f64,
}

impl Value {
    /// The uncertainty as a share of the value.
    pub fn relative(&self) -> f64 {
        self.sigma / self.value.abs()
    }

    /// True if the number differs from 0 by more than three of its uncertainties.
    pub fn differs(&self) -> bool {
        self.value.abs() > 3.0 * self.sigma
    }
}
