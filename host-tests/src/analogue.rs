//! Calculated figures of the analogue front end in `docs/board.md`: settling time of a column's amplifier, and phase
//! margin of the virtual ground's buffer. Nothing here was measured.

use crate::page::Page;
use num_complex::Complex64;
use std::f64::consts::{PI, TAU};
use std::fmt::Write as _;

pub const PAGE: Page = Page { name: "docs/board.md", tables: "analogue figures", command: "cargo xtask docs" };

/// Settle time of the default scan, s.
const SETTLE_S: f64 = 2.4e-6;
/// A quarter of a code, as a share of a full-scale step of 12 bits.
const QUARTER_CODE: f64 = 1.0 / 16_384.0;
/// Resolution of a settling time, and the longest one, s.
const STEP_S: f64 = 0.5e-9;
const LONGEST_S: f64 = 20e-6;
/// Feedback resistor of a column's amplifier, Ohm.
const COLUMN_OHM: f64 = 48.7e3;

/// Linear model of an operational amplifier: an integrator with a second pole, behind a resistance.
#[derive(Clone, Copy)]
struct Amplifier {
    gain_bandwidth_hz: f64,
    second_pole_hz: f64,
    output_ohm: f64,
    input_f: f64,
}

/// Typical figures of the OPA4354 (TI SBOS233H, 6.7). The second pole is assumed: the data sheet gives none.
const OPA4354: Amplifier =
    Amplifier { gain_bandwidth_hz: 100e6, second_pole_hz: 250e6, output_ohm: 39.0, input_f: 4e-12 };

/// Transimpedance stage of one column. Its noise gain stays above 10 up to the crossover, so the second pole and the
/// output resistance are left out.
#[derive(Clone, Copy)]
struct Column {
    amplifier: Amplifier,
    feedback_f: f64,
    /// Capacitance of array and cable at the inverting input.
    input_f: f64,
    /// 1 + feedback resistance times conductance of all taxels of the column.
    noise_gain: f64,
}

impl Column {
    /// Share of a step of the output that is left after a time: x'' + 2 decay x' + square x = 0.
    fn left(self, time_s: f64) -> f64 {
        let crossover = TAU * self.amplifier.gain_bandwidth_hz;
        let capacitance = self.input_f + self.amplifier.input_f + self.feedback_f;
        let square = crossover / COLUMN_OHM / capacitance;
        let decay = (self.feedback_f * crossover + self.noise_gain / COLUMN_OHM) / (2.0 * capacitance);
        let ringing = Complex64::from(decay * decay - square).sqrt();
        let [a, b] = [ringing - decay, -ringing - decay];
        ((a * (b * time_s).exp() - b * (a * time_s).exp()) / (a - b)).re
    }

    /// Time after which the output stays within a quarter of a code, for a full-scale step.
    fn settling_s(self) -> f64 {
        let mut times_s = (0..(LONGEST_S / STEP_S) as u32).rev().map(|n| f64::from(n) * STEP_S);
        times_s.find(|time_s| self.left(*time_s).abs() > QUARTER_CODE).unwrap_or(0.0)
    }

    /// Capacitance of array and cable, in pF, up to which the output settles in time, at a noise gain of 2 and of 10.
    fn input_max_pf(self) -> u32 {
        let settles = |pf: &u32| {
            let of = |noise_gain| Self { input_f: f64::from(*pf) * 1e-12, noise_gain, ..self }.settling_s();
            of(2.0).max(of(10.0)) <= SETTLE_S
        };
        (100..600).step_by(5).take_while(settles).last().unwrap_or(0)
    }
}

/// Follower with a resistor between output and load. The inverting input takes low frequencies from the load, through a
/// resistor, and high frequencies from the output, through a capacitor.
#[derive(Clone, Copy)]
struct Buffer {
    amplifier: Amplifier,
    isolation_ohm: f64,
    feedback_ohm: f64,
    feedback_f: f64,
    load_f: f64,
}

impl Buffer {
    /// Gain around the loop, its sign inverted.
    fn loop_gain(self, hz: f64) -> Complex64 {
        let Self { amplifier, isolation_ohm, feedback_ohm, feedback_f, load_f } = self;
        let s = Complex64::new(0.0, TAU * hz);
        // Voltages that put 1 V on the inverting input, from the load back to the amplifier's source.
        let all = 1.0 + s * feedback_ohm * (feedback_f + amplifier.input_f);
        let direct = s * feedback_ohm * feedback_f;
        let drop = 1.0 + s * isolation_ohm * load_f + isolation_ohm / feedback_ohm;
        let output = (drop * all - isolation_ohm / feedback_ohm) / (1.0 + drop * direct);
        let load = all - direct * output;
        let current = s * load_f * load + (load - 1.0) / feedback_ohm + (output - 1.0) * s * feedback_f;
        let gain = amplifier.gain_bandwidth_hz / (hz * Complex64::i()) / (1.0 + s / (TAU * amplifier.second_pole_hz));
        gain / (output + amplifier.output_ohm * current)
    }

    /// Smallest phase margin of all crossings of unity gain from 100 Hz to 10 GHz, in degrees.
    fn margin_deg(self) -> f64 {
        let gains = (20_000..100_000).map(|n| self.loop_gain(10_f64.powf(f64::from(n) / 10_000.0)));
        let gains: Vec<_> = gains.collect();
        let crossings = gains.windows(2).filter(|pair| (pair[0].norm() > 1.0) != (pair[1].norm() > 1.0));
        let margin = |gain: Complex64| PI + if gain.arg() > 0.0 { gain.arg() - TAU } else { gain.arg() };
        crossings.map(|pair| margin(pair[0]).to_degrees()).fold(f64::INFINITY, f64::min)
    }
}

