//! The observer against its equations in f64.

use crate::config;
use fingertip::config::Config;
use fingertip::control::Observer;
use fingertip::units::{Millimetres, MillimetresPerSecond, MillimetresPerSecond2};

/// The equations of the observer's documentation.
struct Reference {
    beta: f64,
    frame_s: f64,
    travel: f64,
    speed: f64,
    disturbance: f64,
}

impl Reference {
    /// For a pace: its poles are 2.5 times as quick as the speed loop.
    fn new(pace: usize, config: &Config) -> Self {
        let frame_s = f64::from(config.frame_s_q37) / 2_f64.powi(37);
        let speed_gain = f64::from(config.gain_sets[pace].speed_q18_per_s) / 2_f64.powi(18);
        let half = 0.5 * 2.5 * speed_gain * frame_s;
        Self { beta: (1.0 - half) / (1.0 + half), frame_s, travel: 0.0, speed: 0.0, disturbance: 0.0 }
    }

    fn update(&mut self, measured: f64, driven: f64) {
        let Self { beta, frame_s: t, .. } = *self;
        let gap = 1.0 - beta;
        let acceleration = driven + self.disturbance;
        self.travel += self.speed * t + acceleration * t * t / 2.0;
        self.speed += acceleration * t;
        let error = measured - self.travel;
        self.travel += (1.0 - beta.powi(3)) * error;
        self.speed += 1.5 * gap * gap * (1.0 + beta) / t * error;
        self.disturbance += gap.powi(3) / (t * t) * error;
    }
}

#[test]
fn it_follows_its_equations_at_each_pace() {
    let config = config();
    let count_mm = config.mm_per_count_q40 as f64 / 2_f64.powi(40);
    let mut rng = fastrand::Rng::with_seed(5);
    for pace in 0..config.gain_sets.len() {
        let (mut observer, mut reference) = (Observer::new(), Reference::new(pace, &config));
        let (mut counts, mut fastest, mut hardest) = (0, 0.0_f64, 0.0_f64);
        for frame in 0..2_000 {
            if frame % 50 == 0 {
                counts += rng.i32(-40..=40);
            }
            counts += rng.i32(-2..=2);
            let driven = rng.i32(-100_000..=100_000);
            observer.update(counts, driven * 256, &config.gain_sets[pace], &config);
            reference.update(f64::from(counts) * count_mm, driven.into());
            let is = [
                observer.travel.0.to_num::<f64>() - reference.travel,
                observer.speed.0.to_num::<f64>() - reference.speed,
                observer.disturbance.0.to_num::<f64>() - reference.disturbance,
            ];
            (fastest, hardest) = (fastest.max(reference.speed.abs()), hardest.max(reference.disturbance.abs()));
            assert!(is[0].abs() < 1e-5, "travel is {} mm off in frame {frame} of pace {pace}", is[0]);
            assert!(is[1].abs() < 1e-2, "speed is {} mm/s off in frame {frame} of pace {pace}", is[1]);
            assert!(is[2].abs() < 20.0, "disturbance is {} mm/s^2 off in frame {frame} of pace {pace}", is[2]);
        }
        assert!(fastest > 5.0 && hardest > 500.0, "{fastest} mm/s and {hardest} mm/s^2 prove little");
    }
}

#[test]
fn what_no_motion_makes_is_a_jump_to_rest_at_the_new_place() {
    for counts in [500, -500, 100_000, i32::MIN] {
        let config = config();
        let way = config.travel(counts);
        // At rest it expects to stay: the error is the whole way.
        let error = way.to_bits().unsigned_abs();
        for (jump, jumps) in [(error, false), (error - 1, true)] {
            let config = Config { jump, ..config.clone() };
            let mut observer = Observer::zeroed_at(77);
            observer.update(77_i32.wrapping_add(counts), 0, &config.gain_sets[0], &config);
            let rests = observer.speed == MillimetresPerSecond::ZERO;
            assert_eq!((rests, observer.disturbance == MillimetresPerSecond2::ZERO), (jumps, jumps), "{counts}");
            if jumps {
                assert_eq!(observer.travel, way);
            }
            assert_eq!(observer.measured(77, &config), Millimetres::ZERO, "zero stays where it was");
        }
    }
}
