//! A simulated finger that presses as the chip will: the tip is carried along a plan, and every frame goes through the
//! effects of the scene. Hysteresis, creep and relaxation go on from press to press.

use sim::effects::Parts;
use sim::effects::sensor::{self, Readout};
use sim::mechanics::contact::Contact;
use sim::native::calibrated::Place;
use sim::scene::{Scene, read};
use sim::setup::Setup;
use solve::press::{Array, Branch, Press, Reading, Step};

const ROWS: usize = 10;
const COLUMNS: usize = 10;
/// Frames are 0.5 ms apart, where the chip's are 0.1 ms: fewer frames, hence more noise in a mean.
pub const FRAME_S: f64 = 0.5e-3;
const TARE_FRAMES: usize = 256;

#[derive(Clone, Debug, Default)]
pub struct Draw {
    pub seed: u64,
    pub modulus_kpa: f64,
    pub noise_codes: f64,
    pub gains_percent: f64,
    pub creep_percent: f64,
    pub hysteresis_percent: f64,
    pub relaxation: f64,
    pub relaxation_s: f64,
    pub dead: Vec<[usize; 2]>,
    pub extra: String,
}

impl Draw {
    pub fn plain(modulus_kpa: f64) -> Self {
        Self { seed: 1, modulus_kpa, noise_codes: 1.0, relaxation_s: 0.5, ..Self::default() }
    }

    /// Of the ranges that a tip and an array have, by a seed.
    pub fn any(seed: u64, gains_percent: [f64; 2], dead: [usize; 2]) -> Self {
        let mut rng = fastrand::Rng::with_seed(seed);
        let mut broken: Vec<[usize; 2]> = (0..36).map(|taxel| [2 + taxel / 6, 2 + taxel % 6]).collect();
        rng.shuffle(&mut broken);
        broken.truncate(rng.usize(dead[0]..=dead[1]));
        let mut within = |low: f64, high: f64| low + (high - low) * rng.f64();
        Self {
            seed,
            modulus_kpa: 50.0 * 40.0_f64.powf(within(0.0, 1.0)),
            noise_codes: within(0.0, 3.0),
            gains_percent: within(gains_percent[0], gains_percent[1]),
            creep_percent: within(0.5, 4.0),
            hysteresis_percent: within(0.0, 10.0),
            relaxation: within(0.0, 0.15),
            relaxation_s: 0.05 * 40.0_f64.powf(within(0.0, 1.0)),
            dead: broken,
            extra: String::new(),
        }
    }

    /// Factor of each taxel's reading; 0 for a dead one.
    pub fn gains(&self) -> Vec<f64> {
        let alone = Self { creep_percent: 0.0, hysteresis_percent: 0.0, extra: String::new(), ..self.clone() };
        let mut sensor = Parts::of(&alone.scene(&Place::default()), 0).sensor;
        let mut gains = Vec::new();
        for row in 0..ROWS {
            let mut kpa = [100.0; COLUMNS];
            sensor.pressure.each(|part| part(row, 0.0, &mut kpa));
            gains.extend(kpa.map(|kpa| kpa / 100.0));
        }
        self.dead.iter().for_each(|[row, column]| gains[row * COLUMNS + column] = 0.0);
        gains
    }

    fn scene(&self, place: &Place) -> Scene {
        let dead: Vec<String> = self.dead.iter().map(|[row, column]| format!("[{row}, {column}]")).collect();
        let Self { seed, modulus_kpa, noise_codes, gains_percent, creep_percent, hysteresis_percent, .. } = self;
        let (Self { relaxation, relaxation_s, extra, .. }, dead) = (self, dead.join(", "));
        let Place { centre_mm: [x_mm, y_mm], tilt_deg: [columns_deg, rows_deg] } = place;
        let text = format!(
            "about = \"a press\"\nduration_s = 1.0\nseed = {seed}\n[tip]\nmodulus_kpa = {modulus_kpa:?}\n\
             [object]\ndistance_mm = 5.0\ncentre_x_mm = {x_mm:?}\ncentre_y_mm = {y_mm:?}\n\
             [effects.tilted_plane]\nalong_columns_deg = {columns_deg:?}\nalong_rows_deg = {rows_deg:?}\n\
             [effects.noise]\nrms_codes = {noise_codes:?}\n[effects.gain_spread]\nrms_percent = {gains_percent:?}\n\
             [effects.creep]\nrate_percent_per_decade = {creep_percent:?}\n\
             [effects.hysteresis]\nwidth_percent = {hysteresis_percent:?}\n\
             [effects.relaxation]\nshare = {relaxation:?}\ntau_s = {relaxation_s:?}\n\
             [effects.broken_taxels]\ndead = [{dead}]\n{extra}"
        );
        read("press.toml", &text).unwrap_or_else(|error| panic!("{error}\n{text}"))
    }
}

