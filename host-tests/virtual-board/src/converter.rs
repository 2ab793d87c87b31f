//! The converters, with what the crate's own lack: the external trigger, two at once, the array at their inputs.
//!
//! A sequence with DMA is one event, at its last conversion: the inputs are sampled at each rank's own instant, and the
//! words wait together for [`crate::streams`]. Nothing that the image can see depends on the words in between, and 110
//! conversions a frame cost 22 events. In a scene they cost one, see [`crate::front_end::Scan`]. Not modelled: interrupts,
//! several ranks without DMA, an injected group with a separate trigger, continuous and discontinuous mode, analogue
//! watchdog, resolutions other than 12 bits; a request for one is reported as a gap.

use crate::front_end::{LAST_ROW, Shared, Slot};
use crate::report::Edge;
use crate::timers::COMPARE_1;
use fingertip::chip::Factory;
use rigless::device::{Device, DeviceContext, Level, RegisterFile, RequestChange};
use rigless::soc::stm32f427::generated::adc1::{Register, cr1, cr2, jsqr, sqr1, sr};
use rigless::soc::stm32f427::generated::{ADC2, ADC3};
use rigless::soc::stm32f427::peripherals::adc::DMA_REQUEST;
use rigless::soc::{Layout, Width};
use rigless::time::{EventId, VirtualNanos};

/// `EXTSEL` of TIM8_CC1, 13.13.3.
const TIM8_CC1: u64 = 13;
/// The row drives' port, and how many of its pins are rows.
const ROW_PORT: (&str, usize) = ("GPIOB", 10);

/// Conversions under way, all of them over at the event.
#[derive(Clone, Debug)]
struct Running {
    event: Option<EventId>,
    sequence: Sequence,
    /// Slot of a scene; `None` outside a scene.
    slot: Option<Slot>,
}

/// Inputs with the instants at which they are sampled, and the end of the last conversion, ns.
type Sequence = (Vec<(usize, u64)>, u64);

/// ADC1, ADC2 or ADC3.
#[derive(Debug)]
pub struct Converter {
    nth: usize,
    front_end: Shared,
    clock_hz: u64,
    status: u64,
    running: Option<Running>,
    injected: Injected,
    /// True if the reference and the temperature sensor are on, by the register that the converters share.
    pub inside_on: bool,
}

impl Converter {
    /// Out of reset, its inputs on a front end.
    pub fn new(nth: usize, front_end: Shared, clock_hz: u64) -> Self {
        Self { nth, front_end, clock_hz, status: 0, running: None, injected: Injected::default(), inside_on: false }
    }

    fn sequence(&self, begun_ns: u64, inputs: impl IntoIterator<Item = usize>, registers: &RegisterFile) -> Sequence {
        let after = |cycles: u64| begun_ns + (cycles * 1_000_000_000).div_ceil(self.clock_hz);
        let mut cycles = 0;
        let sample = |input| {
            let sampled = cycles + sampling_cycles(registers, input);
            cycles = sampled + CONVERSION_CYCLES;
            (input, after(sampled))
        };
        let samples = inputs.into_iter().map(sample).collect();
        (samples, after(cycles))
    }

    /// Begins the next slot of a scene: the sequence of the slot before has ended, and the new one starts at the
    /// trigger. Only the last slot of a frame is an event, as the image waits for it.
    fn next_slot(&mut self, registers: &mut RegisterFile, context: &mut DeviceContext<'_>) {
        if let Some(running) = self.running.take_if(|running| running.event.is_none()) {
            self.finish(running, registers, context);
        }
        let slot = self.front_end.lock().scan.as_ref().map(|scan| scan.slot);
        self.triggered(slot, registers, context);
    }

