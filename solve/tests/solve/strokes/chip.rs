//! The motions that the controller makes, frame by frame, and what it records of them.
//!
//! ```text
//! jog forward, jog back          a pulse each way, so quick that nothing goes far without an encoder
//! pulse forward, pulse back      slower: the voltage at which it moves
//! feel forward to 0.8 mm         pulses: the voltage rises until it moves, then the motor is shorted
//! go back to 0                   by the voltage at which pulses moved
//! feel back to -0.8 mm
//! strokes between +-0.7 mm       recorded; steps of voltage of 8 speeds, twice each, forward and back
//! go home                        as the slowest stroke
//! ```
//!
//! A pulse presses with what its voltage has beyond that of the easiest pulse, and no more than 40 um go by before it
//! is shorted: a force of 0.17 N stops it whatever the array sees. Strokes stay within the way that was felt.

use super::drive::{DELAY_S, FRAME_S, Rig, View};
use crate::series;
use core::f64::consts::TAU;
use fingertip::params::Params;
use solve::record::{self, Ended, Reason};
use solve::strokes::{Record, Sample, Stroke};

/// Frames for a sample.
const DECIMATION: usize = record::SAMPLE_FRAMES as usize;
/// Samples that 40 KiB hold: a count from the origin, and a mean voltage in quarters of a millivolt, 16 bits each.
pub const SAMPLES: usize = 40 * 1024 / 4;
/// The way is felt this far to each side, strokes rest here, and any motion beyond the last is shorted, mm.
const FELT_MM: f64 = 0.8;
const STROKE_MM: f64 = 0.7;
const FARTHEST_MM: f64 = 1.2;
/// Share of the supply that a pulse takes at most.
const PULSE_PART: f64 = 0.08;
/// Rise of the voltage of a jog, as by this force at the tip, N/s, and of a pulse: by the back-EMF of the fastest stroke
/// in this time, s. A pulse begins at this share of the voltage of the easiest one.
const JOG_N_PER_S: f64 = 50.0;
const RISE_S: f64 = 0.36;
const BEGIN: f64 = 0.6;
/// A pulse ends this far, mm, or this long, s, after it began to move.
const PULSE_MM: f64 = 0.04;
const PULSE_S: f64 = 0.05;
/// A pulse, or the start of a stroke, may need this force more than the easiest pulse, N.
const FEEL_N: f64 = 0.17;
/// What a stroke has at least beyond the voltage at which pulses moved: as by this force at the tip, N, and no more than
/// this share of the back-EMF of the fastest one.
const START_N: f64 = 0.05;
const START_PART: f64 = 0.1;
/// Speeds of the strokes, as shares of the fastest; the first one goes as slowly as it will start. Fast strokes are
/// short, so there are more of them.
pub const SPEEDS: [f64; 8] = [0.0, 0.25, 0.5, 0.75, 1.0, 1.0, 0.75, 0.5];
const TIMES: usize = 2;
/// The fastest: this, mm/s, or what rolls on for this far, mm, when shorted.
const SPEED_MM_PER_S: f64 = 28.0;
const ROLL_MM: f64 = 0.25;
/// The way that a shorted motor rolls on, in the sheet's time constants.
const ROLL: f64 = 1.4;
/// A stroke takes at most this long, s, and this share of the supply.
const STROKE_S: f64 = 0.5;
const STROKE_PART: f64 = 1.0 / 3.0;
/// A fall of the speed as by this force, N, over this time, s, ends a stroke; so does no start within three times that.
const PUSH_N: f64 = 0.3;
const PUSH_S: f64 = 0.016;
/// At rest: no count for this long, within this long, s.
const STILL_S: f64 = 0.012;
const REST_S: f64 = 0.5;
const TOUCH_N: f64 = 0.04;
/// Counts that are motion.
const MOVED: i32 = 2;
/// Against its direction nothing moves by more counts, and farther, mm.
const BACK: i32 = 4;
const BACK_MM: f64 = 0.03;

struct Chip<'a> {
    rig: &'a mut Rig,
    view: View,
    origin: i32,
    mm_per_count: f64,
    /// By the parameters: back-EMF at the tip's speed (V s/mm), force for a voltage (N/V), time constant (s).
    volts_per_mm_per_s: f64,
    newtons_per_volt: f64,
    tau_s: f64,
    /// The lowest voltage at which pulses moved, forward and back.
    moved_v: [f64; 2],
    recorded: Option<Recorded>,
}

#[derive(Default)]
struct Recorded {
    stroke: Stroke,
    frames: usize,
    sum_v: f64,
}

/// The chip's number is in thousandths of the unit, but for counts.
fn refuse<T>(reason: Reason, value: f64) -> Result<T, Ended> {
    let factor = if reason == Reason::Reversed { 1.0 } else { 1e3 };
    Err(Ended { reason, value: (factor * value) as i32 })
}

