//! A host that holds on: it reads the controller, and asks for more force before the contact slips, or when it did.
//!
//! It knows only what the bus tells: force and centre of pressure. A load along the surface stretches the patch and
//! moves the centre:
//!
//! ```text
//! s = centre - centre at rest        T = grip_n_per_mm |s|
//! margin: the force asked for is at least T / grip_friction, 10 % more once it has to rise
//! slip:   |s| falls by grip_drop_mm from its farthest while the force stands: the patch springs back as friction falls from
//!         still to slipping; the force asked for rises by a quarter. Only a contact that bears something can slip
//! ```
//!
//! What was asked for is kept until the script lets go. A slip at which friction does not fall shows no drop: only the
//! margin helps.
//!
//! Two fingers that hold a free thing each with a force of its own push it aside without end, since no two arrays read
//! quite alike. So a finger that went on by x from where its force first stood asks for centre_n_per_mm x less, and one
//! that was pushed back for more.

use crate::key::Values;
use fingertip::pipeline::Status;

/// From the request for a reading to its arrival: 14 and 23 bytes at 1 Mbaud, and the controller's turn.
const READ_S: f64 = 0.5e-3;
/// The force stands at what was asked for within this share.
const STANDS: f64 = 0.1;
/// Readings under a standing force that make the centre at rest.
const RESTS: u32 = 8;
/// Share of the trusted friction that a contact must bear before a drop counts as a slip. The centre of a contact that
/// bears less moves by noise alone, and a finger that then presses harder pushes a free object into the other one.
const BEARS: f64 = 0.25;
/// What is asked for beyond the margin, and after a slip.
const AHEAD: f64 = 1.1;
const AFTER_SLIP: f64 = 1.25;

/// What a reading tells.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Reading {
    /// Contact force.
    pub force_n: f64,
    /// Centre of pressure.
    pub centre_mm: [f64; 2],
    /// Travel of the tip.
    pub travel_mm: f64,
}

impl Reading {
    /// Of a controller.
    pub fn of(status: &Status) -> Self {
        let contact = &status.contact;
        Self {
            travel_mm: status.travel.0.to_num(),
            force_n: contact.force.0.to_num(),
            centre_mm: [contact.centre_x.0.to_num(), contact.centre_y.0.to_num()],
        }
    }
}

/// The policy, and what it remembers.
#[derive(Clone, Debug)]
pub struct Grip {
    friction: f64,
    n_per_mm: f64,
    drop_mm: f64,
    most_n: f64,
    centre_n_per_mm: f64,
    on_mm: f64,
    rest_travel_mm: f64,
    rest_mm: [f64; 2],
    rests: u32,
    farthest_mm: f64,
    asked_n: f64,
}

impl Grip {
    /// Of the table `[host]`.
    pub fn new(host: &Values) -> Self {
        Self {
            friction: host.number("grip_friction"),
            n_per_mm: host.number("grip_n_per_mm"),
            drop_mm: host.number("grip_drop_mm"),
            most_n: host.number("grip_most_n"),
            centre_n_per_mm: host.number("centre_n_per_mm"),
            on_mm: 0.0,
            rest_travel_mm: 0.0,
            rest_mm: [0.0; 2],
            rests: 0,
            farthest_mm: 0.0,
            asked_n: 0.0,
        }
    }

    /// When a reading asked for at a time arrives, where nothing delays it.
    pub fn answered_s(asked_s: f64) -> f64 {
        asked_s + READ_S
    }

    /// The force to ask for where the script asks for this one.
    pub fn goal_n(&self, script_n: f64) -> f64 {
        if script_n > 0.0 { self.grip_n(script_n) - self.centring_n(script_n) } else { 0.0 }
    }

    fn grip_n(&self, script_n: f64) -> f64 {
        script_n.max(self.asked_n)
    }

    /// At most half of what the script asks for.
    fn centring_n(&self, script_n: f64) -> f64 {
        (self.centre_n_per_mm * self.on_mm).clamp(-0.5 * script_n, 0.5 * script_n)
    }