    fn begin(&mut self, slot: Option<Slot>, registers: &RegisterFile, context: &mut DeviceContext<'_>) {
        let control = registers.get(Register::Cr2);
        if !cr2::ADON.is_set(control) || self.running.is_some() || sr::OVR.is_set(self.status) || self.clock_hz == 0 {
            return;
        }
        if self.injected.runs(context.now().0) {
            context.tell("CR2", "a regular sequence that waits for the injected group is not modelled");
        }
        let by_dma = cr2::DMA.is_set(control);
        // What a scene's last slot left is being fetched at this very instant.
        if by_dma && slot.is_none() && !self.front_end.lock().waiting[self.nth].is_empty() {
            self.status = sr::OVR.set(self.status, 1);
            return;
        }
        let length = length(registers);
        if !by_dma && length > 1 {
            context.tell("CR2", "a regular sequence of several ranks without DMA is not modelled");
        }
        let begun_ns = slot.map_or(context.now().0, |slot| slot.begun_ns);
        let sequence = self.sequence(begun_ns, (0..length).map(|rank| input(registers, rank)), registers);
        let done = VirtualNanos(sequence.1);
        let event = slot.is_none_or(|slot| slot.rows == LAST_ROW).then(|| context.schedule(done));
        self.status = sr::STRT.set(self.status, 1);
        self.running = Some(Running { event, sequence, slot });
    }

    fn finish(&mut self, running: Running, registers: &mut RegisterFile, context: &mut DeviceContext<'_>) {
        let (samples, done_ns) = running.sequence;
        let by_dma = cr2::DMA.is_set(registers.get(Register::Cr2));
        let mut front_end = self.front_end.lock();
        if !by_dma {
            front_end.waiting[self.nth].clear();
        }
        front_end.convert(self.nth, self.inside_on, running.slot, samples.into_iter());
        if let Some(word) = front_end.waiting[self.nth].front() {
            registers.set(Register::Dr, u64::from(*word));
        }
        if self.nth == 1 {
            front_end.sequence_done(context.now().0, running.slot);
        }
        drop(front_end);
        if cr1::JAUTO.is_set(registers.get(Register::Cr1)) {
            self.inject(done_ns, registers, context);
        }
        self.status = sr::EOC.set(self.status, 1);
        if by_dma {
            // The streams take all that waits; the line falls by itself.
            context.request(DMA_REQUEST, Level::High);
        }
    }

    /// The injected group begins, behind a regular sequence.
    fn inject(&mut self, begun_ns: u64, registers: &mut RegisterFile, context: &mut DeviceContext<'_>) {
        self.status = self.injected.show(context.now().0, self.status, registers);
        let inputs = injected_inputs(registers);
        let too_short = |input| sampling_cycles(registers, input) * 1_000_000_000 < SAMPLING_NS * self.clock_hz;
        if inputs.iter().any(|input| *input >= REFERENCE_INPUT && too_short(*input)) {
            context.tell("SMPR1", "reference and sensor are sampled for less than 10 us");
        }
        let (samples, done_ns) = self.sequence(begun_ns, inputs, registers);
        let front_end = self.front_end.lock();
        let word = |(input, at_ns)| front_end.word(self.nth, input, self.inside_on, at_ns);
        self.injected = Injected { words: samples.into_iter().map(word).collect(), done_ns };
    }

    fn triggered(&mut self, slot: Option<Slot>, registers: &mut RegisterFile, context: &mut DeviceContext<'_>) {
        let control = registers.get(Register::Cr2);
        if cr2::EXTEN.get(control) & 1 == 1 && cr2::EXTSEL.get(control) == TIM8_CC1 {
            self.begin(slot, registers, context);
            registers.set(Register::Sr, self.status);
        }
    }

    fn write_cr2(&mut self, registers: &mut RegisterFile, context: &mut DeviceContext<'_>) {
        let value = registers.get(Register::Cr2);
        if cr2::CONT.is_set(value) || cr2::JSWSTART.is_set(value) || cr2::ALIGN.is_set(value) {
            context.tell("CR2", "continuous mode, injected group and left alignment are not modelled");
        }
        if cr2::EXTEN.get(value) > 1 || cr2::EXTEN.get(value) == 1 && cr2::EXTSEL.get(value) != TIM8_CC1 {
            context.tell("CR2", "of the external triggers only the rising edge of TIM8_CC1 is modelled");
        }
        registers.set(Register::Cr2, cr2::SWSTART.set(value, 0));
        if !cr2::ADON.is_set(value) {
            (self.running, self.injected) = (None, Injected::default());
            self.front_end.lock().waiting[self.nth].clear();
        } else if cr2::SWSTART.is_set(value) {
            self.begin(None, registers, context);
        }
    }
}

impl Device for Converter {
    type Register = Register;

    fn on_clock(&mut self, hz: u64, _registers: &mut RegisterFile, _context: &mut DeviceContext<'_>) {
        self.clock_hz = hz;
    }

