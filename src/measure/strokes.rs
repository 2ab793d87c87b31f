//! Motions in the air that measure the drive: pulses, and strokes under one voltage each.
//!
//! ```text
//! pulse forward, pulse back      quick, so that nothing goes far without an encoder: motor and encoder go the same way
//! pulse forward, pulse back      slower: the voltage at which it moves
//! feel forward to 0.8 mm         pulses: the voltage rises until it moves, then the motor is shorted
//! go back to 0                   by the voltage at which pulses moved. A jog ends here
//! feel back to -0.8 mm
//! 32 strokes within +-0.7 mm     recorded: 8 speeds, twice each, forward and back
//! go home                        as the slowest stroke
//! ```
//!
//! The voltage is open loop. The force of a pulse is that of its voltage beyond the voltage of the easiest pulse, and
//! the pulse is shorted 40 um after it began to move: a force of 0.17 N stops it whatever the array sees. Strokes
//! stay within the range of the pulses. In any other case the motor is shorted at once until the tip rests.

use super::{BuiltIn, Ended, MeasureStatus, Task};
use crate::config::{Config, Motions, SPAN_PARTS};
use crate::units::Newtons;

/// Time from the end of a frame, when the encoder is read, to the moment at which the voltage of its step acts, ns,
/// by the emulated board.
pub const DELAY_NS: u32 = 33_000;
/// Number of frames of a sample.
pub const SAMPLE_FRAMES: u32 = 8;
/// Speeds of the strokes, in quarters of the fastest. The first one is the slowest with which the tip starts. Fast
/// strokes are short, so there are more of them.
const SPEEDS: [u8; 8] = [0, 1, 2, 3, 4, 4, 3, 2];
/// Number of strokes: each speed twice, forward and back.
const STROKES: u8 = 4 * SPEEDS.len() as u8;
/// Largest share of the supply for a pulse: 2/25.
const PULSE_SUPPLY: [i32; 2] = [2, 25];
/// Largest share of the supply for a stroke: 1/3.
const STROKE_SUPPLY: [i32; 2] = [1, 3];
/// Number of counts from which a change counts as motion.
const MOVED: i32 = 2;
/// Largest number of pulses in one direction: five times the usual number.
const PULSES: u8 = 100;

/// Inputs of the motion in a frame.
#[derive(Clone, Copy, Debug)]
pub struct StrokeInputs {
    /// Count of the encoder.
    pub encoder: i32,
    /// Force of the array.
    pub force: Newtons,
    /// Supply of the bridge, mV.
    pub supply_mv: u16,
    /// Voltage of the bridge since the frame before, quarters of a mV.
    pub applied: i32,
}

/// Parts of the motion, in their order.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Part {
    /// A pulse; quick ones prove the direction.
    Pulse { quick: bool },
    /// Pulses until the end of travel.
    Feel,
    /// Motion under one voltage to a place.
    Go,
    /// Recorded stroke with its number.
    Stroke(u8),
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Phase {
    Moving,
    /// Shorted until it rests; then on, or to this end.
    Rest(Option<(Ended, i32)>),
    Over,
}

/// State of a jog, or of all strokes.
#[derive(Clone, Copy, Debug)]
pub struct Strokes {
    _built_in: BuiltIn,
    task: Task,
    phase: Phase,
    part: Part,
    /// Number of parts begun so far: all pulses in one direction count as one.
    done: u8,
    /// Number of pulses in the present direction.
    pulses: u8,
    /// Direction: forward 1, back -1.
    sign: i32,
    /// Encoder counts at the start of all, and of this motion.
    origin: i32,
    begun: i32,
    /// Numbers of frames of this motion, and of motion within it, or of this rest.
    frames: u32,
    moving: u32,
    /// Requested voltage, uV, positive in the direction of motion; and by how much it was raised because nothing
    /// moved.
    voltage_uv: i32,
    more_uv: i32,
    /// Lowest voltages at which pulses moved, forward and back, and the voltage of friction at the slowest strokes.
    moved_uv: [i32; 2],
    friction_uv: [i32; 2],
    /// Counts at the ends of the last parts of a span; counts over the last span and the last quarter of one, as the
    /// last part ended; the fastest span.
    history: [i32; SPAN_PARTS],
    over: [i32; 2],
    fastest: i32,
    /// Count at the last motion, its frame, and the count at the second half of a rest.
    stood: (i32, u32),
    half_rest: i32,
    /// Frames and voltage of the sample under way; and the part of the record in this frame.
    sampled: u32,
    sum: i32,
    row: Option<Kept>,
}

