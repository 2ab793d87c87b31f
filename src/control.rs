//! The force loop: a goal in d, a speed reference, and the voltage that makes the tip follow it.
//!
//! Force grows with the square of the indentation, so a loop closed in force sees its gain vary 8.4 times between 0.1 N
//! and 7 N. Closed in d = sqrt(F / (pi Y)) it sees the finger's own dynamics, which are linear:
//!
//! ```text
//! x' = v,   v' = g V - c v + w
//! ```
//!
//! with the tip's travel x, the voltage V, g = k_t N / (R m), c = k_t^2 N^2 / (R m), m = J N^2 (N the motor's angle for
//! a travel of the tip) and everything else, the contact force and friction among it, in the disturbance w.
//!
//! [`Reference::towards`] turns the distance to go into the fastest speed from which the tip can still stop there;
//! [`GainSchedule`] selects one of the gain sets of [`Gains`]; [`Observer`] estimates x, v and w
//! from the encoder and the voltage; [`Drive`] keeps the voltage within its limits, and [`Winding`] lowers the limit of
//! the current before the motor is too warm. The law that joins them is
//!
//! ```text
//! g V = k_v (v_ref - v) + a_ref + c v - w
//! ```
//!
//! The observer gets the voltage after all limits, so nothing winds up; and every mode only chooses v_ref, so a change
//! of mode is bumpless.
//!
//! # Speed reference
//!
//! The time-optimal speed over the distance e with a deceleration a is sqrt(2 a |e|). Its slope is infinite at e = 0,
//! so near the goal a line of slope k takes over where both agree in value and slope (a proximate time-optimal servo):
//!
//! ```text
//! |e| <= a / (2 k^2):  v_ref = k e                                 a_ref = -k v
//! beyond:              v_ref = +-(sqrt(2 a |e|) - a / (2 k))      a_ref = -v a / sqrt(2 a |e|)
//! ```
//!
//! a_ref is the slope of v_ref along the motion: what the loop needs to stay on the curve without a lag.
//!
//! # Gain schedule
//!
//! Rest and speed want different bandwidths. The calmest gain set is for distances within twice a band that encoder
//! counts and noise explain, each quicker set for distances twice as long. When the mean distance is longer, the loop
//! becomes quicker at once; when it was half as long for four of the loop's own time constants, the loop becomes
//! calmer. So a loop that swings slows down, whatever made it swing. Only gains change, never the state of observer and
//! drive, so a change of the gain set moves nothing.
//!
//! # Observer
//!
//! A third-order observer whose poles lie together at beta in the z plane. Prediction, then correction by the error
//! e = x_measured - x:
//!
//! ```text
//! x += v T + (u - c v + w) T^2 / 2,   v += (u - c v + w) T
//! x += l1 e,   v += l2 e,   w += l3 e
//! l1 = 1 - beta^3,   l2 = 1.5 (1 - beta)^2 (1 + beta) / T,   l3 = (1 - beta)^3 / T^2
//! ```
//!
//! An error beyond what motion can make in a frame is a jump of the encoder: the observer starts again at the new
//! place, at rest. A limited correction would not work: three integrators behind a limited error swing for ever.
//!
//! # Compensation
//!
//! Compensates what a held force only seems to be: the array's creep, and its drift with temperature. Both are added to
//! the goal, not subtracted from the reading: the guard, the monitor and the model see what the array reads.
//!
//! ## Creep
//!
//! Under a constant force F the reading grows to F (1 + k) with the time constant tau. So a part c of a reading S is
//! creep, c' = (k (S - c) - c) / tau: a lag towards S k / (1 + k) with tau / (1 + k). The lag has one state of first
//! order and moves at most half of the difference in a frame, so it stays between 0 and the largest target, and cannot
//! ring.
//!
//! ## Temperature
//!
//! A force F on a drifting array reads
//!
//! ```text
//! S = F (1 + a (T - T_gain)) + b A (T - T_zero)
//! ```
//!
//! with a and b the array's coefficients, A its area, T_gain the temperature at its calibration and T_zero the
//! temperature at which the taxels' zero was last learnt. T is the temperature of the microcontroller: a proxy, which
//! does not show a heat source that warms only one of the two, or one of them sooner. The compensation moves a goal by
//! half of it at most, whatever the temperature.

mod drive;

pub use drive::{Drive, WINDING_WORDS, Winding};