    /// The part's description sends requests to the first converter only, so this one hands the trigger on: as a write
    /// to the others' data registers, which are read-only and mean nothing else there. In a scene [`crate::streams`]
    /// triggers both of the scan so.
    fn on_request(&mut self, change: RequestChange, registers: &mut RegisterFile, context: &mut DeviceContext<'_>) {
        if change.instance == ROW_PORT.0 && change.request < ROW_PORT.1 {
            self.front_end.lock().drive_row(change.request, change.level == Level::High, context.now().0);
        } else if change.instance == ROW_PORT.0 && self.nth == 0 {
            let edge = Edge { at_ns: context.now().0, on: change.level == Level::High };
            self.front_end.lock().pin_edges.iter_mut().for_each(|edges| edges.push((change.request, edge)));
        } else if change.instance == "TIM8" && change.request == COMPARE_1 {
            let mut front_end = self.front_end.lock();
            if front_end.trigger_cut || front_end.scan.is_some() {
                return;
            }
            let missed = std::mem::take(&mut front_end.trigger_missed);
            drop(front_end);
            self.triggered(None, registers, context);
            if self.nth == 0 {
                for other in [ADC2, ADC3].into_iter().skip(missed.into()) {
                    context.write_to(other.base + u64::from(Register::Dr.spec().offset), Width::W32, 0, 0);
                }
            }
        }
    }

    fn read(&mut self, register: Register, file: &mut RegisterFile, context: &mut DeviceContext<'_>) -> Option<u64> {
        self.status = self.injected.show(context.now().0, self.status, file);
        let taken = match register {
            Register::Dr => self.front_end.lock().waiting[self.nth].pop_front().is_some(),
            // Words that the streams fetched were read, too.
            Register::Sr if cr2::DMA.is_set(file.get(Register::Cr2)) => {
                self.front_end.lock().waiting[self.nth].is_empty()
            }
            _ => false,
        };
        if register == Register::Sr {
            file.set(Register::Sr, self.status);
        }
        if taken {
            let value = file.get(register);
            self.status = sr::EOC.set(self.status, 0);
            file.set(Register::Sr, self.status);
            return (register == Register::Dr).then_some(value);
        }
        None
    }

    fn write(&mut self, register: Register, value: u64, registers: &mut RegisterFile, context: &mut DeviceContext<'_>) {
        match register {
            Register::Sr => self.status &= value,
            Register::Cr2 => self.write_cr2(registers, context),
            Register::Dr if self.front_end.lock().scan.is_some() => return self.next_slot(registers, context),
            Register::Dr => return self.triggered(None, registers, context),
            Register::Cr1 => {
                let control = registers.get(Register::Cr1);
                let more = [cr1::RES, cr1::EOCIE, cr1::OVRIE, cr1::JEOCIE, cr1::DISCEN, cr1::AWDEN];
                if more.iter().any(|field| field.get(control) != 0) {
                    let what = "resolutions but 12 bits, interrupts, discontinuous mode and watchdog are not modelled";
                    context.tell("CR1", what);
                }
            }
            _ => {}
        }
        registers.set(Register::Sr, self.status);
    }

    fn on_event(&mut self, event: EventId, registers: &mut RegisterFile, context: &mut DeviceContext<'_>) {
        if let Some(running) = self.running.take_if(|running| running.event == Some(event)) {
            self.finish(running, registers, context);
            registers.set(Register::Sr, self.status);
        }
    }

    fn reset(&mut self) {
        self.front_end.lock().waiting[self.nth].clear();
        *self = Self::new(self.nth, self.front_end.clone(), self.clock_hz);
    }
}

// A converter's sequences as its registers describe them: the inputs in their order, and for how long each is sampled.
//
// The injected group follows each regular sequence automatically. It is no separate event: its words appear in their
// registers when the core reads them after the last conversion.

/// Cycles of a 12-bit conversion after sampling, RM0090 13.7.
pub const CONVERSION_CYCLES: u64 = 12;

/// `SMPx`, 13.13.4, in converter cycles.
const SAMPLING_CYCLES: [u64; 8] = [3, 15, 28, 56, 84, 112, 144, 480];

