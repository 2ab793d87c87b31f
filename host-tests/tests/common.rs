//! Names and helpers of most tests.

pub use fastrand::Rng;
pub use fingertip::command::Command;
pub use fingertip::config::newtons;
pub use fingertip::contact::{Contact, FitLevel};
pub use fingertip::control::SpeedLoop;
pub use fingertip::frame::Sense;
pub use fingertip::measure::{Ended, MeasureState, Task};
pub use fingertip::params::Params;
pub use fingertip::pipeline::{Status, Taring};
pub use fingertip::pressure::GAIN_ONE;
pub use fingertip::scan::Clocks;
pub use fingertip::shipped::{
    CLOCKS, COLUMNS, Calibration, Config, Fit, Frame, Pipeline, ROWS, SLOTS, TARE_FRAMES, TAXELS, TactileImage,
};
pub use fingertip::state::{Fault, Limits, Mode};
pub use fingertip::units::{Celsius, CoreCycles, Duty, Millimetres, MillimetresPerSecond, Newtons};
pub use host_tests::finger::config;
pub use images::record::Record;
pub use proptest::prelude::*;
pub use sim::native::bench::Bench;
pub use sim::plant::{Plant, Taxel};
pub use sim::setup::Setup;
