//! The order of the rows in a refinement that takes one of them in a frame.

/// A row a frame is taken in steps of so many rows, so that what changes meanwhile is not taken for a slope: three, or
/// the next number that shares no divisor with the number of rows, so that the steps come to each of them once.
pub const fn row_step(rows: usize) -> usize {
    let mut step = 3;
    while divisor(step, rows) != 1 {
        step += 1;
    }
    step
}

/// The largest divisor of both.
const fn divisor(a: usize, b: usize) -> usize {
    if b == 0 { a } else { divisor(b, a % b) }
}

#[cfg(test)]
mod tests {
    use super::{divisor, row_step};
    use crate::contact::FitLevel;

    #[test]
    fn every_row_comes_once() {
        assert_eq!([3, 4, 8, 9, 10, 15, 16].map(row_step), [4, 3, 3, 4, 3, 4, 3]);
        for rows in 3..=16 {
            assert_eq!(divisor(row_step(rows), rows), 1);
            let mut seen: std::vec::Vec<_> = (0..rows).map(|frame| frame * row_step(rows) % rows).collect();
            seen.sort_unstable();
            assert!(seen.into_iter().eq(0..rows));
            for fit_level in [FitLevel::TwoRows, FitLevel::FiveRows, FitLevel::AllRows] {
                let most = fit_level.rows(rows);
                let frames = (1..).find(|frames| frames * most >= rows).unwrap();
                let stride = rows.div_ceil(most);
                assert_eq!(frames, stride);
                let taken = |frame: usize| (frame..rows).step_by(stride);
                assert!((0..frames).all(|frame| (1..=most).contains(&taken(frame).count())));
                assert_eq!((0..frames).flat_map(taken).count(), rows);
            }
        }
    }
}
