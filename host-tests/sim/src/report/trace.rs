//! What a report draws, gathered while the run goes on: a bounded number of points, whatever the run's length.

use crate::agreement::Path;
use crate::metrics::newtons;
use crate::watch::{Step, Watch};
use fingertip::units::Duty;
use host_tests::heatmap::Pressures;

/// Stretches of time in which the least and the largest value are kept.
const STRETCHES: f64 = 900.0;
/// How many of them a mean is taken over.
const STRETCHES_OF_A_MEAN: u64 = 9;
/// Pressure maps of a run.
const MAPS: usize = 10;

/// A stretch of time under way.
#[derive(Clone, Copy, Debug)]
struct Stretch {
    number: u64,
    low: (f64, f64),
    high: (f64, f64),
}

/// A quantity's points: the least and the largest of each stretch, in order of time.
#[derive(Clone, Debug, Default)]
pub struct Track {
    points: Vec<(f64, f64)>,
    /// Sum of the times, sum of the values and number of the points of each longer stretch.
    sums: Vec<(f64, f64, f64)>,
    stretch: Option<Stretch>,
}

impl Track {
    fn add(&mut self, stretch: u64, time_s: f64, value: f64) {
        let point = (time_s, value);
        let longer = (stretch / STRETCHES_OF_A_MEAN) as usize;
        if self.sums.len() <= longer {
            self.sums.resize(longer + 1, (0.0, 0.0, 0.0));
        }
        let (times, values, count) = self.sums[longer];
        self.sums[longer] = (times + time_s, values + value, count + 1.0);
        match &mut self.stretch {
            Some(Stretch { number, low, high }) if *number == stretch => {
                if value < low.1 {
                    *low = point;
                }
                if value > high.1 {
                    *high = point;
                }
            }
            _ => {
                self.close();
                self.stretch = Some(Stretch { number: stretch, low: point, high: point });
            }
        }
    }

    fn close(&mut self) {
        let Some(Stretch { low, high, .. }) = self.stretch.take() else { return };
        let (first, second) = if low.0 <= high.0 { (low, high) } else { (high, low) };
        self.points.push(first);
        if second.0 > first.0 {
            self.points.push(second);
        }
    }

    /// The mean of each longer stretch.
    pub fn means(&self) -> Vec<(f64, f64)> {
        let mean = |(times, values, count): (f64, f64, f64)| (times / count, values / count);
        self.sums.iter().copied().filter(|(.., count)| *count > 0.0).map(mean).collect()
    }

    /// All of them.
    pub fn points(&self) -> Vec<(f64, f64)> {
        let mut whole = self.clone();
        whole.close();
        whole.points
    }
}

/// What is drawn of a finger.
#[derive(Clone, Debug, Default)]
pub struct Tracks {
    /// The force asked for, N.
    pub goal: Track,
    /// The true force, N.
    pub force: Track,
    /// The sensed force, N.
    pub sensed: Track,
    /// Indentation, mm.
    pub indentation: Track,
    /// Duty, %.
    pub duty: Track,
    /// Current, A.
    pub current: Track,
    /// Supply, V.
    pub supply: Track,
    /// The winding's temperature, degrees C.
    pub winding: Track,
    /// Slip, mm.
    pub slip: Track,
    /// Height of the object, mm.
    pub height: Track,
    /// The true force beside the other board's, N, where there is one.
    pub force_difference: Track,
    /// The travel beside the other board's, mm.
    pub travel_difference: Track,
    /// True pressures at instants.
    pub maps: Vec<(f64, Pressures)>,
}

/// Watches a run for a report.
#[derive(Clone, Debug)]
pub struct Trace {
    duration_s: f64,
    other: Option<Path>,
    /// Finger by finger.
    pub fingers: Vec<Tracks>,
}

impl Trace {
    /// Of a run of this length.
    pub fn new(duration_s: f64) -> Self {
        Self { duration_s, other: None, fingers: Vec::new() }
    }

    /// Draws the difference from this one too.
    pub fn compare_with(&mut self, other: Path) {
        self.other = Some(other);
    }

    fn map_is_due(&self, finger: usize, time_s: f64) -> bool {
        let taken = self.fingers.get(finger).map_or(0, |tracks| tracks.maps.len());
        taken < MAPS && time_s >= self.duration_s * (taken as f64 + 0.5) / MAPS as f64
    }
}

impl Watch for Trace {
    fn wants_pressures(&mut self, finger: usize, time_s: f64) -> bool {
        time_s >= 0.0 && self.map_is_due(finger, time_s)
    }

    fn step(&mut self, step: &Step) {
        let Step { time_s, truth, status, .. } = *step;
        if time_s < 0.0 {
            return;
        }
        let due = self.map_is_due(step.finger, time_s);
        if self.fingers.len() <= step.finger {
            self.fingers.resize_with(step.finger + 1, Tracks::default);
        }
        let share = if self.duration_s > 0.0 { time_s / self.duration_s } else { 0.0 };
        let stretch = (STRETCHES * share) as u64;
        let tracks = &mut self.fingers[step.finger];
        for (track, value) in [
            (&mut tracks.goal, newtons(step.command.goal)),
            (&mut tracks.force, truth.force_n),
            (&mut tracks.sensed, newtons(status.contact.force)),
            (&mut tracks.indentation, truth.indentation_mm),
            (&mut tracks.duty, 100.0 * f64::from(status.duty.0) / f64::from(Duty::FULL)),
            (&mut tracks.current, truth.current_a),
            (&mut tracks.supply, truth.supply_v),
            (&mut tracks.winding, truth.winding_c),
            (&mut tracks.slip, truth.slip_mm),
            (&mut tracks.height, truth.object_mm[1]),
        ] {
            track.add(stretch, time_s, value);
        }
        if let Some([force_n, travel_mm]) = self.other.as_ref().and_then(|other| other.difference(step)) {
            tracks.force_difference.add(stretch, time_s, force_n);
            tracks.travel_difference.add(stretch, time_s, travel_mm);
        }
        if due {
            tracks.maps.push((time_s, truth.pressures_kpa));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_track_keeps_each_spike_and_the_order() {
        let mut track = Track::default();
        for n in 0..10_000 {
            let value = if n == 7_777 { 5.0 } else { f64::from(n % 3) };
            track.add(n as u64 / 100, f64::from(n), value);
        }
        let points = track.points();
        assert_eq!(points.len(), 200);
        assert!(points.contains(&(7_777.0, 5.0)));
        assert!(points.is_sorted_by(|a, b| a.0 < b.0));
    }
}
