//! The taxels' gains, which outlive a reset beside the parameters.

use crate::{Client, Error};
use fingertip::shipped::address;

/// All of them, in rows.
pub(in crate::commands) fn read(client: &mut Client) -> Result<Vec<Vec<u16>>, Error> {
    let columns = (client.number(address::MODEL_INFORMATION)? >> 8 & 0xFF).max(1) as usize;
    let gains = client.block(address::GAINS, address::GAINS)?.numbers(address::GAINS);
    // The registers have 16 bits.
    Ok(gains.chunks(columns).map(|row| row.iter().map(|gain| *gain as u16).collect()).collect())
}

/// Sets them, all or none, with torque off. What they were, where that is something else: a tare is needed then.
pub(in crate::commands) fn set(gains: &[Vec<u16>], client: &mut Client) -> Result<Option<Vec<Vec<u16>>>, Error> {
    let before = read(client)?;
    let shape = |rows: &[Vec<u16>]| rows.iter().map(Vec::len).collect::<Vec<_>>();
    if shape(gains) != shape(&before) {
        let [rows, columns] = [before.len(), before.first().map_or(0, Vec::len)];
        return Err(
            format!("the array has {rows} rows of {columns} gains, the file others; nothing was changed").into()
        );
    }
    if before == gains {
        return Ok(None);
    }
    let bytes: Vec<u8> = gains.iter().flatten().flat_map(|gain| gain.to_le_bytes()).collect();
    client.again(|client| client.write(address::GAINS, &bytes))?;
    Ok(Some(before))
}