/// Part of the record in a frame.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kept {
    /// A stroke begins with the next frame.
    Stroke,
    /// Count from the origin, and mean voltage in quarters of a mV.
    Sample(i16, i16),
}

/// No pulse has moved yet.
const UNKNOWN: i32 = i32::MAX;

impl Strokes {
    /// Begins a jog or the strokes, at rest at this count.
    pub fn begin(task: Task, encoder: i32, built_in: BuiltIn) -> Self {
        Self {
            _built_in: built_in,
            task,
            phase: Phase::Moving,
            part: Part::Pulse { quick: true },
            done: 0,
            pulses: 0,
            sign: 1,
            origin: encoder,
            begun: encoder,
            frames: 0,
            moving: 0,
            voltage_uv: 0,
            more_uv: 0,
            moved_uv: [UNKNOWN; 2],
            friction_uv: [0; 2],
            history: [encoder; SPAN_PARTS],
            over: [0; 2],
            fastest: 0,
            stood: (encoder, 0),
            half_rest: encoder,
            sampled: 0,
            sum: 0,
            row: None,
        }
    }

    /// Returns true while the motion needs the motor.
    pub fn running(&self) -> bool {
        self.phase != Phase::Over
    }

    /// Count at which the motion began.
    pub fn origin(&self) -> i32 {
        self.origin
    }

    /// Part of the record in this frame.
    pub fn row(&self) -> Option<Kept> {
        self.row
    }

    /// Shorts the motor until it rests, and ends.
    pub fn halt(&mut self, encoder: i32) {
        if !matches!(self.phase, Phase::Rest(Some(_)) | Phase::Over) {
            self.short(encoder, Some((Ended::Interrupted, 0)));
        }
    }

    /// Voltage for the motor, mV.
    pub fn voltage_mv(&self) -> i32 {
        match self.phase {
            Phase::Moving => self.sign * (self.voltage_uv.saturating_add(self.more_uv) / 1_000),
            Phase::Rest(_) | Phase::Over => 0,
        }
    }

    /// Takes a frame.
    #[inline(never)]
    pub fn observe(&mut self, view: &StrokeInputs, standing: &mut MeasureStatus, config: &Config) {
        let plan = &config.motions;
        self.row = None;
        self.sample(view);
        match self.phase {
            Phase::Over => {}
            Phase::Rest(ended) => self.rest(ended, view, standing, plan),
            Phase::Moving => {
                let ended = self.danger(view, plan);
                match (ended, self.part) {
                    (Some(ended), _) => self.short(view.encoder, Some(ended)),
                    (None, Part::Pulse { .. } | Part::Feel) => self.pulse(view, plan),
                    (None, Part::Go | Part::Stroke(_)) => self.stroke(view, plan),
                }
                self.frames = self.frames.saturating_add(1);
            }
        }
    }

    /// Records a stroke, until the tip rests.
    fn sample(&mut self, view: &StrokeInputs) {
        if !matches!(self.part, Part::Stroke(_)) {
            return;
        }
        self.sum = self.sum.saturating_add(view.applied);
        if self.sampled.is_multiple_of(SAMPLE_FRAMES) {
            let narrow = |value: i32| value.max(i16::MIN as i32 + 1).min(i16::MAX.into()) as i16;
            let count = narrow(view.encoder.wrapping_sub(self.origin));
            self.row = Some(Kept::Sample(count, narrow(self.sum / SAMPLE_FRAMES as i32)));
            self.sum = 0;
        }
        self.sampled = self.sampled.wrapping_add(1);
    }

    /// Counts from where this motion began, in its direction.
    fn gone(&self, encoder: i32) -> i32 {
        encoder.wrapping_sub(self.begun).saturating_mul(self.sign)
    }

    /// Counts from the origin in the direction of this motion.
    fn place(&self, encoder: i32) -> i32 {
        encoder.wrapping_sub(self.origin).saturating_mul(self.sign)
    }

    fn side(&self) -> usize {
        usize::from(self.sign < 0)
    }

