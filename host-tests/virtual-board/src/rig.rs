//! The rig: an image on the board, run piece by piece from outside.
//!
//! The emulator owns its loop, so it runs on a separate thread and halts at instants of the world's grid. Jobs execute
//! at a halt, between two instructions; nothing runs without an order. The same calls give the same run.

use crate::bench::{Bench, STEP_NS};
use crate::board::Surroundings;
use crate::flash::SECTOR;
use crate::front_end::{ScanCounts, Shared};
use crate::image::Firmware;
use crate::part::Part;
use crate::{Error, converter};
use fingertip::chip::Factory;
use fingertip::params::Params;
use fingertip::shipped::Record;
use rigless::emulator::{self, Driver, Host, Settled, Start, Stop};
use rigless::image::Image;
use rigless::session::Session;
use rigless::time::VirtualNanos;
use sim::plant::Plant;
use std::path::Path;
use std::sync::mpsc;
use std::thread::JoinHandle;

#[derive(Clone, Debug, Default)]
pub struct Options {
    /// First bytes of the parameter sector.
    pub stored: Vec<u8>,
    /// Bits 3:2 of the option bytes: 0 is level 3, as `cargo xtask flash` leaves them; 3 is off, as the factory does.
    pub brown_out_bits: u8,
    /// Factory codes of the reference and of the temperature sensor, if they are not those of a sound part.
    pub factory: Option<Factory>,
}

impl Options {
    /// A board whose flash holds that its motor goes the right way: torque is refused before that is known.
    pub fn confirmed() -> Self {
        let params = Params { direction_confirmed: 1, ..Params::DEFAULT };
        Self::stored(&Record { params, ..Record::DEFAULT })
    }

    pub fn stored(record: &Record) -> Self {
        Self { stored: sim::encode(record, 0), ..Self::default() }
    }
}

/// The image, the factory's calibration, and the parameter sector.
fn images(image: &Firmware, options: &Options) -> Result<Vec<Image>, Error> {
    let read = |path: &Path, bytes: Vec<u8>, at| {
        Image::new(path, bytes, at).map_err(|why| Error::NotAnImage(path.into(), why.to_string()))
    };
    let mut images = vec![read(&image.path, image.elf.clone(), None)?];
    let Factory { reference, sensor: [cold, hot] } = options.factory.unwrap_or_else(converter::factory);
    let codes = [reference, cold, hot].map(u16::to_le_bytes);
    let factory = [&converter::UNIQUE_ID[..], codes.as_flattened()].concat();
    images.push(read(Path::new("factory"), factory, Some(converter::FACTORY_AT))?);
    if !options.stored.is_empty() {
        images.push(read(Path::new("parameters"), options.stored.clone(), Some(SECTOR.start))?);
    }
    Ok(images)
}

enum Order {
    /// Run to an instant of the grid, ns.
    Run(u64),
    /// Do this at the present halt.
    Do(Box<dyn FnOnce(&mut Stand<'_>) + Send>),
}

/// A run. After the emulator has stopped, every method that returns a `Result` returns why.
#[derive(Debug)]
pub struct Rig {
    pub image: Firmware,
    orders: Option<mpsc::Sender<Order>>,
    reached: mpsc::Receiver<u64>,
    thread: Option<JoinHandle<Result<(), Error>>>,
    now_ns: u64,
    /// Virtual time after which an answer on the bus counts as missing, ns.
    pub wait_ns: u64,
}

/// The default of [`Rig::wait_ns`].
pub const WAIT_NS: u64 = 5_000_000;

impl Rig {
    /// A board with an image and a world, a step after power-on.
    pub fn new(image: &Path, world: Surroundings, options: &Options) -> Result<Self, Error> {
        let image = Firmware::read(image)?;
        let images = images(&image, options)?;
        let front_end = Shared::new(world);
        let board = Part::new(front_end.clone(), options.brown_out_bits)?;
        let session = Session::new(Box::new(board), 0, VirtualNanos(STEP_NS)).map_err(failure)?;
        let bench = Bench::new(front_end, &image);
        let (orders, ordered) = mpsc::channel();
        let (reaching, reached) = mpsc::channel();
        let hall = Hall { until_ns: bench.next_ns, bench, orders: ordered, reached: reaching };
        let thread = std::thread::Builder::new()
            .name("board".into())
            .spawn(move || emulator::run(session, &Start::new(&images), hall).map(drop).map_err(failure))?;
        let mut rig = Self { image, orders: Some(orders), reached, thread: Some(thread), now_ns: 0, wait_ns: WAIT_NS };
        rig.await_reached()?;
        Ok(rig)
    }

    /// Present time of the run, virtual ns since power-on.
    pub fn now_ns(&self) -> u64 {
        self.now_ns
    }

    /// Runs to an instant, rounded up to the world's grid. Does nothing if the instant has passed.
    pub fn run_until_ns(&mut self, until_ns: u64) -> Result<(), Error> {
        if until_ns <= self.now_ns {
            return Ok(());
        }
        self.set_out(until_ns)?;
        self.await_reached()
    }

    /// Sets out for an instant still to come, and does not wait: boards that share a world run side by side. What is
    /// posted or asked behind it happens there; [`Rig::await_reached`] is to be called once for each.
    pub fn set_out(&mut self, until_ns: u64) -> Result<(), Error> {
        self.order(Order::Run(until_ns.next_multiple_of(STEP_NS)))
    }

    pub fn run_ms(&mut self, ms: u64) -> Result<(), Error> {
        self.run_until_ns(self.now_ns + ms * 1_000_000)
    }

    /// Executes a job at the present halt, between two instructions.
    pub fn with<T: Send + 'static>(&mut self, job: impl FnOnce(&mut Stand) -> T + Send + 'static) -> Result<T, Error> {
        let asked = self.ask(job)?;
        self.answer(&asked)
    }

    /// The plant, to look at or to change.
    pub fn world<T: Send + 'static>(&mut self, job: impl FnOnce(&mut Plant) -> T + Send + 'static) -> Result<T, Error> {
        self.with(|stand| match &mut stand.bench.front_end.lock().world {
            Surroundings::Plant(world) => Ok(job(world)),
            Surroundings::Scene(_) => Err(Error::OtherWorld),
        })?
    }

