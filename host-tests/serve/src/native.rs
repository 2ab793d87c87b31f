//! The native core and link with a scene's world.

use crate::Finger;
use sim::native::served::Bus;
use std::convert::Infallible;

impl Finger for Bus {
    type Error = Infallible;

    fn now_s(&self) -> f64 {
        self.now_s()
    }

    fn run_until(&mut self, time_s: f64) -> Result<(), Infallible> {
        // Whole frames that end by this time.
        while self.now_s() + self.frame_s() <= time_s {
            self.frame();
        }
        Ok(())
    }

    fn hear(&mut self, bytes: &[u8]) -> Result<(), Infallible> {
        self.hear(bytes);
        Ok(())
    }

    fn answer(&mut self) -> Result<Vec<u8>, Infallible> {
        // An answer leaves with the frame in which it is due, not with the one behind it.
        let by_s = self.now_s() + self.frame_s();
        Ok(std::iter::from_fn(|| self.answer(by_s)).flat_map(|answer| answer.bytes).collect())
    }

    fn due_s(&self) -> Option<f64> {
        self.due_s()
    }

    fn baud(&self) -> Option<u32> {
        Some(self.baud())
    }

    fn command(&mut self, text: &str) -> Result<String, String> {
        self.command(text)
    }
}
