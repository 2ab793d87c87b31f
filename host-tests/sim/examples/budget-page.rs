//! Prints `docs/budget.md`: the error budget of the force.

use sim::native;
use sim::population::budget::Budget;

/// Enough that the larger causes come in the same order with other draws.
const FINGERS: usize = 24;

fn main() {
    match Budget::of(FINGERS, &native::board, &native::calibrated::board) {
        Ok(budget) => print!("{}", budget.page()),
        Err(why) => panic!("{why}"),
    }
}
