//! The bytes that the chip makes of a press.

use fingertip::measure::series::{HEAD, VERSION, check, step_bytes};
use solve::press::{Branch, Press};
use solve::record::{Ended, MAGIC};
use std::f64::consts::TAU;

/// Head of a series, but for the check.
pub struct Head {
    pub kind: u8,
    pub shape: [u8; 2],
    pub ended: Option<Ended>,
    pub records: u32,
    pub frame_ns: u32,
    pub origin: i32,
    pub delay_ns: u32,
}

/// A series of a head and a body.
pub fn sealed(head: &Head, body: &[u8]) -> Vec<u8> {
    let (reason, value) = head.ended.map_or((0, 0), |ended| (ended.reason as u8, ended.value));
    let mut bytes = Vec::from(MAGIC);
    bytes.extend([VERSION, head.kind, head.shape[0], head.shape[1], reason]);
    bytes.extend(head.records.to_le_bytes());
    bytes.extend(check(body).to_le_bytes());
    bytes.extend(head.frame_ns.to_le_bytes());
    bytes.extend(head.origin.to_le_bytes());
    bytes.extend(head.delay_ns.to_le_bytes());
    bytes.extend(value.to_le_bytes());
    assert_eq!(bytes.len(), HEAD);
    bytes.extend(body);
    bytes
}

/// Byte of a standard deviation in codes.
pub fn deviation(codes: f64) -> u8 {
    let variance = (16.0 * codes * codes) as u64;
    if variance == 0 {
        return 0;
    }
    let exponent = variance.ilog2();
    (((exponent << 3) as u8) | ((variance << 3 >> exponent) as u8 & 7)).max(1)
}

/// Millimetres of an encoder count by the default parameters.
pub fn mm_per_count() -> f64 {
    TAU / 1600.0 / 3.583
}

/// A press as a series, with frames of this length.
pub fn press(press: &Press, frame_ns: u32, origin: i32) -> Vec<u8> {
    let mut body = Vec::new();
    for step in &press.steps {
        let length = body.len() + step_bytes(step.taxels.len());
        for time_s in step.time_s {
            body.extend(((1e9 * time_s / f64::from(frame_ns)).round() as u32).to_le_bytes());
        }
        for travel_mm in step.travel_mm {
            body.extend(((travel_mm / mm_per_count()).round() as i32 + origin).to_le_bytes());
        }
        body.extend((step.frames as u16).to_le_bytes());
        body.extend([u8::from(step.branch == Branch::Unloading), 0]);
        body.extend(((1e3 * step.bridge_v).round() as i16).to_le_bytes());
        body.extend((step.chip_c.map_or(0.0, |chip_c| 10.0 * (chip_c + 273.15)).round() as u16).to_le_bytes());
        for taxel in &step.taxels {
            body.extend(((8.0 * (taxel.mean + 128.0)).round() as u16).to_le_bytes());
        }
        body.extend(step.taxels.iter().map(|taxel| deviation(taxel.deviation)));
        for taxels in step.taxels.chunks(8) {
            body.push(taxels.iter().enumerate().map(|(bit, taxel)| u8::from(taxel.bad) << bit).sum());
        }
        body.resize(length, 0);
    }
    let (shape, records) = ([press.array.rows as u8, press.array.columns as u8], press.steps.len() as u32);
    sealed(&Head { kind: 1, shape, ended: press.ended, records, frame_ns, origin, delay_ns: 0 }, &body)
}