use crate::arith::{clamp_bits, high, nearest_product, nearest_share, product};
use crate::config::{BRAKE_SHARE_Q8, Config, GAIN_SETS, Gains};
use crate::state::Limits;
use crate::units::{Celsius, Duty, Millimetres, MillimetresPerSecond, MillimetresPerSecond2, Newtons};
use fixed::types::I16F16;

/// The state of the speed loop.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct SpeedLoop {
    /// Estimate of travel, speed and disturbance.
    pub observer: Observer,
    /// Limits of the voltage between the law and the bridge.
    pub drive: Drive,
    /// The gain set in use.
    pub schedule: GainSchedule,
    /// Estimate of the winding's temperature.
    pub winding: Winding,
}

impl SpeedLoop {
    /// Speed loop at rest.
    pub const fn new() -> Self {
        Self { observer: Observer::new(), drive: Drive::new(), schedule: GainSchedule::QUICK, winding: Winding::new() }
    }

    /// The duty that makes the tip follow a speed reference.
    #[inline(always)]
    pub fn follow(&mut self, reference: Reference, supply_mv: u16, config: &Config, limits: &mut Limits) -> Duty {
        self.apply_law(reference, supply_mv, config, limits);
        self.drive.duty(supply_mv, config)
    }

    /// Duty for a voltage (g V, Q8 mm/s^2) that is set without the control law.
    pub fn apply_voltage(&mut self, voltage: i32, supply_mv: u16, config: &Config, limits: &mut Limits) -> Duty {
        self.drive.limit_current(self.winding.share());
        self.drive.apply(voltage, self.back_emf(config), supply_mv, config, limits);
        self.drive.duty(supply_mv, config)
    }

    /// Computes the voltage by the law, and limits it.
    #[inline(always)]
    pub fn apply_law(&mut self, reference: Reference, supply_mv: u16, config: &Config, limits: &mut Limits) {
        // Speeds are held to 2,048 mm/s, which is beyond every reference, and their difference to 8,192 mm/s: so no
        // product here leaves 32 bits. Accelerations are Q4 here, held to 28 bits, so that they fit 32 bits as Q8.
        let speed = clamp_bits(self.observer.speed.to_bits(), 28);
        let behind = clamp_bits(reference.speed.to_bits().saturating_sub(speed), 30);
        // c v, the acceleration that the back-EMF takes away.
        let back_emf = high(speed << 3, config.damping_q17_per_s);
        let requested = high(behind << 2, self.schedule.gains(config).speed_q18_per_s)
            + (reference.acceleration.to_bits() >> 4)
            + back_emf
            - (self.observer.disturbance.to_bits() >> 4);
        self.drive.limit_current(self.winding.share());
        let [requested, back_emf] = [clamp_bits(requested, 28) << 4, clamp_bits(back_emf, 28) << 4];
        self.drive.apply(requested, back_emf, supply_mv, config, limits);
    }

    /// Updates observer and winding with the encoder's count of this frame.
    #[inline(always)]
    pub fn observe(&mut self, encoder: i32, config: &Config) {
        self.winding.observe(self.drive.acceleration(), config);
        self.observer.update(encoder, self.drive.acceleration(), self.schedule.gains(config), config);
    }

    /// Returns the speed reference for a distance to go, at most `limit`, and true if that limit reduced it.
    ///
    /// Once the loop has settled, a distance within `slack` counts as 0: otherwise a tip that sticks would be driven
    /// from count to count for ever.
    #[inline(always)]
    pub fn towards(
        &mut self,
        distance: Millimetres,
        slack: Millimetres,
        limit: MillimetresPerSecond,
        config: &Config,
    ) -> (Reference, bool) {
        self.schedule.note(distance, config);
        let distance = if self.schedule.settled() {
            Millimetres(distance.0 - distance.0.max(-slack.0).min(slack.0))
        } else {
            distance
        };
        let brake = self.brake(distance, config);
        let reference = Reference::towards(distance, self.observer.speed, brake, self.schedule.gains(config));
        // A motor with less current brakes less, so it moves more slowly: it may meet something.
        let limit = MillimetresPerSecond::from_bits(self.winding.allowed(limit.to_bits()));
        let limited = reference.limited(limit);
        (limited, limited != reference)
    }

    /// Takes note that the bridge is open: no current flows, so neither voltage nor back-EMF acts.
    pub fn coast(&mut self) {
        self.drive = Drive::new();
        self.schedule = GainSchedule::QUICK;
    }

