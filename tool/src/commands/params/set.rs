//! Sets stored registers, all of them or none.
//!
//! The parameters lie side by side, so they go out in one packet, which the controller takes whole or not at all. The
//! few others have a packet each: where one is refused, what was set before is put back.

use super::{Value, is_bus, is_param, twice};
use crate::table::{self, name};
use crate::{Client, Error};
use fingertip::link::table::Register;
use fingertip::params::Params;
use fingertip::shipped::{Config, address};
use fingertip::store::BAUD_RATES;

/// A register, what it was, and what it is now.
pub(in crate::commands) type Changed = (&'static Register, i64, i64);

/// Sets them; what changed.
///
/// # Errors
/// Something is wrong with a value, or torque is on: nothing was changed. Or the controller refused: the text says how
/// it stands.
pub(in crate::commands) fn set(values: &[Value], client: &mut Client) -> Result<Vec<Changed>, Error> {
    let wrong: Vec<String> = values.iter().filter_map(wrong).chain(twice(values)).collect();
    if !wrong.is_empty() {
        return Err(format!("{}; nothing was changed", wrong.join("; ")).into());
    }
    let (params, others): (Vec<Value>, Vec<Value>) =
        values.iter().copied().partition(|(register, _)| is_param(register));
    let before = client.read(address::PARAMS, 4 * Params::COUNT as u16)?;
    let block = table::Block { first: address::PARAMS, bytes: before.clone() };
    let mut after = before.clone();
    for (register, value) in &params {
        let at = usize::from(register.address - address::PARAMS);
        after[at..at + 4].copy_from_slice(&table::encode(register, *value));
    }
    check_together(&after)?;
    if client.number(address::TORQUE_ENABLE)? != 0 {
        return Err("torque is on: parameters are set with torque off. Nothing was changed".into());
    }
    for (_, id) in others.iter().filter(|(register, _)| register.address == address::ID) {
        if *id != i64::from(client.id) && client.is_taken(*id as u8)? {
            let why = "two with one ID cannot be told apart, nor set apart again";
            return Err(format!("another device has the ID {id}: {why}. Nothing was changed").into());
        }
    }
    let mut changed: Vec<Changed> = params.iter().map(|(r, value)| (*r, block.number(r.address), *value)).collect();
    changed.retain(|(_, from, to)| from != to);
    if after != before {
        client.again(|client| client.write(address::PARAMS, &after)).map_err(|why| unsure(&why))?;
    }
    // Those of the bus come last: behind them the controller is found elsewhere.
    let (bus, plain): (Vec<Value>, Vec<Value>) = others.into_iter().partition(|(register, _)| is_bus(register));
    for (register, value) in plain.into_iter().chain(bus) {
        let done = client.again(|client| client.number(register.address)).and_then(|from| {
            if from == value {
                return Ok(());
            }
            // Before it is known: where its answer is lost it is set all the same.
            changed.push((register, from, value));
            set_one(register, value, client)
        });
        if let Err(why) = done {
            return Err(put_back(&before, &changed, client, &why));
        }
    }
    for (register, _, to) in &changed {
        let now = client.again(|client| client.number(register.address)).map_err(|why| unsure(&why))?;
        if now != *to {
            return Err(format!("{} was set to {to}, but reads {now}: the others are set", name(register)).into());
        }
    }
    Ok(changed)
}

/// What an answer that was lost leaves open.
fn unsure(why: &Error) -> Error {
    Error::Other(format!("{why}. Whether they are set is not known: `fingertip params get` tells"))
}

fn set_one(register: &'static Register, value: i64, client: &mut Client) -> Result<(), Error> {
    client.set_register(register, value)?;
    match register.address {
        address::ID => client.id = value as u8,
        address::BAUD_RATE => {
            let baud = BAUD_RATES.get(value as usize).copied();
            client.set_baud(baud.ok_or_else(|| format!("baud_rate of {value}: no such code"))?)?;
        }
        _ => {}
    }
    Ok(())
}

/// What is wrong with a value by itself.
fn wrong((register, value): &Value) -> Option<String> {
    let (min, max) = (register.min, register.max);
    if !table::is_stored(register) {
        return Some(format!("{} is no parameter: it is not stored", name(register)));
    }
    (!(min..=max).contains(value)).then(|| format!("{} of {value}: {min} to {max} are allowed", name(register)))
}

/// Refuses parameters that contradict each other, by the core's own check.
fn check_together(bytes: &[u8]) -> Result<(), Error> {
    let mut values = [0; Params::COUNT];
    for (value, bytes) in values.iter_mut().zip(bytes.as_chunks::<4>().0) {
        *value = i32::from_le_bytes(*bytes);
    }
    let checked = Config::shipped(&Params::from_array(&values));
    let config =
        checked.map_err(|why| Error::Other(format!("these do not go together: {why}; nothing was changed")))?;
    config.warnings().for_each(|warning| eprintln!("warning: {warning}"));
    Ok(())
}

/// Undoes what was set, and says how it stands.
fn put_back(params: &[u8], changed: &[Changed], client: &mut Client, why: &Error) -> Error {
    let mut undone = if changed.iter().any(|(r, ..)| is_param(r)) {
        client.again(|client| client.write(address::PARAMS, params))
    } else {
        Ok(())
    };
    for (register, from, _) in changed.iter().rev().filter(|(register, ..)| !is_param(register)) {
        undone = undone.and_then(|()| set_one(register, *from, client));
    }
    match undone {
        Ok(()) => Error::Other(format!("{why}; what was set before is put back: nothing was changed")),
        Err(second) => {
            let names: Vec<String> = changed.iter().map(|(register, ..)| name(register)).collect();
            Error::Other(format!(
                "{why}; and putting back failed: {second}. Only some are set, of {}: \
                 a reboot brings back what was saved",
                names.join(", ")
            ))
        }
    }
}
