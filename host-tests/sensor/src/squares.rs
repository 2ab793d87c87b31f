//! Least squares of a few unknowns, and figures of a sample.

/// Coefficients c that lay sum(c_i x_i) through y with the least squares; none where the points do not tell them.
pub fn solve<const N: usize>(points: impl Iterator<Item = ([f64; N], f64)>) -> Option<[f64; N]> {
    let (mut matrix, mut right) = ([[0.0; N]; N], [0.0; N]);
    for (x, y) in points {
        for row in 0..N {
            for column in 0..N {
                matrix[row][column] += x[row] * x[column];
            }
            right[row] += x[row] * y;
        }
    }
    let whole: [f64; N] = std::array::from_fn(|at| matrix[at][at]);
    for pivot in 0..N {
        // Normal equations are positive: they need no exchange of rows. What is left of one tells whether it is new.
        if matrix[pivot][pivot] <= 1e-9 * whole[pivot] {
            return None;
        }
        for row in pivot + 1..N {
            let share = matrix[row][pivot] / matrix[pivot][pivot];
            let above = matrix[pivot];
            for (value, above) in matrix[row].iter_mut().zip(above) {
                *value -= share * above;
            }
            right[row] -= share * right[pivot];
        }
    }
    let mut solution = [0.0; N];
    for row in (0..N).rev() {
        let known: f64 = (row + 1..N).map(|column| matrix[row][column] * solution[column]).sum();
        solution[row] = (right[row] - known) / matrix[row][row];
    }
    solution.iter().all(|value| value.is_finite()).then_some(solution)
}

/// Root mean square.
pub fn rms(values: impl Iterator<Item = f64> + Clone) -> f64 {
    let count = values.clone().count().max(1) as f64;
    (values.map(|value| value * value).sum::<f64>() / count).sqrt()
}

/// The middle of a sample, 0 of none.
pub fn median(values: impl Iterator<Item = f64>) -> f64 {
    let sorted = sorted(values);
    let middle = sorted.len() / 2;
    match sorted.len() {
        0 => 0.0,
        count if count.is_multiple_of(2) => (sorted[middle - 1] + sorted[middle]) / 2.0,
        _ => sorted[middle],
    }
}

/// The mean without the fifth that is least and the fifth that is largest: a hold that went wrong does not move it.
pub fn trimmed_mean(values: impl Iterator<Item = f64>) -> f64 {
    let sorted = sorted(values);
    let kept = &sorted[sorted.len() / 5..sorted.len() - sorted.len() / 5];
    kept.iter().sum::<f64>() / kept.len().max(1) as f64
}

fn sorted(values: impl Iterator<Item = f64>) -> Vec<f64> {
    let mut sorted: Vec<_> = values.collect();
    sorted.sort_by(f64::total_cmp);
    sorted
}
