//! The demonstration on the native core: closed over the plant on this machine, without a microcontroller in between.

use super::{DemoError, Phase, Picture, Run, Script};
use crate::heatmap::Pressures;
use crate::metrics::Sample;
use crate::native::Native;
use crate::plant::{Bridge, Setup};
use fingertip::config::newtons;
use fingertip::params::Params;
use fingertip::pipeline::Status;
use fingertip::shipped::Config;

/// Plays the script.
///
/// # Errors
/// The controller stopped with a fault.
///
/// # Panics
/// The default parameters are refused.
pub fn play(script: &Script) -> Result<Run, DemoError> {
    let config = Config::shipped(&Params::DEFAULT).expect("the defaults are in their ranges");
    let mut board = Native::new(&Setup::default(), &config);
    board.tare_and_enable();
    let mut run = Run { span_s: [board.time_s(); 2], ..Run::default() };
    for phase in &script.0 {
        play_phase(phase, &mut board, &mut run)?;
    }
    run.span_s[1] = board.time_s();
    Ok(run)
}

fn play_phase(phase: &Phase, board: &mut Native, run: &mut Run) -> Result<(), DemoError> {
    let start_s = board.time_s();
    let goal_n = phase.goal_n();
    board.command.goal = newtons(phase.goal_mn);
    run.goals.push((start_s, goal_n));
    while board.time_s() - start_s < phase.hold_ms as f64 * 1e-3 {
        let status = board.step();
        if let Some(fault) = status.fault {
            return Err(DemoError::Fault(fault as u8));
        }
        run.trace.push(sample(board, &status, goal_n));
    }
    if phase.map {
        run.pictures.push(picture(board, goal_n));
    }
    Ok(())
}

fn sample(board: &Native, status: &Status, goal_n: f64) -> Sample {
    let duty = match crate::native::bridge(status) {
        Bridge::Coast => 0.0,
        Bridge::Driven { duty } => duty,
    };
    Sample {
        time_s: board.time_s(),
        goal_n,
        true_force_n: board.world.force_n(),
        sensed_force_n: status.contact.force.0.to_num(),
        travel_mm: board.world.travel_mm(),
        indentation_mm: board.world.indentation_mm(),
        duty,
        mode: status.mode,
    }
}

/// The taxels as the controller has them.
fn picture(board: &mut Native, goal_n: f64) -> Picture {
    let contact = board.pipeline.status().contact;
    let taxels = &board.pipeline.array().picture().taxels;
    let kpa_per_sum = board.pipeline.config().pascals_per_sum_q32 as f64 * 1e-3 / 2f64.powi(32);
    let pressures_kpa: Pressures = taxels.map(|row| row.map(|taxel| f64::from(taxel.max(0)) * kpa_per_sum));
    Picture {
        goal_n,
        force_n: contact.force.0.to_num(),
        centre_mm: [contact.centre_x.0.to_num(), contact.centre_y.0.to_num()],
        radius_mm: contact.radius.0.to_num(),
        pressures_kpa,
    }
}
