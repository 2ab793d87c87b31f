//! Table of all checks: figure, expected range, reason, and advice if the figure is outside.

use crate::script::Bench;
use crate::script::{COUNTS_PER_RAD, FORCE_PER_MM2, MM_PER_RAD};
use fingertip::control::Winding;
use fingertip::params::Params;
use fingertip::pipeline::AcknowledgedRequests;
use fingertip::shipped::{Config, Pipeline};
use serde_json::Value;
use std::sync::OnceLock;

/// A figure of the image's report, with its expected range.
pub struct Check {
    pub name: String,
    /// Description.
    pub what: String,
    pub unit: &'static str,
    /// Range of expected values.
    pub within: [f64; 2],
    /// Source of the range.
    pub source: &'static str,
    /// Advice if the figure is outside.
    pub then: &'static str,
    /// Reason why the emulated board cannot show this figure.
    pub unseen: Option<&'static str>,
}

const INF: f64 = f64::INFINITY;
const NO_NOISE: &str = "its converters have none";
const NO_CAPTURE: &str = "it has no inside connection from the oscillators to the timers";
const OWN_TIMES: &str = "its flash takes the data sheet's times by construction";
/// Reason why the emulated board shows no cycle counts, also those of the kernels.
pub const FLAT: &str = "it retires a flat number of instructions a second";

type Row = (&'static str, &'static str, &'static str, [f64; 2], &'static str, &'static str, Option<&'static str>);

