//! The kernels' inputs: some of the study's from the image, and behind them the records of the loop on the simulated
//! finger, computed again for each request.

use bringup::script::{Bench, RECORDS};
use fingertip::control::Winding;
use fingertip::pipeline::AcknowledgedRequests;
use fingertip::shipped::Pipeline;
use images::record::Record;

use crate::host::fail;

/// Inputs written by `study few`.
static BYTES: &[u8] = include_bytes!("../inputs.bin");

/// Address of the next byte.
pub struct Inputs<'a> {
    place: usize,
    bench: &'a mut Bench,
    pipeline: &'a mut Pipeline,
}

impl<'a> Inputs<'a> {
    /// Inputs from the start; bench and pipeline make the records.
    pub fn new(bench: &'a mut Bench, pipeline: &'a mut Pipeline) -> Self {
        Self { place: 0, bench, pipeline }
    }

    /// The next bytes.
    pub fn read(&mut self, bytes: &mut [u8]) {
        if let Some(kept) = BYTES.get(self.place..self.place + bytes.len()) {
            bytes.copy_from_slice(kept);
        } else if self.place == BYTES.len() && bytes.len() == 4 {
            bytes.copy_from_slice(&RECORDS.to_le_bytes());
        } else if bytes.len() == Record::BYTES {
            bytes.copy_from_slice(&self.bench.record(self.pipeline).to_bytes());
        } else {
            fail("the inputs end early")
        }
        self.place += bytes.len();
    }

    /// The next words.
    pub fn words<const N: usize>(&mut self) -> [i32; N] {
        core::array::from_fn(|_| {
            let mut bytes = [0; 4];
            self.read(&mut bytes);
            i32::from_le_bytes(bytes)
        })
    }

    /// Position of the next byte.
    pub fn place(&self) -> usize {
        self.place
    }

    /// Goes back to a place: of the records to the first only.
    pub fn seek(&mut self, place: usize) {
        if place >= BYTES.len() {
            self.bench.restart();
            self.pipeline.renew(AcknowledgedRequests::default(), 0, Winding::new());
        }
        self.place = place;
    }
}
