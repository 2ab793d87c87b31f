//! Which strokes are made.

/// Slow strokes to each side, and fast ones.
pub const EACH: u8 = 3;
/// Before those that count the first one goes to the end of the way, and one to each side is a trial.
pub const COUNT_FROM: u8 = 3;
/// The first fast one.
const FAST_FROM: u8 = COUNT_FROM + 2 * EACH;
/// All that are measured. One more goes home, slowly: the last of them went back.
pub const COUNT: u8 = FAST_FROM + 2 * EACH;

/// Of the strokes, counted from 0: whether it goes forward, and whether it is fast.
pub const fn kind(stroke: u8) -> (bool, bool) {
    (stroke % 2 == 1, stroke >= FAST_FROM && stroke < COUNT)
}