/// A place within these bounds.
pub fn any_place(rng: &mut fastrand::Rng, off_mm: f64, tilt_deg: f64) -> Place {
    let mut within = |most: f64| most * (2.0 * rng.f64() - 1.0);
    let centre_mm = [within(off_mm), within(off_mm)];
    let (angle, tilt) = (within(std::f64::consts::PI), within(tilt_deg).abs());
    Place { centre_mm, tilt_deg: [tilt * angle.cos(), tilt * angle.sin()] }
}

/// A part of the plan: to a travel from the contact at a speed, in a number of steps; or a hold with steps at these times.
#[derive(Clone, Debug)]
pub enum Part {
    Ramp { to_mm: f64, mm_per_s: f64, step_mm: f64 },
    Hold { ends_s: Vec<f64> },
}

pub struct Finger {
    draw: Draw,
    setup: Setup,
    sensor: sensor::Named,
    readout: Readout,
    contact: Contact,
    time_s: f64,
    travel_mm: f64,
    carried_mm_per_s: f64,
    carried_mm: f64,
    tare: [[f64; COLUMNS]; ROWS],
}

impl Finger {
    pub fn new(draw: &Draw) -> Self {
        let scene = draw.scene(&Place::default());
        let parts = Parts::of(&scene, 0);
        let setup = scene.setup();
        let (readout, contact) = (Readout::new(&setup.array, None), Contact::new(&setup, parts.contact));
        let tare = [[0.0; COLUMNS]; ROWS];
        Self {
            draw: draw.clone(),
            setup,
            sensor: parts.sensor,
            readout,
            contact,
            time_s: 0.0,
            travel_mm: 0.0,
            carried_mm_per_s: 0.0,
            carried_mm: 0.0,
            tare,
        }
    }

    /// Puts the finger before the plate at another place.
    pub fn go(&mut self, place: &Place) {
        let scene = self.draw.scene(place);
        self.setup = scene.setup();
        self.contact = Contact::new(&self.setup, Parts::of(&scene, 0).contact);
        self.travel_mm = self.setup.wall.distance_mm - 0.5;
    }

    /// Moves the object's surface from now on, mm/s.
    pub fn carry(&mut self, mm_per_s: f64) {
        self.carried_mm_per_s = mm_per_s;
    }

    /// Carries the tip to a travel within a frame, and reads the array.
    pub fn frame(&mut self, travel_mm: f64) -> [[f64; COLUMNS]; ROWS] {
        let before = self.travel_mm - self.setup.wall.distance_mm - self.carried_mm;
        self.carried_mm += FRAME_S * self.carried_mm_per_s;
        let now = travel_mm - self.setup.wall.distance_mm - self.carried_mm;
        self.contact.relax(0.5 * FRAME_S, before);
        self.contact.relax(0.5 * FRAME_S, now);
        self.travel_mm = travel_mm;
        self.time_s += FRAME_S;
        let place = self.contact.place(now);
        core::array::from_fn(|row| {
            let codes = self.readout.codes(&mut self.sensor, row, self.time_s, &self.contact.row_kpa(&place, row));
            core::array::from_fn(|column| f64::from(codes[column]) - self.tare[row][column])
        })
    }

    pub fn tare(&mut self) {
        self.tare = [[0.0; COLUMNS]; ROWS];
        let mut sums = [[0.0; COLUMNS]; ROWS];
        for _ in 0..TARE_FRAMES {
            let codes = self.frame(self.travel_mm);
            sums.iter_mut().flatten().zip(codes.iter().flatten()).for_each(|(sum, code)| *sum += code);
        }
        self.tare = sums.map(|row| row.map(|sum| sum / TARE_FRAMES as f64));
    }

    /// Lets time go by in the air: the effects are exact for any time that nothing changes.
    pub fn pause(&mut self, seconds: f64) {
        for _ in 0..10 {
            self.time_s += 0.1 * seconds;
            self.frame(self.travel_mm);
        }
    }

