//! Whatever a press is shown, its record has a bound; whatever a finger is shown, motions neither panic nor overflow.

use crate::finger::Finger;
use crate::series::decode;
use fingertip::capture::State as Kept;
use fingertip::config::newtons;
use fingertip::contact::Contact;
use fingertip::control::SpeedLoop;
use fingertip::measure::press::{Press, ROWS_MAX, Step, View};
use fingertip::measure::{MeasureStatus, State, Task};
use fingertip::shipped::{COLUMNS, Picture, ROWS};
use fingertip::units::Celsius;
use host_tests::finger::config;

/// Frames of 83 us to 10 ms, an encoder that walks, jumps or stands, and a force that comes and goes.
#[test]
fn a_press_has_no_more_rows_than_stated() {
    let mut most = 0;
    for seed in 0..400 {
        let mut random = fastrand::Rng::with_seed(seed);
        let mut config = config();
        config.timing.frame_ns = random.u32(83_000..10_000_000);
        let (mut motion, mut standing) = (SpeedLoop::new(), MeasureStatus::running(Task::Press));
        let (mut step, mut picture) = (Step::<ROWS, COLUMNS>::NONE, Picture::EMPTY);
        let mut contact = Contact::default();
        motion.observe(0, &config);
        let mut press = Press::begin(&motion);
        let (mut encoder, mut rows, mut sequence) = (0_i32, 0, 0_u32);
        let stride = [3, 60, 600, 40_000][random.usize(0..4)];
        while press.running() && sequence < 40_000 {
            sequence += 1;
            if random.u32(0..40) == 0 {
                contact.force = newtons([0, 50, 2_000][random.usize(0..3)]);
            }
            if random.u32(0..500) == 0 {
                picture.taxels = [[random.i32(-200_000..200_000); COLUMNS]; ROWS];
                picture.bad_count = random.u16(0..2);
            }
            encoder = encoder.wrapping_add(random.i32(-stride..=stride));
            motion.observe(encoder, &config);
            let chip = random.bool().then(|| Celsius::from_bits(random.i32(..)));
            let view = View {
                sequence,
                picture: &picture,
                contact: &contact,
                encoder,
                motion: &motion,
                applied_mv: random.i32(-20_000..20_000),
                chip,
            };
            press.observe(&view, &mut step, &mut standing, &config);
            rows += usize::from(press.part() == Some(0));
        }
        most = most.max(rows);
        assert!(rows <= ROWS_MAX, "seed {seed}: {rows} rows");
        assert_eq!(press.running(), standing.state == State::Running);
    }
    assert!(most > ROWS_MAX / 2, "{most} rows at most: the inputs show nothing");
}

/// Codes, counts and supplies of any kind while a motion is under way.
#[test]
fn a_motion_takes_anything_and_closes_its_record() {
    for seed in 0..60 {
        let mut random = fastrand::Rng::with_seed(seed);
        let task = [Task::Jog, Task::Strokes, Task::Press][seed as usize % 3];
        let mut finger = Finger::<{ 44 << 10 }>::begun(task);
        (0..random.u32(0..30_000)).for_each(|_| _ = finger.frame());
        let odd = random.u32(2..200);
        for _ in 0..3_000 {
            finger.frame_with(|record| {
                if random.u32(0..odd) == 0 {
                    let code = random.u16(..);
                    record.frame.set_code(random.usize(0..=ROWS), random.usize(0..COLUMNS), code);
                    record.sense.encoder = record.sense.encoder.wrapping_add(random.i32(-60..60));
                    record.sense.chip = Some(Celsius::from_bits(random.i32(..)));
                }
                if random.u32(0..20 * odd) == 0 {
                    record.sense.encoder = random.i32(..);
                    record.sense.supply_mv = random.u16(..);
                }
            });
        }
        finger.bench.request(Task::Stop);
        finger.frame();
        if finger.ends().measure.state != State::None && task != Task::Jog {
            let record = decode(finger.capture.data());
            assert!(task != Task::Press || record.steps.len() <= ROWS_MAX);
        }
        assert_ne!(finger.capture.standing().state, Kept::Recording);
    }
}
