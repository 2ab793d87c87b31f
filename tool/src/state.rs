//! The state of the loop, all of it from one frame.

use crate::Error;
use crate::client::Client;
use crate::table::{self, Block};
use fingertip::shipped::{COLUMNS, ROWS, address};
use serde_json::{Map, Value, json};
use std::time::{Duration, Instant, SystemTime, UNIX_EPOCH};

/// The registers of the state, side by side: with the goal, and without the pressures.
const FIRST: u16 = address::GOAL_FORCE_MN;
const LAST: u16 = address::FRAME_PERIOD_NS;
/// The state before the pressures, and these.
const PICTURE: u16 = address::PICTURE_TIME_US;

/// Rows and columns that this program knows.
pub const SHAPE: [usize; 2] = [ROWS, COLUMNS];

/// The state of the loop at a frame, as the control table has it.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct State {
    /// Time of the frame's end by the controller's clock, us; wraps after 71 minutes.
    pub time_us: u32,
    pub frame: i64,
    pub goal_mn: i64,
    pub force_mn: i64,
    pub indentation_um: i64,
    pub centre_x_um: i64,
    pub centre_y_um: i64,
    pub travel_um: i64,
    pub speed_um_per_s: i64,
    pub duty_permille: i64,
    pub mode: i64,
    /// Number of the fault; 0 without one.
    pub fault: i64,
    /// Active limits, a bit each.
    pub limits: i64,
    /// Confidence, 0 to 255.
    pub confidence: i64,
    /// Time between two frames, ns.
    pub period_ns: i64,
    /// Pressures, Pa, row by row, if they were read.
    pub pressures_pa: Vec<i64>,
}

impl State {
    pub fn read(client: &mut Client) -> Result<Self, Error> {
        Ok(Self::of(&client.block(FIRST, LAST)?, false))
    }

    /// Reads it with the pressures, in one packet.
    pub fn read_picture(client: &mut Client) -> Result<Self, Error> {
        let block = client.block(PICTURE, address::PRESSURES)?;
        Ok(Self { pressures_pa: block.numbers(address::PRESSURES), ..Self::of(&block, true) })
    }

    /// The state of its registers, or of those that mirror them beside the pressures.
    fn of(block: &Block, mirrored: bool) -> Self {
        let at = |plain: u16, mirror: u16| block.number(if mirrored { mirror } else { plain });
        Self {
            time_us: at(address::FRAME_TIME_US, address::PICTURE_TIME_US) as u32,
            frame: at(address::FRAME_COUNTER, address::PICTURE_FRAME),
            goal_mn: at(address::GOAL_FORCE_MN, address::PICTURE_GOAL_MN),
            force_mn: at(address::PRESENT_FORCE_MN, address::PICTURE_FORCE_MN),
            indentation_um: at(address::INDENTATION_UM, address::PICTURE_INDENTATION_UM),
            centre_x_um: at(address::CENTRE_X_UM, address::PICTURE_CENTRE_X_UM),
            centre_y_um: at(address::CENTRE_Y_UM, address::PICTURE_CENTRE_Y_UM),
            travel_um: at(address::TRAVEL_UM, address::PICTURE_TRAVEL_UM),
            speed_um_per_s: at(address::SPEED_UM_PER_S, address::PICTURE_SPEED_UM_PER_S),
            duty_permille: at(address::DUTY_PERMILLE, address::PICTURE_DUTY_PERMILLE),
            mode: at(address::PRESENT_MODE, address::PICTURE_MODE),
            fault: at(address::FAULT, address::PICTURE_FAULT),
            limits: at(address::LIMITS, address::PICTURE_LIMITS),
            confidence: at(address::CONFIDENCE, address::PICTURE_CONFIDENCE),
            period_ns: at(address::FRAME_PERIOD_NS, address::PICTURE_PERIOD_NS),
            pressures_pa: Vec::new(),
        }
    }

    pub fn mode_name(&self) -> String {
        table::meaning(address::PRESENT_MODE, self.mode)
    }

    /// The fault in words; `None` without one.
    pub fn fault_name(&self) -> Option<String> {
        (self.fault != 0).then(|| table::meaning(address::FAULT, self.fault))
    }

    pub fn limit_names(&self) -> Vec<String> {
        table::bits(address::LIMITS, self.limits)
    }

    pub fn limits_text(&self) -> String {
        let names = self.limit_names();
        if names.is_empty() { "none".into() } else { names.join(", ") }
    }