const TABLE: [Row; 26] = [
    (
        "hse_mhz",
        "8 MHz of the ST-LINK, by the internal 16 MHz",
        "MHz",
        [7.66, 8.70],
        "DS10693, HSI: -8 to +4.5 % over temperature; UM1724, MCO 8 MHz",
        "none: solder bridges SB16 and SB50 closed, SB55 open? Power the ST-LINK; update its firmware",
        Some(NO_CAPTURE),
    ),
    (
        "lsi_khz",
        "the watchdog's oscillator, by the core's clock",
        "kHz",
        [17.0, 47.0],
        "DS10693, LSI",
        "out of the sheet: replace the board",
        Some(NO_CAPTURE),
    ),
    (
        "core_per_stopwatch",
        "cycles of the core in a tick of the stopwatch (TIM5)",
        "",
        [1.999, 2.001],
        "docs/board.md, Clocks: 168 and 84 MHz",
        "the bus prescalers are not what the image set: another image was flashed",
        None,
    ),
    (
        "brown_out_bits",
        "brown-out level in the option bytes: 0 is level 3",
        "",
        [0.0, 0.0],
        "RM0390, FLASH_OPTCR; docs/board.md, Option bytes",
        "`cargo xtask flash` programs level 3; a board from the factory has it off",
        None,
    ),
    (
        "window_watchdog_us",
        "a hang until the window watchdog resets",
        "us",
        [880.0, 1_100.0],
        "docs/firmware.md, Failure: 10 ticks of 97.5 us, less up to one",
        "0: it did not bite; is a debugger halting the core?",
        None,
    ),
    (
        "independent_watchdog_ms",
        "a hang until the independent watchdog resets",
        "ms",
        [8.0, 23.0],
        "docs/firmware.md, Failure: 12 ms by 17 to 47 kHz",
        "0: it did not bite; is a debugger halting the core?",
        None,
    ),
    (
        "stack_foot",
        "a store below RAM is a hard fault: 1",
        "",
        [1.0, 1.0],
        "docs/firmware.md, Failure: the memory protection unit",
        "an overflow of the stack would go unseen: do not give the motor power, and tell us",
        None,
    ),
    ("loopback_57600", "bytes of 256 that the bus's port heard wrong at 57,600 baud", "", [0.0, 0.0], BUS, PORT, None),
    ("loopback_115200", "the same at 115,200 baud", "", [0.0, 0.0], BUS, PORT, None),
    ("loopback_1000000", "the same at 1 Mbaud", "", [0.0, 0.0], BUS, PORT, None),
    ("loopback_2000000", "the same at 2 Mbaud", "", [0.0, 0.0], BUS, PORT, None),
    ("loopback_3000000", "the same at 3 Mbaud", "", [0.0, 0.0], BUS, PORT, None),
    (
        "flash_word_us",
        "longest of 64 words programmed",
        "us",
        [1.0, 100.0],
        "DS10693, flash memory programming, x32",
        "a save would take longer than the watchdogs allow",
        Some(OWN_TIMES),
    ),
    (
        "flash_erase_ms",
        "a sector of 128 KiB erased",
        "ms",
        [100.0, 2_000.0],
        "DS10693, flash memory programming, x32",
        "below 2.7 V the part erases more slowly: measure 3V3",
        Some(OWN_TIMES),
    ),
    (
        "flash_reads_back",
        "words read as programmed, the sector blank again: 1",
        "",
        [1.0, 1.0],
        "docs/firmware.md, Parameters",
        "the sector is worn out, or write-protected: see the option bytes",
        None,
    ),
    (
        "noise_prefetch_codes",
        "noise of column 5 with no row driven, held by the DAC, while the step runs; flash prefetch on, rms",
        "codes",
        [0.0, 2.0],
        "estimate: 1 code for 10.3 effective bits (DS10693), and as much again",
        "above: supply the board from a quiet USB port; measure AVDD's ripple",
        Some(NO_NOISE),
    ),
    (
        "noise_by_prefetch_codes",
        "the same, less the same with the prefetch off",
        "codes",
        [-0.5, 0.5],
        "estimate: half a code; AN4073 says that the prefetch may add noise",
        "above: the scan would gain by a prefetch that is off",
        Some(NO_NOISE),
    ),
    (
        "analogue_mv",
        "analogue supply by the internal reference",
        "mV",
        [3_135.0, 3_465.0],
        "3.3 V, 5 %; UM1724",
        "measure 3V3 and AVDD at the morpho connectors",
        None,
    ),
    (
        "chip_c",
        "the microcontroller's temperature",
        "C",
        [10.0, 65.0],
        "estimate: a room's, up to 20 K for itself and some for its sensor",
        "not reported: the factory's codes are missing, and the force is not compensated for temperature; else tell us",
        None,
    ),
    (
        "rows_frames",
        "frames for which the rows were read back",
        "",
        [1.0, INF],
        "asked for by --frames",
        "fewer than asked for: the rows stand still; is a debugger halting the core?",
        None,
    ),
    (
        "rows_wrong",
        "of their rows, those that were not the next one",
        "",
        [0.0, 0.0],
        "docs/board.md, Scan",
        "a pin of PB0 to PB9 is shorted or held: take off what is wired to it",
        None,
    ),
    (
        "slot_least_ns",
        "shortest slot at the rows' pins",
        "ns",
        [8_800.0, 9_350.0],
        "settle, sample and conversion by the parameters; the look takes up to 250 ns",
        "the timer's clock is another: see hse_mhz and core_per_stopwatch",
        None,
    ),
    (
        "slot_most_ns",
        "longest slot at the rows' pins",
        "ns",
        [8_800.0, 9_350.0],
        "the same",
        "the DMA was held up: tell us, with the JSON file",
        None,
    ),
    (
        "sample_ends_ns",
        "from the trigger to the end of column 5's sample, by a step of the DAC",
        "ns",
        [300.0, 1_050.0],
        "estimate: 15 cycles of 21 MHz and up to 3 to begin (RM0390), the step up to 0.4 us late",
        "nothing may hang on PA4; else the converters do not take 15 cycles as set",
        None,
    ),
    (
        "loop_missed",
        "frames that the loop on the simulated finger missed",
        "",
        [0.0, 0.0],
        "docs/firmware.md, Time",
        "the step and the finger take longer than a frame: see their cycles",
        None,
    ),
    (
        "loop_answer_us",
        "longest answer, from the scan's end to the duty",
        "us",
        [1.0, 75.0],
        "docs/firmware.md, Time: three quarters of a frame",
        "the flash accelerator is off, or the clock too slow: see hse_mhz",
        Some(FLAT),
    ),
];
const BUS: &str = "docs/board.md: APB1's 42 MHz makes each of these speeds";
const PORT: &str = "nothing may hang on PA2; see hse_mhz";

/// Cycles of the step on the simulated finger; the timing model's estimate is the only reference.
const CYCLES: [(&str, &str); 3] = [
    ("step_cycles", "a step of the loop, mean"),
    ("step_most_cycles", "a step of the loop, the longest"),
    ("finger_most_cycles", "a frame of the simulated finger, the longest"),
];

/// Figures of the loop on the simulated finger, computed once.
fn loop_bits() -> u32 {
    static BITS: OnceLock<u32> = OnceLock::new();
    *BITS.get_or_init(|| {
        let config = Config::shipped(&images::CONFIRMED);
        let config = config.expect("the defaults make a configuration: a test of the core holds that");
        let mut bench = Bench::new();
        bench.finger.make_table();
        let mut pipeline = Pipeline::new(&config);
        // As the image does behind its other checks.
        pipeline.renew(AcknowledgedRequests::default(), 0, Winding::new());
        bench.digest(&mut pipeline)
    })
}

