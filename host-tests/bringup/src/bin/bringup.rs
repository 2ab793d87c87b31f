//! The image of `cargo xtask bringup`: measures a bare NUCLEO-F446RE with the firmware's own board layer, closes the
//! loop on a finger that it simulates, and reports all of it on the virtual COM port.
//!
//! It judges nothing: `bringup::checks` does, on the host. Checks that end in a reset come first, see `stages`.
#![no_std]
#![no_main]

#[path = "../../../../src/board/mod.rs"]
#[allow(dead_code, reason = "the image takes a part of the firmware's board layer")]
mod board;

#[path = "../image/array.rs"]
mod array;
#[path = "../image/kernels.rs"]
mod kernels;
#[path = "../image/on_chip.rs"]
mod on_chip;
#[path = "../image/part.rs"]
mod part;
#[path = "../image/report.rs"]
mod report;
#[path = "../image/stages.rs"]
mod stages;

use board::analogue::Analogue;
use board::bridge::Bridge;
use board::scan::Scan;
use board::{clocks, crash, flash, guard, pins, stack, trace};
use bringup::script::Bench;
use cortex_m::peripheral::DWT;
use defmt_rtt as _;
use fingertip::control::Winding;
use fingertip::link::snapshot::CrashCause;
use fingertip::pipeline::AcknowledgedRequests;
use fingertip::shipped::{Config, Pipeline};
use kernels::host;
use stages::{Kept, Stage};
use static_cell::{ConstStaticCell, StaticCell};

static BENCH: ConstStaticCell<Bench> = ConstStaticCell::new(Bench::at_rest());
static PIPELINE: StaticCell<Pipeline> = StaticCell::new();
static CONFIG: StaticCell<Config> = StaticCell::new();

/// Cycles of the core in a microsecond.
const CYCLES_PER_US: u32 = 168;

#[cortex_m_rt::entry]
fn main() -> ! {
    stack::protect();
    let boot = crash::boot();
    let clocked = clocks::start_external();
    let external_hz = part::external_by_internal();
    let p = clocks::init(clocked);
    // Asleep, should there be one after all.
    let _bridge = Bridge::new(p.TIM1, p.PA8, p.PA9, p.PB12, p.PC9);
    clocks::accelerate_flash();
    clocks::freeze_when_halted();
    clocks::free_trace_pin();
    board::set_priorities();
    count_cycles();
    trace::start(p.PB10, p.PB13, p.PB14, p.PB15);
    guard::start(p.TIM5);
    report::start(p.USART2, p.PA2, p.PA3);

    let config = make_config();
    let kept = Kept::load(boot.reset);
    match kept.stage {
        Stage::Waits if boot.crashed => report::say(format_args!(
            "crashed: cause {}, line {}, pc {:#010x}",
            boot.crash.cause as u8, boot.crash.line, boot.crash.pc
        )),
        Stage::Waits => {}
        Stage::Window | Stage::Independent => stages::bite(kept, p.IWDG, p.WWDG, config.timing),
        Stage::Foot => stages::foot(kept),
        Stage::Rest => {}
    }
    if kept.stage != Stage::Rest {
        stages::wait(kept);
    }
    Kept { stage: Stage::Waits, ..kept }.store();

    report::begin();
    if let Some(hz) = external_hz {
        report::figure("hse_mhz", hz * 1e-6);
    }
    if let Some(hz) = part::low_speed() {
        report::figure("lsi_khz", hz * 1e-3);
    }
    report::figure("core_per_stopwatch", part::core_per_stopwatch());
    report::figure("brown_out_bits", (flash::option_bytes() >> 2 & 0b11) as f32);
    let [window, independent] = kept.cycles.map(|cycles| cycles as f32 / CYCLES_PER_US as f32);
    report::figure("window_watchdog_us", window);
    report::figure("independent_watchdog_ms", independent * 1e-3);
    report::figure("stack_foot", f32::from(u8::from(boot.crashed && boot.crash.cause == CrashCause::HardFault)));
    part::loopback();
    part::flash_times(p.FLASH);
    array::means(Analogue::new(p.ADC1, p.PA0));

    let mut scan = Scan::new(p.TIM8, (p.ADC3, p.ADC2), (p.DMA2_CH0, p.DMA2_CH1, p.DMA2_CH2), pins::of_scan!(p));
    scan.start(config.timing);
    array::rows(kept.frames);
    array::sample_instant(&mut scan, config.timing);

    let (bench, pipeline) = (BENCH.take(), make_pipeline(config));
    bench.finger.make_table();
    on_chip::run(bench, pipeline);
    array::noise(&mut scan, bench, pipeline);
    scan.stop();
    pipeline.renew(AcknowledgedRequests::default(), 0, Winding::new());
    report::number("loop_bits", bench.digest(pipeline));
    kernels::run(config, bench, pipeline);
    report::end();
    stages::wait(Kept { stage: Stage::Waits, ..kept })
}

#[inline(never)]
fn make_config() -> &'static Config {
    let Ok(config) = Config::shipped(&images::CONFIRMED) else { host::fail("the default parameters are refused") };
    CONFIG.init(config)
}

/// Makes the pipeline. A separate function, so that its large temporaries take stack only here.
#[inline(never)]
fn make_pipeline(config: &Config) -> &'static mut Pipeline {
    PIPELINE.init_with(|| Pipeline::new(config))
}

fn count_cycles() {
    if let Some(mut core) = cortex_m::Peripherals::take() {
        core.DCB.enable_trace();
        core.DWT.enable_cycle_counter();
    }
}

/// True once the given number of cycles passed since then.
fn passed(since: u32, cycles: u32) -> bool {
    DWT::cycle_count().wrapping_sub(since) >= cycles
}

/// Looks until there is something, at most this many milliseconds long.
fn wait_for<T>(ms: u32, mut look: impl FnMut() -> Option<T>) -> Option<T> {
    let since = DWT::cycle_count();
    loop {
        let found = look();
        if found.is_some() || passed(since, ms * 1_000 * CYCLES_PER_US) {
            return found;
        }
    }
}
