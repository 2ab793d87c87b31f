//! `fingertip info`.

use super::{say, say_json};
use crate::state::{SHAPE, State};
use crate::{Client, Error, table};
use fingertip::shipped::address;
use serde_json::{Map, json};

/// Shows identity and status of the controller.
pub fn run(client: &mut Client, json: bool) -> Result<(), Error> {
    let pong = client.ping()?;
    let state = State::read(client)?;
    let information = client.number(address::MODEL_INFORMATION)?;
    let shape = [information & 0xFF, information >> 8 & 0xFF];
    let version = information >> 16;
    let mut numbers = Map::new();
    let wanted = [
        address::RETURN_DELAY_TIME,
        address::TORQUE_ENABLE,
        address::BUS_WATCHDOG,
        address::HARDWARE_ERROR_STATUS,
        address::SUPPLY_MV,
        address::LOOP_TIME_MAX_US,
        address::MISSED_FRAMES,
        address::BAD_TAXELS,
        address::TARE_STATE,
        address::SAVED_STATE,
        address::FIT_LEVEL,
        address::FIT_LEVEL_IN_USE,
        address::RESET_CAUSE,
        address::CRASH_CAUSE,
        address::CRASH_COUNT,
        address::GOOD_PACKETS,
        address::RESULT_ERRORS,
        address::INSTRUCTION_ERRORS,
        address::CRC_ERRORS,
        address::RANGE_ERRORS,
        address::LENGTH_ERRORS,
        address::LIMIT_ERRORS,
        address::ACCESS_ERRORS,
        address::FRAMING_ERRORS,
    ];
    for place in wanted {
        let scale = table::register_at(place).map_or(1, |register| register.scale);
        let name = match place {
            address::RETURN_DELAY_TIME => "return_delay_us".to_owned(),
            address::BUS_WATCHDOG => "bus_watchdog_ms".to_owned(),
            _ => table::place(place),
        };
        let number = client.number(place)?;
        let number = if number < 0 { number } else { number * i64::from(scale) };
        numbers.insert(name, json!(number));
    }
    let known = shape == SHAPE.map(|side| side as i64);
    if json {
        let mut all = Map::new();
        all.insert("port".into(), json!(client.port));
        all.insert("baud".into(), json!(client.baud));
        all.insert("id".into(), json!(pong.id));
        all.insert("model_number".into(), json!(pong.model));
        all.insert("firmware_version".into(), json!(pong.firmware));
        all.insert("rows".into(), json!(shape[0]));
        all.insert("columns".into(), json!(shape[1]));
        all.insert("table_version".into(), json!(version));
        all.extend(state.json());
        all.extend(numbers);
        say_json(&json!(all));
        return Ok(());
    }
    let (major, minor) = (pong.firmware / 10, pong.firmware % 10);
    say(format_args!("fingertip {major}.{minor} at ID {} on {}, {} baud", pong.id, client.port, client.baud));
    let strange = if known { "" } else { " (this program knows another shape: maps and pressures are not shown)" };
    say(format_args!("array     {} x {}{strange}, control table version {version}", shape[0], shape[1]));
    say(format_args!("mode      {} ({})", state.mode_name(), state.mode));
    match state.fault_name() {
        None => say("fault     none"),
        Some(name) => say(format_args!("fault     {} ({name}): `fingertip recover` once it is mended", state.fault)),
    }
    say(format_args!("limits    {}", state.limits_text()));
    say(format_args!("force     {} mN, goal {} mN", state.force_mn, state.goal_mn));
    let hz = if state.period_ns > 0 { 1e9 / state.period_ns as f64 } else { 0.0 };
    say(format_args!("frames    {hz:.0} a second, frame {}", state.frame));
    for (name, number) in numbers {
        let place = table::find(&name).map_or(0, |register| register.address);
        let words = match place {
            address::TARE_STATE | address::SAVED_STATE | address::RESET_CAUSE | address::CRASH_CAUSE => {
                format!(" ({})", table::meaning(place, number.as_i64().unwrap_or(0)))
            }
            _ => String::new(),
        };
        say(format_args!("{name:22} {number}{words}"));
    }
    Ok(())
}
