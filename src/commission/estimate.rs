//! From the strokes' lines to the drive.
//!
//! Under a step of voltage V from rest, a motor with friction that does not change with speed goes
//!
//! ```text
//! x = v (t - tau (1 - exp(-t / tau)))      v = (V - V_f) / (k N)      tau = R J / k^2
//! ```
//!
//! so the line of the steady part has the slope v, and crosses the place of rest at t = tau. Two voltages give k from
//! the difference of the speeds, which friction does not change, and V_f from what is left.

use super::line::Line;
use super::strokes::{COUNT_FROM, EACH, kind};
use super::{Drive, Refusal};
use crate::config::Config;
use crate::params::Params;
use crate::root::floor_sqrt;

/// A line has so many frames at least, and such a slope (Q16 counts a frame).
const FRAMES_MIN: u32 = 16;
const SPEED_MIN: i32 = 64;
/// What the supply's divider and reference add to a voltage, and friction at low speed to a time, permille.
const VOLTAGE_PERMILLE: u64 = 8;
const TIME_PERMILLE: u64 = 15;
/// What friction changes with speed, permille of it.
const FRICTION_PERMILLE: u64 = 30;
/// The speeds of a kind may lie apart by this part of their mean, and the two ways' torque constants.
const APART: i64 = 8;
/// The duty acts this much later than the frame that it was made from, frames in Q8.
const DEAD_Q8: i32 = 85;
/// 2 pi in millionths.
const TURN: u64 = 6_283_185;

/// Values of a kind.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Spread {
    sum: i64,
    least: i32,
    most: i32,
}

impl Spread {
    const NONE: Self = Self { sum: 0, least: i32::MAX, most: i32::MIN };

    fn add(&mut self, value: i32) {
        self.sum += i64::from(value);
        self.least = self.least.min(value);
        self.most = self.most.max(value);
    }

    fn range(&self) -> i64 {
        (i64::from(self.most) - i64::from(self.least)).max(0)
    }
}

/// What the strokes gave so far, back and forward.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Estimate {
    /// Slow and fast: counts a frame, Q16.
    speeds: [[Spread; 2]; 2],
    /// Of the fast ones: time constants in frames, Q8.
    times: [Spread; 2],
    /// The largest time constant of the trials, frames.
    slowest: u32,
}

impl Estimate {
    /// Nothing yet.
    pub const NONE: Self = Self { speeds: [[Spread::NONE; 2]; 2], times: [Spread::NONE; 2], slowest: 0 };

    /// The largest time constant of the trials, in frames; 0 before the first.
    pub fn slowest(&self) -> u32 {
        self.slowest
    }

    /// Takes a stroke whose line began so many frames after its voltage, a trial or one that counts; gives its speed
    /// (counts a frame, Q16), or nothing where there is no line in it.
    pub fn take(&mut self, stroke: u8, began: u32, line: &Line) -> Option<i32> {
        let (forward, fast) = kind(stroke);
        let way = usize::from(forward);
        let fitted = line.fit().filter(|fitted| line.frames() >= FRAMES_MIN && fitted.speed >= SPEED_MIN)?;
        let time = (began.min(1 << 20) << 8).cast_signed().saturating_sub(fitted.zero).saturating_sub(DEAD_Q8);
        if stroke < COUNT_FROM {
            self.slowest = self.slowest.max(time.max(0).unsigned_abs().div_ceil(256));
        } else {
            self.speeds[way][usize::from(fast)].add(fitted.speed);
        }
        if fast {
            self.times[way].add(time);
        }
        Some(fitted.speed)
    }