    /// Moves by a plan and records. The press goes no deeper where a taxel nears the converter's end or the force its bound.
    pub fn press(&mut self, plan: &[Part], force_max_n: f64) -> Press {
        let at_mm = self.setup.wall.distance_mm;
        let mut steps = Vec::new();
        let mut recorder = Recorder::default();
        let mut depth_mm = self.travel_mm - at_mm;
        let mut deepest: f64 = depth_mm;
        let mut most_mm = f64::INFINITY;
        for part in plan {
            match part {
                Part::Ramp { to_mm, mm_per_s, step_mm } => {
                    let to_mm = to_mm.min(most_mm);
                    let way = (to_mm - depth_mm).signum() * mm_per_s * FRAME_S;
                    let branch = if way > 0.0 { Branch::Loading } else { Branch::Unloading };
                    let mut mark = depth_mm;
                    while (to_mm - depth_mm) * way > 0.0 {
                        depth_mm += way;
                        let codes = self.frame(at_mm + depth_mm);
                        recorder.take(self, &codes);
                        if (depth_mm - mark).abs() >= *step_mm {
                            mark = depth_mm;
                            steps.extend(recorder.step(branch));
                        }
                        deepest = deepest.max(depth_mm);
                        let highest = codes.iter().flatten().copied().fold(0.0, f64::max);
                        if way > 0.0 && (highest > 3_300.0 || self.contact.law.force_n(depth_mm) > force_max_n) {
                            most_mm = depth_mm;
                            break;
                        }
                    }
                    steps.extend(recorder.step(branch));
                }
                Part::Hold { ends_s } => {
                    let begin_s = self.time_s;
                    for end_s in ends_s {
                        while self.time_s < begin_s + end_s {
                            let codes = self.frame(at_mm + depth_mm);
                            recorder.take(self, &codes);
                        }
                        let branch = if depth_mm >= deepest { Branch::Loading } else { Branch::Unloading };
                        steps.extend(recorder.step(branch));
                    }
                }
            }
        }
        let array = Array { rows: ROWS, columns: COLUMNS, pitch_mm: self.setup.array.pitch_mm, codes_per_kpa: 24.0 };
        Press { radius_mm: self.setup.tip.radius_mm, array, steps, ended: None }
    }

    pub fn travel_mm(&self) -> f64 {
        (self.travel_mm / crate::mm_per_count()).floor() * crate::mm_per_count()
    }
}

/// Frames that are to make a step.
#[derive(Default)]
struct Recorder {
    frames: u32,
    time_s: [f64; 2],
    travel_mm: [f64; 2],
    sums: [[[f64; 2]; COLUMNS]; ROWS],
}

impl Recorder {
    fn take(&mut self, finger: &Finger, codes: &[[f64; COLUMNS]; ROWS]) {
        if self.frames == 0 {
            (self.time_s[0], self.travel_mm[0]) = (finger.time_s, finger.travel_mm());
        }
        self.frames += 1;
        (self.time_s[1], self.travel_mm[1]) = (finger.time_s, finger.travel_mm());
        for (sums, code) in self.sums.iter_mut().flatten().zip(codes.iter().flatten()) {
            *sums = [sums[0] + code, sums[1] + code * code];
        }
    }

    fn step(&mut self, branch: Branch) -> Option<Step> {
        let Self { frames, time_s, travel_mm, sums } = core::mem::take(self);
        let count = f64::from(frames);
        let reading = |[sum, square]: &[f64; 2]| {
            let mean = sum / count;
            let deviation = (square / count - mean * mean).max(0.0).sqrt();
            Reading { mean, deviation, bad: false }
        };
        let taxels = sums.iter().flatten().map(reading).collect();
        (frames > 0).then_some(Step { time_s, travel_mm, frames, branch, taxels, chip_c: Some(25.0) })
    }
}

/// Stroke of a press in the plans, from the air to the deepest place, mm, and its part in front of the contact.
const WAY_MM: f64 = 3.5;
const AIR_MM: f64 = 0.5;
/// Length of a step: a 30th of the stroke, mm.
const STEP_MM: f64 = WAY_MM / 30.0;

/// The press that the chip makes: a quick cycle, then a slow one with a hold.
pub fn plan() -> Vec<Part> {
    let mut plan = cycle(10.0, 0.0);
    plan.extend(cycle(2.0, 3.0));
    plan
}

/// In at a speed, a hold at the deepest place, and back.
pub fn cycle(mm_per_s: f64, hold_s: f64) -> Vec<Part> {
    let ends_s = [0.02, 0.04, 0.08, 0.16, 0.32, 0.64, 1.3, 2.1, 3.0].into_iter().filter(|end_s| *end_s <= hold_s);
    vec![
        Part::Ramp { to_mm: WAY_MM - AIR_MM, mm_per_s, step_mm: STEP_MM },
        Part::Hold { ends_s: ends_s.collect() },
        Part::Ramp { to_mm: -AIR_MM, mm_per_s, step_mm: STEP_MM },
    ]
}

/// Pause in the air before a tare, s.
const PAUSE_S: f64 = 10.0;

/// Presses at places of a plate, each after a pause and a tare.
pub fn presses(draw: &Draw, count: usize, plan: &[Part]) -> Vec<Press> {
    let mut finger = Finger::new(draw);
    let mut rng = fastrand::Rng::with_seed(draw.seed ^ 0x5eed);
    let mut press = |_| {
        finger.go(&any_place(&mut rng, 1.5, 2.0));
        finger.pause(PAUSE_S);
        finger.tare();
        finger.press(plan, 8.0)
    };
    (0..count).map(&mut press).collect()
}
