//! The object while a finger is served: taken away, put back, moved.

use super::{Broken, Bus, Kind, line};
use crate::effects::set::Set;
use crate::world::World;

/// Where an object is out of reach.
const AWAY_MM: f64 = 1e3;
/// How fast the object is moved where nothing else is said.
const MM_PER_S: f64 = 20.0;
/// No faster, as its surface goes by steps of a frame.
const MM_PER_S_MAX: f64 = 500.0;
/// Between an object that is put in place and a tip that is beyond that place.
const GAP_MM: f64 = 0.2;

/// Where the object is, and where it goes.
pub struct Object {
    /// As the scene has it.
    scene_mm: f64,
    now_mm: f64,
    goal_mm: f64,
    mm_per_s: f64,
}

impl Object {
    pub fn new<E: Set>(world: &World<E>) -> Self {
        let scene_mm = world.fingers()[0].setup().wall.distance_mm;
        Self { scene_mm, now_mm: scene_mm, goal_mm: scene_mm, mm_per_s: MM_PER_S }
    }

    /// Goes on towards where it is moved.
    pub fn approach<E: Set>(&mut self, world: &mut World<E>, dt_s: f64) {
        if self.now_mm != self.goal_mm {
            let most_mm = self.mm_per_s * dt_s;
            self.now_mm += (self.goal_mm - self.now_mm).clamp(-most_mm, most_mm);
            self.place(world);
        }
    }

    fn jump<E: Set>(&mut self, world: &mut World<E>, to_mm: f64) {
        (self.now_mm, self.goal_mm) = (to_mm, to_mm);
        self.place(world);
    }

    fn place<E: Set>(&self, world: &mut World<E>) {
        world.fingers_mut().iter_mut().for_each(|finger| finger.place_object(self.now_mm));
    }
}

/// What [`Bus::command`] understands.
pub const HELP: &str = "\
remove               takes the object away
put                  puts it back where the scene has it, or in front of a tip that is beyond
move MM [MM_PER_S]   moves its surface to where the tip meets it at this travel, at 20 mm/s or as said
fault KIND [FINGER]  breaks something until it is mended; without KIND, says what can be broken
mend                 mends all that is broken; the controller's fault stands until the host clears it
state                says what is true of each finger
help                 says this
";

impl<E: Set> Bus<E> {
    /// Does what a line says, and tells what was done.
    ///
    /// # Errors
    /// It cannot be understood or done; the text is for people.
    pub fn command(&mut self, text: &str) -> Result<String, String> {
        let words: Vec<&str> = text.split_whitespace().collect();
        match words[..] {
            [] => Ok(String::new()),
            ["help"] => Ok(HELP.trim_end().into()),
            ["state"] => Ok(self.state()),
            ["remove"] => {
                self.object.jump(&mut self.board.world, AWAY_MM);
                Ok("the object is taken away".into())
            }
            ["put"] => {
                let tip_mm = self.board.world.fingers().iter().map(|finger| finger.tip_mm()).fold(f64::MIN, f64::max);
                let to_mm =
                    self.object.scene_mm.max(if tip_mm > self.object.scene_mm { tip_mm + GAP_MM } else { tip_mm });
                self.object.jump(&mut self.board.world, to_mm);
                Ok(format!("the object is at {to_mm:.2} mm"))
            }
            ["move", to_mm] => self.move_object(to_mm, None),
            ["move", to_mm, mm_per_s] => self.move_object(to_mm, Some(mm_per_s)),
            ["fault"] => Ok(format!("what can be broken: {}", Kind::names())),
            ["fault", kind] => self.break_one(kind, "1"),
            ["fault", kind, finger] => self.break_one(kind, finger),
            ["mend"] => {
                self.devices.iter_mut().for_each(|device| device.broken = None);
                Ok("all is mended".into())
            }
            _ => Err(format!("`{text}` is no command; those that are:\n{}", HELP.trim_end())),
        }
    }

    fn state(&mut self) -> String {
        let object = &self.object;
        let object = match object.now_mm {
            AWAY_MM.. => "the object is away".into(),
            mm if mm == object.goal_mm => format!("the object is at {mm:.2} mm"),
            mm => format!("the object is at {mm:.2} mm on its way to {:.2} mm", object.goal_mm),
        };
        let fingers = self.truths();
        let lines =
            fingers.iter().enumerate().map(|(n, (truth, status))| format!("finger {}: {}", n + 1, line(truth, status)));
        lines.chain([object]).collect::<Vec<_>>().join("\n")
    }

    fn move_object(&mut self, to_mm: &str, mm_per_s: Option<&str>) -> Result<String, String> {
        if self.devices.len() > 1 {
            return Err("the object lies between two fingers: it cannot be moved towards one".into());
        }
        let to_mm = number(to_mm, "MM", -100.0, 100.0)?;
        let mm_per_s = mm_per_s.map_or(Ok(MM_PER_S), |text| number(text, "MM_PER_S", 0.001, MM_PER_S_MAX))?;
        // One that was away comes from where it cannot touch.
        if self.object.now_mm == AWAY_MM {
            let tip_mm = self.board.world.fingers()[0].tip_mm();
            self.object.jump(&mut self.board.world, to_mm.max(tip_mm + GAP_MM));
        }
        (self.object.goal_mm, self.object.mm_per_s) = (to_mm, mm_per_s);
        Ok(format!("the object moves to {to_mm:.2} mm at {mm_per_s:.3} mm/s"))
    }

    fn break_one(&mut self, kind: &str, finger: &str) -> Result<String, String> {
        let count = self.devices.len();
        let broken = Broken::new(kind.parse()?);
        let device = finger.parse::<usize>().ok().and_then(|finger| self.devices.get_mut(finger.wrapping_sub(1)));
        let device = device.ok_or_else(|| format!("no finger `{finger}`: 1 to {count} are there"))?;
        device.broken = Some(broken);
        Ok(format!("finger {finger}: {kind} from now on; `mend` ends it"))
    }
}

fn number(text: &str, name: &str, least: f64, most: f64) -> Result<f64, String> {
    let number = text.parse().ok().filter(|number| (least..=most).contains(number));
    number.ok_or_else(|| format!("{name} of `{text}`: a number from {least} to {most} is asked for"))
}