/// All motions of a commissioning, with strokes of these speeds.
pub fn measure(rig: &mut Rig, speeds: &[f64]) -> Record {
    let view = rig.view();
    let d = &rig.drive;
    let (counts_per_turn, rad_per_mm) = (d.counts_per_turn, d.rad_per_mm);
    let params = Params {
        encoder_counts_per_turn: counts_per_turn as i32,
        reduction_mrad_per_mm: (1e3 * rad_per_mm).round() as i32,
        resistance_mohm: (1e3 * d.ohmmeter_ohm).round() as i32,
        ..Params::DEFAULT
    };
    let mut chip = Chip {
        view,
        origin: view.count,
        mm_per_count: TAU / counts_per_turn / rad_per_mm,
        volts_per_mm_per_s: d.sheet_k * rad_per_mm,
        newtons_per_volt: d.sheet_k / d.ohmmeter_ohm * rad_per_mm * 1e3,
        tau_s: d.sheet_inertia * d.ohmmeter_ohm / (d.sheet_k * d.sheet_k),
        moved_v: [f64::INFINITY; 2],
        recorded: None,
        rig,
    };
    let mut strokes = Vec::new();
    let ended = chip.motions(speeds, &mut strokes).err();
    let [frame_ns, delay_ns] = [FRAME_S, DELAY_S].map(|time_s| (1e9 * time_s).round() as u32);
    let bytes = series::strokes(&strokes, ended, frame_ns, delay_ns);
    record::strokes(&bytes, &params).expect("a series")
}