    /// Takes note that the motor is shorted: only the back-EMF acts.
    pub fn short(&mut self, config: &Config) {
        self.coast();
        self.drive.short(self.back_emf(config));
    }

    /// Returns the distance, at most that to the end of the travel.
    pub fn within_travel(&self, distance: Millimetres, config: &Config, limits: &mut Limits) -> Millimetres {
        let left = Millimetres(config.travel_max.0.saturating_sub(self.observer.travel.0));
        if left < distance {
            limits.set(Limits::TRAVEL);
        }
        distance.min(left)
    }

    /// Deceleration by the back-EMF at the present speed, c v, Q8 mm/s^2.
    fn back_emf(&self, config: &Config) -> i32 {
        let speed = clamp_bits(self.observer.speed.to_bits(), 28);
        clamp_bits(high(speed << 3, config.damping_q17_per_s), 28) << 4
    }

    /// Deceleration that the motor can surely give to a motion in the direction of `distance`, with the current that
    /// the winding's temperature allows.
    ///
    /// The contact force brakes a tip that presses in and accelerates one that releases: the disturbance contains it.
    #[inline(always)]
    pub fn brake(&self, distance: Millimetres, config: &Config) -> MillimetresPerSecond2 {
        let disturbance = product(self.observer.disturbance.to_bits(), BRAKE_SHARE_Q8, 8);
        // Without `map`, of which the compiler makes a function.
        let [least, usual, most] = config.brake;
        let allowed = |brake| self.winding.allowed(brake);
        let [least, usual, most] = [allowed(least), allowed(usual), allowed(most)];
        let pressing = distance >= Millimetres::ZERO;
        let whole = if pressing { usual.saturating_sub(disturbance) } else { usual.saturating_add(disturbance) };
        MillimetresPerSecond2::from_bits(whole.max(least).min(most))
    }
}

impl Default for SpeedLoop {
    fn default() -> Self {
        Self::new()
    }
}

/// The mean distance moves by 1/8 of the difference in each frame, which reduces white noise to a quarter.
const MEAN_BITS: u32 = 3;

/// The gain set in use, and the mean distance that selects it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct GainSchedule {
    number: usize,
    /// Mean distance to go, Q24 mm.
    mean: i32,
    settled_frames: u32,
}

impl GainSchedule {
    /// The quickest gain set.
    pub const QUICK: Self = Self { number: 0, mean: 0, settled_frames: 0 };

    /// The gain set in use.
    #[inline(always)]
    pub fn gains<'a>(&self, config: &'a Config) -> &'a Gains {
        &config.gain_sets[self.number % GAIN_SETS]
    }

    /// True unless the quickest gain set is in use.
    #[inline(always)]
    pub fn settled(&self) -> bool {
        self.number > 0
    }

    /// Takes the distance to go of this frame.
    #[inline(always)]
    pub fn note(&mut self, distance: Millimetres, config: &Config) {
        let band = config.settled_band.to_bits();
        // Limited, so that a long distance is soon forgotten.
        let limited = distance.to_bits().max(-16 * band).min(16 * band);
        self.mean += (limited - self.mean) >> MEAN_BITS;
        let mean = self.mean.saturating_abs();
        while self.number > 0 && mean > reach(band, self.number) {
            (self.number, self.settled_frames) = (self.number - 1, 0);
        }
        if self.number + 1 < GAIN_SETS && mean <= reach(band, self.number + 1) / 2 {
            self.settled_frames += 1;
            if self.settled_frames > config.settled_frames << self.number {
                (self.number, self.settled_frames) = (self.number + 1, 0);
            }
        } else {
            self.settled_frames = 0;
        }
    }
}

/// Longest distance for which a gain set is quick enough: two bands for the calmest, twice that for each quicker set.
const fn reach(band: i32, number: usize) -> i32 {
    band << (GAIN_SETS - number)
}

/// Speed and acceleration that the speed loop follows.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Reference {
    /// Speed.
    pub speed: MillimetresPerSecond,
    /// Acceleration that keeps the tip on the curve.
    pub acceleration: MillimetresPerSecond2,
}

