//! Registers whose values take more than a line to read or to write.

use crate::config::newtons;
use crate::link::packet::StatusError;
use crate::link::settings::Settings;
use crate::link::stand::Hindrance;
use crate::measure::Task;
use crate::units::{Duty, Newtons};

use super::Staged;

/// The bus watchdog's unit.
const WATCHDOG_MS: u16 = 20;

/// Sets torque enable. On is refused in a fault, after a tripped watchdog, with an unconfirmed motor direction, before
/// a tare, and after a tare during which something touched the tip. Off sets the goal to 0.
pub(super) fn set_torque<const ROWS: usize, const COLUMNS: usize>(
    staged: &mut Staged<ROWS, COLUMNS>,
    value: i64,
) -> Result<(), StatusError> {
    let on = value != 0;
    let unconfirmed = staged.settings.record.params.direction_confirmed == 0;
    let zeroed = staged.stand.zeroed(&staged.settings.command);
    if on && (staged.settings.watchdog_tripped || staged.stand.faulted || unconfirmed || !zeroed) {
        return Err(StatusError::Result);
    }
    let strokes = staged.stand.strokes(&staged.settings.command);
    let command = &mut staged.settings.command;
    command.torque = on;
    if !on {
        command.goal = Newtons::ZERO;
        if strokes {
            command.measure_request = Task::Stop.after(command.measure_request);
        }
    }
    Ok(())
}

/// Tare: 2 forces torque to be allowed after it.
pub(super) fn set_tare<const ROWS: usize, const COLUMNS: usize>(
    staged: &mut Staged<ROWS, COLUMNS>,
    value: i64,
) -> Result<(), StatusError> {
    bump(&mut staged.settings.command.tare_request, value);
    staged.settings.command.tare_forced = value == 2 || value == 0 && staged.settings.command.tare_forced;
    Ok(())
}

/// Measure: a task.
pub(super) fn set_measure<const ROWS: usize, const COLUMNS: usize>(
    staged: &mut Staged<ROWS, COLUMNS>,
    value: i64,
) -> Result<(), StatusError> {
    let task = Task::of(value as u8);
    let command = &mut staged.settings.command;
    command.measure_request = task.after(command.measure_request);
    // Its record needs the memory of a capture.
    let kept = matches!(task, Task::Strokes | Task::Press) && staged.stand.captures;
    if kept { Err(StatusError::Result) } else { Ok(()) }
}

/// Goal force: refused until a tripped watchdog is reset.
pub(super) fn set_goal<const ROWS: usize, const COLUMNS: usize>(
    staged: &mut Staged<ROWS, COLUMNS>,
    value: i64,
) -> Result<(), StatusError> {
    if staged.settings.watchdog_tripped {
        return Err(StatusError::Range);
    }
    staged.settings.command.goal = newtons(value as i32);
    Ok(())
}

/// Bus watchdog: 0 resets a tripped one.
pub(super) fn set_watchdog<const ROWS: usize, const COLUMNS: usize>(
    staged: &mut Staged<ROWS, COLUMNS>,
    value: i64,
) -> Result<(), StatusError> {
    if staged.settings.watchdog_tripped && value != 0 {
        return Err(StatusError::Range);
    }
    staged.settings.watchdog_tripped = false;
    staged.settings.command.bus_watchdog_ms = value as u16 * WATCHDOG_MS;
    Ok(())
}

/// Recover: a tripped watchdog, torque, goal and fault in one.
pub(super) fn set_recover<const ROWS: usize, const COLUMNS: usize>(
    staged: &mut Staged<ROWS, COLUMNS>,
    value: i64,
) -> Result<(), StatusError> {
    if value == 0 || !staged.stand.faulted && !staged.settings.watchdog_tripped {
        return Ok(());
    }
    if staged.stand.hindrance(&staged.settings.record.params, staged.actions) != Hindrance::None {
        return Err(StatusError::Result);
    }
    if staged.settings.watchdog_tripped {
        set_watchdog(staged, 0)?;
    }
    set_torque(staged, 0)?;
    bump(&mut staged.settings.command.clear_request, 1);
    Ok(())
}

/// Capture: to arm it, or to end it.
pub(super) fn set_capture<const ROWS: usize, const COLUMNS: usize>(
    staged: &mut Staged<ROWS, COLUMNS>,
    value: i64,
) -> Result<(), StatusError> {
    let arm = value != 0;
    if arm && staged.settings.command.torque {
        return Err(StatusError::Access);
    }
    if arm && staged.stand.captures {
        return Err(StatusError::Result);
    }
    staged.actions.capture = Some(arm);
    Ok(())
}

/// The bus watchdog as it reads.
pub(super) fn watchdog<const ROWS: usize, const COLUMNS: usize>(settings: &Settings<ROWS, COLUMNS>) -> i32 {
    if settings.watchdog_tripped { -1 } else { i32::from(settings.command.bus_watchdog_ms / WATCHDOG_MS) }
}

/// Makes a request: a change of the number.
pub(super) fn bump(request: &mut u8, value: i64) {
    *request = request.wrapping_add(u8::from(value != 0));
}

/// The low bytes of a number of 16 bits, held at its ends.
pub(super) fn short(value: i32) -> u32 {
    value.max(i16::MIN.into()).min(i16::MAX.into()) as u32
}

/// Thousandths of the whole supply, rounded.
pub(super) fn permille(duty: Duty) -> i32 {
    let full = i32::from(Duty::FULL);
    let duty = i32::from(duty.0);
    (duty * 1000 + duty.signum() * (full / 2)) / full
}