    /// Returns the reason that ends any motion.
    fn danger(&self, view: &StrokeInputs, plan: &Motions) -> Option<(Ended, i32)> {
        let (place, gone) = (self.place(view.encoder), self.gone(view.encoder));
        if view.force >= plan.touch {
            Some((Ended::Touched, super::millinewtons(view.force)))
        } else if place.saturating_abs() > plan.farthest {
            Some((Ended::Astray, plan.um(place)))
        } else {
            (gone < -plan.back).then(|| (Ended::Reversed, gone.saturating_neg()))
        }
    }

    /// Shorts the motor.
    fn short(&mut self, encoder: i32, ended: Option<(Ended, i32)>) {
        self.phase = Phase::Rest(ended);
        (self.voltage_uv, self.more_uv, self.frames) = (0, 0, 0);
        (self.stood, self.half_rest) = ((encoder, 0), encoder);
    }

    fn rest(&mut self, ended: Option<(Ended, i32)>, view: &StrokeInputs, standing: &mut MeasureStatus, plan: &Motions) {
        self.frames = self.frames.saturating_add(1);
        let touched = view.force >= plan.touch;
        let ended = ended.or(touched.then(|| (Ended::Touched, super::millinewtons(view.force))));
        self.phase = Phase::Rest(ended);
        if view.encoder != self.stood.0 {
            self.stood = (view.encoder, self.frames);
        }
        if self.frames <= plan.rest / 2 {
            self.half_rest = view.encoder;
        }
        let still = self.frames.wrapping_sub(self.stood.1) >= plan.still;
        let restless = self.frames >= plan.rest;
        if !still && !restless {
            return;
        }
        match ended {
            Some((ended, value)) => self.end(standing, ended, value),
            None if restless => {
                self.end(standing, Ended::Restless, view.encoder.wrapping_sub(self.half_rest).saturating_abs());
            }
            None => self.next(view, standing, plan),
        }
    }

    fn end(&mut self, standing: &mut MeasureStatus, ended: Ended, value: i32) {
        self.phase = Phase::Over;
        standing.end(ended, value);
    }

    /// Starts the next motion, or ends. The motion begins with the next frame.
    fn next(&mut self, view: &StrokeInputs, standing: &mut MeasureStatus, plan: &Motions) {
        let felt = self.part != Part::Feel || self.place(view.encoder) >= plan.felt;
        self.done += u8::from(felt);
        self.pulses = if felt { 0 } else { self.pulses.saturating_add(1) };
        if self.pulses > PULSES {
            let place = plan.um(self.place(view.encoder));
            return self.end(standing, Ended::Stalled, place);
        }
        if felt {
            let part = match self.done {
                1 => (Part::Pulse { quick: true }, -1),
                2 => (Part::Pulse { quick: false }, 1),
                3 => (Part::Pulse { quick: false }, -1),
                4 => (Part::Feel, 1),
                5 => (Part::Go, -1),
                6 if self.task == Task::Jog => return self.end(standing, Ended::Complete, 0),
                6 => (Part::Feel, -1),
                7.. if self.done - 7 < STROKES => {
                    (Part::Stroke(self.done - 7), if (self.done - 7).is_multiple_of(2) { 1 } else { -1 })
                }
                _ if self.done == 7 + STROKES => (Part::Go, 1),
                _ => return self.end(standing, Ended::Complete, 0),
            };
            (self.part, self.sign) = part;
        }
        if self.done == 2 {
            // The slower pulses find the voltages again.
            self.moved_uv = [UNKNOWN; 2];
        }
        standing.progress = (u32::from(self.done) * 100 / (u32::from(STROKES) + 8)) as u8;
        (self.begun, self.frames, self.moving, self.more_uv) = (view.encoder, 0, 0, 0);
        (self.history, self.over, self.fastest) = ([view.encoder; SPAN_PARTS], [0; 2], 0);
        self.voltage_uv = match self.part {
            Part::Pulse { .. } | Part::Feel => match self.easiest() {
                UNKNOWN => 0,
                // It begins at 0.6 of the easiest.
                easiest => easiest / 5 * 3,
            },
            Part::Go => self.least(plan),
            Part::Stroke(stroke) => {
                (self.sampled, self.sum, self.row) = (0, 0, Some(Kept::Stroke));
                let speed = SPEEDS.get(usize::from(stroke / 4)).copied().unwrap_or(0);
                let wanted = self.friction_uv[self.side()] + plan.fastest_uv / 4 * i32::from(speed);
                wanted.max(self.least(plan))
            }
        }
        .min(self.largest(view));
        self.phase = Phase::Moving;
    }

