//! The link task: bytes from the bus to the server, its replies back, and its requests to the firmware.
//!
//! The command and the count of packets, which the bus watchdog uses, cross to control as one.

use defmt::{error, info, warn};
use embassy_time::{Duration, Instant, Timer};
use fingertip::link::{Actions, Captured, Reply};
use fingertip::shipped::{CLOCKS, Record, Server, Snapshot};

use super::bus::Bus;
use super::capture;
use super::crash::{self, Boot};
use super::exchange::{BusSnapshot, CAPTURE, GAINS, HEARD, Heard, NotSaved, PARAMS, PICTURE, SAVE, SAVED};
use super::guard::{self, Stopwatch};
use super::health;
use super::log::log_save_error;
use super::scan::WAKE;

/// Runs for ever.
#[embassy_executor::task]
pub async fn run(bus: Bus, record: Record, boot: Boot) {
    let mut task = LinkTask { bus, boot, server: Server::new(record, &CLOCKS), line_good: true };
    task.run().await;
}

struct LinkTask {
    bus: Bus,
    boot: Boot,
    server: Server,
    line_good: bool,
}

impl LinkTask {
    async fn run(&mut self) {
        let mut received = [0; 256];
        let mut reply = Reply::new();
        // Stored requests apply before the host sends any.
        self.pass_on(Actions::default());
        loop {
            match self.bus.receive(&mut received).await {
                Ok(count) => {
                    self.line_good = true;
                    self.answer(received.get(..count).unwrap_or_default(), &mut reply).await;
                }
                Err(cause) => {
                    health::note_line(cause);
                    // The first of a row: a line at the wrong speed would fill the log.
                    if core::mem::take(&mut self.line_good) {
                        warn!("bus: {}", cause);
                    }
                }
            }
        }
    }

    async fn answer(&mut self, mut bytes: &[u8], reply: &mut Reply) {
        let received = Instant::now();
        while !bytes.is_empty() {
            // Control, which fills the snapshot, interrupts this task: it never runs at this point.
            let Some(taken) = self.feed(bytes, reply) else { return };
            bytes = bytes.get(taken..).unwrap_or_default();
            let actions = self.server.take_actions();
            self.pass_on(actions);
            if !reply.is_empty() {
                Timer::at(received + Duration::from_micros(self.server.reply_delay_us().into())).await;
                if let Err(cause) = self.bus.send(reply).await {
                    warn!("bus, sending: {}", cause);
                }
            }
            self.carry_out(actions).await;
        }
    }

    /// Number of bytes that the server took.
    fn feed(&mut self, bytes: &[u8], reply: &mut Reply) -> Option<usize> {
        PICTURE.visit(|picture| {
            let snapshot = snapshot(picture, self.boot);
            // A capture that is done is the link's until the next one is armed.
            let whole = CAPTURE.visit(|capture| {
                let capture = Captured { data: capture.data(), ..snapshot.capture };
                self.server.feed(bytes, &Snapshot { capture, ..snapshot }, reply)
            });
            whole.unwrap_or_else(|| self.server.feed(bytes, &snapshot, reply))
        })
    }

    /// Passes a packet to control: its parameters and gains first, then its command.
    fn pass_on(&self, actions: Actions) {
        let record = &self.server.settings().record;
        if actions.configure {
            // The newest count where control has not yet taken those before.
            PARAMS.take(|_| ());
            PARAMS.fill(|params| *params = record.params);
        }
        if actions.calibrate {
            GAINS.take(|_| ());
            GAINS.fill(|gains| *gains = record.gains);
        }
        // Before the reply, so that the host reads the state after its request.
        if let Some(arm) = actions.capture {
            capture::ask(arm);
        }
        HEARD.set(Heard { command: self.server.command(), packets: self.server.good_packets() });
    }

    /// What waits until the reply is sent.
    async fn carry_out(&mut self, actions: Actions) {
        let baud = self.server.settings().baud();
        let record = &self.server.settings().record;
        if actions.save {
            let saved = save(record).await;
            self.server.note_saved(saved);
        }
        if actions.baud {
            info!("bus at {} baud", baud);
            if let Err(cause) = self.bus.set_baud(baud) {
                error!("bus speed: {}", cause);
            }
        }
        if actions.reboot {
            crash::reboot();
        }
    }
}

/// Has control write to flash, which makes the core wait: never while the motor is driven.
async fn save(record: &Record) -> bool {
    // The result of an earlier save is void.
    SAVE.take(|_| ());
    SAVED.reset();
    SAVE.fill(|place| *place = *record);
    WAKE.signal(());
    let saved = SAVED.wait().await;
    match saved {
        Ok(()) => info!("parameters saved"),
        Err(NotSaved::Busy) => warn!("parameters not saved: the motor is driven or a tare is under way"),
        Err(NotSaved::Failed(cause)) => log_save_error(cause),
    }
    saved.is_ok()
}

/// Snapshot for the bus, from the newest data.
fn snapshot(picture: &BusSnapshot, boot: Boot) -> Snapshot<'_> {
    let BusSnapshot { report, frame, taxels, pascals_per_sum_q32, tare } = picture;
    let report = report.unwrap_or_default();
    Snapshot {
        status: report.status,
        supply_mv: report.supply_mv,
        tick_ms: Instant::now().as_millis() as u32,
        frame_time_us: report.frame_time_us,
        frame_ns: report.frame_ns,
        loop_time_us: microseconds(report.loop_time),
        loop_time_max_us: microseconds(report.loop_time_max),
        reset_cause: boot.reset,
        crash: boot.crash,
        health: health::health(),
        frame,
        taxels,
        pascals_per_sum_q32: *pascals_per_sum_q32,
        tare,
        capture: Captured { standing: report.capture, data: &[] },
    }
}

/// Rounded up: a high-water mark must not look better than it is.
fn microseconds(time: Stopwatch) -> u16 {
    u16::try_from(time.0.div_ceil(guard::TICKS_PER_US)).unwrap_or(u16::MAX)
}