impl Chip<'_> {
    fn motions(&mut self, speeds: &[f64], strokes: &mut Vec<Stroke>) -> Result<(), Ended> {
        for rise in [JOG_N_PER_S / self.newtons_per_volt, self.rise()] {
            self.moved_v = [f64::INFINITY; 2];
            self.pulse(1.0, rise)?;
            self.pulse(-1.0, rise)?;
        }
        self.feel(1.0)?;
        self.go(-1.0, self.least(1), 0.0)?;
        self.feel(-1.0)?;
        let mut friction_v = [0.0; 2];
        for speed in speeds.iter().flat_map(|speed| [*speed; TIMES]) {
            for (side, sign) in [1.0, -1.0].into_iter().enumerate() {
                let taken: usize = strokes.iter().map(|stroke| stroke.samples.len()).sum();
                if taken + ((STROKE_S + REST_S) / FRAME_S) as usize / DECIMATION > SAMPLES {
                    continue;
                }
                let voltage = self.least(side).max(friction_v[side] + self.fastest_v() * speed);
                let voltage = voltage.min(self.view.supply_v * STROKE_PART);
                self.recorded = Some(Recorded::default());
                let reached = self.go(sign, voltage, STROKE_MM);
                strokes.extend(self.recorded.take().map(|recorded| recorded.stroke));
                let reached = reached?;
                if speed == 0.0 {
                    friction_v[side] = voltage - self.volts_per_mm_per_s * reached;
                }
            }
        }
        self.go(1.0, self.least(0), 0.0)?;
        Ok(())
    }

    /// The voltage with which a stroke starts for certain.
    fn least(&self, side: usize) -> f64 {
        let most = START_PART * self.fastest_v();
        self.moved_v[side] + (START_N / self.newtons_per_volt).min(most)
    }

    /// Back-EMF of the fastest strokes.
    fn fastest_v(&self) -> f64 {
        self.volts_per_mm_per_s * SPEED_MM_PER_S.min(ROLL_MM / self.tau_s)
    }

    /// Rise of a pulse's voltage, V/s.
    fn rise(&self) -> f64 {
        self.fastest_v() / RISE_S
    }

    /// A frame under this voltage.
    fn frame(&mut self, voltage: f64) {
        // A PWM of 8400 ticks.
        let duty = (voltage / self.view.supply_v * 8400.0).round() / 8400.0;
        if let Some(recorded) = &mut self.recorded {
            if recorded.frames.is_multiple_of(DECIMATION) {
                let voltage_v = (recorded.sum_v / DECIMATION as f64 * 4e3).round() / 4e3;
                recorded.stroke.samples.push(Sample { count: self.view.count - self.origin, voltage_v });
                recorded.sum_v = 0.0;
            }
            recorded.frames += 1;
            recorded.sum_v += duty * self.view.supply_v;
        }
        self.rig.frame(duty);
        self.view = self.rig.view();
    }

    fn place_mm(&self) -> f64 {
        f64::from(self.view.count - self.origin) * self.mm_per_count
    }

    /// What ends any motion.
    fn danger(&self, begun: i32, sign: f64) -> Result<(), Ended> {
        let back = -sign as i32 * (self.view.count - begun);
        if self.view.force_n >= TOUCH_N {
            refuse(Reason::Touched, self.view.force_n)
        } else if self.place_mm().abs() > FARTHEST_MM {
            refuse(Reason::Astray, self.place_mm())
        } else if back > BACK && f64::from(back) * self.mm_per_count > BACK_MM {
            refuse(Reason::Reversed, f64::from(back))
        } else {
            Ok(())
        }
    }

    /// Shorts the motor until it rests.
    fn rest(&mut self, mut outcome: Result<(), Ended>) -> Result<(), Ended> {
        let mut still = 0.0;
        let mut counts = vec![self.view.count];
        while still < STILL_S / FRAME_S {
            let before = self.view.count;
            self.frame(0.0);
            still = if self.view.count == before { still + 1.0 } else { 0.0 };
            counts.push(self.view.count);
            if self.view.force_n >= TOUCH_N {
                outcome = outcome.and(refuse(Reason::Touched, self.view.force_n));
            }
            if counts.len() as f64 * FRAME_S > REST_S {
                let gone = f64::from(self.view.count - counts[counts.len() / 2]) * self.mm_per_count;
                return outcome.and(refuse(Reason::Restless, gone / (0.5 * REST_S)));
            }
        }
        outcome
    }

    /// The voltage rises until it moves; a little later the motor is shorted.
    fn pulse(&mut self, sign: f64, rise_v_per_s: f64) -> Result<(), Ended> {
        let side = usize::from(sign < 0.0);
        let begun = self.view.count;
        let easiest = self.moved_v[side];
        let limit = (easiest + FEEL_N / self.newtons_per_volt).min(PULSE_PART * self.view.supply_v);
        let mut voltage = if easiest.is_finite() { BEGIN * easiest } else { 0.0 };
        let mut moving_s = 0.0;
        let outcome = loop {
            if let Err(ended) = self.danger(begun, sign) {
                break Err(ended);
            }
            let gone = sign as i32 * (self.view.count - begun);
            if gone >= MOVED {
                self.moved_v[side] = self.moved_v[side].min(voltage);
                moving_s += FRAME_S;
                if f64::from(gone) * self.mm_per_count >= PULSE_MM || moving_s > PULSE_S {
                    break Ok(());
                }
            } else if voltage >= limit {
                let force = (voltage - easiest) * self.newtons_per_volt;
                break if easiest.is_finite() { refuse(Reason::Pushed, force) } else { refuse(Reason::Still, voltage) };
            } else {
                voltage += rise_v_per_s * FRAME_S;
            }
            self.frame(sign * voltage);
        };
        self.rest(outcome)
    }

    /// Pulses to the end of the way.
    fn feel(&mut self, sign: f64) -> Result<(), Ended> {
        while sign * self.place_mm() < FELT_MM {
            self.pulse(sign, self.rise())?;
        }
        Ok(())
    }

    /// A stroke under one voltage that comes to rest at a place; the speed that it reached, mm/s.
    fn go(&mut self, sign: f64, voltage: f64, end_mm: f64) -> Result<f64, Ended> {
        let begun = self.view.count;
        // v = F tau / m: what a force takes of the speed.
        let push = PUSH_N / self.newtons_per_volt / self.volts_per_mm_per_s;
        let (mut counts, mut fastest, mut more_v, mut reached) = (Vec::new(), 0.0_f64, 0.0, 0.0);
        let outcome = loop {
            if let Err(ended) = self.danger(begun, sign) {
                break Err(ended);
            }
            counts.push(self.view.count);
            let speed = |span_s: f64| {
                let span = ((span_s / FRAME_S) as usize).min(counts.len() - 1);
                let gone = self.view.count - counts[counts.len() - 1 - span];
                sign * f64::from(gone) * self.mm_per_count / (span.max(1) as f64 * FRAME_S)
            };
            let took_s = counts.len() as f64 * FRAME_S;
            reached = speed(PUSH_S);
            if took_s > 2.0 * PUSH_S {
                fastest = fastest.max(reached);
            }
            if sign * self.place_mm() + speed(PUSH_S / 4.0) * ROLL * self.tau_s >= end_mm || took_s > STROKE_S {
                break Ok(());
            } else if fastest - reached > push {
                break refuse(Reason::Pushed, (fastest - reached) / push * PUSH_N);
            } else if sign as i32 * (self.view.count - begun) < MOVED && took_s > 3.0 * PUSH_S {
                more_v += self.rise() * FRAME_S;
                if more_v * self.newtons_per_volt > FEEL_N {
                    break refuse(Reason::Pushed, more_v * self.newtons_per_volt);
                }
            }
            self.frame(sign * (voltage + more_v));
        };
        self.rest(outcome)?;
        Ok(reached)
    }
}
