//! In place of the scenes where this crate is built without them (feature `scenes`): a finger and a host of which there
//! is none.

/// A scene's finger.
pub mod finger {
    use host_tests::plant::Bridge;

    /// There is none.
    #[derive(Debug)]
    pub enum Finger {}

    /// What a scene's host is told of a frame; there is none.
    #[derive(Debug)]
    pub enum Seen {}

    #[expect(missing_docs, reason = "those of the scene's finger, none of which is ever called")]
    impl Finger {
        pub fn hold(&mut self, _: Bridge) {
            match *self {}
        }
        pub fn expect(&mut self, _: impl Iterator<Item = (u64, u16)>) {
            match *self {}
        }
        pub fn advance(&mut self, _: u64) {
            match *self {}
        }
        pub fn grid_ns(&self) -> u64 {
            match *self {}
        }
        pub fn supply_v(&self) -> f64 {
            match *self {}
        }
        pub fn encoder_counts(&self, _: u64) -> i32 {
            match *self {}
        }
        pub fn reference_v(&self) -> f64 {
            match *self {}
        }
        pub fn code(&mut self, _: usize, _: u16, _: u64) -> u16 {
            match *self {}
        }
        pub fn frame_done(&mut self, _: u64, _: u64) {
            match *self {}
        }
        pub fn take_seen(&mut self) -> Vec<Seen> {
            match *self {}
        }
    }
}

/// A scene's host.
pub mod host {
    use super::finger::Seen;
    use crate::wire::{TimedByte, Wire};

    /// There is none.
    #[derive(Debug)]
    pub enum Host {}

    #[expect(missing_docs, reason = "as above")]
    impl Host {
        pub fn turn(&mut self, _: u64, _: u64, _: Vec<TimedByte>, _: Vec<Seen>, _: &mut Wire) {
            match *self {}
        }
    }
}
