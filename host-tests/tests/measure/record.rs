//! What a motion leaves in the memory, and who else wants it.

use crate::finger::Finger;
use fingertip::capture::{Ended as CaptureEnded, State as Kept};
use fingertip::measure::press::{HOLDS_MS, PARTS, ROWS_MAX};
use fingertip::measure::{Ended, State, Task};

#[test]
fn a_press_is_recorded_whole() {
    let mut finger = Finger::<{ 44 << 10 }>::begun(Task::Press);
    finger.ends();
    finger.assert_ended(Task::Press, Ended::Complete);
    let record = finger.record();
    assert!(record.steps.len() <= ROWS_MAX && record.steps.len() > 80, "{} rows", record.steps.len());
    // In and back twice, and a hold that stands.
    let turns = record.steps.windows(2).filter(|pair| pair[0].back != pair[1].back).count();
    assert_eq!(turns, 3);
    let held = record
        .steps
        .windows(2)
        .filter(|pair| {
            pair[1].counts[0].abs_diff(pair[0].counts[1]) < 20
                && !pair[1].back
                && pair[1].counts[0].abs_diff(pair[1].counts[1]) < 20
        })
        .count();
    assert!(held + 1 >= HOLDS_MS.len(), "{held} rows of a hold");
    for pair in record.steps.windows(2) {
        // Those in which the step before is handed over are left out.
        assert_eq!(pair[0].frames[1].wrapping_add(PARTS.into()), pair[1].frames[0]);
    }
    let deepest = record.steps.iter().map(|step| step.means.iter().sum::<f64>()).fold(0.0, f64::max);
    assert!(deepest > 1_000.0, "{deepest} codes");
}

#[test]
fn strokes_are_recorded_whole() {
    let mut finger = Finger::<{ 44 << 10 }>::begun(Task::Strokes);
    finger.ends();
    finger.assert_ended(Task::Strokes, Ended::Complete);
    let record = finger.record();
    let strokes = record.samples.iter().filter(|[count, _]| *count == i16::MIN).count();
    assert_eq!((strokes, record.delay_ns), (32, 33_000));
    assert!(finger.capture.standing().bytes < 40 << 10, "{} bytes", finger.capture.standing().bytes);
}

/// What fits is kept, and closed as full; the motion goes on.
#[test]
fn a_memory_that_is_full_keeps_what_it_has() {
    let mut finger = Finger::<{ 2 << 10 }>::begun(Task::Press);
    assert_eq!(finger.ends().measure.state, State::Done);
    let (record, standing) = (finger.record(), finger.capture.standing());
    assert_eq!((record.ended, record.value, record.rows), (Ended::Full as u8, 5, 5));
    assert_eq!((standing.ended, standing.frames), (CaptureEnded::Full, 5));
}

/// Armed: the motion takes the memory. Recording: the frames keep it, and the motion has no record.
#[test]
fn a_capture_and_a_motion_share_the_memory() {
    let mut finger = Finger::<{ 44 << 10 }>::tared();
    finger.capture.arm();
    finger.begin(Task::Press);
    finger.capture.arm();
    finger.ends();
    finger.assert_ended(Task::Press, Ended::Complete);

    let mut finger = Finger::<{ 44 << 10 }>::tared();
    finger.capture.arm();
    finger.bench.command().tare_request += 1;
    (0..330).for_each(|_| _ = finger.frame());
    assert_eq!(finger.capture.standing().state, Kept::Recording);
    finger.bench.request(Task::Strokes);
    (0..5).for_each(|_| _ = finger.frame());
    assert_eq!(finger.bench.status().measure.state, State::Running);
    finger.capture.end(CaptureEnded::Asked);
    assert_eq!(finger.capture.data()[..3], *b"FTC");
    let frames = finger.capture.standing().frames;
    assert_eq!(frames, 335);
    finger.ends();
    assert_eq!((finger.capture.standing().frames, finger.capture.standing().count), (frames, 1));
}
