//! Commands that only look: `fingertip scan`, `info` and `latency`.

use super::{Interrupt, answer, aside, say, say_json};
use crate::client::{BAUD_MIN, Pong, Reach};
use crate::state::{SHAPE, State};
use crate::{Client, Error, client, numbers, table};
use fingertip::link::table::Register;
use fingertip::shipped::address;
use fingertip::store::BAUD_RATES;
use serde_json::json;
use std::time::{Duration, Instant};

#[derive(Debug, clap::Args)]
#[command(after_help = "Examples:\n  fingertip scan\n  fingertip --port /dev/ttyUSB0 scan --speeds 57600,1000000")]
pub struct Scan {
    /// Only at these speeds, in baud
    #[arg(long, value_delimiter = ',', value_name = "BAUD", value_parser = clap::value_parser!(u32).range(BAUD_MIN..))]
    speeds: Vec<u32>,
}

pub fn scan(args: &Scan, reach: &Reach, json: bool) -> Result<(), Error> {
    let ports = reach.port.clone().map_or_else(client::ports, |port| vec![port]);
    if ports.is_empty() {
        return Err(Error::NoPort);
    }
    let mut speeds = if args.speeds.is_empty() { BAUD_RATES.to_vec() } else { args.speeds.clone() };
    // A TCP port has no baud rate. The rate only sets the longest wait: one pass at the first one, the slowest by default.
    let tcp = reach.port.as_ref().is_some_and(|port| port.starts_with("tcp:"));
    if tcp {
        speeds.truncate(1);
    }
    let mut found = Vec::new();
    'ports: for port in &ports {
        for &baud in &speeds {
            let there = Client::open(&Reach { port: Some(port.clone()), baud, ..reach.clone() })
                .and_then(|mut client| client.ping_all());
            match there {
                Ok(pongs) => found.extend(pongs.into_iter().map(|pong| (port, baud, pong))),
                Err(why) if reach.port.is_some() => return Err(why),
                // Of all ports of a machine some are another's, at every speed.
                Err(why) => {
                    aside(format_args!("passed over: {why}"));
                    continue 'ports;
                }
            }
        }
    }
    if json {
        let line = |(port, baud, pong): &(&String, u32, Pong)| {
            json!({
                "port": port, "baud": (!tcp).then_some(baud), "id": pong.id, "model_number": pong.model,
                "firmware_version": pong.firmware, "fingertip": pong.is_fingertip(),
            })
        };
        say_json(&json!(found.iter().map(line).collect::<Vec<_>>()));
    } else {
        for (port, baud, pong) in &found {
            let what = if pong.is_fingertip() { "fingertip" } else { "another device" };
            let at = if tcp { String::new() } else { format!("  {baud} baud") };
            let Pong { id, model, firmware } = pong;
            say(format_args!("{port}{at}  ID {id}  {what}, model {model}, firmware {firmware}"));
        }
    }
    if found.is_empty() {
        let speeds = speeds.iter().map(u32::to_string).collect::<Vec<_>>().join(", ");
        let (ports, at) = (ports.join(", "), if tcp { String::new() } else { format!(" at {speeds} baud") });
        return Err(format!("nothing answers on {ports}{at}: is it powered, and are the bus's wires right?").into());
    }
    Ok(())
}

/// Registers that `info` shows beside identity and state.
const SHOWN: &str = "chip_id return_delay_time torque_enable bus_watchdog hardware_error_status supply_mv \
                     loop_time_max_us missed_frames bad_taxels tare_state saved_state fit_level fit_level_in_use \
                     reset_cause crash_cause crash_count good_packets result_errors instruction_errors crc_errors \
                     range_errors length_errors limit_errors access_errors framing_errors";

/// Name of a register, with the unit in which its number is shown.
fn scaled_name(register: &Register) -> String {
    match register.address {
        address::RETURN_DELAY_TIME => "return_delay_us".into(),
        address::BUS_WATCHDOG => "bus_watchdog_ms".into(),
        _ => table::name(register),
    }
}