impl Reference {
    /// Returns the fastest reference over `distance` that ends at rest, at the present speed `speed`, with a
    /// deceleration `brake` of up to 1000 m/s^2.
    #[inline(always)]
    pub fn towards(
        distance: Millimetres,
        speed: MillimetresPerSecond,
        brake: MillimetresPerSecond2,
        gains: &Gains,
    ) -> Self {
        let (distance_bits, speed_bits) = (distance.to_bits(), speed.to_bits());
        let brake_bits = brake.to_bits().max(1);
        let slope = gains.slope_per_s;
        // a / (2 k^2): Q8 to Q24 mm.
        let linear = (i64::from(brake_bits) * i64::from(gains.half_over_slope2_q40)) >> 24;
        let (reference, acceleration) = if i64::from(distance_bits.unsigned_abs()) <= linear {
            (product(distance_bits, slope, 8), product(speed_bits, slope, 8))
        } else {
            // Q8 mm/s^2 times Q24 mm is Q32 mm^2/s^2; its root is Q16 mm/s, and good enough as the FPU gives it.
            let (root, _) = lanes::root_and_product(2 * brake_bits.cast_unsigned(), distance_bits.unsigned_abs(), 0);
            let root = root.cast_signed();
            let magnitude = root.wrapping_sub(product(brake_bits, gains.half_over_slope_q32, 24));
            let reference = if distance_bits < 0 { magnitude.wrapping_neg() } else { magnitude };
            (reference, product(brake_bits, share_q12(speed_bits, root), 12))
        };
        Self {
            speed: MillimetresPerSecond::from_bits(reference),
            acceleration: MillimetresPerSecond2::from_bits(acceleration.saturating_neg()),
        }
    }

    /// Limits the speed to `limit`. A limited speed is constant, so its acceleration is 0.
    #[inline(always)]
    pub fn limited(self, limit: MillimetresPerSecond) -> Self {
        let limited = self.speed.max(MillimetresPerSecond::from_bits(limit.to_bits().saturating_neg())).min(limit);
        if limited == self.speed { self } else { Self { speed: limited, acceleration: MillimetresPerSecond2::ZERO } }
    }
}

/// Returns speed / root in Q12, limited to +-1.25, by one 32-bit division.
#[inline(always)]
fn share_q12(speed: i32, root: i32) -> i32 {
    let speed = speed.clamp(-1 << 29, (1 << 29) - 1) << 2;
    // Never 0, nor the -1 by which a division can overflow.
    let root = (root.cast_unsigned() >> 10 | 1).cast_signed();
    (speed / root).clamp(-5120, 5120)
}

/// Estimate of travel, speed and disturbance at the last frame, from the encoder and the voltage.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Observer {
    /// Tip travel from where the observer was zeroed.
    pub travel: Millimetres,
    /// Tip speed.
    pub speed: MillimetresPerSecond,
    /// Acceleration by everything but voltage and back-EMF: contact, friction, and errors of the parameters.
    pub disturbance: MillimetresPerSecond2,
    origin: i32,
}

impl Observer {
    /// Observer at rest at zero.
    pub const fn new() -> Self {
        Self {
            travel: Millimetres::ZERO,
            speed: MillimetresPerSecond::ZERO,
            disturbance: MillimetresPerSecond2::ZERO,
            origin: 0,
        }
    }

    /// Observer at rest, with zero travel at this count.
    pub const fn zeroed_at(encoder: i32) -> Self {
        Self { origin: encoder, ..Self::new() }
    }

    /// Makes this count the zero of the travel, without a change of the motion. Returns the travel there before.
    pub fn zero(&mut self, encoder: i32, config: &Config) -> Millimetres {
        let travel = self.measured(encoder, config);
        self.travel = Millimetres(self.travel.0.saturating_sub(travel.0));
        self.origin = encoder;
        travel
    }

    /// Encoder count at which the travel is zero.
    pub fn origin(&self) -> i32 {
        self.origin
    }

    /// Travel at an encoder count, limited to the type's range less a count.
    pub fn measured(&self, encoder: i32, config: &Config) -> Millimetres {
        config.travel(encoder.wrapping_sub(self.origin))
    }