/// Conversions of a regular sequence.
pub fn length(registers: &RegisterFile) -> usize {
    if cr1::SCAN.is_set(registers.get(Register::Cr1)) {
        sqr1::L.get(registers.get(Register::Sqr1)) as usize + 1
    } else {
        1
    }
}

pub fn input(registers: &RegisterFile, rank: usize) -> usize {
    // Six ranks of five bits in a register, the last register first.
    let register = [Register::Sqr3, Register::Sqr2, Register::Sqr1][rank / 6 % 3];
    (registers.get(register) >> (5 * (rank % 6)) & 0b1_1111) as usize
}

/// Converter cycles for which an input is sampled.
pub fn sampling_cycles(registers: &RegisterFile, input: usize) -> u64 {
    let (register, place) = if input < 10 { (Register::Smpr2, input) } else { (Register::Smpr1, input - 10) };
    SAMPLING_CYCLES[(registers.get(register) >> (3 * place) & 0b111) as usize]
}

/// Data registers of the injected group.
const DATA: [Register; 4] = [Register::Jdr1, Register::Jdr2, Register::Jdr3, Register::Jdr4];

/// Inputs of the injected group in their order. A group of fewer than four uses the last places (RM0390, ADC_JSQR).
pub fn injected_inputs(registers: &RegisterFile) -> Vec<usize> {
    let sequence = registers.get(Register::Jsqr);
    let places = [jsqr::JSQ1, jsqr::JSQ2, jsqr::JSQ3, jsqr::JSQ4];
    places[3 - jsqr::JL.get(sequence) as usize..].iter().map(|place| place.get(sequence) as usize).collect()
}

/// Words of a group under way, and the instant at which they are done.
#[derive(Clone, Debug, Default)]
struct Injected {
    words: Vec<u16>,
    done_ns: u64,
}

impl Injected {
    fn runs(&self, now_ns: u64) -> bool {
        now_ns < self.done_ns
    }

    /// Updates the completed conversions, and their flag in a status.
    fn show(&mut self, now_ns: u64, status: u64, registers: &mut RegisterFile) -> u64 {
        if self.runs(now_ns) || self.words.is_empty() {
            return status;
        }
        for (register, word) in DATA.into_iter().zip(self.words.drain(..)) {
            registers.set(register, word.into());
        }
        sr::JEOC.set(status, 1)
    }
}

// Internal inputs of the first converter, and the factory's readings of both.

/// The converter that they are inputs of, and which ones.
pub const CONVERTER: usize = 0;
pub const REFERENCE_INPUT: usize = 17;
pub const SENSOR_INPUT: usize = 18;
/// Minimum sampling time of both inputs, ns (DS10693).
pub const SAMPLING_NS: u64 = 10_000;
/// Address of the unique ID. After it and a gap come the factory's codes: of the reference, and of the temperature sensor
/// at 30 and 110 degrees Celsius.
pub const FACTORY_AT: u64 = 0x1fff_7a10;
/// Unique ID of the virtual microcontroller, with the gap behind it.
pub const UNIQUE_ID: [u8; 26] = *b"virtual chip\xff\xff\xff\xff\xff\xff\xff\xff\xff\xff\xff\xff\xff\xff";
/// Default ambient temperature of the board, degrees Celsius.
pub const ROOM_C: f64 = 25.0;

/// Typical values of the data sheet (DS10693), V.
const REFERENCE_V: f64 = 1.21;
const SENSOR_V: f64 = 0.76;
const SENSOR_V_PER_K: f64 = 0.0025;
const FACTORY_V: f64 = 3.3;
const CODES: f64 = 4096.0;

/// Voltage at an internal input of a converter for a chip temperature, V; `None` for any other input.
pub fn volts(converter: usize, input: usize, chip_c: f64) -> Option<f64> {
    match (converter, input) {
        (CONVERTER, REFERENCE_INPUT) => Some(REFERENCE_V),
        (CONVERTER, SENSOR_INPUT) => Some(SENSOR_V + SENSOR_V_PER_K * (chip_c - 25.0)),
        _ => None,
    }
}

pub fn factory() -> Factory {
    let code = |input, chip_c| (volts(CONVERTER, input, chip_c).unwrap_or(0.0) / FACTORY_V * CODES) as u16;
    Factory { reference: code(REFERENCE_INPUT, 30.0), sensor: [30.0, 110.0].map(|chip_c| code(SENSOR_INPUT, chip_c)) }
}