    pub fn scan_counts(&mut self) -> Result<ScanCounts, Error> {
        self.with(|stand| stand.bench.front_end.lock().counts)
    }

    /// The digest of every duty and every byte so far.
    pub fn trace_hash(&mut self) -> Result<String, Error> {
        self.with(|stand| stand.bench.trace.hash())
    }

    /// Does something where the run will then stand, and does not wait.
    pub fn post(&mut self, job: impl FnOnce(&mut Stand<'_>) + Send + 'static) -> Result<(), Error> {
        self.order(Order::Do(Box::new(job)))
    }

    /// Queues a job for the next halt and does not wait; [`Rig::answer`] waits for its result.
    pub fn ask<T: Send + 'static>(
        &mut self,
        job: impl FnOnce(&mut Stand<'_>) -> T + Send + 'static,
    ) -> Result<mpsc::Receiver<T>, Error> {
        let (answer, answered) = mpsc::channel();
        self.post(move |stand| {
            // An error means that nobody waits for the answer any more.
            let _ = answer.send(job(stand));
        })?;
        Ok(answered)
    }

    /// Waits for the result of a job of [`Rig::ask`].
    pub fn answer<T>(&mut self, asked: &mpsc::Receiver<T>) -> Result<T, Error> {
        asked.recv().map_err(|_| self.broken())
    }

    fn order(&mut self, order: Order) -> Result<(), Error> {
        let sent = self.orders.as_ref().is_some_and(|orders| orders.send(order).is_ok());
        if sent { Ok(()) } else { Err(self.broken()) }
    }

    /// Waits until the run has reached its next halt.
    pub fn await_reached(&mut self) -> Result<(), Error> {
        self.now_ns = self.reached.recv().map_err(|_| self.broken())?;
        Ok(())
    }

    fn broken(&mut self) -> Error {
        let why = match self.thread.take().map(JoinHandle::join) {
            Some(Ok(Err(error))) => return error,
            Some(Ok(Ok(()))) => "the image ended the run".to_owned(),
            Some(Err(panic)) => panic.downcast::<String>().map_or_else(|_| "it panicked".to_owned(), |text| *text),
            None => "it had stopped before".to_owned(),
        };
        Error::Emulator(self.now_ns, why)
    }
}

impl Drop for Rig {
    fn drop(&mut self) {
        self.orders = None;
        if let Some(thread) = self.thread.take() {
            // Its failure, if any, was reported to whoever asked last.
            let _ = thread.join();
        }
    }
}

fn failure(error: emulator::Error) -> Error {
    Error::Emulator(0, error.to_string())
}

/// The run at a halt, between two instructions.
pub struct Stand<'a> {
    /// The board, its registers and the emulator's reports.
    pub session: &'a mut Session<Part>,
    /// The guest's memory and interrupt lines.
    pub host: &'a mut dyn Host,
    pub stop: Stop,
    pub bench: &'a mut Bench,
}

struct Hall {
    bench: Bench,
    orders: mpsc::Receiver<Order>,
    reached: mpsc::Sender<u64>,
    until_ns: u64,
}

impl Hall {
    /// Executes orders until one continues the run; returns false after the last order.
    fn halt(&mut self, session: &mut Session<Part>, stop: Stop, host: &mut dyn Host) -> bool {
        let Self { bench, orders, reached, until_ns } = self;
        if reached.send(bench.next_ns).is_err() {
            return false;
        }
        while let Ok(order) = orders.recv() {
            match order {
                Order::Run(until) => {
                    *until_ns = until;
                    return true;
                }
                Order::Do(job) => job(&mut Stand { session, host, stop, bench }),
            }
        }
        false
    }
}

impl Driver<Part> for Hall {
    fn on_settled(&mut self, session: &mut Session<Part>, host: &mut dyn Host, settled: Settled) {
        if let Settled::Stop(stop) = &settled
            && self.bench.flash.stall_done(stop.at.0)
        {
            host.hold(self.bench.core_held);
        }
        match settled {
            Settled::Access { access, .. } => {
                self.bench.accessed(session.board_mut(), &access);
                self.bench.flash.stored(session, host, &access);
                self.bench.clock.accessed(session, host, &access);
            }
            Settled::Stop(stop) => self.bench.stopped(session.board_mut(), stop.at.0),
            _ => {}
        }
    }

    fn on_stop(&mut self, session: &mut Session<Part>, stop: Stop, host: &mut dyn Host) -> Option<VirtualNanos> {
        if stop.at.0 >= self.bench.next_ns {
            self.bench.step(session, host);
            if self.bench.next_ns >= self.until_ns && !self.halt(session, stop, host) {
                return None;
            }
            self.bench.go_on();
        }
        Some(self.bench.next_stop(session.board_mut(), stop.at))
    }
}
