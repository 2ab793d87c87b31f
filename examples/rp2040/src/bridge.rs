//! The H-bridge: two outputs of a PWM at 30 kHz.

use crate::pins;
use fingertip::pipeline;
use fingertip::units::Duty;
use rp_pac::PWM;

/// The slice of the bridge's pins.
const SLICE: usize = 4;
/// A period of the PWM, in ticks of 8 ns.
const PERIOD: u16 = 4_166;

/// The bridge, which nothing else drives; only [`cut`] opens it from elsewhere.
pub struct Bridge(());

impl Bridge {
    /// Both outputs low and the driver asleep.
    pub fn open() -> Self {
        let slice = PWM.ch(SLICE);
        slice.top().write(|top| top.set_top(PERIOD - 1));
        slice.cc().write_value(Default::default());
        slice.csr().write(|control| control.set_en(true));
        Self(())
    }

    /// Sets what a frame's status asks for.
    pub fn set(&mut self, bridge: pipeline::Bridge) {
        let (inputs, awake) = match bridge {
            pipeline::Bridge::Asleep => ([0; 2], false),
            pipeline::Bridge::Open => ([0; 2], true),
            pipeline::Bridge::Brakes => ([PERIOD; 2], true),
            pipeline::Bridge::Driven(duty) => (slow_decay(duty), true),
        };
        // Both in one write: the slice takes them at the end of its period.
        PWM.ch(SLICE).cc().write(|compare| {
            compare.set_a(inputs[0]);
            compare.set_b(inputs[1]);
        });
        if awake { pins::high(pins::AWAKE) } else { pins::low(pins::AWAKE) }
    }
}

/// One input stays high, the other one is low for the duty's share of a period: driven, and shorted in between.
fn slow_decay(duty: Duty) -> [u16; 2] {
    let share = u32::from(duty.0.unsigned_abs()) * u32::from(PERIOD) / u32::from(Duty::FULL.unsigned_abs());
    let low = PERIOD - share.min(PERIOD.into()) as u16;
    if duty.0 < 0 { [low, PERIOD] } else { [PERIOD, low] }
}

/// Shorts the motor at once, from any interrupt: a tip that presses holds energy, and would fly back from an open bridge.
pub fn cut() {
    PWM.ch(SLICE).cc().write(|compare| {
        compare.set_a(PERIOD);
        compare.set_b(PERIOD);
    });
}