pub fn info(client: &mut Client, json: bool) -> Result<(), Error> {
    let pong = client.ping()?;
    let state = State::read(client)?;
    let information = client.number(address::MODEL_INFORMATION)?;
    let shape = [information & 0xFF, information >> 8 & 0xFF];
    let version = information >> 16;
    let mut numbers = Vec::new();
    for name in SHOWN.split_whitespace() {
        let register = table::find(name)?;
        let number = client.number(register.address)?;
        let scale = if number < 0 { 1 } else { i64::from(register.scale) };
        numbers.push((register, number * scale));
    }
    let known = shape == SHAPE.map(|side| side as i64);
    if json {
        let identity = json!({
            "port": client.port, "baud": client.baud, "id": pong.id, "model_number": pong.model,
            "firmware_version": pong.firmware, "rows": shape[0], "columns": shape[1], "table_version": version,
        });
        let mut all = identity.as_object().cloned().unwrap_or_default();
        all.extend(state.json());
        all.extend(numbers.into_iter().map(|(register, number)| (scaled_name(register), json!(number))));
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
    for (register, number) in numbers {
        let words = match register.address {
            address::TARE_STATE | address::SAVED_STATE | address::RESET_CAUSE | address::CRASH_CAUSE => {
                format!(" ({})", table::meaning(register.address, number))
            }
            _ => String::new(),
        };
        say(format_args!("{:22} {number}{words}", scaled_name(register)));
    }
    Ok(())
}

/// The state, as DYNAMIXEL drivers read it: 54 bytes.
const STATE_FIRST: u16 = address::PRESENT_MODE;
const STATE_LENGTH: u16 = 54;

#[derive(Debug, clap::Args)]
#[command(after_help = "Examples:\n  fingertip latency --seconds 10")]
pub struct Latency {
    /// Duration of the measurement
    #[arg(long, default_value_t = 5.0, value_parser = numbers::seconds)]
    seconds: f64,
}

/// Reads 54 bytes repeatedly without a pause, and reports the times of the answers.
pub fn latency(args: &Latency, client: &mut Client, json: bool) -> Result<(), Error> {
    let interrupt = Interrupt::catch()?;
    let delay_us = 2 * client.number(address::RETURN_DELAY_TIME)?;
    let (begun, mut took, mut unanswered) = (Instant::now(), Vec::new(), 0);
    while begun.elapsed().as_secs_f64() < args.seconds && !interrupt.came() {
        let asked = Instant::now();
        match client.read(STATE_FIRST, STATE_LENGTH) {
            Ok(_) => took.push(asked.elapsed()),
            Err(Error::Silent(_) | Error::Damaged(_)) => unanswered += 1,
            Err(why) => return Err(why),
        }
    }
    let per_s = took.len() as f64 / begun.elapsed().as_secs_f64();
    took.sort_unstable();
    let at = |percent: usize| took.get(took.len() * percent / 100).copied().unwrap_or_default();
    let ms = |time: Duration| time.as_secs_f64() * 1e3;
    let (median_ms, most_ms, longest_ms) = (ms(at(50)), ms(at(99)), ms(took.last().copied().unwrap_or_default()));
    let reads = took.len();
    let value = json!({
        "reads": reads, "unanswered": unanswered, "reads_per_s": per_s, "return_delay_us": delay_us,
        "median_ms": median_ms, "percentile_99_ms": most_ms, "longest_ms": longest_ms,
    });
    let text = format_args!(
        "{reads} reads of {STATE_LENGTH} bytes, {per_s:.0} a second; an answer takes {median_ms:.2} ms in the middle, \
         {most_ms:.2} ms at 99 %, {longest_ms:.2} ms at most ({delay_us} us of it return delay); {unanswered} unanswered"
    );
    answer(json, &value, text);
    Ok(())
}
