//! The flash image.
#![no_std]
#![no_main]
use defmt_rtt as _;
use embassy_stm32 as _;
#[panic_handler]
fn p(_: &core::panic::PanicInfo) -> ! {
    loop {}
}
#[cortex_m_rt::entry]
fn main() -> ! {
    defmt::info!("x");
    loop {}
}
