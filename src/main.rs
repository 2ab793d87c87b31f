//! The flash image: sets the board up, then leaves it to the tasks; see `docs/firmware.md`.
#![no_std]
#![no_main]

mod board;

use board::analogue::Analogue;
use board::bridge::{Bridge, Encoder};
use board::control::{self, Control};
use board::flash::Store;
use board::guard::{self, Watchdogs};
use board::log::{log_boot, log_refusal, log_remark, log_save_error, log_unfit};
use board::scan::Scan;
use board::{bus, clocks, crash, link_task, log, pins, stack, trace};
use defmt::{info, unwrap, warn};
use defmt_rtt as _;
use embassy_executor::{InterruptExecutor, Spawner};
use embassy_stm32::gpio::{Level, Output, Speed};
use embassy_stm32::interrupt;
use fingertip::config::ConfigError;
use fingertip::params::Params;
use fingertip::shipped::{Calibration, Config, Loaded, Pipeline, Record, Settings};
use fingertip::state::Fault;
use fingertip::store::{Remark, settle};
use static_cell::StaticCell;

/// Runs control above everything but the scan, the guard and the bus's line.
static CONTROL: InterruptExecutor = InterruptExecutor::new();

static PIPELINE: StaticCell<Pipeline> = StaticCell::new();

#[embassy_stm32::interrupt]
fn SPI3() {
    // SAFETY: this is the executor's vector, and it is unmasked only by `start`.
    unsafe { CONTROL.on_interrupt() }
}

#[embassy_executor::main]
async fn main(spawner: Spawner) {
    stack::protect();
    let boot = crash::boot();
    let clocked = clocks::start_external();
    let p = clocks::init(clocked);
    let bridge = Bridge::new(p.TIM1, p.PA8, p.PA9, p.PB12, p.PC9);
    clocks::accelerate_flash();
    clocks::freeze_when_halted();
    clocks::free_trace_pin();
    board::set_priorities();
    log_boot(boot);
    let unfit = unfit(clocked);

    let mut store = Store::new(p.FLASH);
    let (mut record, mut sound) = load(&mut store);
    let made = settle(&mut record.params, make_pipeline, |cause| {
        log_refusal(cause);
        sound = false;
    });
    let pipeline = unwrap!(made, "the default parameters make a configuration: a test of the core holds that");
    pipeline.calibrate(&Calibration::of(&record.gains));
    if let Some(fault) = unfit {
        log_unfit(fault);
        pipeline.stop(fault);
    }
    if !sound {
        pipeline.stop(Fault::BrokenParameters);
    }
    if boot.crashed {
        pipeline.stop(Fault::Crash);
    }

    trace::start(p.PB10, p.PB13, p.PB14, p.PB15);
    guard::start(p.TIM5);
    let control = Control {
        scan: Scan::new(p.TIM8, (p.ADC3, p.ADC2), (p.DMA2_CH0, p.DMA2_CH1, p.DMA2_CH2), pins::of_scan!(p)),
        bridge,
        encoder: Encoder::new(p.TIM3, p.PC6, p.PC7),
        analogue: Analogue::new(p.ADC1, p.PA0),
        watchdogs: Watchdogs::new(p.IWDG, p.WWDG),
        store,
        pipeline,
        unfit,
    };
    let bus_parts = bus::Parts {
        usart: p.USART2,
        tx: p.PA2,
        rx: p.PA3,
        transmit_enable: p.PC8,
        tx_dma: p.DMA1_CH6,
        rx_dma: p.DMA1_CH5,
    };
    let bus = unwrap!(bus::Bus::new(bus_parts, Settings::new(record).baud()));
    let led = Output::new(p.PA5, Level::Low, Speed::Low);

    spawner.spawn(unwrap!(link_task::run(bus, record, boot).ok()));
    spawner.spawn(unwrap!(log::run(led).ok()));
    CONTROL.start(interrupt::SPI3).spawn(unwrap!(control::run(control).ok()));
}

/// Loads the record from the flash, and returns if all of it could be taken. Then makes room for the next records.
fn load(store: &mut Store) -> (Record, bool) {
    let mut unknown = 0;
    let Loaded { record, sound } = store.load(|remark| {
        unknown += u32::from(matches!(remark, Remark::Unknown { .. }));
        log_remark(remark);
    });
    if unknown > 0 {
        warn!("stored parameters: {=u32} that this firmware does not know", unknown);
    }
    match store.make_room() {
        Ok(false) => {}
        Ok(true) => info!("the older parameter sector is erased"),
        Err(cause) => log_save_error(cause),
    }
    (record, sound)
}

/// Returns the reason why this board must not drive a motor, if any.
fn unfit(clocked: bool) -> Option<Fault> {
    if !clocked {
        return Some(Fault::NoClock);
    }
    (!board::flash::brown_out_resets()).then_some(Fault::BrownOutLevel)
}

/// Makes the core. Its parts are functions of their own, because a configuration and a pipeline that are being made are
/// large, and their stack is soon free again.
fn make_pipeline(params: &Params) -> Result<&'static mut Pipeline, ConfigError> {
    let made = make_config(params);
    made.as_ref().map(put_in_place).map_err(|cause| *cause)
}

#[inline(never)]
fn make_config(params: &Params) -> Result<Config, ConfigError> {
    Config::shipped(params)
}

#[inline(never)]
fn put_in_place(config: &Config) -> &'static mut Pipeline {
    PIPELINE.init_with(|| Pipeline::new(config))
}
