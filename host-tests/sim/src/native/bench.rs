//! A finger on a bench: the scene around it is exchanged while its controller stays, as a user moves finger and plate
//! between two presses.

use super::{Begun, Board, SimError};
use crate::bridge::Bridge;
use crate::effects::sensor::Stages as _;
use crate::effects::set::Set;
use crate::scene::Scene;
use crate::watch::Truth;
use fingertip::command::Command;
use fingertip::pipeline::{Pipeline, Status};
use fingertip::shipped::{COLUMNS, ROWS, TARE_FRAMES};

/// The first finger of a scene.
pub struct Bench<E: Set> {
    board: Board<E>,
}

/// The core of the array that is shipped.
type Core = Pipeline<ROWS, COLUMNS>;

impl<E: Set> Bench<E> {
    /// At rest, torque off, not tared.
    ///
    /// # Errors
    /// What the scene asks for cannot be simulated.
    pub fn new(scene: &Scene) -> Result<Self, SimError> {
        Ok(Self { board: Board::new(scene, Begun::default())? })
    }

    /// Exchanges the world and the array's effects; the controller stays as it is.
    ///
    /// # Errors
    /// What the scene asks for cannot be simulated.
    pub fn exchange(&mut self, scene: &Scene) -> Result<(), SimError> {
        let before = core::mem::replace(&mut self.board, Board::new(scene, Begun::default())?);
        if let (Some(now), Some(before)) = (self.board.units.first_mut(), before.units.into_iter().next()) {
            (now.pipeline, now.frame, now.command) = (before.pipeline, before.frame, before.command);
        }
        Ok(())
    }

    /// What the host asks.
    pub fn command(&mut self) -> &mut Command {
        &mut self.board.units[0].command
    }

    /// The controller.
    pub fn pipeline(&mut self) -> &mut Core {
        &mut self.board.units[0].pipeline
    }

    /// One frame and its control step.
    pub fn step(&mut self) -> Status {
        self.board.scan();
        let sense = self.board.world.sense(0, 0);
        let unit = &mut self.board.units[0];
        unit.frame.sequence = unit.frame.sequence.wrapping_add(1);
        let (_, status) = unit.pipeline.step(&unit.frame, &sense, &unit.command);
        unit.next = Bridge::of(status);
        *status
    }

    /// What is true of the finger.
    pub fn truth(&mut self) -> Truth {
        self.board.world.truth(0, false)
    }

    /// Torque off, a tare, torque on; nothing may touch.
    pub fn tare(&mut self) {
        let command = self.command();
        command.torque = false;
        command.tare_request = command.tare_request.wrapping_add(1);
        for _ in 0..TARE_FRAMES + 2 {
            self.step();
        }
        self.command().torque = true;
    }

    /// What each taxel makes of 100 kPa, as a share of it: its own gain, where no effect remembers what was before.
    pub fn sensitivities(&mut self) -> [[f64; COLUMNS]; ROWS] {
        let unit = &mut self.board.units[0];
        core::array::from_fn(|row| {
            let mut kpa = [100.0; COLUMNS];
            unit.sensor.pressure(row, 0.0, &mut kpa);
            kpa.map(|kpa| kpa / 100.0)
        })
    }
}