    /// Takes a reading in. Says whether more is to be asked for, now.
    pub fn judge(&mut self, script_n: f64, reading: &Reading) -> bool {
        if script_n == 0.0 {
            (self.rests, self.farthest_mm, self.asked_n, self.on_mm) = (0, 0.0, 0.0, 0.0);
            return false;
        }
        let goal_n = self.grip_n(script_n);
        let stands = (reading.force_n - self.goal_n(script_n)).abs() <= STANDS * goal_n;
        if self.rests < RESTS {
            if stands {
                self.rests += 1;
                let share = 1.0 / f64::from(self.rests);
                for (rest, centre) in self.rest_mm.iter_mut().zip(reading.centre_mm) {
                    *rest += share * (centre - *rest);
                }
                self.rest_travel_mm += share * (reading.travel_mm - self.rest_travel_mm);
            }
            return false;
        }
        self.on_mm = reading.travel_mm - self.rest_travel_mm;
        let [x, y] = [0, 1].map(|axis| reading.centre_mm[axis] - self.rest_mm[axis]);
        let shift_mm = (x * x + y * y).sqrt();
        let bears = self.n_per_mm * self.farthest_mm >= BEARS * self.friction * goal_n;
        let dropped = stands && bears && shift_mm < self.farthest_mm - self.drop_mm;
        self.farthest_mm = if dropped { shift_mm } else { self.farthest_mm.max(shift_mm) };
        let needed_n = self.n_per_mm * shift_mm / self.friction;
        let mut asked_n = goal_n;
        if needed_n > goal_n {
            asked_n = AHEAD * needed_n;
        }
        if dropped {
            asked_n = asked_n.max(AFTER_SLIP * goal_n);
        }
        self.asked_n = asked_n.min(self.most_n);
        self.grip_n(script_n) > goal_n
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn at_rest() -> Grip {
        let mut grip = Grip {
            friction: 0.5,
            n_per_mm: 1.0,
            drop_mm: 0.05,
            most_n: 4.0,
            centre_n_per_mm: 0.1,
            on_mm: 0.0,
            rest_travel_mm: 0.0,
            rest_mm: [0.0; 2],
            rests: 0,
            farthest_mm: 0.0,
            asked_n: 0.0,
        };
        for _ in 0..RESTS {
            assert!(!grip.judge(1.0, &reading(1.0, 0.2)));
        }
        grip
    }

    fn reading(force_n: f64, y_mm: f64) -> Reading {
        Reading { force_n, centre_mm: [0.3, y_mm], travel_mm: 6.0 }
    }

    #[test]
    fn a_finger_that_goes_on_asks_for_less_and_one_pushed_back_for_more() {
        let mut grip = at_rest();
        for (travel_mm, goal_n) in [(6.0, 1.0), (7.0, 0.9), (4.0, 1.2), (99.0, 0.5)] {
            assert!(!grip.judge(1.0, &Reading { travel_mm, ..reading(1.0, 0.2) }), "nothing slips");
            assert!((grip.goal_n(1.0) - goal_n).abs() < 1e-12);
        }
    }

    #[test]
    fn the_margin_raises_the_goal_before_friction_is_used_up() {
        let mut grip = at_rest();
        assert!(!grip.judge(1.0, &reading(1.0, 0.69)), "0.49 N along the surface need 0.98 N");
        assert!(grip.judge(1.0, &reading(1.0, 0.8)));
        assert!((grip.goal_n(1.0) - 1.32).abs() < 1e-12);
        assert!(!grip.judge(1.0, &reading(1.3, 0.8)), "enough");
        assert!(grip.judge(1.0, &reading(1.3, 9.0)));
        assert_eq!(grip.goal_n(1.0), 4.0, "never more than the most");
    }

    #[test]
    fn noise_of_a_contact_that_bears_nothing_is_no_slip() {
        let mut grip = at_rest();
        assert!(!grip.judge(1.0, &reading(1.0, 0.32)), "less than a quarter of what friction holds");
        assert!(!grip.judge(1.0, &reading(1.0, 0.2)));
        assert!(!grip.judge(1.0, &reading(1.0, 0.33)) && grip.judge(1.0, &reading(1.0, 0.2)));
    }

    #[test]
    fn a_drop_is_a_slip_only_while_the_force_stands() {
        let mut grip = at_rest();
        assert!(!grip.judge(1.0, &reading(1.0, 0.6)));
        assert!(!grip.judge(1.0, &reading(1.0, 0.56)), "less than the drop that counts");
        assert!(!grip.judge(1.0, &reading(0.7, 0.4)), "the force falls too");
        assert!(grip.judge(1.0, &reading(1.0, 0.5)));
        assert_eq!(grip.goal_n(1.0), 1.25);
        assert!(!grip.judge(0.0, &reading(1.0, 0.5)));
        assert_eq!(grip.goal_n(0.0), 0.0, "the script lets go");
        assert_eq!(grip.goal_n(1.0), 1.0, "and what was asked for is forgotten");
    }
}