    /// Largest voltage, uV. That of a jog is small, as its direction may be wrong.
    fn largest(&self, view: &StrokeInputs) -> i32 {
        let strokes = self.task != Task::Jog && matches!(self.part, Part::Go | Part::Stroke(_));
        of_supply(view, if strokes { STROKE_SUPPLY } else { PULSE_SUPPLY })
    }

    fn easiest(&self) -> i32 {
        self.moved_uv[self.side()]
    }

    /// Voltage with which a stroke surely starts.
    fn least(&self, plan: &Motions) -> i32 {
        self.easiest().saturating_add(plan.start_uv)
    }

    /// Raises the voltage until the tip moves; slightly later the motor is shorted.
    fn pulse(&mut self, view: &StrokeInputs, plan: &Motions) {
        let (gone, easiest) = (self.gone(view.encoder), self.easiest());
        let limit = easiest.saturating_add(plan.feel_uv).min(of_supply(view, PULSE_SUPPLY));
        if gone >= MOVED {
            self.moved_uv[self.side()] = self.voltage_uv.max(1).min(easiest);
            self.moving += 1;
            if gone >= plan.pulse || self.moving > plan.pulse_frames {
                self.short(view.encoder, None);
            }
        } else if self.voltage_uv >= limit {
            let ended = if easiest == UNKNOWN {
                (Ended::Still, self.voltage_uv / 1_000)
            } else {
                (Ended::Pushed, plan.millinewtons(self.voltage_uv - easiest))
            };
            self.short(view.encoder, Some(ended));
        } else {
            let quick = self.part == Part::Pulse { quick: true };
            let rise = if quick { plan.jog_rise_uv } else { plan.rise_uv };
            self.voltage_uv = self.voltage_uv.saturating_add(rise).min(limit);
        }
    }

    /// Runs a stroke under one voltage that comes to rest at a place.
    fn stroke(&mut self, view: &StrokeInputs, plan: &Motions) {
        let gone = self.gone(view.encoder);
        if self.frames.is_multiple_of(plan.span_part) {
            let before = [self.history[SPAN_PARTS - 1], self.history[SPAN_PARTS / 4 - 1]];
            self.over = before.map(|before| view.encoder.wrapping_sub(before).saturating_mul(self.sign));
            self.history.rotate_right(1);
            self.history[0] = view.encoder;
        }
        let [span, quarter] = self.over;
        // The first spans are those of the run-up.
        if self.frames > 2 * plan.span() {
            self.fastest = self.fastest.max(span);
        }
        let end = if matches!(self.part, Part::Stroke(_)) { plan.stroke } else { 0 };
        let roll = ((i64::from(quarter) * i64::from(plan.roll_q8)) >> 8) as i32;
        if self.place(view.encoder).saturating_add(roll) >= end || self.frames >= plan.longest {
            if let Part::Stroke(0 | 1) = self.part {
                let back_emf = (i64::from(span) * i64::from(plan.uv_per_count_q8)) >> 8;
                let friction = i64::from(self.voltage_uv + self.more_uv) - back_emf;
                self.friction_uv[self.side()] = friction.max(0) as i32;
            }
            self.short(view.encoder, None);
        } else if self.fastest - span > plan.push {
            let force = plan.push_mn.saturating_mul(self.fastest - span).checked_div(plan.push.max(1)).unwrap_or(0);
            self.short(view.encoder, Some((Ended::Pushed, force)));
        } else if gone < MOVED && self.frames > 3 * plan.span() {
            // In total no more than a stroke may take.
            let most = self.largest(view).saturating_sub(self.voltage_uv).max(0);
            self.more_uv = self.more_uv.saturating_add(plan.rise_uv);
            if self.more_uv > plan.feel_uv.min(most) {
                self.short(view.encoder, Some((Ended::Pushed, plan.millinewtons(self.more_uv))));
            }
        }
    }
}

fn of_supply(view: &StrokeInputs, [part, of]: [i32; 2]) -> i32 {
    i32::from(view.supply_mv) * 1_000 / of * part
}