    /// Advances by a frame; `acceleration` is that by voltage and back-EMF since the last frame (Q8 mm/s^2).
    #[inline(always)]
    pub fn update(&mut self, encoder: i32, acceleration: i32, gains: &Gains, config: &Config) {
        // Q8 mm/s^2 times T (Q37) to Q16 mm/s, and the mean speed over the frame times T to Q24 mm.
        let pushed = acceleration.saturating_add(self.disturbance.to_bits());
        let gained = nearest_product(pushed, config.frame_s_q37, 29);
        let before = self.speed.to_bits();
        let moved = nearest_product(before.saturating_add(gained / 2), config.frame_s_q37, 29);
        let travel = self.travel.to_bits().saturating_add(moved);
        let speed = before.saturating_add(gained);

        let measured = self.measured(encoder, config);
        let error = measured.to_bits().saturating_sub(travel);
        if error.unsigned_abs() > config.jump {
            *self = Self { travel: measured, origin: self.origin, ..Self::new() };
            return;
        }
        let [l1_q31, l2_per_s_q16, l3_per_s2] = gains.observer;
        let disturbance = self.disturbance.to_bits().saturating_add(nearest_product(error, l3_per_s2, 16));
        self.travel = Millimetres::from_bits(travel.saturating_add(nearest_share(error, l1_q31)));
        self.speed = MillimetresPerSecond::from_bits(speed.saturating_add(nearest_product(error, l2_per_s_q16, 24)));
        self.disturbance = MillimetresPerSecond2::from_bits(disturbance);
    }
}

/// Estimate of the creep of the held force.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Creep {
    /// Creep, Q48 N, not below 0.
    state: i64,
}

impl Creep {
    /// Takes a frame's reading. While no force is held the creep is 0: the baseline learns what remains of it.
    #[inline(always)]
    pub fn observe(&mut self, held: bool, force: Newtons, config: &Config) {
        if config.creep_share_q32 == 0 || !held {
            self.state = 0;
            return;
        }
        let target = (i64::from(force.to_bits().max(0)) * i64::from(config.creep_share_q32)) >> 32;
        let way = target - (self.state >> 32);
        self.state = self.state.saturating_add(way * i64::from(config.creep_leak_q32));
    }

    /// Creep in the reading.
    #[inline(always)]
    pub fn force(&self) -> Newtons {
        Newtons(I16F16::from_bits((self.state >> 32) as i32))
    }
}

/// Least temperature that is used, degrees Celsius in Q16.
const CELSIUS_MIN: i32 = -64 << 16;
/// Largest temperature that is used, degrees Celsius in Q16.
const CELSIUS_MAX: i32 = 192 << 16;
/// A reading moves the filtered temperature by 2^-10 of the difference.
const CHIP_FILTER_BITS: u32 = 10;

/// Temperatures from which the array's drift is computed.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct TemperatureDrift {
    /// Filtered temperature of the microcontroller, degrees Celsius in Q32; none before the first reading, and while
    /// the compensation is off.
    chip: Option<i64>,
    /// Temperature when the zero was last learnt, degrees Celsius in Q16.
    zero: i32,
}

impl TemperatureDrift {
    /// Takes a frame's reading of the microcontroller's temperature. Without a reading the last one is kept.
    #[inline(always)]
    pub fn observe(&mut self, chip: Option<Celsius>, config: &Config) {
        if !config.drift.on() {
            self.chip = None;
        }
        let Some(chip) = chip.filter(|_| config.drift.on()) else { return };
        let chip = chip.to_bits().max(CELSIUS_MIN).min(CELSIUS_MAX);
        match &mut self.chip {
            Some(state) => *state += ((i64::from(chip) << 16) - *state) >> CHIP_FILTER_BITS,
            state => {
                *state = Some(i64::from(chip) << 16);
                self.zero = chip;
            }
        }
    }

    /// Takes note that a share of the zero, Q16 from 0 to 1, was learnt at the present temperature.
    pub fn zero(&mut self, share: i32) {
        let way = self.chip.map_or(0, |chip| (chip >> 16) - i64::from(self.zero));
        self.zero += ((way * i64::from(share)) >> 16) as i32;
    }

    /// Returns by how much a held force reads more than it is; at most half of the force, up or down.
    #[inline(always)]
    pub fn force(&self, held: Newtons, config: &Config) -> Newtons {
        let Some(chip) = self.chip else { return Newtons::ZERO };
        let drift = &config.drift;
        let [warmer, since] = [drift.gain_at_q16, self.zero].map(|then| (chip >> 16) - i64::from(then));
        let share = (warmer * i64::from(drift.gain_q32_per_k)) >> 16;
        let held = i64::from(held.to_bits().max(0));
        let half = held >> 1;
        let gain = (held * share.max(-1 << 31).min(1 << 31)) >> 32;
        let zero = (since * i64::from(drift.zero_q24_per_k)) >> 24;
        Newtons(I16F16::from_bits((gain + zero).max(-half).min(half) as i32))
    }
}
