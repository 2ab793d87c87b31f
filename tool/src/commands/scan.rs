//! `fingertip scan`.

use super::{aside, say, say_json};
use crate::client::{BAUD_MIN, Pong, Reach};
use crate::{Client, Error, line};
use fingertip::store::BAUD_RATES;
use serde_json::json;

/// Ports and speeds to scan.
#[derive(Debug, clap::Args)]
#[command(after_help = "Examples:\n  fingertip scan\n  fingertip --port /dev/ttyUSB0 scan --speeds 57600,1000000")]
pub struct Args {
    /// Only at these speeds, in baud
    #[arg(long, value_delimiter = ',', value_name = "BAUD", value_parser = clap::value_parser!(u32).range(BAUD_MIN..))]
    speeds: Vec<u32>,
}

/// Lists the devices that answer.
pub fn run(args: &Args, reach: &Reach, json: bool) -> Result<(), Error> {
    let ports = reach.port.clone().map_or_else(line::ports, |port| vec![port]);
    if ports.is_empty() {
        return Err(Error::NoPort);
    }
    let speeds = if args.speeds.is_empty() { BAUD_RATES.to_vec() } else { args.speeds.clone() };
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
                "port": port, "baud": baud, "id": pong.id, "model_number": pong.model,
                "firmware_version": pong.firmware, "fingertip": pong.is_fingertip(),
            })
        };
        say_json(&json!(found.iter().map(line).collect::<Vec<_>>()));
    } else {
        for (port, baud, pong) in &found {
            let what = if pong.is_fingertip() { "fingertip" } else { "another device" };
            say(format_args!(
                "{port}  {baud} baud  ID {}  {what}, model {}, firmware {}",
                pong.id, pong.model, pong.firmware
            ));
        }
    }
    if found.is_empty() {
        let speeds = speeds.iter().map(u32::to_string).collect::<Vec<_>>().join(", ");
        return Err(format!(
            "nothing answers on {} at {speeds} baud: is it powered, and are the bus's wires right?",
            ports.join(", ")
        )
        .into());
    }
    Ok(())
}