/// All checks, in the report's order.
pub fn checks() -> Vec<Check> {
    let mut checks = Vec::new();
    for (name, what, unit, within, source, then, unseen) in TABLE {
        checks.push(Check { name: name.into(), what: what.into(), unit, within, source, then, unseen });
    }
    let frame_ns = Config::shipped(&Params::DEFAULT).map_or(f64::NAN, |config| f64::from(config.timing.frame_ns));
    checks.push(Check {
        name: "frame_ns".into(),
        what: "a frame at the rows' pins, mean".into(),
        unit: "ns",
        within: [frame_ns - 2.0, frame_ns + 2.0],
        source: "the parameters' settle time, sampling and conversions",
        then: "the timer's clock is another: see hse_mhz and core_per_stopwatch",
        unseen: None,
    });
    for (name, what) in CYCLES {
        checks.push(Check {
            name: name.into(),
            what: what.into(),
            unit: "cycles",
            within: [1.0, 16_764.0],
            source: "a frame of 99.8 us; the estimates beside the kernels below",
            then: "the flash accelerator is off, or the clock too slow: see hse_mhz",
            unseen: Some(FLAT),
        });
    }
    let bits = f64::from(loop_bits());
    checks.push(Check {
        name: "loop_bits".into(),
        what: "digest of all duties and states of the loop, as on this machine".into(),
        unit: "",
        within: [bits, bits],
        source: "1200 steps on the simulated finger, computed here as well",
        then: "the step or the finger computes other bits: image and host are of different sources, or tell us",
        unseen: None,
    });
    checks.extend(steps());
    checks
}

// The steps of the simulated finger against the demonstration's.

const DEMO: &str = include_str!("../../../docs/demo.json");
/// Name in the report, its unit, name in the demonstration, description, and unit there.
const FIGURES: [(&str, &str, &str, &str, &str); 3] = [
    ("rise", "ms", "rise_ms", "rise, 10 to 90 %", "ms"),
    ("overshoot", "percent", "overshoot_percent", "overshoot", "%"),
    ("settled", "ms", "settling_ms", "settled to 2 %", "ms"),
];
/// Allowed relative difference to the demonstration.
const SHARE: f64 = 0.1;

/// The force of two counts of the encoder at the goal, in percent of the step, as an overshoot is reported: where
/// within a count a step ends is chance, here and in the demonstration, whose images of other timing drew 0.00 to 0.48
/// % at the same step. Therefore an overshoot has no lower bound: none is as good as a small one.
fn two_counts_percent(from_n: f64, to_n: f64) -> f64 {
    let count_mm = f64::from(MM_PER_RAD) / f64::from(COUNTS_PER_RAD);
    let stiffness_n_per_mm = 2.0 * (f64::from(FORCE_PER_MM2) * to_n).sqrt();
    let unit_n = f64::min((to_n - from_n).abs(), to_n);
    100.0 * 2.0 * count_mm * stiffness_n_per_mm / unit_n
}

/// A check for each figure of each step.
pub fn steps() -> Vec<Check> {
    let demo: Value = serde_json::from_str(DEMO).expect("docs/demo.json is JSON");
    let steps = demo["steps"].as_array().expect("docs/demo.json has steps");
    let mut checks = Vec::new();
    for (place, step) in steps.iter().enumerate() {
        let number = |name: &str| step[name].as_f64().unwrap_or_else(|| panic!("docs/demo.json has {name}"));
        let [from_n, to_n] = ["from_n", "to_n"].map(number);
        for (figure, ends, theirs, words, unit) in FIGURES {
            let expected = number(theirs);
            let counts = if unit == "%" { two_counts_percent(from_n, to_n) } else { 0.0 };
            let allowed = f64::max(expected * SHARE, counts);
            let least = if unit == "%" { 0.0 } else { expected - allowed };
            checks.push(Check {
                name: format!("{figure}_{}_{ends}", place + 1),
                what: format!("simulated finger, {from_n:.1} to {to_n:.1} N: {words}"),
                unit,
                within: [least, expected + allowed],
                source: "docs/demo.json, within a tenth, an overshoot at most two counts of the encoder more",
                then: "the step computes something else than on the emulated board: tell us, with the JSON file",
                unseen: None,
            });
        }
    }
    checks
}
