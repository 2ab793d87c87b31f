//! The chip's clocks: core and timers at 125 MHz, the converter at 48 MHz, both from a crystal of 12 MHz.

use rp_pac::clocks::vals::{ClkAdcCtrlAuxsrc, ClkRefCtrlSrc, ClkSysCtrlAuxsrc, ClkSysCtrlSrc};
use rp_pac::xosc::vals::{CtrlFreqRange, Enable};
use rp_pac::{CLOCKS, PLL_SYS, PLL_USB, RESETS, WATCHDOG, XOSC, pll};

/// The crystal, MHz: the timers count microseconds of it.
const CRYSTAL_MHZ: u16 = 12;

/// Starts the clocks and all that the example uses.
pub fn start() {
    XOSC.ctrl().write(|control| control.set_freq_range(CtrlFreqRange::_1_15MHZ));
    // 1 ms, in 256 cycles of the crystal.
    XOSC.startup().write(|startup| startup.set_delay(CRYSTAL_MHZ * 1_000 / 256 + 1));
    XOSC.ctrl().modify(|control| control.set_enable(Enable::ENABLE));
    while !XOSC.status().read().stable() {}
    CLOCKS.clk_ref_ctrl().write(|clock| clock.set_src(ClkRefCtrlSrc::XOSC_CLKSRC));
    CLOCKS.clk_sys_ctrl().write(|clock| clock.set_src(ClkSysCtrlSrc::CLK_REF));
    while CLOCKS.clk_sys_selected().read() != 1 {}

    release(|reset| {
        reset.set_pll_sys(false);
        reset.set_pll_usb(false);
        reset.set_io_bank0(false);
        reset.set_pads_bank0(false);
        reset.set_pwm(false);
        reset.set_timer(false);
    });
    // 12 MHz x 125 / 6 / 2 and 12 MHz x 120 / 6 / 5.
    lock(PLL_SYS, 125, [6, 2]);
    lock(PLL_USB, 120, [6, 5]);
    CLOCKS.clk_sys_ctrl().modify(|clock| clock.set_auxsrc(ClkSysCtrlAuxsrc::CLKSRC_PLL_SYS));
    CLOCKS.clk_sys_ctrl().modify(|clock| clock.set_src(ClkSysCtrlSrc::CLKSRC_CLK_SYS_AUX));
    while CLOCKS.clk_sys_selected().read() != 2 {}
    CLOCKS.clk_adc_ctrl().write(|clock| {
        clock.set_auxsrc(ClkAdcCtrlAuxsrc::CLKSRC_PLL_USB);
        clock.set_enable(true);
    });
    release(|reset| reset.set_adc(false));
    WATCHDOG.tick().write(|tick| {
        tick.set_cycles(CRYSTAL_MHZ);
        tick.set_enable(true);
    });
}

/// Ends the reset of what is set to false, and waits until it is ready.
fn release(which: impl Fn(&mut rp_pac::resets::regs::Peripherals)) {
    RESETS.reset().modify(&which);
    // Those whose reset has ended are set; `which` clears its own.
    let mut rest = rp_pac::resets::regs::Peripherals(u32::MAX);
    which(&mut rest);
    while RESETS.reset_done().read().0 | rest.0 != u32::MAX {}
}

fn lock(pll: pll::Pll, times: u16, [by, then_by]: [u8; 2]) {
    pll.cs().write(|control| control.set_refdiv(1));
    pll.fbdiv_int().write(|feedback| feedback.set_fbdiv_int(times));
    pll.pwr().modify(|power| {
        power.set_pd(false);
        power.set_vcopd(false);
    });
    while !pll.cs().read().lock() {}
    pll.prim().write(|post| {
        post.set_postdiv1(by);
        post.set_postdiv2(then_by);
    });
    pll.pwr().modify(|power| power.set_postdivpd(false));
}
