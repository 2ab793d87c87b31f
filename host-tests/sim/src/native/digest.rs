//! What a run was, in one number.

use fingertip::command::Command;
use fingertip::frame::Sense;
use fingertip::pipeline::Status;
use fingertip::shipped::Frame;
use fingertip::units::Duty;
use twox_hash::xxhash3_128::Hasher;

/// The 128 bits of XXH3 over what every control step took and gave, in order: equal where two runs are equal to the
/// bit. It finds runs that happen to differ, and keeps nobody from making two that do not seem to.
pub struct Digest(Hasher);

/// Words of what a step takes beside the codes.
const TAKEN: usize = 13;

impl Digest {
    /// Of nothing.
    pub fn new() -> Self {
        Self(Hasher::new())
    }

    /// Adds a step.
    pub fn add(&mut self, frame: &Frame, sense: &Sense, command: &Command, duty: Duty, status: &Status) {
        self.0.write(frame.codes.rows.map(|codes| codes.map(u16::to_le_bytes)).as_flattened().as_flattened());
        self.0.write(frame.codes.undriven.map(u16::to_le_bytes).as_flattened());
        self.0.write(taken(frame.sequence, sense, command).map(u32::to_le_bytes).as_flattened());
        // Of the temperature only what it does, which is in the rest.
        Status { chip: None, ..*status }.words(duty, |word| self.0.write(&word.to_le_bytes()));
    }

    /// In hexadecimal.
    pub fn hex(&self) -> String {
        format!("{:032x}", self.0.finish_128())
    }
}

/// What a step takes beside the codes. Of the command all but whether a tare is forced: what
/// becomes of that is in what the step gives.
fn taken(sequence: u32, sense: &Sense, command: &Command) -> [u32; TAKEN] {
    let Sense { encoder, supply_mv, bus_silent_ms, bridge_fault, answer, chip: _ } = *sense;
    let Command { torque, goal, bus_watchdog_ms, fit_level, tare_request, clear_request, measure_request, .. } =
        *command;
    [
        sequence,
        encoder as u32,
        supply_mv.into(),
        bus_silent_ms.into(),
        bridge_fault.into(),
        answer.0,
        torque.into(),
        goal.to_bits() as u32,
        bus_watchdog_ms.into(),
        fit_level as u32,
        tare_request.into(),
        clear_request.into(),
        measure_request.into(),
    ]
}

#[cfg(test)]
mod tests {
    use super::*;
    use fingertip::units::CoreCycles;
    use fingertip::units::Newtons;

    /// What a step takes and gives.
    type Step = (Frame, Sense, Command, Duty, Status);

    fn of(change: impl Fn(&mut Step)) -> String {
        let mut step = (Frame::EMPTY, Sense::default(), Command::default(), Duty(0), Status::default());
        change(&mut step);
        let mut digest = Digest::new();
        digest.add(&step.0, &step.1, &step.2, step.3, &step.4);
        digest.hex()
    }

    #[test]
    fn whatever_a_step_takes_or_gives_counts() {
        let mut all = vec![
            of(|_| ()),
            of(|step| step.0.set_code(0, 0, 1)),
            of(|step| step.0.set_code(10, 9, 1)),
            of(|step| step.0.sequence = 1),
            of(|step| step.1.encoder = 1),
            of(|step| step.1.answer = CoreCycles(1)),
            of(|step| step.2.torque = !step.2.torque),
            of(|step| step.2.goal = Newtons::from_bits(1)),
            of(|step| step.2.measure_request = 1),
            of(|step| step.3 = Duty(1)),
            of(|step| step.4.sequence = 1),
            of(|step| step.4.contact.bad_taxels = 1),
            of(|step| step.4.duty = Duty(1)),
            of(|step| step.4.tare = fingertip::pipeline::Taring::Running),
            of(|step| step.4.taken.clear = 1),
        ];
        let steps = all.len();
        all.sort();
        all.dedup();
        assert_eq!(all.len(), steps);
        assert_eq!(all[0].len(), 32);
    }
}