    /// Each number with its name, in the order in which it is written; the pressures apart.
    pub fn numbers(&self) -> [(&'static str, i64); 14] {
        [
            ("frame", self.frame),
            ("mode", self.mode),
            ("fault", self.fault),
            ("limits", self.limits),
            ("goal_mn", self.goal_mn),
            ("force_mn", self.force_mn),
            ("indentation_um", self.indentation_um),
            ("centre_x_um", self.centre_x_um),
            ("centre_y_um", self.centre_y_um),
            ("travel_um", self.travel_um),
            ("speed_um_per_s", self.speed_um_per_s),
            ("duty_permille", self.duty_permille),
            ("confidence_255", self.confidence),
            ("period_ns", self.period_ns),
        ]
    }

    /// JSON for scripts: numbers by name, and the names of mode, fault and limits.
    pub fn json(&self) -> Map<String, Value> {
        let mut all: Map<String, Value> =
            self.numbers().into_iter().map(|(name, value)| (name.to_owned(), json!(value))).collect();
        all.insert("mode_name".into(), json!(self.mode_name()));
        all.insert("fault_name".into(), json!(self.fault_name()));
        all.insert("limit_names".into(), json!(self.limit_names()));
        all
    }
}

/// The controller's time beyond its wrap, from the first state on.
#[derive(Clone, Copy, Debug, Default)]
pub struct Clock {
    /// Time and frame of the last state.
    last: Option<(u32, u32)>,
    total_us: u64,
}

/// Message for a [`Clock`] without a time.
pub const RESTARTED: &str = "the controller restarted: torque is off, and it is not tared";

impl Clock {
    /// Seconds since the first state; states come in order, an hour apart at most. None where frames count back: the
    /// controller restarted, which takes an unknown time.
    pub fn time_s(&mut self, state: &State) -> Option<f64> {
        let now = (state.time_us, state.frame as u32);
        let (last_us, last_frame) = self.last.replace(now).unwrap_or(now);
        if now.1.wrapping_sub(last_frame) as i32 > -1 {
            self.total_us += u64::from(now.0.wrapping_sub(last_us));
            Some(self.total_us as f64 / 1e6)
        } else {
            *self = Self::default();
            None
        }
    }
}

/// Time of a state, by both clocks.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Stamp {
    /// Controller's time from the first state on, s.
    pub time_s: f64,
    /// Host's time when the state was read, ns since 1970.
    pub read_ns: u64,
    /// Host's time of the first state plus `time_s`, ns since 1970: as even as the controller's clock.
    pub frame_ns: u64,
}

/// Stamps states with both clocks. The host's time is taken once and goes on evenly, whatever sets the clock meanwhile.
#[derive(Clone, Copy, Debug, Default)]
pub struct Stamps {
    clock: Clock,
    begun: Option<(Instant, u64)>,
}

impl Stamps {
    /// Stamps a state that was just read. None where the controller restarted, as of [`Clock::time_s`].
    pub fn stamp(&mut self, state: &State) -> Option<Stamp> {
        let Some(time_s) = self.clock.time_s(state) else {
            self.begun = None;
            return None;
        };
        let now = Instant::now();
        let (begun, first_ns) = *self.begun.get_or_insert_with(|| (now, unix_ns()));
        let after = |time: Duration| first_ns + time.as_nanos() as u64;
        Some(Stamp { time_s, read_ns: after(now - begun), frame_ns: after(Duration::from_secs_f64(time_s)) })
    }
}

pub fn unix_ns() -> u64 {
    SystemTime::now().duration_since(UNIX_EPOCH).unwrap_or_default().as_nanos() as u64
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_clock_goes_on_beyond_its_wrap_and_begins_again_after_a_restart() {
        let mut clock = Clock::default();
        let times = [u32::MAX - 999, u32::MAX, 999_000];
        let times = times.map(|time_us| clock.time_s(&State { time_us, ..State::default() }));
        assert_eq!(times, [Some(0.0), Some(0.000_999), Some(1.0)]);
        // One that began again tells no time.
        let mut clock = Clock::default();
        let mut at = |time_us, frame| clock.time_s(&State { time_us, frame, ..State::default() });
        // Frames wrap too, though after days.
        assert_eq!([at(500, 0xFFFF_FFFF), at(600, 0), at(100, 1_000)].map(|time| time.is_some()), [true; 3]);
        assert_eq!(at(900_000, 999), None);
        assert_eq!([at(1_000_000, 1_999), at(1_500_000, 6_999)], [Some(0.0), Some(0.5)], "it begins with the next");
    }

    #[test]
    fn words_come_out_of_the_table() {
        let state = State { mode: 2, fault: 16, limits: 1 << 6 | 1 << 12, ..State::default() };
        assert_eq!(state.mode_name(), "approach");
        assert_eq!(state.fault_name().as_deref(), Some("unseen contact"));
        assert_eq!(state.limit_names(), ["not tared", "guard"]);
        assert_eq!(State::default().fault_name(), None);
        for number in 1..=16 {
            assert!(!table::meaning(address::FAULT, number).starts_with("number"), "{number}");
        }
    }
}
