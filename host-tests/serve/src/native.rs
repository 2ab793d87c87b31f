//! The native core and link with a scene's world.

use crate::Finger;
use sim::native::served::Bus;
use std::convert::Infallible;

pub struct Native(pub Bus);

impl Finger for Native {
    type Error = Infallible;

    fn now_s(&self) -> f64 {
        self.0.now_s()
    }

    fn run_until(&mut self, time_s: f64) -> Result<(), Infallible> {
        // Whole frames that end by this time.
        while self.0.now_s() + self.0.frame_s() <= time_s {
            self.0.frame();
        }
        Ok(())
    }

    fn hear(&mut self, bytes: &[u8]) -> Result<(), Infallible> {
        self.0.hear(bytes);
        Ok(())
    }

    fn answer(&mut self) -> Result<Vec<u8>, Infallible> {
        // An answer leaves with the frame in which it is due, not with the one behind it.
        let by_s = self.0.now_s() + self.0.frame_s();
        Ok(std::iter::from_fn(|| self.0.answer(by_s)).flat_map(|answer| answer.bytes).collect())
    }

    fn due_s(&self) -> Option<f64> {
        self.0.due_s()
    }

    fn baud(&self) -> Option<u32> {
        Some(self.0.baud())
    }

    fn command(&mut self, text: &str) -> Result<String, String> {
        self.0.command(text)
    }
}
