//! Force of each step, and the pose that a fit starts from: what a press says by its sums.

use crate::gains::{Condition, Gain};
use crate::model::{At, Pose, Square};
use crate::press::{Array, Press, Step};

/// Rows and columns beside the array that the model covers: a contact may reach over the edge.
const BESIDE: usize = 4;

/// Force of each step, N: what the sound taxels read, gains taken off, times what the model has under the whole contact over
/// what it has under them. So the missing force of dead taxels, and of what lies off the array, is filled by the model.
///
/// Near the contact the ratio is that of a quarter of the depth: there and in the air, readings that creep leaves are forces
/// too, by which [`crate::modulus()`] tells creep from relaxation.
pub fn forces(press: &Press, pose: &Pose, taxels: &[Gain]) -> Vec<f64> {
    let Press { tip, array, .. } = press;
    let sound = |taxel: usize| matches!(taxels[taxel].condition, Condition::Sound | Condition::Unreached);
    let wide = Array { rows: array.rows + 2 * BESIDE, columns: array.columns + 2 * BESIDE, ..*array };
    let squares: Vec<_> = (0..wide.taxels()).map(|taxel| Square::new(pose, tip, &wide, taxel)).collect();
    let inner = |taxel: usize| (taxel / array.columns + BESIDE) * wide.columns + taxel % array.columns + BESIDE;
    let least_mm = pose.touch_mm + 0.25 * (press.deepest_mm() - pose.touch_mm).max(0.0);
    let force = |step: &Step| {
        let at = step.at(array);
        let at = At { travel_mm: at.travel_mm.max(least_mm), ..at };
        let shares: Vec<f64> = squares.iter().map(|square| square.share(&at)).collect();
        let (mut read, mut under) = (0.0, 0.0);
        for taxel in (0..array.taxels()).filter(|taxel| sound(*taxel) && !step.taxels[*taxel].bad) {
            read += step.taxels[taxel].mean / array.codes_per_kpa / taxels[taxel].reads;
            under += shares[inner(taxel)];
        }
        1e-3 * array.pitch_mm * array.pitch_mm * read * shares.iter().sum::<f64>() / under.max(1e-9)
    };
    press.steps.iter().map(force).collect()
}

/// Pose to start from: axis at the centre of the deepest readings, touch by the line through the roots of the sums.
pub fn first_pose(press: &Press) -> Pose {
    let steps: Vec<_> = press.inward().collect();
    let largest = steps.iter().map(|step| step.sum()).fold(0.0, f64::max);
    let points: Vec<[f64; 2]> = steps
        .iter()
        .filter(|step| step.sum() > 0.05 * largest)
        .map(|step| [step.middle_mm(), step.sum().sqrt()])
        .collect();
    let count = points.len().max(1) as f64;
    let mean = |index: usize| points.iter().map(|point| point[index]).sum::<f64>() / count;
    let [x, y] = [mean(0), mean(1)];
    let (xx, xy) =
        points.iter().fold((0.0, 0.0), |(xx, xy), p| (xx + (p[0] - x).powi(2), xy + (p[0] - x) * (p[1] - y)));
    let touch_mm = if xy > 0.0 { x - y * xx / xy } else { x };
    let mut axis_mm = [0.0; 2];
    if let Some(deepest) = steps.last() {
        let readings = || deepest.taxels.iter().enumerate().filter(|(_, taxel)| !taxel.bad && taxel.mean > 0.0);
        let sum: f64 = readings().map(|(_, taxel)| taxel.mean).sum();
        for (taxel, reading) in readings() {
            let place_mm = press.array.place_mm(taxel);
            axis_mm.iter_mut().zip(place_mm).for_each(|(axis, place)| *axis += place * reading.mean / sum);
        }
    }
    Pose { touch_mm, axis_mm, ..Pose::default() }
}
