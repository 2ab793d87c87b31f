//! What an array's rows feel, each at its own time.

use super::{World, surface_mm};
use crate::effects::set::Set;
use crate::mechanics::contact::Place;
use fingertip::shipped::COLUMNS;

impl<E: Set> World<E> {
    /// How a finger touches at a time within the last step. Several may be asked for before their rows: one then need
    /// not wait for another to be worked out.
    #[inline]
    pub fn place(&self, index: usize, since_s: f64) -> Place {
        let mut body = self.body;
        if since_s < self.dt_s {
            let (before, t) = (&self.body_before, since_s / self.dt_s);
            let (v0, v1) = (before.speed_mm_per_s[0], body.speed_mm_per_s[0]);
            body.away_mm += (before.away_mm - body.away_mm) * (1.0 - t);
            body.place_mm[0] = before.place_mm[0] + since_s * (v0 + 0.5 * (v1 - v0) * t);
        }
        let finger = &self.fingers[index];
        finger.contact.place(finger.flank_within_mm(since_s) - surface_mm(finger.setup(), index, &body))
    }

    /// Mean pressures on a row's taxels where a finger touches like this.
    #[inline]
    pub fn placed_kpa(&mut self, index: usize, place: &Place, row: usize) -> [f64; COLUMNS] {
        self.fingers[index].contact.row_kpa(place, row)
    }

    /// The same at a time within the last step.
    pub fn row_kpa(&mut self, index: usize, since_s: f64, row: usize) -> [f64; COLUMNS] {
        let place = self.place(index, since_s);
        self.placed_kpa(index, &place, row)
    }

    /// The same at a time before the last step's end, below 0, or behind it: then all goes on as it did in it.
    pub fn row_off_kpa(&mut self, index: usize, off_s: f64, row: usize) -> [f64; COLUMNS] {
        if off_s < 0.0 {
            return self.row_kpa(index, (self.dt_s + off_s).max(0.0), row);
        }
        let mut body = self.body;
        if self.dt_s > 0.0 {
            let (v0, v1) = (self.body_before.speed_mm_per_s[0], body.speed_mm_per_s[0]);
            body.place_mm[0] += off_s * (v1 + 0.5 * (v1 - v0) * off_s / self.dt_s);
        }
        let finger = &self.fingers[index];
        let place = finger.contact.place(finger.flank_ahead_mm(off_s) - surface_mm(finger.setup(), index, &body));
        self.placed_kpa(index, &place, row)
    }
}