/// Both tables as Markdown.
pub fn markdown() -> String {
    let column = |feedback_pf: f64, input_pf: f64, noise_gain| Column {
        amplifier: OPA4354,
        feedback_f: feedback_pf * 1e-12,
        input_f: input_pf * 1e-12,
        noise_gain,
    };
    let mut page =
        "\n| array and cable | C_f 3.9 pF: noise gain 2 | 10 | 110 | C_f 5.6 pF: 2 | 10 | C_f 6.8 pF: 2 | 10 |\n\
         | --- | --- | --- | --- | --- | --- | --- | --- |\n"
            .to_owned();
    for input_pf in [100.0, 200.0, 300.0, 390.0, 470.0] {
        let cases = [(3.9, 2.0), (3.9, 10.0), (3.9, 110.0), (5.6, 2.0), (5.6, 10.0), (6.8, 2.0), (6.8, 10.0)];
        let times = cases.map(|(feedback_pf, noise_gain)| {
            let settling_us = column(feedback_pf, input_pf, noise_gain).settling_s() * 1e6;
            format!("{settling_us:.1} us")
        });
        let _ = writeln!(page, "| {input_pf} pF | {} |", times.join(" | "));
    }
    let slower = Amplifier { gain_bandwidth_hz: 80e6, ..OPA4354 };
    let [typical_pf, slower_pf] =
        [OPA4354, slower].map(|amplifier| Column { amplifier, ..column(3.9, 0.0, 10.0) }.input_max_pf());
    let _ = writeln!(
        page,
        "\nWith C_f = 3.9 pF, 2.4 us suffice up to {typical_pf} pF; with a gain-bandwidth product of 80 MHz, up to \
         {slower_pf} pF.\n\n| buffer of VG | load | phase margin | R_O 78 Ohm, second pole 100 MHz |\n\
         | --- | --- | --- | --- |"
    );
    let bare = |load_f| Buffer { amplifier: OPA4354, isolation_ohm: 0.0, feedback_ohm: 1.0, feedback_f: 0.0, load_f };
    let isolated = |load_f| Buffer { isolation_ohm: 4.7, feedback_ohm: 10e3, feedback_f: 10e-9, ..bare(load_f) };
    let worse = Amplifier { output_ohm: 78.0, second_pole_hz: 100e6, ..OPA4354 };
    for (name, load, buffer) in [
        ("plain follower", "0.1 nF", bare(0.1e-9)),
        ("plain follower", "1 nF", bare(1e-9)),
        ("plain follower", "4.2 nF", bare(4.2e-9)),
        ("4.7 Ohm, 10 kOhm, 10 nF", "2.2 uF", isolated(2.2e-6)),
        ("4.7 Ohm, 10 kOhm, 10 nF", "4.7 uF", isolated(4.7e-6)),
    ] {
        let margins = [buffer, Buffer { amplifier: worse, ..buffer }].map(Buffer::margin_deg);
        let _ = writeln!(page, "| {name} | {load} | {:.0} deg | {:.0} deg |", margins[0], margins[1]);
    }
    page + "\n"
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Without input capacitance the fast pole is 120 times the slow one, whose time constant is R_f C_f + N / (2 pi GBW).
    #[test]
    fn a_column_without_capacitance_settles_as_one_pole() {
        let amplifier = Amplifier { input_f: 0.0, ..OPA4354 };
        let column = Column { amplifier, feedback_f: 3.9e-12, input_f: 0.0, noise_gain: 2.0 };
        let tau_s = COLUMN_OHM * 3.9e-12 + 2.0 / (TAU * 100e6);
        let ratio = column.settling_s() / (tau_s * (1.0 / QUARTER_CODE).ln());
        assert!((0.99..1.01).contains(&ratio), "{ratio}");
    }

    #[test]
    fn a_follower_has_the_margin_of_its_two_poles() {
        let amplifier = Amplifier { second_pole_hz: f64::INFINITY, input_f: 0.0, ..OPA4354 };
        let buffer = Buffer { amplifier, isolation_ohm: 0.0, feedback_ohm: 1.0, feedback_f: 0.0, load_f: 1e-9 };
        // With x = crossover times R_O C_L: x^2 (1 + x^2) = (2 pi GBW R_O C_L)^2.
        let product = TAU * 100e6 * 39.0 * 1e-9;
        let x = ((0.25 + product * product).sqrt() - 0.5).sqrt();
        let margin = buffer.margin_deg();
        assert!((margin - (90.0 - x.atan().to_degrees())).abs() < 0.01, "{margin}");
    }

    /// Far above 1 / (2 pi R C) of the feedback, only the divider of output and isolation resistance is left.
    #[test]
    fn an_isolated_buffer_divides_at_high_frequency() {
        let buffer =
            Buffer { amplifier: OPA4354, isolation_ohm: 4.7, feedback_ohm: 10e3, feedback_f: 10e-9, load_f: 4.7e-6 };
        let pole = 1.0 + Complex64::i() * 10e6 / 250e6;
        let gain = buffer.loop_gain(10e6) * Complex64::i() * pole / 10.0;
        assert!((gain * (39.0 + 4.7) / 4.7 - 1.0).norm() < 2e-3, "{gain}");
    }
}
