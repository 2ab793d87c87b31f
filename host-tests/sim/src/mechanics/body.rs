//! An object that can move, and what moves it beside the fingers: weight, a floor, a shaking, and the hand that lifts.

use crate::events::Event;
use crate::scene::Scene;

/// Standard gravity, mm/s^2.
const GRAVITY_MM_PER_S2: f64 = 9806.65;

/// Place and speed along the first finger's motion and upwards.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Body {
    /// From where it is at the start, mm.
    pub place_mm: [f64; 2],
    /// mm/s.
    pub speed_mm_per_s: [f64; 2],
    /// Distance by which events have moved the object's surface away from every finger, mm.
    pub away_mm: f64,
}

/// What a scene does to its object.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Surroundings {
    /// Until when a floor carries it.
    pub floor_until_s: f64,
    /// Acceleration that drives it down, in g.
    pub shake_g: f64,
    /// From when to when.
    pub shake_s: [f64; 2],
    /// How far the hand lifts.
    pub lift_mm: f64,
    /// From when to when.
    pub lift_s: [f64; 2],
    /// Events, in order of time.
    pub events: Vec<Event>,
}

impl Surroundings {
    /// Of a scene.
    pub fn of(scene: &Scene) -> Self {
        let (object, hand) = (scene.table("object"), scene.table("hand"));
        let (shake_s, lift_s) = (object.number("shake_at_s"), hand.number("lift_at_s"));
        Self {
            floor_until_s: object.number("floor_until_s"),
            shake_g: object.number("shake_g"),
            shake_s: [shake_s, shake_s + object.number("shake_ms") * 1e-3],
            lift_mm: hand.number("lift_mm"),
            lift_s: [lift_s, lift_s + hand.number("lift_s")],
            events: scene.events.clone(),
        }
    }

    /// How high the hand is: from rest to rest with the least jerk, 10 t^3 - 15 t^4 + 6 t^5.
    pub fn hand_mm(&self, time_s: f64) -> f64 {
        let [from_s, to_s] = self.lift_s;
        let t = ((time_s - from_s) / (to_s - from_s)).clamp(0.0, 1.0);
        self.lift_mm * t * t * t * (10.0 - t * (15.0 - 6.0 * t))
    }

    /// Mean acceleration downwards over a step.
    fn down_mm_per_s2(&self, time_s: f64, dt_s: f64) -> f64 {
        let shaken_s = overlap_s([time_s, time_s + dt_s], self.shake_s);
        let share = if dt_s > 0.0 { shaken_s / dt_s } else { 0.0 };
        GRAVITY_MM_PER_S2 * (1.0 + self.shake_g * share)
    }
}

/// How long two spans of time have in common.
pub fn overlap_s(a: [f64; 2], b: [f64; 2]) -> f64 {
    (a[1].min(b[1]) - a[0].max(b[0])).max(0.0)
}

impl Body {
    /// Where it ends under mean forces of the fingers, N.
    pub fn moved(&self, mass_kg: f64, force_n: [f64; 2], around: &Surroundings, time_s: f64, dt_s: f64) -> Self {
        let mut next = *self;
        let down = around.down_mm_per_s2(time_s, dt_s);
        let mm_per_s2 = [force_n[0] / mass_kg * 1e3, force_n[1] / mass_kg * 1e3 - down];
        for (axis, mm_per_s2) in mm_per_s2.into_iter().enumerate() {
            let change = dt_s * mm_per_s2;
            next.place_mm[axis] += dt_s * (self.speed_mm_per_s[axis] + 0.5 * change);
            next.speed_mm_per_s[axis] += change;
        }
        if time_s < around.floor_until_s && next.place_mm[1] < 0.0 {
            next.place_mm[1] = 0.0;
            next.speed_mm_per_s[1] = 0.0;
        }
        next
    }
}
