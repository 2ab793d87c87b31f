//! Slips of the contact, and whether somebody noticed: who notices asks for more force.

/// A slip shorter than this in all is creep at rest, and does not count.
const COUNTS_MM: f64 = 1e-3;
/// A slip is over when the contact stuck for this long.
const OVER_S: f64 = 0.01;

/// What came of all slips so far.
#[derive(Clone, Copy, Debug, Default)]
pub struct Slips {
    under_way: Option<Slip>,
    last_mm: f64,
    /// How many there were.
    pub count: u32,
    /// How many were over before more force was asked for.
    pub unnoticed: u32,
    /// From the onset until more force was asked for, the longest.
    pub noticed_after_s: Option<f64>,
}

#[derive(Clone, Copy, Debug)]
struct Slip {
    onset_s: f64,
    moved_s: f64,
    from_mm: f64,
    goal_n: f64,
    counted: bool,
    noticed: bool,
}

impl Slips {
    /// Takes a step in.
    pub fn step(&mut self, time_s: f64, slip_mm: f64, goal_n: f64) {
        let moves = slip_mm > self.last_mm;
        let before_mm = core::mem::replace(&mut self.last_mm, slip_mm);
        if moves {
            let begun =
                Slip { onset_s: time_s, moved_s: time_s, from_mm: before_mm, goal_n, counted: false, noticed: false };
            let slip = self.under_way.get_or_insert(begun);
            slip.moved_s = time_s;
            if !slip.counted && slip_mm - slip.from_mm > COUNTS_MM {
                slip.counted = true;
                self.count += 1;
            }
        }
        let Some(slip) = &mut self.under_way else { return };
        if goal_n > slip.goal_n && !slip.noticed {
            slip.noticed = true;
            let after_s = time_s - slip.onset_s;
            self.noticed_after_s = Some(self.noticed_after_s.map_or(after_s, |longest| longest.max(after_s)));
        }
        if time_s - slip.moved_s > OVER_S {
            self.unnoticed += u32::from(slip.counted && !slip.noticed);
            self.under_way = None;
        }
    }

    /// A slip that the run ended in counts too.
    pub fn unnoticed(&self) -> u32 {
        self.unnoticed + self.under_way.map_or(0, |slip| u32::from(slip.counted && !slip.noticed))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_slip_is_timed_from_its_onset_to_the_raised_goal() {
        let mut slips = Slips::default();
        for ms in 0..100 {
            let time_s = f64::from(ms) * 1e-3;
            // Slips from 20 ms on, until the force is raised at 26 ms; again from 60 to 70 ms, and nobody notices.
            let slip_mm = 0.1 * f64::from((ms - 19).clamp(0, 8) + (ms - 59).clamp(0, 11));
            slips.step(time_s, slip_mm, if ms < 26 { 1.0 } else { 1.5 });
        }
        assert_eq!((slips.count, slips.unnoticed()), (2, 1));
        assert!((slips.noticed_after_s.unwrap() - 6e-3).abs() < 1e-12, "{slips:?}");
    }
}