    /// The drive, from voltages (mV) that the slow and the fast strokes had beyond those (back and forward) that all
    /// of a way had.
    ///
    /// Sums stand for means of [`EACH`]: so there are few divisions, which take long.
    #[inline(never)]
    pub fn drive(&self, beyond_mv: [i32; 2], common_mv: [i32; 2], config: &Config) -> Result<Drive, Refusal> {
        let p = &config.params;
        let [slow_mv, fast_mv] = beyond_mv;
        let step_mv = u64::from((fast_mv - slow_mv).max(0).unsigned_abs());
        let kinds = self.speeds.as_flattened();
        if kinds.iter().any(|kind| kind.range() * APART * i64::from(EACH) > kind.sum) {
            return Err(Refusal::Unsteady);
        }
        let gains = self.speeds.map(|[slow, fast]| fast.sum - slow.sum);
        let gain = gains[0] + gains[1];
        let [time_back, time_forward] = self.times;
        let time = time_back.sum + time_forward.sum;
        if gain <= 0 || (gains[0] - gains[1]).abs() * 2 * APART > gain || step_mv == 0 || time <= 0 {
            return Err(Refusal::Unsteady);
        }
        let (gain, time) = (gain.unsigned_abs().max(1), time.unsigned_abs().max(1));
        const BOTH: u64 = 2 * EACH as u64;

        // k = dV / dw, w = 2 pi s / (counts T).
        let turns = step_mv * u64::from(p.encoder_counts_per_turn.unsigned_abs());
        let scaled = turns * u64::from(config.timing.frame_ns) * BOTH;
        let torque_constant = (((scaled << 8) / gain).min(1 << 52) << 8) / TURN;
        let torque_constant = torque_constant.min(1 << 18);
        // The mean of three varies by a range of three / (1.69 sqrt(3)), and two means make a difference.
        let range = kinds.iter().map(Spread::range).sum::<i64>().unsigned_abs();
        let scatter = range * (BOTH * 1_000 * 100 / 4 / 293) / gain;
        let torque_constant_sigma = together([scatter, VOLTAGE_PERMILLE, 0]);

        // tau = R J / k^2.
        let time_us = ((time * u64::from(config.timing.frame_ns)) / (BOTH * 256 * 1_000)).min(1 << 20);
        let range = (time_back.range() + time_forward.range()).unsigned_abs();
        let scatter_of_time = range * (BOTH * 1_000 * 100 / 2 / 414) / time;
        let time_constant_sigma = together([scatter_of_time, TIME_PERMILLE, 0]);
        let resistance = u64::from(p.resistance_mohm.max(1).unsigned_abs());
        let inertia = over(time_us * torque_constant * torque_constant, resistance * 1_000_000);
        let inertia_sigma = together([time_constant_sigma, 2 * torque_constant_sigma, 0]);

        // T = V_f k / R.
        let friction = |slow: &Spread, gain: i64, common_mv: i32| {
            // In uV, of which a voltage has 26 bits.
            let lost = slow.sum.max(0).unsigned_abs() * (step_mv * 1_000) / gain.max(1).unsigned_abs();
            let given = u64::from(common_mv.saturating_add(slow_mv).max(0).unsigned_abs()) * 1_000;
            let left = given.saturating_sub(lost);
            // The slow speed counts 2.2 times and the fast one 1.2 times: 2.5 times the scatter of one.
            let sigma = (step_mv * scatter * 2_530).checked_div(left).unwrap_or(1_000);
            (
                over(left * torque_constant, resistance * 1_000),
                together([sigma, torque_constant_sigma, FRICTION_PERMILLE]),
            )
        };
        let [[slow_back, _], [slow_forward, _]] = &self.speeds;
        let (back, back_sigma) = friction(slow_back, gains[0], common_mv[0]);
        let (forward, forward_sigma) = friction(slow_forward, gains[1], common_mv[1]);

        let sound = TORQUE_CONSTANT.hold(torque_constant)
            && INERTIA.hold(inertia)
            && FRICTION.hold(back)
            && FRICTION.hold(forward);
        if !sound {
            return Err(Refusal::Range);
        }
        let permille = |value: u64| value.min(u16::MAX.into()) as u16;
        Ok(Drive {
            torque_constant_unm_per_a: torque_constant as u32,
            torque_constant_sigma: permille(torque_constant_sigma),
            time_constant_us: time_us as u32,
            time_constant_sigma: permille(time_constant_sigma),
            inertia_ug_m2: inertia as u32,
            inertia_sigma: permille(inertia_sigma),
            friction_unm: [forward as u16, back as u16],
            friction_sigma: [permille(forward_sigma), permille(back_sigma)],
        })
    }
}

/// The range of a parameter.
struct Allowed {
    min: u64,
    max: u64,
}

const TORQUE_CONSTANT: Allowed = Allowed::of("torque_constant_unm_per_a");
const INERTIA: Allowed = Allowed::of("inertia_ug_m2");
const FRICTION: Allowed = Allowed::of("friction_unm");

impl Allowed {
    const fn of(name: &str) -> Self {
        let mut place = 0;
        while !same(Params::RANGES[place].0.as_bytes(), name.as_bytes()) {
            place += 1;
        }
        let (_, _, min, max) = Params::RANGES[place];
        Self { min: min as u64, max: max as u64 }
    }

    fn hold(&self, value: u64) -> bool {
        value >= self.min && value <= self.max
    }
}

const fn same(one: &[u8], other: &[u8]) -> bool {
    if one.len() != other.len() {
        return false;
    }
    let mut place = 0;
    while place < one.len() {
        if one[place] != other[place] {
            return false;
        }
        place += 1;
    }
    true
}

/// A share, rounded.
fn over(value: u64, of: u64) -> u64 {
    (value + of / 2) / of.max(1)
}

/// Independent parts of an uncertainty, permille.
fn together(parts: [u64; 3]) -> u64 {
    let squares = parts.map(|part| part.min(1 << 16).pow(2));
    u64::from(floor_sqrt(squares.iter().sum()))
}
