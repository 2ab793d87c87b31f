//! Arrays of other shapes than the shipped one, through the whole core: closed loops, and the worst that a frame can
//! bring.

mod closed_loop;
mod finger;
mod rates;
mod worst;
